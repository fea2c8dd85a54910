"""Steps in any number of bits."""

import numpy as np
import pytest

from heavytop.equations.formulation import FORMULATIONS
from heavytop.integration.high_precision import PreciseIntegrator, Unfinished


def test_leaving_the_finite_numbers_is_said():
    form = FORMULATIONS["routh"].build()
    constants = dict.fromkeys((p.name for p in form.parameters), "1")
    engine = PreciseIntegrator(form, 128, constants)
    with pytest.raises(Unfinished):
        engine.walk(engine.start(["0", "0"]), [("1", None)], 10.0)


def test_an_event_that_is_none_is_not_found():
    form = FORMULATIONS["axis"].build()
    constants = {p.name: "1" for p in form.parameters} | {"g": "0"}
    engine = PreciseIntegrator(form, 128, constants, ["reversal"])
    start = engine.start(["0", "-0.6", "0.8", "0", "0"])  # l along the vertical: theta is constant
    found, _ = engine.walk(start, [("0.5", "reversal"), ("0.5", None)], 10.0)
    assert found[0] is None
    assert np.isclose(float(found[1].state[0]), 0.6 * np.sin(0.5))


def cubic(bits):
    form = FORMULATIONS["cubic"].build("top")
    return PreciseIntegrator(form, bits, {f"k_{i}": "1" for i in range(3)})


def test_steps_do_not_go_back():
    engine = cubic(128)
    start = engine.start(["0.1", "0"])
    for t, far in (("-0.5", 10.0), ("0.5", -10.0)):
        with pytest.raises(ValueError, match="before the mark"):
            engine.walk(start, [(t, None)], far)


@pytest.mark.parametrize("bits", [64, 128])
def test_texts_hold_every_bit(bits):
    engine = cubic(bits)
    third = engine.number("1") / engine.number("3")
    assert engine.number(str(third)) == third
