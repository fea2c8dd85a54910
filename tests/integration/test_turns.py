"""phi and psi that are read off the axis or the quaternion, their turns counted, against the closed
form; and the attitude form itself."""

from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.equations.quaternion import product
from heavytop.integration.integrator import continued, not_begun
from heavytop.run.verify import own_motion

from ..motions import LIE, LIE_START, SCENES

pytestmark = pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")

ANGLES = ("theta", "phi", "psi")
UNIT = ht.Top(A=1, C="0.5", gMR=1)
both_forms = pytest.mark.parametrize("form", ["axis", "attitude"])


def run(scene, formulation="attitude"):
    return ht.propagate(scene, formulation=formulation)


def shipped(name, *overrides):
    return ht.load_scene(name, [f"want.quantities={list(ANGLES)!r}", *overrides])


def scene(top, start, **span):
    return ht.Scene(top, start, **({"quantities": ANGLES, "events": ("turning",)} | span))


def off(trajectory, exact, where, bound):
    for angle in ("phi", "psi"):
        if (told := getattr(trajectory, angle)) is not None:
            difference = np.abs(told - getattr(exact, angle))[where]
            assert np.max(difference, initial=0) < bound, angle


def assert_wound_right(top, start, form, bound=0.1, aside=1e-5, **span):
    """A lost turn is 6.28."""
    wanted = scene(top, start, quantities=ANGLES if form == "attitude" else ANGLES[:2], **span)
    trajectory = run(wanted, form)
    exact = own_motion(trajectory).at(trajectory.t)
    if np.max(np.abs(trajectory.theta - exact.theta)) > 1e-4:
        return trajectory  # beside the unstable vertical: the motion itself is forgotten
    motion = ht.Motion(top, start)  # whose samples may all lie at its turning point by a pole
    widest = max(np.sin(motion.theta_min), np.sin(motion.theta_max), np.max(np.sin(exact.theta)))
    off(trajectory, exact, np.sin(exact.theta) > aside * widest, bound)
    return trajectory


def thousandths(low, high):
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda k: k / 1000)


near_a_pole = st.integers(-9, -1).map(lambda k: 10.0**k)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["auto", "attitude"])
@settings(max_examples=80, deadline=None)
@given(
    theta=thousandths(0.01, 3.13) | near_a_pole | near_a_pole.map(lambda x: np.pi - x),
    thetadot=thousandths(-8, 8),
    phidot=thousandths(-25, 25),
    psidot=thousandths(-60, 60) | st.just(0.0) | thousandths(-600, 600),
    g=thousandths(-3, 3),
    samples=st.sampled_from((2, 7, 401)),
    sign=st.sampled_from((1, -1)),
)
def test_turns_of_any_motion(form, theta, thetadot, phidot, psidot, g, samples, sign):
    top = ht.Top(A=1, C=0.5, gMR=g)
    start = ht.State(theta=theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    motion = ht.Motion(top, start)
    if not motion.nutates or min(motion.from_top, motion.from_bottom) < 1e-13:
        return  # no turning points, or a pass through a pole within rounding
    try:
        span = sign * 20 * motion.period
        motion.at(span)
    except ht.NoClosedForm:
        return
    assert_wound_right(top, start, form, time=span, samples=samples)


@both_forms
def test_close_passes_of_the_benchmark_over_a_thousand_periods(form):
    """Past the bottom at 7e-7 rad."""
    trajectory = run(scene(LIE, LIE_START, periods=1000), form)
    motion, periods = ht.Motion(LIE, LIE_START), np.arange(1, 1000)
    there = trajectory(periods * motion.period)
    # away from the pole, at the upper turning points, phi is as good as the axis
    assert np.max(np.abs(there.phi - np.pi - periods * motion.precession)) < 1e-9
    assert np.max(np.abs(there.psi - periods * motion.spin)) < 1e-9


@both_forms
@pytest.mark.parametrize("name", ["through-top", "through-bottom", "planar-rotating"])
def test_beside_a_pass_phi_is_that_of_before_or_of_after(name, form):
    """However close to the pole, and at the pole itself, where there is no azimuth; and after
    hundreds of passes, whatever side of the pole a drifting state passes on."""
    wanted = shipped(name, "span.periods=500.3", f"want.quantities={list(ANGLES[:2])!r}")
    trajectory = run(wanted if form == "axis" else shipped(name, "span.periods=500.3"), form)
    exact = ht.Motion(wanted.top, wanted.start).at(trajectory.t)
    off(trajectory, exact, np.sin(exact.theta) > 1e-2, 1e-7)
    events, upper = trajectory.events, np.abs(trajectory.events.axis[:, 2])
    passes = np.flatnonzero((upper > 1 - 1e-12) & (events.t > 0))[:50:7]
    assert passes.size == 8
    aside = 10.0 ** np.arange(-13, -5)
    for t, at_pole in zip(events.t[passes], events.phi[passes], strict=True):
        before, after = (trajectory(t + sign * aside) for sign in (-1, 1))
        for beside in (before, after):
            assert np.max(np.abs(beside.phi[3:] - beside.phi[-1])) < 1e-3
        assert abs(after.phi[-1] - before.phi[-1] - np.pi) < 1e-3
        near = np.concatenate(([at_pole], before.phi, after.phi))
        aside_by = np.minimum(np.abs(near - before.phi[-1]), np.abs(near - after.phi[-1]))
        # within the rounding of a state on a pole its azimuth is any
        assert np.max(aside_by) < (np.pi / 2 + 1e-3 if form == "axis" else 0.1)
        if form == "attitude":
            jump = np.sign(trajectory(t).axis[2]) * np.pi
            assert abs(after.psi[-1] - before.psi[-1] + jump) < 1e-3


@both_forms
@pytest.mark.parametrize("miss", [1e-2, -1e-4, 1e-6, -1e-8, 1e-11, -1e-16])
@pytest.mark.parametrize("spin_rate", [0.0, 3.0, 30.0])
def test_however_closely_a_pole_is_missed_the_turn_is_the_right_one(form, miss, spin_rate):
    """Without spin both poles are passed, where neither phi + psi nor phi - psi is regular."""
    phidot = (0.5 * spin_rate * (1 - np.cos(1.0)) + miss) / np.sin(1.0) ** 2
    start = ht.State.kicked(theta=1, thetadot=-6.0, omega3=spin_rate, phidot=phidot)
    trajectory = assert_wound_right(UNIT, start, form, 1e-9, aside=1e-3, time=30)
    assert trajectory.events.count("turning") >= 10


@pytest.fixture
def fuzz(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "validation"))
    return import_module("43_fuzz")


def test_no_turn_is_lost_and_no_digit_in_silence(fuzz, monkeypatch):
    """A fast slice of ``validation/43_fuzz.py``, and an error planted: a pole's sense."""
    assert fuzz.turn_misses(2, 10) == []
    monkeypatch.setattr("heavytop.integration.turns.in_sense", lambda _sense, change: change)
    found = " ".join(fuzz.turn_misses(2, 10))
    assert "attitude: phi off by" in found
    assert "axis: phi off by" in found


# --- the attitude form ---------------------------------------------------------------------------


def attitude_of(exact):
    """The quaternions of the closed form, of phi and psi that keep their digits."""
    half = exact.theta / 2
    plus, minus = ((exact.phi_mod + sign * exact.psi_mod) / 2 for sign in (1, -1))
    c, s = np.cos(half), np.sin(half)
    parts = (c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus))
    return np.stack(parts, axis=-1)


def distance(a, b):
    """How far quaternions are apart, of either sign."""
    return np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))


@pytest.mark.parametrize("name", SCENES)
def test_every_shipped_scene_as_the_closed_form_and_as_well_as_the_axis_form(name):
    wanted = shipped(name)
    both_poles = ht.Motion(wanted.top, wanted.start).kind == "planar-pendulum"  # no psi by the axis
    trajectory, axis = run(wanted), None if both_poles else run(wanted, "axis")
    errors, known = (ht.run_errors(each) if each else None for each in (trajectory, axis))
    end = trajectory(trajectory.orbit.end)
    assert errors.why_not == ""
    for angle in (*ANGLES, "event_time"):
        # where a motion forgets its start, errors grow in either form alike
        least = 30 * (getattr(known, angle) or 0.0) if known else 0.0
        bound = 1e-12 * max(1.0, abs(float(getattr(end, angle, 0.0))))
        assert (getattr(errors, angle) or 0.0) <= max(bound, least), angle
    assert max(errors.energy, errors.invariants["length"]) < 1e-14
    for rate in ("thetadot", "phidot", "psidot", "omega", "quaternion"):
        assert np.isfinite(getattr(trajectory.samples, rate)).all(), rate


def test_the_quaternion_of_the_lie_group_benchmark_at_two_seconds():
    """The published state's quaternion at 2 s, by another program at 50 digits.

    The benchmark's body frame is ours turned by a constant rotation, such that R = 1 at first.
    """
    published = np.array(
        [0.12294713504153347, -0.49107989255002701, 0.35043003034362096, -0.78798688755048567]
    )
    trajectory = run(ht.load_scene("lie-group-benchmark", ['want.quantities=["attitude"]']))
    first, last = trajectory([0.0, 2.0]).quaternion
    ours = product(tuple(last), (first[0], *(-x for x in first[1:])))
    assert distance(np.array(ours, dtype=float), published) < 1e-13


def test_a_fast_spin_costs_no_digits_and_no_steps():
    """At 1e6 rad/s psi itself has lost nine of its digits; the momentum p_psi is the same."""
    steps = []
    for factor in (1, 1000, 10**6):
        start = ht.State.kicked(theta=0.5, phidot=0.3, omega3=6.0 * factor)
        trajectory = run(scene(ht.Top(1, 0.5 / factor, 1), start, periods=10, events=()))
        steps.append(trajectory.statistics.steps)
        exact = own_motion(trajectory).at(trajectory.t)
        assert np.max(distance(trajectory.samples.quaternion, attitude_of(exact))) < 1e-13
    assert np.max(np.abs(exact.psi)) > 1e6
    assert max(steps) <= min(steps) + 1


def test_the_closed_form_is_that_of_the_runs_own_numbers():
    """A start whose |q| is off one by 1e-9 is another top: the witness must know it."""
    trajectory = run(shipped("simo-wong", "span.periods=3.3"))
    orbit = trajectory.orbit
    state = orbit.checkpoints[0].state.copy()
    state[:4] *= 1 + 1e-9
    start = replace(orbit.checkpoints[0], state=state)
    other = replace(trajectory, orbit=continued(not_begun(orbit.integrator, start), trajectory.t))
    theta = own_motion(other).at(other.t).theta
    assert np.max(np.abs(other.theta - theta)) < 1e-14
    assert np.max(np.abs(trajectory.theta - theta)) > 1e-11
