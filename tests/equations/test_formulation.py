"""Every formulation, against the Lagrange equations: identically, and at 50 digits.

These are built from the rotation matrix, whose angular velocity generates it.
"""

import random
from itertools import chain

import mpmath
import pytest
import sympy as sp

from heavytop.equations import euler_angles, reduced_cubic
from heavytop.equations import lagrangian as lag
from heavytop.equations.euler_poisson import deviation, frame_rate, kappa
from heavytop.equations.formulation import FORMULATIONS, components, spin, time
from heavytop.equations.lagrangian import normal_form

VARIANTS = [(name, each) for name, entry in FORMULATIONS.items() for each in entry.variants]
FORMS = {f"{name}-{v}" if v else name: FORMULATIONS[name].build(v) for name, v in VARIANTS}
SOLVED = dict(zip(lag.ACCELERATIONS, lag.accelerations(), strict=True))
SYMBOLS = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)
DEVIATIONS = (deviation, *euler_angles.DEVIATIONS)
GIVEN = {frame_rate: 7, euler_angles.phi_rate: 5, euler_angles.psi_rate: -3}
TINY = mpmath.mpf(10) ** -42

every_form = pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)


def test_the_rotation_is_orthogonal_and_the_angular_velocity_generates_it():
    R, omega = lag.rotation(), lag.angular_velocity()
    assert (R.T * R).applyfunc(normal_form) == sp.eye(3)
    difference = R.applyfunc(lag.time_derivative) - R * omega.hat()
    assert difference.applyfunc(normal_form) == sp.zeros(3)


def test_torque_less_the_change_of_momentum_is_the_quadratic_of_steady_precession():
    """Exercise 2.13 d of SICM: along the line of nodes."""
    moments, quadratic = sp.diag(lag.A, lag.A, lag.C), lag.A * sp.cos(lag.theta) * lag.phidot**2
    quadratic += lag.gMR - lag.momenta()[2] * lag.phidot
    L = (lag.rotation() * moments * lag.angular_velocity()).applyfunc(normal_form)
    torque = lag.axis().cross(sp.Matrix([0, 0, -lag.gMR]))
    nodes = sp.Matrix([sp.cos(lag.phi), sp.sin(lag.phi), 0])
    off = L.applyfunc(lag.time_derivative) - torque + quadratic * sp.sin(lag.theta) * nodes
    steady = dict.fromkeys((lag.thetadot, *lag.ACCELERATIONS), 0)
    assert off.subs(steady).applyfunc(lambda x: normal_form(sp.expand(x))) == sp.zeros(3, 1)


def in_half_angles(expression):
    """Write everything through half angles, of which some forms are made."""
    for angle in lag.COORDINATES:
        half = sp.Symbol(f"half_{angle}", real=True)
        s, c = sp.sin(half), sp.cos(half)
        doubled = {sp.sin(2 * half): 2 * s * c, sp.cos(2 * half): 1 - 2 * s**2}
        expression = expression.subs(angle, 2 * half).subs(doubled)
    return expression


@pytest.mark.slow
@every_form
def test_states_move_as_the_lagrange_equations_say(form):
    in_angles = dict(zip(form.states, form.start, strict=True))
    for state, start, derivative in zip(form.states, form.start, form.derivatives, strict=True):
        if state in DEVIATIONS:
            continue  # an angle less a uniform rotation: see below
        rate = lag.time_derivative(start).subs(SOLVED)
        if form.name == "attitude":  # in a frame that spins by kappa
            rate -= form.parameters[kappa] * sp.diff(start, lag.psi)
        expected = sp.sympify(derivative).subs(in_angles).subs(dict(form.parameters))
        difference = in_half_angles(rate - expected)
        cleared = sp.cancel(sp.together(difference * lag.A * lag.C * lag.gMR))
        assert normal_form(sp.numer(cleared)) == 0, state


@every_form
def test_what_is_integrated_is_what_the_motion_is_read_from(form):
    """Constants are rounded one by one: others would define the motion of another top."""
    pairs = zip(form.states, form.derivatives, strict=True)
    integrated = form.constants_in(sp.sympify(rate) for x, rate in pairs if x not in DEVIATIONS)
    unread = {*integrated} - {*form.constants_in(map(sp.sympify, form.reading.values()))}
    assert not unread, f"the derivatives have {unread}: let `reading` be of these constants too"
    read = {*form.reading} | ({"psidot"} if "omega3" in form.reading else set())
    lacking = {symbol.name for symbol in SYMBOLS} - read if read.isdisjoint(("w", "e_x")) else ()
    assert not lacking, f"`reading`, which is of Euler's angles, lacks {lacking}"


@every_form
def test_a_form_has_the_constants_that_outputs_ask_for(form):
    needed = {"omega3"} if form.limits else set()
    needed |= {"l_z", "phi_0", "P_plus", "P_minus"} if form.phi_wraps else set()
    lacking = needed - {symbol.name for symbol in form.parameters}
    assert not lacking, f"with its `limits` or `phi_wraps` it has to have the constants {lacking}"
    named = (form.outputs, form.events, form.invariants, form.reading)
    used = chain(form.derivatives, [form.spin], form.limits, *(each.values() for each in named))
    unknown = set().union(*(sp.sympify(x).free_symbols for x in used)) - {*form.arguments(), *spin}
    assert not unknown, f"{unknown}: neither states nor `parameters`, which it has to have"


def quaternion():
    """The attitude in Euler angles, scalar first."""
    half, plus, minus = lag.theta / 2, (lag.phi + lag.psi) / 2, (lag.phi - lag.psi) / 2
    c, s = sp.cos, sp.sin
    return c(half) * c(plus), s(half) * c(minus), s(half) * s(minus), c(half) * s(plus)


EXPECTED = {
    **{s.name: s for s in (*lag.COORDINATES, *lag.VELOCITIES)},
    **components("axis", lag.axis()),
    **components("omega", lag.rotation() * lag.angular_velocity()),
    **{f"quaternion_{i}": c for i, c in enumerate(quaternion())},
    "energy": (lag.energy() - lag.momenta()[2] ** 2 / (2 * lag.C)) / lag.A,
    **{name: p / lag.A for name, p in zip(("p_phi", "p_psi"), lag.momenta()[1:], strict=True)},
    "length": 1,
}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@every_form
def test_all_it_tells_is_what_the_angles_tell_at_fifty_digits(form, seed):
    source = random.Random(seed)
    ranges = [(0.1, 3), (0.1, 3), (-2, 2), (0.1, 3), *[(-3, 3)] * 2, *[(-4, 4)] * 2, (-9, 9)]
    drawn = [sp.Rational(str(source.uniform(*ends))) for ends in ranges]
    values = dict(zip(SYMBOLS, drawn, strict=True))

    def value(expression, **rates):
        """What an expression in states and parameters is, where rates are others."""
        there = values | {sp.Symbol(name, real=True): x for name, x in rates.items()}
        named = dict(zip(form.states, form.start, strict=True)) | dict(form.parameters)
        numbers = {s: sp.sympify(x).subs(there).evalf(60) for s, x in named.items()}
        known = numbers | GIVEN | {time: 0, spin[0]: 1, spin[1]: 0}
        return sp.sympify(expression).subs(known).evalf(50)

    def off(expression, expected):
        return abs(value(expression) - sp.sympify(expected).subs(values).evalf(50))

    for name, output in (form.outputs | form.invariants).items():
        assert off(output.subs(values), EXPECTED[name]) < TINY, name
    for angle, rate in ((lag.phi, lag.phidot), (lag.psi, lag.psidot)):  # by quadrature or not
        if (output := form.outputs.get(angle.name)) is not None:
            assert off(sp.diff(output, time) + form.flow_derivative(output), rate) < TINY
    assert off(form.spin, lag.momenta()[2] / lag.A) < TINY
    for event, rate in (("turning", lag.thetadot), ("reversal", lag.phidot)):
        for sign in (1, -1, 0):
            found = value(form.events[event], **{rate.name: sign * abs(values[rate])})
            assert sp.sign(found.round(40)) == sign, event


@pytest.mark.parametrize("side", [1, -1])
def test_the_cubic_in_heights_is_the_cubic(side):
    A, P, n, g = lag.A, reduced_cubic.P, reduced_cubic.n, reduced_cubic.g
    values = {lag.u: side * (1 - reduced_cubic.w), lag.p_phi: A * (P + side * n), lag.p_psi: A * n}
    values |= {lag.E_prime: A * (reduced_cubic.excess + side * g), lag.gMR: A * g}
    assert sp.expand(lag.cubic().subs(values) - reduced_cubic.height_cubic(side)) == 0


def test_an_entry_of_the_table_says_what_its_formulation_is():
    for name, entry in FORMULATIONS.items():
        first, *others = map(entry.build, entry.variants)
        for form in (first, *others):
            assert form.name == name
            assert bool(form.limits) == entry.starts_at_pole, f"{name}: `starts_at_pole`, `limits`"
        assert entry.states == len(first.states), f"{name}: `states` in its row"
        assert entry.us > 0, f"{name}: `us` in its row"
