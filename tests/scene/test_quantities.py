"""The table of quantities: run and closed form have what a scene may want, in its units."""

import re

import numpy as np
import pytest

from heavytop.scene import quantities
from heavytop.scene.quantities import QUANTITIES, Need, columns_of, values_of, wanted

from ..trajectories import run_of

PROVED = [n for n in wanted() if QUANTITIES[n].need > Need.NOTHING and not QUANTITIES[n].of]


@pytest.fixture(scope="module")
def run():
    return run_of("span.time=0.2", 'want.quantities=["attitude", "rates"]')


@pytest.mark.parametrize("name", sorted({name for each in PROVED for name in columns_of(each)}))
def test_run_closed_form_and_proved_digits_have_the_same_of_every_column(run, name):
    motion = run.motion
    ours, exact = (values_of(x, name, motion) for x in (run.samples, motion.at(run.t)))
    np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-11)
    found = motion.interval(name, run.t[-1], 20)
    balls = found if isinstance(found, tuple) else (found,)
    np.testing.assert_allclose(np.ravel(ours[-1]), [float(x.middle) for x in balls], atol=1e-11)
    assert len(balls) == len(quantities.component_names((name,)))


@pytest.mark.parametrize("name", QUANTITIES)
def test_every_quantity_has_a_symbol_and_a_unit_in_every_form(name):
    quantity = QUANTITIES[name]
    assert quantity.symbol
    assert re.fullmatch(r"1|[A-Za-zµ0-9 -]+", quantity.cf_unit)
    assert set(quantity.attributes) == {"long_name", "units"}
    assert quantity.text(0.5)
