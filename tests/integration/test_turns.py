"""phi and psi of the attitude form, their turns counted, against the closed form."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.equations.quaternion import attitude_form
from heavytop.integration.compiled import Block
from heavytop.integration.integrator import Checkpoint, Integrator
from heavytop.integration.turns import MOST_POINTS
from heavytop.run.verify import closed_form

pytestmark = pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")

ANGLES = ("theta", "phi", "psi")
UNIT = ht.Top(A=1, C="0.5", gMR=1)


def run(scene):
    return ht.propagate(scene, formulation="attitude")


def shipped(name, *overrides):
    return ht.load_scene(name, overrides=[f"want.quantities={list(ANGLES)!r}", *overrides])


def assert_wound_right(top, start, **span):
    wants = {"quantities": ANGLES, "events": ("turning",)}
    trajectory = run(ht.Scene(top, start, **wants, **span))
    exact = closed_form(trajectory)(trajectory.t)
    lost = np.max(np.abs(trajectory.theta - exact.theta))
    if lost > 1e-4:  # beside the unstable vertical: the motion itself is forgotten
        return trajectory
    motion = ht.Motion(top, start)  # whose samples may all lie at its turning point by a pole
    widest = max(np.sin(motion.theta_min), np.sin(motion.theta_max), np.max(np.sin(exact.theta)))
    away = np.sin(exact.theta) > 1e-5 * widest
    if not away.any():
        return trajectory
    for angle in ("phi", "psi"):
        off = np.abs(getattr(trajectory, angle) - getattr(exact, angle))[away]
        assert np.max(off) < 0.1, angle  # a lost turn is 6.28
    return trajectory


def thousandths(low, high):
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda k: k / 1000)


@settings(max_examples=100, deadline=None)
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
def test_turns_of_any_motion(theta, thetadot, phidot, psidot, g, samples, backwards):
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
    assert_wound_right(top, start, time=span, samples=samples)


def test_close_passes_of_the_benchmark_over_a_thousand_periods():
    scene = shipped("lie-group-benchmark", "span.periods=1000")
    trajectory = run(scene)
    motion, periods = ht.Motion(scene.top, scene.start), np.arange(1, 1000)
    there = trajectory(periods * motion.period)
    # away from the pole, at the upper turning points, phi is as good as the axis
    assert np.max(np.abs(there.phi - np.pi - periods * motion.precession)) < 1e-9
    assert np.max(np.abs(there.psi - periods * motion.spin)) < 1e-9


@pytest.mark.parametrize("seed", range(40))
def test_passes_through_a_pole_jump_as_documented(seed):
    source = np.random.default_rng(seed)
    top = ht.Top(A=1, C=source.uniform(0.2, 1.5), gMR=source.uniform(-2, 2))
    start = ht.State(
        theta="pi" if seed % 2 else 0,
        thetadot=source.uniform(-4, 4),
        psidot=source.uniform(-20, 20),
    )
    for span in (20, -20):
        trajectory = run(ht.Scene(top, start, time=span, quantities=ANGLES, events=("turning",)))
        exact = ht.Motion(top, start).at(trajectory.t)
        away = np.sin(exact.theta) > 1e-4
        assert np.max(np.abs((trajectory.phi - exact.phi)[away])) < 1e-8
        assert np.max(np.abs((trajectory.psi - exact.psi)[away])) < 1e-8
        first = trajectory(0.0)
        assert abs(first.phi - exact.phi[0]) < 1e-14
        assert abs(first.psi - exact.psi[0]) < 1e-14


@pytest.mark.parametrize("name", ["through-top", "through-bottom", "planar-rotating"])
def test_hundreds_of_passes_through_a_pole(name):
    """Whatever side of the pole a drifting state passes on."""
    scene = shipped(name, "span.periods=500.3")
    trajectory = run(scene)
    exact = ht.Motion(scene.top, scene.start).at(trajectory.t)
    away = np.sin(exact.theta) > 1e-2
    assert np.max(np.abs((trajectory.phi - exact.phi)[away])) < 1e-7
    assert np.max(np.abs((trajectory.psi - exact.psi)[away])) < 1e-7


@pytest.mark.parametrize("name", ["through-top", "through-bottom", "planar-rotating"])
def test_beside_a_pass_phi_is_that_of_before_or_of_after(name):
    """However close to the pole, and at the pole itself, where there is no azimuth."""
    trajectory = run(shipped(name, "span.periods=60"))
    events, upper = trajectory.events, np.abs(trajectory.events.axis[:, 2])
    passes = np.flatnonzero((upper > 1 - 1e-12) & (events.t > 0))[:-1]
    assert passes.size >= 50
    aside = 10.0 ** np.arange(-13, -5)
    for t, at_pole in zip(events.t[passes[::7]], events.phi[passes[::7]], strict=True):
        before, after = (trajectory(t + sign * aside) for sign in (-1, 1))
        assert np.max(np.abs(before.phi[3:] - before.phi[-1])) < 1e-3
        assert np.max(np.abs(after.phi[3:] - after.phi[-1])) < 1e-3
        assert abs(after.phi[-1] - before.phi[-1] - np.pi) < 1e-3
        jump = np.sign(trajectory(t).axis[2]) * np.pi
        assert abs(after.psi[-1] - before.psi[-1] + jump) < 1e-3
        near = np.concatenate(([at_pole], before.phi, after.phi))
        assert np.max(np.minimum(np.abs(near - before.phi[-1]), np.abs(near - after.phi[-1]))) < 0.1


@pytest.mark.parametrize("miss", [s * 10.0**k for s, k in product((1, -1), range(-16, -1))])
@pytest.mark.parametrize("spin_rate", [0.0, 3.0, 30.0])
def test_however_closely_a_pole_is_missed_the_turn_is_the_right_one(miss, spin_rate):
    """Without spin both poles are passed, where neither phi + psi nor phi - psi is regular."""
    theta = 1.0
    p_psi = 0.5 * spin_rate
    phidot = (p_psi * (1 - np.cos(theta)) + miss) / np.sin(theta) ** 2
    start = ht.State.kicked(theta=theta, thetadot=-6.0, omega3=spin_rate, phidot=phidot)
    trajectory = run(ht.Scene(UNIT, start, time=30, quantities=ANGLES, events=("turning",)))
    assert trajectory.events.count("turning") >= 10
    exact = closed_form(trajectory)(trajectory.t)
    away = np.sin(exact.theta) > 1e-3
    for angle in ("phi", "psi"):
        difference = getattr(trajectory, angle) - getattr(exact, angle)
        assert np.max(np.abs(difference)[away]) < 1e-9, angle


def test_a_pendulum_that_turns_over_is_wound_alike_however_it_is_sampled():
    """Both poles are passed exactly: at either phi jumps by pi forward, psi to and fro."""
    top = ht.Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    scene = ht.Scene(top, ht.State(theta=2, thetadot=40), time=2, quantities=ANGLES)
    fine, coarse = (run(replace(scene, samples=n)) for n in (401, 3))
    passes = fine.events.count("turning")
    assert fine.phi[-1] == coarse.phi[-1] == fine(2.0).phi
    assert fine.psi[-1] == coarse.psi[-1] == fine(2.0).psi
    assert abs(fine.phi[-1] - np.pi * passes) < 1e-9
    assert abs(fine.psi[-1] - np.pi * (passes % 2)) < 1e-9


@pytest.mark.parametrize("theta", ["0", "pi"])
@pytest.mark.parametrize("time", [5, -5, 500, -500])
def test_on_the_vertical_phi_stays_and_psi_takes_all_the_spin(theta, time):
    start = ht.State(theta=theta, phi=0.25, psi=1.5, psidot=2)  # so slow that steps are long
    trajectory = run(ht.Scene(UNIT, start, time=time, quantities=ANGLES, samples=3))
    assert np.max(np.abs(trajectory.phi - 0.25)) < 1e-15
    assert np.max(np.abs(trajectory.psi - 1.5 - 2 * trajectory.t)) < 1e-14 * max(5, abs(time))


def test_a_top_that_rests_upright_takes_one_step():
    """Nothing moves, whatever gravity would do: a step as long as the span, and no turns."""
    top = ht.Top(A=1, C=0.5, gMR=1e4)
    trajectory = run(ht.Scene(top, ht.State(theta=0, phi=1, psi=2), time=1e6, quantities=ANGLES))
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
    start = Checkpoint((0.0, 0.0), state, 0)
    still = {"g": 1.0, "l_z": 0.0, "P_plus": 0.0, "P_minus": 0.0}
    Integrator(attitude_form("angles"), engine, still, state).block(start, 1, 1e9, reach=1e8)
    assert engine.asked == MOST_POINTS


def test_a_vertical_top_that_hardly_nods_turns_with_its_precession():
    top = ht.Top(A=1, C=0.5, gMR=0.01)
    for theta in (1e-9, np.pi - 1e-9):
        assert_wound_right(top, ht.State(theta=theta, psidot=40.0), periods=20)


def test_angles_start_where_the_scene_says():
    start = ht.State(theta=1.0, phi=100.0, psi=-2e4, phidot=0.3, psidot=6)
    trajectory = assert_wound_right(UNIT, start, time=5)
    assert (trajectory.phi[0], trajectory.psi[0]) == (100.0, -2e4)
    assert abs(trajectory(1e-9).psi + 2e4) < 1e-7


# --- the same bits, however it is asked ----------------------------------------------------


def test_samples_resumption_and_storage_change_no_bit(tmp_path):
    scene = shipped("sicm-kicked", "span.periods=100", "want.samples=5")
    whole = run(scene)
    dense = run(replace(scene, samples=1001))
    assert np.array_equal(whole.samples.states, dense.samples.states[::250])
    half = run(replace(scene, periods=None, time=ht.Exact.of(whole.orbit.end / 2)))
    extended = ht.extend(half, whole.orbit.end)
    whole.save(tmp_path / "run.nc")
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    asked = np.linspace(0.0, whole.orbit.end, 77)
    for other in (dense, extended, loaded):
        assert np.array_equal(other(asked).states, whole(asked).states)
        assert np.array_equal(other(asked).quaternion, whole(asked).quaternion)
    assert np.array_equal(loaded.events.phi, whole.events.phi)


def test_a_projected_run_counts_the_same_turns_and_keeps_its_invariants():
    scene = shipped("sicm-kicked", "span.periods=3000.3", "want.samples=3")
    free, held = (
        ht.propagate(scene, formulation="attitude", projected=projected)
        for projected in (False, True)
    )
    errors = ht.run_errors(held)
    assert max(abs(free.phi[-1] - held.phi[-1]), abs(free.psi[-1] - held.psi[-1])) < 1e-7
    assert max(errors.energy, *errors.invariants.values()) < 3e-15
    assert max(errors.phi, errors.psi) < 1e-10
