"""phi and psi that are read off the axis or the quaternion, with whole turns; the attitude form.

The turns are the closed form's; the Lagrangian form, to which none are added, has them too."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import heavytop as ht
from heavytop.integration.orbit import integrate, start_orbit
from heavytop.run.binary_motion import BinaryMotion

pytestmark = pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")

ANGLES = ("theta", "phi", "psi")


run = partial(ht.propagate, formulation="attitude")


def shipped(name, *overrides):
    return ht.load_scene(name, [f"want.quantities={list(ANGLES)!r}", *overrides])


def scene(top, start, **span):
    return ht.Scene(top, start, **({"quantities": ANGLES, "events": ("turning",)} | span))


def off(trajectory, exact, where, bound):
    for angle in ("phi", "psi"):
        if (angles := getattr(trajectory, angle)) is not None:
            assert np.max(np.abs(angles - getattr(exact, angle))[where], initial=0) < bound, angle


def drawn(seed):
    """A top, and a start that passes one of the poles at 1e-9 to 1e-2 rad, or neither."""
    draw = np.random.default_rng(seed)
    top = ht.Top(1, draw.uniform(0.1, 1.9), draw.choice([-1, 1]) * draw.uniform(0.3, 3))
    theta, spin_rate = draw.uniform(0.3, 2.8), draw.uniform(-5, 5)
    rates = {"thetadot": draw.normal(), "phidot": draw.normal()}
    if seed % 3:  # p_phi -+ p_psi, which is the angular momentum at the pole
        side, miss = (1, -1)[seed % 2], draw.choice([-1, 1]) * 10 ** draw.uniform(-9, -2)
        p_psi = top.C * spin_rate
        rates = {"thetadot": -side * draw.uniform(4, 6)}
        rates["phidot"] = float(p_psi * (side - np.cos(theta)) + miss) / np.sin(theta) ** 2
    start = ht.State(theta=theta, omega3=spin_rate, **rates)
    return top, start, draw.choice([-1, 1]) * draw.uniform(1, 4)


SEEDS = [*range(30), *(pytest.param(n, marks=pytest.mark.slow) for n in range(30, 1000))]


@pytest.mark.parametrize("seed", SEEDS)
def test_turns_are_those_that_the_lagrangian_form_counts(seed):
    """phi and psi of Euler's angles have their turns: no closed form, no azimuth is needed."""
    top, start, periods = drawn(seed)
    time = periods * ht.Motion(top, start).period
    wanted = scene(top, start, time=time, samples=25, events=(), digits=6)
    counted = run(wanted, formulation="lagrange")
    assert abs(counted.theta - counted.binary_motion.closed_form.at(counted.t).theta).max() < 1e-4
    for form in ("axis", "attitude"):
        if form == "attitude" or ht.Motion(top, start).kind != "planar-pendulum":
            found = run(wanted, formulation=form)
            off(found, counted, (np.sin(found.theta) > 1e-2), 1e-2)


def test_an_angle_that_is_no_longer_known_is_missed_and_not_unwrapped(monkeypatch):
    """Planted: the closed form, which gives whole turns, is ahead by 2 rad."""
    good, right = run(shipped("sicm-kicked"), formulation="axis"), BinaryMotion.at

    def at(self, seen):
        exact = right(self, seen)
        vars(exact)["phi"] = exact.phi + 2
        return exact

    monkeypatch.setattr(BinaryMotion, "at", at)
    lost = run(shipped("sicm-kicked"), formulation="axis")
    assert np.max(np.abs(lost.phi)) <= np.pi < np.max(np.abs(good.phi))
    assert ht.run_errors(lost).phi > np.pi / 2


@pytest.mark.parametrize("form", ["axis", "attitude"])
@pytest.mark.parametrize("name", ["through-top", "through-bottom", "planar-rotating"])
def test_beside_a_pass_phi_is_that_of_before_or_of_after(name, form):
    """However close to the pole, and at the pole itself, where there is no azimuth; and after
    hundreds of passes, whatever side of the pole a drifting state passes on."""
    quantities = [*ANGLES[:2]] if form == "axis" else [*ANGLES]
    wanted = shipped(name, "span.periods=500.3", f"want.quantities={quantities!r}")
    trajectory = run(wanted, formulation=form)
    exact = ht.Motion(wanted.top, wanted.start).at(trajectory.t)
    off(trajectory, exact, np.sin(exact.theta) > 1e-2, 1e-7)
    events, upper = trajectory.events, np.abs(trajectory.events.axis[:, 2])
    passes = np.flatnonzero((upper > 1 - 1e-12) & (events.t > 0))[:50:7]
    assert passes.size == 8
    for t, at_pole in zip(events.t[passes], events.phi[passes], strict=True):
        before, after = (trajectory(t + s * 10.0 ** np.arange(-13, -5)) for s in (-1, 1))
        assert all(np.ptp(beside.phi[3:]) < 1e-3 for beside in (before, after))
        assert abs(after.phi[-1] - before.phi[-1] - np.pi) < 1e-3
        near = np.concatenate(([at_pole], before.phi, after.phi))
        aside_by = np.minimum(np.abs(near - before.phi[-1]), np.abs(near - after.phi[-1]))
        # within the rounding of a state on a pole its azimuth is any
        assert np.max(aside_by) < (np.pi / 2 + 1e-3 if form == "axis" else 0.1)
        jump = np.sign(trajectory(t).axis[2]) * np.pi
        assert form == "axis" or abs(after.psi[-1] - before.psi[-1] + jump) < 1e-3
    pole = ht.State(0, thetadot=-2, omega3=3)  # as after periods, within a rounding of the time
    fine = scene(wanted.top, pole, time=50 * ht.Motion(wanted.top, pole).period, digits=20)
    assert ht.run_errors(run(fine, formulation=form)).phi < 1e-17


# --- the attitude form ---------------------------------------------------------------------------


def test_a_fast_spin_costs_no_digits_and_no_steps():
    """At 1e6 rad/s psi itself has lost nine of its digits; the momentum p_psi is the same."""
    steps = []
    for factor in (1, 1000, 10**6):
        start = ht.State(theta=0.5, phidot=0.3, omega3=6.0 * factor)
        trajectory = run(scene(ht.Top(1, 0.5 / factor, 1), start, periods=10, events=(), samples=9))
        steps.append(trajectory.statistics.steps)
        exact = trajectory.binary_motion.closed_form.at(trajectory.t, 30)
        attitude = np.array([at.quaternion for at in exact], float)
        along = np.sum(attitude * trajectory.samples.quaternion, axis=1)  # of either sign
        difference = trajectory.samples.quaternion - np.sign(along)[:, None] * attitude
        assert np.max(np.abs(difference)) < 1e-13
    assert max(steps) <= min(steps) + 1


def test_the_closed_form_is_that_of_the_runs_own_numbers():
    """A start whose |q| is off one by 1e-9 is another top: the witness must know it."""
    trajectory = run(shipped("simo-wong", "span.periods=3.3"))
    orbit = trajectory.orbit
    state = orbit.checkpoints[0].state * np.array([1 + 1e-9] * 4 + [1, 1])
    start = replace(orbit.checkpoints[0], state=state)
    other = replace(trajectory, orbit=integrate(start_orbit(orbit.integrator, start), trajectory.t))
    theta = other.binary_motion.closed_form.at(other.t).theta
    assert np.max(np.abs(other.theta - theta)) < 1e-14
    assert np.max(np.abs(trajectory.theta - theta)) > 1e-11
