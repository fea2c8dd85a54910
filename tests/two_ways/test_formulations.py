"""Every formulation, against the Lagrange equations: identically, and at 50 digits."""

import random

import mpmath
import pytest
import sympy as sp

from heavytop.equations import euler_angles, reduced_cubic
from heavytop.equations import lagrangian as lag
from heavytop.equations.euler_poisson import deviation, frame_rate, kappa, turned_phi
from heavytop.equations.formulation import FORMULATIONS, power_of_rate, spin, time
from heavytop.equations.lagrangian import normal_form

FORMS = {
    f"{name}{f'-{variant}' if variant else ''}": entry.build(variant)
    for name, entry in FORMULATIONS.items()
    for variant in entry.variants
}
SOLVED = dict(zip(lag.ACCELERATIONS, lag.accelerations(), strict=True))
SYMBOLS = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)
DEVIATIONS = (deviation, *euler_angles.DEVIATIONS)
GIVEN = {frame_rate: 7, euler_angles.phi_rate: 5, euler_angles.psi_rate: -3}


def ids(form):
    return next(name for name, each in FORMS.items() if each is form)


every_form = pytest.mark.parametrize("form", FORMS.values(), ids=ids)


def in_angles(form, expression):
    """Write a function of a formulation's states as a function of the Euler angles."""
    start = dict(zip(form.states, form.start, strict=True))
    return sp.sympify(expression).subs(start).subs(dict(form.parameters))


def along_the_motion(expression, form=None):
    """Differentiate by time; in a frame that spins by kappa, where a formulation has one."""
    rate = lag.time_derivative(expression).subs(SOLVED)
    if form is None or form.name != "attitude":
        return rate
    return rate - form.parameters[kappa] * sp.diff(expression, lag.psi)


@every_form
def test_in_another_unit_of_time_the_equations_are_the_same(form):
    """Every state and constant measured in a third of a second, by the power of 1/s in its unit."""
    powers = {"energy": 2, "p_phi": 1, "p_psi": 1, "length": 0}
    symbols = (*form.states, *form.parameters, *form.given)
    rated = {s: power_of_rate(s.name) for s in symbols}
    for state, derivative in zip(form.states, form.derivatives, strict=True):
        assert power_in(derivative, rated) == rated[state] + 1
    for name, invariant in form.invariants.items():
        assert power_in(invariant, rated) == powers[name]
    for event in form.events.values():  # their zeros are the same whatever the power is
        assert power_in(event, rated) in (1, 2)
    assert power_in(form.spin, rated) == 1
    scene = dict.fromkeys(SYMBOLS, 0) | dict.fromkeys(lag.VELOCITIES, 1) | {lag.gMR: 2}
    for symbol, value in (*zip(form.states, form.start, strict=True), *form.parameters.items()):
        if value != 0:
            assert power_in(value, scene) == rated[symbol], symbol


def power_in(expression, powers):
    """The power of three that comes out where symbols are multiplied by powers of three."""
    numbers = random.Random(5)
    values = {s: sp.Rational(numbers.randint(10, 99), 101) for s in powers}
    thrice = {s: x * 3 ** powers[s] for s, x in values.items()}
    before, after = (sp.sympify(expression).subs(v).evalf(50) for v in (values, thrice))
    power = sp.log(after / before, 3).evalf(40)
    assert abs(power - round(power)) < 1e-30, expression
    return round(power)


@every_form
def test_states_move_as_the_lagrange_equations_say(form):
    for state, start, derivative in zip(form.states, form.start, form.derivatives, strict=True):
        if state in DEVIATIONS:
            continue  # an angle less a uniform rotation: see below
        difference = along_the_motion(start, form) - in_angles(form, derivative)
        cleared = sp.cancel(sp.together(whole_angle(difference) * lag.A * lag.C * lag.gMR))
        assert normal_form(sp.numer(cleared)) == 0, state


def whole_angle(expression):
    """Write everything through half angles, of which some forms are made."""
    for angle in lag.COORDINATES:
        half = sp.Symbol(f"half_{angle}", real=True)
        s, c = sp.sin(half), sp.cos(half)
        doubled = {sp.sin(2 * half): 2 * s * c, sp.cos(2 * half): 1 - 2 * s**2}
        expression = expression.subs(angle, 2 * half).subs(doubled)
    return expression


@every_form
def test_invariants_are_conserved_identically(form):
    for name, invariant in form.invariants.items():
        rate = whole_angle(form.flow_derivative(invariant))
        cleared = sp.numer(sp.cancel(sp.together(rate)))
        assert sp.expand(normal_form(cleared)) == 0, name


def random_state(seed):
    source = random.Random(seed)
    bounds = ((0.1, 3), (0.1, 3), (-2, 2), (0.1, 3), (-3, 3), (-3, 3), (-4, 4), (-4, 4), (-9, 9))
    return {
        s: sp.Rational(source.randint(0, 10**12), 10**12) * (b - a) + a
        for s, (a, b) in zip(SYMBOLS, (map(sp.Rational, map(str, p)) for p in bounds), strict=True)
    }


def quaternion():
    """Return the attitude in Euler angles, scalar first."""
    half, plus, minus = lag.theta / 2, (lag.phi + lag.psi) / 2, (lag.phi - lag.psi) / 2
    c, s = sp.cos, sp.sin
    return c(half) * c(plus), s(half) * c(minus), s(half) * s(minus), c(half) * s(plus)


@pytest.mark.parametrize("seed", range(5))
@every_form
def test_outputs_are_those_of_the_angles_at_fifty_digits(form, seed):
    values = random_state(seed)
    expected = {
        **{s.name: s for s in (*lag.COORDINATES, *lag.VELOCITIES)},
        "phi_mod": sp.atan2(sp.sin(lag.phi), sp.cos(lag.phi)),
        "psi_mod": lag.psi + lag.phi - sp.atan2(sp.sin(lag.phi), sp.cos(lag.phi)),
        **{f"axis_{x}": c for x, c in zip("xyz", lag.axis(), strict=True)},
        **{
            f"omega_{x}": c
            for x, c in zip("xyz", lag.rotation() * lag.angular_velocity(), strict=True)
        },
        **{f"quaternion_{i}": c for i, c in enumerate(quaternion())},
    }
    at_start = {time: 0, turned_phi: lag.phi, **dict.fromkeys(DEVIATIONS, 0), **GIVEN}
    at_start |= dict(zip(spin, (1, 0), strict=True))
    for name, output in form.outputs.items():
        ours = in_angles(form, output.subs(at_start)).subs(values).evalf(50)
        theirs = expected[name].subs(values).evalf(50)
        assert abs(ours - theirs) < mpmath.mpf(10) ** -44, name


@pytest.mark.parametrize("seed", range(3))
@every_form
def test_angles_by_quadrature_turn_as_the_lagrange_equations_say(form, seed):
    values = random_state(seed)
    for angle, expected in ((lag.phi, lag.phidot), (lag.psi, lag.psidot)):
        output = form.outputs.get(angle.name)
        if output is None:
            continue
        rate = sp.diff(output, time) + form.flow_derivative(output)
        ours = in_angles(form, rate).subs(GIVEN).subs(values).evalf(50)
        assert abs(ours - expected.subs(values).evalf(50)) < mpmath.mpf(10) ** -44


@every_form
def test_accelerations_agree_at_fifty_digits(form):
    """The tilt's second derivative, from every formulation's own equations."""
    acceleration = form.flow_derivative(form.outputs["thetadot"])
    named = dict(zip(form.states, form.start, strict=True)) | dict(form.parameters)
    for seed in range(5):
        values = random_state(seed)
        own = {symbol: sp.sympify(x).subs(values).evalf(60) for symbol, x in named.items()}
        ours = acceleration.subs(own).evalf(50)
        exact = SOLVED[lag.thetaddot].subs(values).evalf(50)
        assert abs(ours - exact) < mpmath.mpf(10) ** -42 * max(1, abs(exact))


@every_form
def test_p_psi_is_that_of_the_lagrangian(form):
    values = random_state(1)
    ours = in_angles(form, form.spin * lag.A).subs(values).evalf(50)
    assert abs(ours - lag.momenta()[2].subs(values).evalf(50)) < mpmath.mpf(10) ** -44


@pytest.mark.parametrize("seed", range(3))
@every_form
def test_events_have_the_sign_of_the_rates_they_stand_for(form, seed):
    values = random_state(seed)
    for event, rate in (("turning", lag.thetadot), ("reversal", lag.phidot)):
        zero = in_angles(form, form.events[event])
        for sign in (1, -1):
            there = values | {rate: sign * abs(values[rate])}
            assert sp.sign(zero.subs(there).evalf(50)) == sign, event
        assert abs(zero.subs(values | {rate: 0}).evalf(50, chop=1e-40)) < mpmath.mpf(10) ** -40


def test_the_cubic_in_heights_is_the_cubic():
    for side in (1, -1):
        u = side * (1 - reduced_cubic.w)
        p_phi, p_psi = lag.A * (reduced_cubic.P + side * reduced_cubic.n), lag.A * reduced_cubic.n
        values = {
            lag.u: u,
            lag.p_phi: p_phi,
            lag.p_psi: p_psi,
            lag.E_prime: lag.A * (reduced_cubic.excess + side * reduced_cubic.g),
            lag.gMR: lag.A * reduced_cubic.g,
        }
        assert sp.expand(lag.cubic().subs(values) - reduced_cubic.height_cubic(side)) == 0
