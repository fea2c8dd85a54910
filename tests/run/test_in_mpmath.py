"""The motion of a run in numbers of mpmath, at samples and at other times."""

import pytest

import heavytop as ht
from heavytop.errors import Impossible, NotANumber


@pytest.mark.parametrize("digits", [12, 30])
def test_times_are_those_of_the_run_alone(digits):
    run = ht.propagate(ht.load_scene("sicm-kicked", [f"want.digits={digits}", "span.time=1"]))
    exact = run.motion.at("1/3", digits=50)
    assert abs(run.in_mpmath("1/3").phi - exact.phi) < 10.0 ** (1 - digits)
    assert run.in_mpmath(["1/3", 0.5]).phi.shape == (2,)
    for t in (-1, 1.5, [0.5, 2]):
        with pytest.raises(Impossible, match="where the trajectory was integrated"):
            run.in_mpmath(t)
    with pytest.raises(NotANumber):
        run.in_mpmath("soon")


def test_a_point_mass_is_run_by_the_axis_form():
    scene = ht.Scene(ht.Top(1, 0, 1), ht.State("1"), time=5)
    run = ht.propagate(scene)
    assert run.plan.formulation == "axis"
    assert ht.run_errors(run).theta < 1e-12
