"""Every kind of motion, integrated, against the closed form: poles, pendulums, vertical tops."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.numbers import Exact

UNIT = ht.Top(A=1, C="0.5", gMR=1)
gamma = "1"  # sqrt(gMR/A)


def start(**given):
    return ht.State(**given)


MOTIONS = {
    "waves": (UNIT, start(theta="0.5", phidot="3", psidot=6)),
    "loops": (UNIT, start(theta="0.5", phidot="-0.3", psidot=6)),
    "cusps": (UNIT, start(theta="0.5", psidot=6)),
    "rising": (UNIT, start(theta=1, thetadot=-1, phidot="0.3", psidot=6)),
    "slow precession": (UNIT, ht.State.steady(UNIT, theta=1, omega3=8, which="slow")),
    "fast precession": (UNIT, ht.State.steady(UNIT, theta=1, omega3=8, which="fast")),
    "sleeping": (UNIT, start(theta=0, psidot=6)),
    "hanging": (UNIT, start(theta="pi", psidot=6)),
    "at rest below": (UNIT, start(theta="pi")),
    "separatrix": (
        UNIT,
        start(theta="pi/3", phidot="2/sqrt(3)", psidot="(3 - 0.5)/(0.5*sqrt(3))"),
    ),
    "through the top": (UNIT, start(theta=0, thetadot=2, psidot=3)),
    "through the bottom": (UNIT, start(theta="pi", thetadot=2, psidot=3)),
    "spherical pendulum": (UNIT, start(theta=2, phidot=1)),
    "planar, swinging": (UNIT, start(theta=2)),
    "planar, turning over": (UNIT, start(theta=2, thetadot=3)),
    "force-free": (ht.Top(A=1, C="0.5", gMR=0), start(theta=1, phidot=1, psidot=3)),
    "spherical top": (ht.Top(A=1, C=1, gMR=1), start(theta=1, phidot=1, psidot=3)),
    "inverted": (ht.Top(A=1, C="0.5", gMR=-1), start(theta=1, phidot=1, psidot=3)),
    "fast spin": (ht.Top(A=1, C="1e-6", gMR=1), start(theta=1, psidot="1e6")),
}
TIME = 9.0
# errors grow as exp(gamma t/2) in theta on the separatrix, whose tilt decays as fast
BOUND = dict.fromkeys(MOTIONS, 2e-13) | {"separatrix": 2e-12}


def run(name, direction=1, quantities=("theta", "phi", "psi"), formulation="auto"):
    top, state = MOTIONS[name]
    scene = ht.Scene(
        top,
        state,
        time=direction * TIME,
        quantities=quantities,
        events=("turning", "reversal", "cusp"),
    )
    return ht.propagate(scene, formulation=formulation)


def attitude(theta, phi, psi):
    """Return the rotation, shape (k, 3, 3), which the jumps of phi and psi at a pole leave be."""
    c, s = np.cos, np.sin
    x = np.stack([c(phi) * c(psi) - s(phi) * c(theta) * s(psi), s(theta) * s(psi)], axis=-1)
    return np.concatenate([x, s(phi)[:, None] * s(theta)[:, None], c(theta)[:, None]], axis=-1)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", MOTIONS)
def test_axis_and_attitude(name, direction):
    trajectory = run(name, direction)
    top, state = MOTIONS[name]
    exact = ht.Motion(top, state).at(trajectory.t)
    assert np.max(np.abs(trajectory.axis - exact.axis)) < BOUND[name]
    ours = attitude(trajectory.theta, trajectory.phi, trajectory.psi)
    theirs = attitude(exact.theta, exact.phi, exact.psi)
    scale = max(1.0, float(np.max(np.abs(exact.psi)))) if name == "fast spin" else 1.0
    assert np.max(np.abs(ours - theirs)) < 4 * BOUND[name] * scale


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", sorted(set(MOTIONS) - {"sleeping", "hanging", "at rest below"}))
def test_phi_turns_as_the_closed_form_says(name, direction):
    trajectory = run(name, direction, quantities=("theta", "phi"))
    top, state = MOTIONS[name]
    exact = ht.Motion(top, state).at(trajectory.t)
    away = np.sin(exact.theta) > 1e-4  # at a pole itself phi is what rounding makes it
    assert np.max(np.abs((trajectory.phi - exact.phi)[away])) < 1e-8


@pytest.mark.parametrize("name", MOTIONS)
def test_errors_are_finite_and_events_belong_to_the_kind(name):
    trajectory = run(name)
    errors = ht.run_errors(trajectory)
    assert errors.why_not == ""
    assert errors.axis < 2e-12
    counts = [trajectory.events.count(e) for e in ("turning", "reversal", "cusp")]
    motion = ht.Motion(*MOTIONS[name])
    if not motion.nutates:
        once = motion.kind == "separatrix" and MOTIONS[name][1].thetadot.sign() == 0
        assert counts == [once, 0, 0]  # a start at rest in theta is its only turning point
        return
    offset = 0 if MOTIONS[name][1].thetadot.sign() == 0 else 0.5
    assert abs(counts[0] - (2 * TIME / motion.period + 1 - offset)) <= 1
    if str(motion.kind) == "cusps":
        assert counts[1] == 0
        assert abs(counts[2] - TIME / motion.period - 0.5) <= 0.5
    elif str(motion.kind) == "waves":
        assert counts[1:] == [0, 0]
    elif str(motion.kind) == "loops":
        assert abs(counts[1] - 2 * TIME / motion.period) <= 1
        assert counts[2] == 0


def test_an_end_exactly_on_a_turning_point_counts():
    top, state = MOTIONS["loops"]
    for periods in (1, 10, 100):
        scene = ht.Scene(top, state, periods=periods, events=("turning",))
        assert ht.propagate(scene).events.count("turning") == 2 * periods + 1


@pytest.mark.parametrize("miss", [1e-3, 1e-6, 1e-9, 1e-11])
@pytest.mark.parametrize("side", [-1, 1])
def test_near_a_cusp_the_events_are_counted_right(miss, side):
    """Just below a cusp the precession reverses twice a period; just above it never does."""
    state = ht.State(theta="0.1", phidot=side * miss, psidot=140)
    top = ht.Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    scene = ht.Scene(top, state, periods=20, events=("turning", "reversal", "cusp"))
    events = ht.propagate(scene).events
    assert events.count("turning") == 41
    assert events.count("cusp") == 0
    assert events.count("reversal") == (40 if side < 0 else 0)


@pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")
@pytest.mark.parametrize("miss", [0.0, 1e-16])
def test_within_rounding_of_a_cusp_it_is_a_cusp(miss):
    state = ht.State(theta="0.1", phidot=miss, psidot=140)
    top = ht.Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    scene = ht.Scene(top, state, periods=20, events=("turning", "reversal", "cusp"))
    events = ht.propagate(scene).events
    assert (events.count("turning"), events.count("cusp")) == (41, 21)
    assert events.count("reversal") == 0


def test_the_textbook_form_ends_early_at_a_pole_and_keeps_what_it_has():
    top, state = MOTIONS["through the top"]
    away = ht.Motion(top, state).at(-0.3)
    begin = ht.State(
        theta=float(away.theta),
        thetadot=float(away.thetadot),
        phidot=float(away.phidot),
        psidot=float(away.psidot),
    )
    scene = ht.Scene(top, begin, time=5)
    with pytest.raises(ht.EndedEarly) as early:
        ht.propagate(scene, formulation="lagrange")
    partial = early.value.trajectory
    assert early.value.outcome == "singular"
    assert 0.1 < partial.orbit.end < 5
    assert 0 < partial.t.size < scene.samples
    assert np.isfinite(partial.theta).all()
    whole = ht.propagate(scene)
    assert np.max(np.abs(whole.theta[: partial.t.size] - partial.theta)) < 1e-9


def test_a_step_limit_ends_early():
    scene = replace(ht.load_scene("sicm-kicked"), time=Exact.of(1000))
    with pytest.raises(ht.EndedEarly) as early:
        ht.propagate(scene, step_limit=8000)
    assert early.value.outcome == "step-limit"
    assert 8000 <= early.value.trajectory.statistics.steps < 12000
    assert 320 < early.value.trajectory.orbit.end < 500


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
def test_an_interrupt_is_answered_within_a_block_and_keeps_what_it_has():
    scene = replace(ht.load_scene("sicm-kicked"), time=Exact.of(10_000))
    seen = []

    def interrupt(fraction):
        seen.append(fraction)
        if len(seen) == 3:
            raise KeyboardInterrupt

    with pytest.raises(ht.EndedEarly) as early:
        ht.propagate(scene, formulation="axis", progress=interrupt)
    assert early.value.outcome == "interrupted"
    assert len(seen) == 3
    partial = early.value.trajectory
    whole = ht.propagate(scene, formulation="axis")
    assert np.array_equal(partial.samples.states, whole.samples.states[: partial.t.size])
