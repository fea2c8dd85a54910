"""A trajectory asked for any time, and stored and read back: the same bits, in more digits too."""

from types import SimpleNamespace

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import Impossible, NotANumber
from heavytop.integration import outputs

from ..trajectories import same

ALL = 'want.quantities=["theta", "phi", "psi", "axis"]'


@pytest.fixture(scope="module")
def whole():
    return ht.propagate(ht.load_scene("sicm-kicked", ["span.time=400"]))


@pytest.fixture(scope="module")
def precise():
    changes = [ALL, "want.digits=30", "span.time=7", "want.samples=15"]
    return ht.propagate(ht.load_scene("sicm-kicked", changes))


def test_dense_output_is_the_samples(whole):
    shuffled = np.random.default_rng(7).permutation(whole.t)
    again, order = whole(shuffled), np.argsort(shuffled)
    for name in again.__slots__:
        assert same(getattr(again, name)[order], getattr(whole.samples, name)), name


def test_dense_output_in_more_digits_is_the_same_run_rounded(precise):
    samples = precise.in_mpmath()
    again = precise.in_mpmath(samples.t[::-1])
    assert (again.states[::-1] == samples.states).all()
    assert (again.phi[::-1] == samples.phi).all()
    assert precise.theta.tolist() == [float(theta) for theta in samples.theta]
    assert precise(precise.t[3]).theta == precise.theta[3]
    exact = precise.motion.at("1/3", digits=50)
    assert abs(precise.in_mpmath("1/3").phi - exact.phi) < 1e-29


@pytest.mark.parametrize("formulation", ["axis", "attitude", "lagrange", "routh"])
def test_samples_in_more_digits_are_those_of_the_same_formulas_in_doubles(formulation):
    """Every column, vectors and attitude too, from the states of the run, rounded or not."""
    changes = [ALL, "want.digits=30", "span.time=1", "want.samples=7"]
    run = ht.propagate(ht.load_scene("sicm-kicked", changes), formulation=formulation)
    form, states = run.orbit.integrator.formulation, run.samples.states
    constants = {name: float(x) for name, x in run.orbit.parameters.items()}
    near = SimpleNamespace(phi=run.phi, psi=run.psi)
    again = outputs.sample(form, states, constants, run.t, near)
    for name in ht.Sample.__slots__:
        assert getattr(again, name) == pytest.approx(getattr(run.samples, name), abs=1e-11), name


def test_what_a_formulation_does_not_give_is_nan_as_in_doubles():
    changes = ["want.digits=40", "span.time=1", 'want.quantities=["theta"]', "want.samples=7"]
    run = ht.propagate(ht.load_scene("sicm-kicked", changes), formulation="cubic")
    end = run.end
    for number in (end.phi, end.psi, *end.axis[:2], *end.omega, *end.quaternion):
        assert number != number
        assert run.text(number) is None
    assert abs(end.axis[2] - run.ctx.cos(end.theta)) < 1e-45
    assert run.phi is run.psi is None
    assert run.to_xarray()["phi_text"].to_numpy().tolist() == [""] * 7


def test_times_that_are_refused_and_none(whole, precise):
    for trajectory in (whole, precise):
        one, none = trajectory(np.array([0.5])), trajectory(np.empty(0))
        for name in one.__slots__:
            assert getattr(none, name).shape == (0, *getattr(one, name).shape[1:])
        for t in (-1e-9, trajectory.t[-1] + 1e-6):
            for ask in (trajectory, trajectory.in_mpmath):
                with pytest.raises(Impossible, match="where the trajectory was integrated"):
                    ask(t)
        for t in ("soon", np.nan, [0.0, np.inf], [[1.0]], None, [1, "a"]):
            with pytest.raises(NotANumber, match="a finite time"):
                trajectory(t)
        with pytest.raises(NotANumber):
            trajectory.in_mpmath("soon")
