"""Every run that reaches its end is held against the closed form: its errors, and its digits."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.run.plan import Plan
from heavytop.run.verify import (
    ahead,
    missed_digits,
    phase_error,
    run_errors,
    warn_of_plan,
)

RATES = ("thetadot", "phidot", "psidot")


def shifted(run, by):
    """A run whose samples are those of so much later [s]."""
    rows = run(np.minimum(run.t + by, run.t[-1])).states
    return replace(run, orbit=replace(run.orbit, samples=run.orbit.samples._replace(states=rows)))


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("name", ["sicm-kicked", "force-free", "inverted-gravity"])
def test_errors_of_rates_are_those_against_the_exact_ones(name, formulation):
    wants = ("theta", "rates") if formulation == "cubic" else ("theta", "phi", "rates")
    scene = replace(ht.load_scene(name), quantities=wants, samples=9, events=(), digits=9)
    run = ht.propagate(scene, formulation=formulation)
    exact = run.motion.at(run.t, digits=25)
    off = [getattr(run.samples, x) - [float(getattr(at, x)) for at in exact] for x in RATES]
    assert max(np.max(np.abs(off)), run_errors(run).rates) < 1e-10
    late = run_errors(shifted(run, 1e-6)).rates  # planted
    motion, t = run.motion, run.t[:-1]
    moved = [getattr(motion.at(t + 1e-6), r) - getattr(motion.at(t), r) for r in RATES]
    assert late == pytest.approx(np.max(np.abs(moved)), rel=0.3)


def test_digits_asked_of_rates_are_checked():
    """They are wanted, and nothing else is; held to the largest of them, about 140 rad/s."""
    scene = replace(ht.load_scene("sicm-kicked"), quantities=("rates",), events=(), digits=9)
    run = ht.propagate(scene, formulation="axis")
    assert missed_digits(run) == {}
    wrong = shifted(run, 1e-8)
    assert set(missed_digits(wrong)) == {"rates"}
    tilt = replace(wrong, scene=replace(scene, quantities=("theta",)))
    assert set(missed_digits(tilt)) == {"theta"}


def test_the_bound_is_not_slack():
    """The errors are those of the bits: a run in fewer bits would be seen."""
    changes = ["want.digits=60", "span.time=3", "want.events=[]", "want.samples=7"]
    wanted = 'want.quantities=["theta", "phi", "psi"]'
    run = ht.propagate(ht.load_scene("sicm-kicked", [*changes, wanted]))
    assert run.plan.precision == "256 bits"
    errors = run_errors(run)
    for error in (errors.theta, errors.phi, errors.psi):
        assert 1e-79 < error < 1e-74
    assert 1e-78 < errors.input_rounding < 1e-73


def test_whole_turns_are_errors_through_a_pole_too():
    start = ht.State(2, thetadot=5, phi="0.4")
    scene = ht.Scene(ht.Top(2, 1, 3), start, time=3, quantities=("theta", "phi", "psi"))
    good = ht.propagate(scene)
    assert max(run_errors(good).phi, run_errors(good).psi) < 1e-11
    rows = good.orbit.samples.states.copy()
    rows[200:, :2] *= -1  # planted
    orbit = replace(good.orbit, samples=good.orbit.samples._replace(states=rows))
    assert run_errors(replace(good, orbit=orbit)).phi > 0.5


def test_a_phase_that_is_planted_is_found():
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.events=[]"]), formulation="axis")
    assert abs(phase_error(run)) < 1e-14
    motion, t = run.motion, np.linspace(0, 2, 9)
    exact, later = motion.at(t), motion.at(t + 1e-6)  # planted
    off = later.u - exact.u, later.udot - exact.udot
    assert ahead(*off, exact, 2 * np.pi / motion.period) == pytest.approx(1e-6, rel=1e-3)


def test_a_cubic_run_from_the_pole_that_is_farther_is_held_against_its_numbers():
    """From theta = pi, with both poles passed, heights are measured from the top."""
    scene = ht.Scene(
        ht.Top(1, 1, 0), ht.State("pi", thetadot=2), time=1, quantities=("theta",), digits=13
    )
    run = ht.propagate(scene, formulation="cubic")
    assert run.orbit.checkpoints[0].state[0] == 2
    assert run_errors(run).theta < 1e-13


def test_what_a_plan_says_may_disappoint_is_doubtful():
    with pytest.warns(ht.DoubtfulWarning, match="it may disappoint"):
        warn_of_plan(Plan("lagrange", warnings=("it may disappoint",)))
