"""phi and psi that are read off the axis or the quaternion, their turns counted, against the closed
form; and the attitude form itself."""

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.equations.quaternion import attitude_form, product
from heavytop.integration.compiled import Block
from heavytop.integration.integrator import Checkpoint, Integrator, continued, not_begun
from heavytop.integration.turns import MOST_POINTS
from heavytop.run.verify import closed_form

from ..motions import BOOK, LIE, LIE_START, SCENES

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


def assert_wound_right(top, start, form, bound=0.1, **span):
    """A lost turn is 6.28."""
    wanted = scene(top, start, quantities=ANGLES if form == "attitude" else ANGLES[:2], **span)
    trajectory = run(wanted, form)
    exact = closed_form(trajectory)(trajectory.t)
    if np.max(np.abs(trajectory.theta - exact.theta)) > 1e-4:
        return trajectory  # beside the unstable vertical: the motion itself is forgotten
    motion = ht.Motion(top, start)  # whose samples may all lie at its turning point by a pole
    widest = max(np.sin(motion.theta_min), np.sin(motion.theta_max), np.max(np.sin(exact.theta)))
    off(trajectory, exact, np.sin(exact.theta) > 1e-5 * widest, bound)
    return trajectory


def thousandths(low, high):
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda k: k / 1000)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["auto", "attitude"])
@settings(max_examples=80, deadline=None)
@given(
    theta=st.one_of(
        thousandths(0.01, 3.13),
        st.integers(-9, -1).map(lambda k: 10.0**k),
        st.integers(-9, -1).map(lambda k: np.pi - 10.0**k),
    ),
    thetadot=thousandths(-8, 8),
    phidot=thousandths(-25, 25),
    psidot=st.one_of(thousandths(-60, 60), st.just(0.0), thousandths(-600, 600)),
    g=thousandths(-3, 3),
    samples=st.sampled_from((2, 7, 401)),
    backwards=st.booleans(),
)
def test_turns_of_any_motion(form, theta, thetadot, phidot, psidot, g, samples, backwards):
    top = ht.Top(A=1, C=0.5, gMR=g)
    start = ht.State(theta=theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    motion = ht.Motion(top, start)
    if not motion.nutates or motion.from_top < 1e-13 or motion.from_bottom < 1e-13:
        return  # no turning points, or a pass through a pole within rounding
    try:
        span = 20 * motion.period * (-1 if backwards else 1)
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
@pytest.mark.parametrize("seed", range(20))
def test_passes_through_a_pole_jump_as_documented(form, seed):
    source = np.random.default_rng(seed)
    top = ht.Top(A=1, C=source.uniform(0.2, 1.5), gMR=source.uniform(-2, 2))
    theta = "pi" if seed % 2 else 0
    start = ht.State(theta, thetadot=source.uniform(-4, 4), psidot=source.uniform(-20, 20))
    for span in (20, -20):
        trajectory = run(scene(top, start, time=span), form)
        exact = ht.Motion(top, start).at(trajectory.t)
        off(trajectory, exact, np.sin(exact.theta) > 1e-4, 1e-8)
        first = trajectory(0.0)
        assert abs(first.phi - exact.phi[0]) < 1e-14
        assert abs(first.psi - exact.psi[0]) < 1e-14


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
    passes = np.flatnonzero((upper > 1 - 1e-12) & (events.t > 0))[:50]
    assert passes.size == 50
    aside = 10.0 ** np.arange(-13, -5)
    for t, at_pole in zip(events.t[passes[::7]], events.phi[passes[::7]], strict=True):
        before, after = (trajectory(t + sign * aside) for sign in (-1, 1))
        assert np.max(np.abs(before.phi[3:] - before.phi[-1])) < 1e-3
        assert np.max(np.abs(after.phi[3:] - after.phi[-1])) < 1e-3
        assert abs(after.phi[-1] - before.phi[-1] - np.pi) < 1e-3
        near = np.concatenate(([at_pole], before.phi, after.phi))
        aside_by = np.minimum(np.abs(near - before.phi[-1]), np.abs(near - after.phi[-1]))
        if form == "axis":  # within the rounding of a state on a pole its azimuth is any
            assert np.max(aside_by) < np.pi / 2 + 1e-3
            continue
        assert np.max(aside_by) < 0.1
        jump = np.sign(trajectory(t).axis[2]) * np.pi
        assert abs(after.psi[-1] - before.psi[-1] + jump) < 1e-3


@both_forms
@pytest.mark.parametrize("miss", [s * 10.0**-k for s in (1, -1) for k in (2, 4, 6, 8, 11, 16)])
@pytest.mark.parametrize("spin_rate", [0.0, 3.0, 30.0])
def test_however_closely_a_pole_is_missed_the_turn_is_the_right_one(form, miss, spin_rate):
    """Without spin both poles are passed, where neither phi + psi nor phi - psi is regular."""
    phidot = (0.5 * spin_rate * (1 - np.cos(1.0)) + miss) / np.sin(1.0) ** 2
    start = ht.State.kicked(theta=1, thetadot=-6.0, omega3=spin_rate, phidot=phidot)
    angles = ANGLES if form == "attitude" else ANGLES[:2]
    trajectory = run(scene(UNIT, start, time=30, quantities=angles), form)
    assert trajectory.events.count("turning") >= 10
    exact = closed_form(trajectory)(trajectory.t)
    off(trajectory, exact, np.sin(exact.theta) > 1e-3, 1e-9)


@both_forms
def test_a_pendulum_that_turns_over_is_wound_alike_however_it_is_sampled(form):
    """Both poles are passed exactly: at either phi jumps by pi forward, psi to and fro."""
    wanted = ht.Scene(BOOK, ht.State(2, thetadot=40), time=2, quantities=("theta", "phi"))
    fine, coarse = (run(replace(wanted, samples=n), form) for n in (401, 3))
    passes = fine.events.count("turning")
    assert fine.phi[-1] == coarse.phi[-1] == fine(2.0).phi
    assert abs(fine.phi[-1] - np.pi * passes) < 1e-9
    if form == "attitude":
        assert fine.psi[-1] == coarse.psi[-1] == fine(2.0).psi
        assert abs(fine.psi[-1] - np.pi * (passes % 2)) < 1e-9


@both_forms
@pytest.mark.parametrize("theta", ["0", "pi"])
@pytest.mark.parametrize("time", [5, -500])
def test_on_the_vertical_phi_stays_and_psi_takes_all_the_spin(form, theta, time):
    start = ht.State(theta=theta, phi=0.25, psi=1.5, psidot=2)  # so slow that steps are long
    trajectory = run(scene(UNIT, start, time=time, samples=3), form)
    assert np.max(np.abs(trajectory.phi - 0.25)) < 1e-15
    assert np.max(np.abs(trajectory.psi - 1.5 - 2 * trajectory.t)) < 1e-14 * abs(time)


def test_a_top_that_rests_upright_takes_one_step():
    """Nothing moves, whatever gravity would do: a step as long as the span, and no turns."""
    trajectory = run(scene(ht.Top(1, 0.5, 1e4), ht.State(0, phi=1, psi=2), time=1e6))
    assert trajectory.statistics.steps <= 2
    assert trajectory.orbit.integrator.turns.apart == np.inf
    assert np.max(np.abs(trajectory.phi - 1)) < 1e-15
    assert np.max(np.abs(trajectory.psi - 2)) < 1e-15


def test_a_step_of_any_length_is_seen_at_no_more_points_than_memory_holds():
    class Leap:
        formulation = attitude_form()

        def load(self, constants):
            pass

        def block(self, state, steps, far, samples, longest):
            self.asked = samples.size
            rows = np.broadcast_to(state, (samples.size, state.size))
            return Block(state, (far / 2, 0.0), 1, rows, (), singular=False)

    engine, state = Leap(), np.array([0.6, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    still = {"g": 1.0, "l_z": 0.0, "P_plus": 0.0, "P_minus": 0.0}
    integrator = Integrator(attitude_form("angles"), engine, still, state)
    integrator.block(Checkpoint((0.0, 0.0), state, 0), 1, 1e9, reach=1e8)
    assert engine.asked == MOST_POINTS


@both_forms
@pytest.mark.parametrize("theta", [1e-9, np.pi - 1e-9])
def test_a_vertical_top_that_hardly_nods_turns_with_its_precession(form, theta):
    """Tilted by 1e-9 the axis is slow to show in the error norm: steps of many turns."""
    assert_wound_right(ht.Top(1, 0.5, 0.01), ht.State(theta, psidot=40.0), form, 1e-3, periods=20)


@both_forms
def test_angles_start_where_the_scene_says(form):
    start = ht.State(theta=1.0, phi=100.0, psi=-2e4, phidot=0.3, psidot=6)
    assert_wound_right(UNIT, start, form, 1e-9, time=5)
    trajectory = run(scene(UNIT, start, time=5), form)
    assert abs(trajectory.phi[0] - 100.0) < 1e-13
    assert abs(trajectory.psi[0] + 2e4) == 0
    assert abs(trajectory(1e-9).psi + 2e4) < 1e-7


@pytest.fixture(scope="module")
def fuzz_turns():
    folder = str(Path(__file__).parents[2] / "validation")
    sys.path.insert(0, folder)
    yield import_module("fuzz_turns")
    sys.path.remove(folder)


def test_no_turn_is_lost_and_no_digit_in_silence(fuzz_turns, monkeypatch):
    """A fast slice of ``validation/fuzz_turns.py``, and an error planted: a pole's sense."""
    assert fuzz_turns.misses(2, 10) == []
    monkeypatch.setattr("heavytop.integration.turns.in_sense", lambda _sense, change: change)
    found = " ".join(fuzz_turns.misses(2, 10))
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


def in_the_axis_form(wanted):
    """The run, or None: that form does not give psi where both poles are passed exactly."""
    try:
        return run(wanted, "axis")
    except ht.BadScene:
        assert ht.Motion(wanted.top, wanted.start).kind == "planar-pendulum"
        return None


@pytest.mark.parametrize("name", SCENES)
def test_every_shipped_scene_as_the_closed_form_and_as_well_as_the_axis_form(name):
    wanted = shipped(name)
    trajectory, axis = run(wanted), in_the_axis_form(wanted)
    errors, end = ht.run_errors(trajectory), trajectory(trajectory.orbit.end)
    known = axis and ht.run_errors(axis)
    assert errors.why_not == ""
    for angle in (*ANGLES, "event_time"):
        # where a motion forgets its start, errors grow in either form alike
        least = 30 * (getattr(known, angle) or 0.0) if axis else 0.0
        bound = 1e-12 * max(1.0, abs(float(getattr(end, angle, 0.0))))
        assert (getattr(errors, angle) or 0.0) <= max(bound, least), angle
    assert max(errors.energy, errors.invariants["length"]) < 1e-14
    for rate in ("thetadot", "phidot", "psidot", "omega", "quaternion"):
        assert np.isfinite(getattr(trajectory.samples, rate)).all(), rate
    if name in ("sicm-kicked", "sicm-dropped", "sicm-forward", "simo-wong"):
        ours, theirs = trajectory.events, axis.events
        assert ours.kind == theirs.kind
        assert np.max(np.abs(ours.t - theirs.t)) < 1e-13
        assert np.max(np.abs(ours.phi - theirs.phi)) < 1e-12


@both_forms
def test_rates_and_vectors_as_the_closed_form(form):
    trajectory = run(shipped("sicm-kicked"), form)
    exact = closed_form(trajectory)(trajectory.t)
    for rate in ("thetadot", "phidot", "psidot"):
        assert np.max(np.abs(getattr(trajectory.samples, rate) - getattr(exact, rate))) < 1e-11
    assert np.max(np.abs(trajectory.axis - exact.axis)) < 1e-14
    assert np.max(distance(trajectory.samples.quaternion, attitude_of(exact))) < 1e-11
    spin_rate = np.sum(trajectory.samples.omega * exact.axis, axis=1)
    assert np.max(np.abs(spin_rate - (exact.psidot + exact.phidot * exact.u))) < 1e-11


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
        exact = closed_form(trajectory)(trajectory.t)
        assert np.max(distance(trajectory.samples.quaternion, attitude_of(exact))) < 1e-13
    assert np.max(np.abs(exact.psi)) > 1e6
    assert max(steps) <= min(steps) + 1


def test_without_angles_wanted_none_are_counted():
    trajectory = run(ht.load_scene("sicm-kicked", ['want.quantities=["theta", "axis"]']))
    assert trajectory.plan.states == trajectory.samples.states.shape[1] == 6
    assert trajectory.phi is None
    assert trajectory.psi is None
    counted = run(shipped("sicm-kicked"))
    assert np.array_equal(trajectory.samples.quaternion, counted.samples.quaternion)
    assert np.array_equal(trajectory.theta, counted.theta)


def test_the_closed_form_is_that_of_the_runs_own_numbers():
    """A start whose |q| is off one by 1e-9 is another top: the witness must know it."""
    trajectory = run(shipped("simo-wong", "span.periods=3.3"))
    orbit = trajectory.orbit
    state = orbit.checkpoints[0].state.copy()
    state[:4] *= 1 + 1e-9
    start = replace(orbit.checkpoints[0], state=state)
    other = replace(trajectory, orbit=continued(not_begun(orbit.integrator, start), trajectory.t))
    theta = closed_form(other)(other.t).theta
    assert np.max(np.abs(other.theta - theta)) < 1e-14
    assert np.max(np.abs(trajectory.theta - theta)) > 1e-11


@pytest.mark.slow
@both_forms
@pytest.mark.parametrize("projected", [False, True])
def test_samples_resumption_and_storage_change_no_bit(form, projected, tmp_path):
    """A projected run has several blocks, each of several legs, and keeps its invariants."""
    wanted = shipped("sicm-kicked", "span.periods=700", "want.samples=5")
    whole, dense = (
        ht.propagate(replace(wanted, samples=n), formulation=form, projected=projected)
        for n in (5, 1001)
    )
    part = replace(wanted, periods=None, time=ht.Exact.of(whole.orbit.end / 3))
    extended = ht.propagate(part, formulation=form, projected=projected)
    extended = ht.extend(extended, whole.orbit.end, samples=17)
    whole.save(tmp_path / "run.nc")
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    asked = np.random.default_rng(7).uniform(0.0, whole.orbit.end, 77)
    assert np.array_equal(whole.samples.states, dense.samples.states[::250])
    for other in (dense, extended, loaded):
        assert other.plan.projected == projected
        assert other.orbit.steps == whole.orbit.steps
        for a, b in zip(other.orbit.checkpoints, whole.orbit.checkpoints, strict=True):
            assert a.time == b.time
            assert np.array_equal(a.state, b.state)
        assert np.array_equal(other(asked).states, whole(asked).states)
        assert np.array_equal(other(asked).quaternion, whole(asked).quaternion)
        assert other.events.kind == whole.events.kind
        for name in ("t", "t_low", "phi", "states", "residual"):
            mine, others = (getattr(x.events, name) for x in (whole, other))
            assert np.array_equal(mine, others, equal_nan=True), name
    later = 1.5 * whole.orbit.end
    ends = [ht.extend(x, later).orbit.checkpoints[-1].state for x in (whole, loaded)]
    assert np.array_equal(*ends)
    if projected:
        errors = ht.run_errors(whole)
        assert max(errors.energy, *errors.invariants.values()) < 3e-15
        assert max(errors.phi, errors.psi) < 1e-10
