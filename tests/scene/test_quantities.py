"""The table of quantities: run and closed form have what a scene may want, in its units."""

import re

import numpy as np
import pytest

import heavytop as ht
from heavytop.scene import quantities
from heavytop.scene.quantities import QUANTITIES, WANTED, Need, Quantity, values_of

SCENE = ht.load_scene("sicm-kicked", ["span.time=0.2", 'want.quantities=["attitude", "rates"]'])
COLUMNS = sorted({name for wanted in WANTED for name in QUANTITIES[wanted].columns})


@pytest.fixture(scope="module")
def run():
    return ht.propagate(SCENE)


@pytest.mark.parametrize("name", COLUMNS)
def test_run_closed_form_and_proved_digits_have_the_same_of_every_column(run, name):
    ours, exact = values_of(run.samples, name), values_of(run.motion.at(run.t), name)
    np.testing.assert_allclose(ours, exact, rtol=0, atol=1e-11)
    found = run.motion.interval(name, run.t[-1], 20)
    balls = found if isinstance(found, tuple) else (found,)
    np.testing.assert_allclose(np.ravel(ours[-1]), [float(x.middle) for x in balls], atol=1e-11)
    assert len(balls) == len(quantities.component_names((name,)))


def test_a_derived_quantity_is_one_row(run, monkeypatch):
    ratio = Quantity("φ̇/ψ̇", need=Need.TILT, columns=("rate_ratio",), judged_by=("rates",),
                     of=lambda motion: motion.phidot / motion.psidot)  # fmt: skip
    monkeypatch.setitem(QUANTITIES, "rate_ratio", ratio)
    ours = values_of(run.samples, "rate_ratio")
    np.testing.assert_array_equal(ours, run.samples.phidot / run.samples.psidot)
    exact = values_of(run.motion.at(run.t[-1], 20), "rate_ratio")
    assert float(exact) == pytest.approx(ours[-1], rel=1e-12)
    assert quantities.derived(("theta", "rate_ratio")) == ("rate_ratio",)


def test_the_unit_of_the_axis_is_1(run):
    assert run.to_xarray()["axis"].attrs["units"] == "1"


@pytest.mark.parametrize("name", QUANTITIES)
def test_every_quantity_has_a_symbol_and_a_unit_in_every_form(name):
    quantity = QUANTITIES[name]
    assert quantity.symbol
    assert re.fullmatch(r"1|[A-Za-zµ0-9 -]+", quantity.cf_unit)
    assert set(quantity.attributes) == {"long_name", "units"}
    assert quantity.text(0.5)
