"""The reference solution of every run is exact; the Taylor steppers are the package's own runs."""

import json
import math
from dataclasses import asdict

import numpy as np
import pytest

import heavytop as ht
from heavytop.comparison.steppers import StepperState
from heavytop.studies.methods import method, taylor_methods
from heavytop.studies.steppers import set_up

from ..comparison.kicked import at

KICKED = ht.load_scene("sicm-kicked")
TAYLOR = tuple(taylor_methods())


def own(name, scene=KICKED):
    return set_up(scene, method(name))


# --- the reference solution ------------------------------------------------------------------


def exact_row(reference, t):
    """The states e, l of the axis form at a time, from the closed form at 60 digits."""
    ctx = reference.ctx
    at, r = reference.exact.at(ctx.mpf(t), 60), reference.exact.reduced
    s, c, sine, u = ctx.sin(at.phi), ctx.cos(at.phi), ctx.sin(at.theta), ctx.cos(at.theta)
    # l = e x e' + n e, e' = thetadot e_theta + phidot sin(theta) e_phi
    e_theta, e_phi = (u * s, -u * c, -sine), (c, s, 0)  # e x e_theta = e_phi
    parts = zip(e_phi, e_theta, at.axis, strict=True)
    momentum = [at.thetadot * p - at.phidot * sine * q + r.b * e for p, q, e in parts]
    return [*at.axis, *momentum[:2]]


@pytest.fixture(scope="module")
def axis():
    """The reference of a start whose axis has length 1 exactly: nothing is rounded in it."""
    start = ht.State("pi/2", phidot="0.25", psidot=2)
    scene = ht.Scene(ht.Top(A=1, C="0.5", gMR=1), start, periods=1)
    return own("taylor-axis", scene).reference


@pytest.mark.parametrize("ahead", [0.0, 1e-9, -3e-12])
def test_a_shift_in_time_is_a_phase_error(axis, ahead):
    t = 3.7
    off = axis((t, 0.0), exact_row(axis, axis.ctx.mpf(t) + axis.ctx.mpf(ahead)))
    assert off.phase_s == pytest.approx(ahead, rel=1e-6, abs=1e-28)
    assert abs(off.energy) < 1e-28
    assert all(abs(x) < 1e-28 for x in off.invariants.values())
    back, on = (np.array(axis.exact.at(t + s, 60).axis, float) for s in (-1e-6, 1e-6))
    speed = np.linalg.norm(on - back) / 2e-6
    assert off.axis == pytest.approx(abs(ahead) * speed, rel=1e-6, abs=1e-28)


def test_energy_and_momentum_are_told_apart(axis):
    """A longer axis has another length, another p_psi and another height."""
    ctx, t = axis.ctx, 1.3
    row = exact_row(axis, t)
    longer = [*(x * (1 + ctx.mpf("1e-10")) for x in row[:3]), *row[3:]]
    off = axis((t, 0.0), longer)
    assert off.invariants["length"] == pytest.approx(2e-10, rel=1e-6)
    r, l_z = axis.exact.reduced, ctx.mpf(axis.parameters["l_z"])
    momentum = sum(x * y for x, y in zip(row[:3], [*row[3:], l_z], strict=True)) / 10**10
    assert off.invariants["p_psi"] * float(abs(r.b)) == pytest.approx(float(momentum), rel=1e-6)
    scale = max(abs(float(r.h)), abs(float(r.g)))
    assert off.energy * scale == pytest.approx(float(r.g * row[2]) * 1e-10, rel=1e-6)


@pytest.mark.parametrize("name", [n for n in TAYLOR if "-" not in n[7:]])
def test_every_form_starts_on_its_own_closed_form(name):
    found = own(name)
    off = found.reference((0.0, 0.0), found.stepper.begin().state)
    assert abs(off.phase_s) < 1e-30
    assert off.energy == 0
    assert off.axis is None or off.axis < 1e-30


def test_the_tilt_of_a_state_beside_a_pole_is_a_number():
    """A cosine that rounding put above 1 is that of 0."""
    found = own("taylor-cubic")
    row = list(found.stepper.begin().state)
    assert found.reference((0.0, 0.0), row).theta == pytest.approx(0.0, abs=1e-15)
    assert found.reference((0.0, 0.0), [-1e-20, *row[1:]]).theta == pytest.approx(-0.1)
    longer = [row[0] * (1 + 1e-6), *row[1:]]  # 1 - u: theta grows with it
    assert found.reference((0.0, 0.0), longer).theta == pytest.approx(0.05e-6, rel=1e-2)


# --- the runs --------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
@pytest.mark.parametrize("name", ["taylor-axis", "taylor-cubic", "taylor-axis-projected"])
def test_a_stepper_takes_the_steps_of_the_trajectory_that_propagate_integrates(name):
    """Bit for bit, through several blocks."""
    found = own(name)
    chosen, t = method(name), 700.618 * found.period
    scene = ht.Scene(KICKED.top, KICKED.start, time=t, quantities=("theta",), events=())
    trajectory = ht.propagate(scene, formulation=chosen.formulation, projected=chosen.projected)
    assert at(found.stepper, t)[0].tolist() == trajectory(t).states.tolist()


def test_more_bits_are_written_down_without_loss():
    """A stepper that goes on from stored texts is the one that was never interrupted."""
    stepper = own("taylor-axis-mpfr").stepper
    one = stepper.block(stepper.begin())
    stored = StepperState(**json.loads(json.dumps(asdict(one))))
    assert stepper.block(stored) == stepper.block(one)
    digits = int(128 * math.log10(2))
    assert all(len(x) > digits for x in (*one.state, one.carry[0]))
