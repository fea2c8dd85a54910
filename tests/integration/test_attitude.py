"""The attitude form: derived, integrated, and held against every other way."""

from dataclasses import replace
from fractions import Fraction

import heyoka as hy
import numpy as np
import pytest
import sympy as sp

import heavytop as ht
from heavytop.equations import lagrangian as lag
from heavytop.equations.euler_poisson import axis_form, g, kappa, l_x, l_y, l_z
from heavytop.equations.formulation import spin, time
from heavytop.equations.quaternion import attitude_form, product, psi_slow, q, start_attitude
from heavytop.integration.integrator import continued, not_begun
from heavytop.numbers.double_double import two_product
from heavytop.run.verify import closed_form
from heavytop.scene.scene import shipped_scenes

ANGLES = ("theta", "phi", "psi")


def run(scene, formulation="attitude"):
    return ht.propagate(scene, formulation=formulation)


def shipped(name, *overrides):
    return ht.load_scene(name, overrides=[f"want.quantities={list(ANGLES)!r}", *overrides])


# --- the symbols ---------------------------------------------------------------------------


def matrix_of(a):
    """Return the rotation of a quaternion."""
    conjugate = (a[0], *(-x for x in a[1:]))
    columns = (product(product(a, (0, *unit)), conjugate)[1:] for unit in sp.eye(3).tolist())
    return sp.Matrix(list(columns)).T


def in_half_angles(expression):
    for angle in lag.COORDINATES:
        half = sp.Symbol(f"half_{angle}", real=True)
        s, c = sp.sin(half), sp.cos(half)
        doubled = {sp.sin(2 * half): 2 * s * c, sp.cos(2 * half): 1 - 2 * s**2}
        expression = expression.subs(angle, 2 * half).subs(doubled)
    return lag.normal_form(expression)


def test_the_start_is_the_rotation_of_the_lagrangian():
    difference = matrix_of(start_attitude()) - lag.rotation()
    assert all(in_half_angles(entry) == 0 for entry in difference)


def test_the_attitude_turns_with_omega():
    """dq/dt = omega q / 2 for the whole attitude, spin and all, identically."""
    form = attitude_form()
    attitude = [form.outputs[f"quaternion_{i}"] for i in range(4)]
    omega = (0, *(form.outputs[f"omega_{x}"] for x in "xyz"))
    turning = product(omega, attitude)
    cos, sin = spin
    rates = {cos: -kappa * sin / 2, sin: kappa * cos / 2}
    length = form.invariants["length"]
    for component, expected in zip(attitude, turning, strict=True):
        rate = form.flow_derivative(component)
        # e is q z q*, so that kappa e q = q z kappa |q|^2: the length is one
        rate += length * sum(sp.diff(component, x) * rate_of for x, rate_of in rates.items())
        assert sp.expand(rate - expected / 2) == 0


def test_each_half_of_the_quaternion_moves_in_a_central_force():
    """What the counting of turns stands on: Hill's equations, and their angular momenta."""
    form = attitude_form()
    q_0, q_1, q_2, q_3 = q
    alpha, beta, l2 = (q_0, q_3), (q_1, q_2), l_x**2 + l_y**2 + l_z**2
    upper, lower = q_0**2 + q_3**2, q_1**2 + q_2**2
    momenta = []
    for pair, factor in ((alpha, l2 / 4 + g * lower), (beta, l2 / 4 - g * upper)):
        rates = [form.flow_derivative(x) for x in pair]
        for x, rate in zip(pair, rates, strict=True):
            assert sp.expand(form.flow_derivative(rate) + factor * x) == 0
        momenta.append(pair[0] * rates[1] - pair[1] * rates[0])
    l_e = form.spin
    assert sp.expand(momenta[0] - (l_z * (upper + lower) + l_e) / 4) == 0
    assert sp.expand(momenta[1] - (l_z * (upper + lower) - l_e) / 4) == 0


def test_the_axis_of_the_quaternion_is_the_axis_of_the_axis_form():
    form, axis = attitude_form(), axis_form()
    e = [form.outputs[f"axis_{x}"] for x in "xyz"]
    values = dict(zip(axis.states, (*e, l_x, l_y), strict=True))
    for state, rate in zip(axis.states, axis.derivatives, strict=True):
        assert sp.expand(form.flow_derivative(values[state]) - rate.subs(values)) == 0


def test_psi_is_the_slow_one_and_the_uniform_spin():
    assert sp.expand(attitude_form("angles").outputs["psi"] - psi_slow - kappa * time) == 0


# --- the runs ------------------------------------------------------------------------------


def attitude_of(exact):
    """Return the quaternions of the closed form, of phi and psi that keep their digits."""
    half = exact.theta / 2
    plus, minus = ((exact.phi_mod + sign * exact.psi_mod) / 2 for sign in (1, -1))
    c, s = np.cos(half), np.sin(half)
    parts = (c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus))
    return np.stack(parts, axis=-1)


def distance(a, b):
    """Return how far quaternions are apart, of either sign."""
    return np.minimum(np.linalg.norm(a - b, axis=-1), np.linalg.norm(a + b, axis=-1))


def errors_in_the_axis_form(scene):
    """Return them, or None: that form does not give psi where both poles are passed exactly."""
    try:
        return ht.run_errors(run(scene, "axis"))
    except ht.BadScene:
        assert ht.Motion(scene.top, scene.start).kind == "planar-pendulum"
        return None


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
@pytest.mark.parametrize("name", sorted(shipped_scenes()))
def test_every_shipped_scene_as_the_closed_form_and_as_well_as_the_axis_form(name):
    scene = shipped(name)
    trajectory, axis = run(scene), errors_in_the_axis_form(scene)
    errors, end = ht.run_errors(trajectory), trajectory(trajectory.orbit.end)
    assert errors.why_not == ""
    for angle in (*ANGLES, "event_time"):
        # where a motion forgets its start, errors grow in either form alike
        least = 30 * (getattr(axis, angle) or 0.0) if axis else 0.0
        bound = 1e-12 * max(1.0, abs(float(getattr(end, angle, 0.0))))
        assert (getattr(errors, angle) or 0.0) <= max(bound, least), angle
    assert max(errors.energy, errors.invariants["length"]) < 1e-14
    for rate in ("thetadot", "phidot", "psidot", "omega", "quaternion"):
        assert np.isfinite(getattr(trajectory.samples, rate)).all(), rate


@pytest.mark.parametrize("name", ["sicm-kicked", "sicm-dropped", "sicm-forward", "simo-wong"])
def test_events_as_in_the_axis_form(name):
    ours, theirs = (run(shipped(name), form).events for form in ("attitude", "axis"))
    assert ours.kind == theirs.kind
    assert np.max(np.abs(ours.t - theirs.t)) < 1e-13
    assert np.max(np.abs(ours.phi - theirs.phi)) < 1e-12


def test_rates_and_vectors_as_the_closed_form():
    trajectory = run(shipped("sicm-kicked"))
    exact = closed_form(trajectory)(trajectory.t)
    for rate in ("thetadot", "phidot", "psidot"):
        assert np.max(np.abs(getattr(trajectory.samples, rate) - getattr(exact, rate))) < 1e-11
    assert np.max(np.abs(trajectory.axis - exact.axis)) < 1e-14
    omega = trajectory.samples.omega
    spin_rate = np.sum(omega * exact.axis, axis=1)
    assert np.max(np.abs(spin_rate - (exact.psidot + exact.phidot * exact.u))) < 1e-11


def test_the_quaternion_of_the_lie_group_benchmark_at_two_seconds():
    """The published state's quaternion at 2 s, by another program at 50 digits.

    The benchmark's body frame is ours turned by a constant rotation, such that R = 1 at first.
    """
    published = (
        0.12294713504153347,
        -0.49107989255002701,
        0.35043003034362096,
        -0.78798688755048567,
    )
    trajectory = run(ht.load_scene("lie-group-benchmark", ['want.quantities=["attitude"]']))
    first, last = trajectory([0.0, 2.0]).quaternion
    conjugate = (first[0], *(-x for x in first[1:]))
    ours = np.array(product(tuple(last), conjugate), dtype=float)
    assert distance(ours, np.array(published)) < 1e-13


def test_the_attitude_keeps_its_digits_at_any_spin():
    """At 1e6 rad/s psi itself has lost nine of them."""
    top = ht.Top(A=1, C="1e-6", gMR=1)
    scene = ht.Scene(top, ht.State(theta=1, psidot="1e6"), time=9, quantities=("attitude",))
    trajectory = run(scene)
    exact = closed_form(trajectory)(trajectory.t)
    assert np.max(np.abs(exact.psi)) > 1e6
    assert np.max(distance(trajectory.samples.quaternion, attitude_of(exact))) < 1e-14


def test_without_angles_wanted_none_are_counted():
    scene = ht.load_scene("sicm-kicked", ['want.quantities=["theta", "axis"]'])
    trajectory = run(scene)
    assert trajectory.plan.states == trajectory.samples.states.shape[1] == 6
    assert trajectory.phi is None
    assert trajectory.psi is None
    counted = run(shipped("sicm-kicked"))
    assert np.array_equal(trajectory.samples.quaternion, counted.samples.quaternion)
    assert np.array_equal(trajectory.theta, counted.theta)


def test_a_product_of_two_words_is_exact():
    source = np.random.default_rng(0)
    a, b = source.uniform(-1e6, 1e6, (2, 1000))
    for x, y, high, low in zip(a, b, *two_product(a, b), strict=True):
        assert Fraction(high) + Fraction(low) == Fraction(x) * Fraction(y)


# --- its own binary start ------------------------------------------------------------------


def test_the_closed_form_is_that_of_the_runs_own_numbers():
    """A start whose |q| is off one by 1e-9 is another top: the witness must know it."""
    trajectory = run(shipped("simo-wong", "span.periods=3.3"))
    orbit = trajectory.orbit
    state = orbit.checkpoints[0].state.copy()
    state[:4] *= 1 + 1e-9
    start = replace(orbit.checkpoints[0], state=state)
    longer = continued(not_begun(orbit.integrator, start), trajectory.t)
    other = replace(trajectory, orbit=longer)
    theta = closed_form(other)(other.t).theta
    assert np.max(np.abs(other.theta - theta)) < 1e-14
    assert np.max(np.abs(trajectory.theta - theta)) > 1e-11


# --- the cost of the spin ------------------------------------------------------------------


def fast(factor):
    """Return a top whose spin is faster and whose moment about it smaller, at the same p_psi."""
    return ht.Scene(
        ht.Top(A=1, C=0.5 / factor, gMR=1),
        ht.State.kicked(theta=0.5, phidot=0.3, omega3=6.0 * factor),
        periods=10,
        quantities=("attitude",),
        events=(),
        samples=2,
    )


def body_frame_steps(scene):
    """Return the steps of the Euler-Poisson equations in the body over the scene's span."""
    top, start = scene.top, scene.start
    A, C, gMR = float(top.A), float(top.C), float(top.gMR)
    spin_rate, theta = float(start.omega3), float(start.theta)
    x, y, a, b, c = hy.make_vars("x", "y", "a", "b", "c")  # omega_1, omega_2; the vertical
    ratio = (A - C) / A * spin_rate
    equations = [
        (x, ratio * y + gMR / A * b),
        (y, -ratio * x - gMR / A * a),
        (a, b * spin_rate - c * y),
        (b, c * x - a * spin_rate),
        (c, a * y - b * x),
    ]
    first = [0.0, float(start.phidot) * np.sin(theta), 0.0, np.sin(theta), np.cos(theta)]
    taylor = hy.taylor_adaptive(equations, first)
    motion = ht.Motion(top, start)
    steps = taylor.propagate_until(10 * motion.period)[3]
    assert abs(taylor.state[4] - motion.at(taylor.time).u) < 1e-11 * np.sqrt(steps)
    return steps


def test_a_faster_spin_costs_no_steps():
    slow, quick, quicker = (run(fast(factor)).statistics.steps for factor in (1, 1000, 10**6))
    assert max(slow, quick, quicker) <= min(slow, quick, quicker) + 1
    in_the_body = [body_frame_steps(fast(factor)) for factor in (1, 1000)]
    assert in_the_body[1] > 1000 * in_the_body[0] > 2000 * slow
