"""Every kind of motion, integrated, against the closed form: poles, pendulums, vertical tops."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.numbers import Exact

from ..motions import BOOK

UNIT = ht.Top(A=1, C="0.5", gMR=1)
MOTIONS = {
    "waves": (UNIT, ht.State("0.5", phidot="3", psidot=6)),
    "loops": (UNIT, ht.State("0.5", phidot="-0.3", psidot=6)),
    "cusps": (UNIT, ht.State("0.5", psidot=6)),
    "rising": (UNIT, ht.State(1, thetadot=-1, phidot="0.3", psidot=6)),
    "slow precession": (UNIT, ht.State.steady(UNIT, 1, 8, "slow")),
    "fast precession": (UNIT, ht.State.steady(UNIT, 1, 8, "fast")),
    "sleeping": (UNIT, ht.State(0, psidot=6)),
    "hanging": (UNIT, ht.State("pi", psidot=6)),
    "at rest below": (UNIT, ht.State("pi")),
    "separatrix": (UNIT, ht.State("pi/3", phidot="2/sqrt(3)", psidot="(3 - 0.5)/(0.5*sqrt(3))")),
    "through the top": (UNIT, ht.State(0, thetadot=2, psidot=3)),
    "through the bottom": (UNIT, ht.State("pi", thetadot=2, psidot=3)),
    "spherical pendulum": (UNIT, ht.State(2, phidot=1)),
    "planar, swinging": (UNIT, ht.State(2)),
    "planar, turning over": (UNIT, ht.State(2, thetadot=3)),
    "force-free": (ht.Top(A=1, C="0.5", gMR=0), ht.State(1, phidot=1, psidot=3)),
    "spherical top": (ht.Top(A=1, C=1, gMR=1), ht.State(1, phidot=1, psidot=3)),
    "inverted": (ht.Top(A=1, C="0.5", gMR=-1), ht.State(1, phidot=1, psidot=3)),
    "fast spin": (ht.Top(A=1, C="1e-6", gMR=1), ht.State(1, psidot="1e6")),
}
EVENTS = ("turning", "reversal", "cusp")
VERTICAL = ("sleeping", "hanging", "at rest below")
TIME = 9.0


# errors grow as exp(gamma t/2) in theta on the separatrix, whose tilt decays as fast
BOUND = dict.fromkeys(MOTIONS, 2e-13) | {"separatrix": 2e-12}


def attitude(theta, phi, psi):
    """Return the rotation, shape (k, 3, 3), which the jumps of phi and psi at a pole leave be."""
    c, s = np.cos, np.sin
    x = np.stack([c(phi) * c(psi) - s(phi) * c(theta) * s(psi), s(theta) * s(psi)], axis=-1)
    return np.concatenate([x, s(phi)[:, None] * s(theta)[:, None], c(theta)[:, None]], axis=-1)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", MOTIONS)
def test_axis_attitude_and_events(name, direction):
    top, state = MOTIONS[name]
    scene = ht.Scene(
        top, state, time=direction * TIME, quantities=("theta", "phi", "psi"), events=EVENTS
    )
    run, motion = ht.propagate(scene), ht.Motion(top, state)
    exact = motion.at(run.t)
    assert np.max(np.abs(run.axis - exact.axis)) < BOUND[name]
    ours, theirs = (attitude(at.theta, at.phi, at.psi) for at in (run, exact))
    scale = max(1.0, float(np.max(np.abs(exact.psi)))) if name == "fast spin" else 1.0
    assert np.max(np.abs(ours - theirs)) < 4 * BOUND[name] * scale
    away = np.sin(exact.theta) > 1e-4  # at a pole itself phi is what rounding makes it
    assert name in VERTICAL or np.max(np.abs((run.phi - exact.phi)[away])) < 1e-8
    errors = ht.run_errors(run)
    assert errors.why_not == ""
    assert errors.axis < 2e-12
    turning, reversal, cusp = (run.events.count(event) for event in EVENTS)
    at_rest = state.thetadot.sign() == 0
    if not motion.nutates:
        once = motion.kind == "separatrix" and at_rest
        assert (turning, reversal, cusp) == (once, 0, 0)  # the start is its only turning point
        return
    periods = TIME / motion.period
    assert abs(turning - (2 * periods + 1 - (0 if at_rest else 0.5))) <= 1
    reverses = motion.kind in ("loops", "force-free")
    assert abs(reversal - 2 * periods) <= 1 if reverses else reversal == 0
    assert abs(cusp - periods - 0.5) <= 0.5 if motion.kind == "cusps" else cusp == 0


def test_an_end_exactly_on_a_turning_point_counts():
    top, state = MOTIONS["loops"]
    for periods in (1, 10, 100):
        scene = ht.Scene(top, state, periods=periods, events=("turning",))
        assert ht.propagate(scene).events.count("turning") == 2 * periods + 1


@pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")
@pytest.mark.parametrize("miss", [0.0, 1e-16, 1e-11, -1e-11, 1e-9, -1e-9, 1e-3, -1e-3])
def test_near_a_cusp_the_events_are_counted_right(miss):
    """Just below a cusp the precession reverses twice a period; just above it never does.

    Within rounding of a cusp it is a cusp.
    """
    scene = ht.Scene(BOOK, ht.State("0.1", phidot=miss, psidot=140), periods=20, events=EVENTS)
    events = ht.propagate(scene).events
    assert events.count("turning") == 41
    assert events.count("cusp") == (21 if abs(miss) < 1e-15 else 0)
    assert events.count("reversal") == (40 if miss < 0 else 0)


def test_the_textbook_form_ends_early_at_a_pole_and_keeps_what_it_has():
    top, state = MOTIONS["through the top"]
    away = ht.Motion(top, state).at(-0.3)
    rates = {name: float(getattr(away, name)) for name in ("thetadot", "phidot", "psidot")}
    scene = ht.Scene(top, ht.State(float(away.theta), **rates), time=5)
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
