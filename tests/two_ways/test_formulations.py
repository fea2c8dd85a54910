"""Every formulation, against the Lagrange equations: identically, and at 50 digits."""

import random

import mpmath
import pytest
import sympy as sp

from heavytop.models import lagrangian as lag
from heavytop.models.axis_form import axis_form, deviation, frame_rate
from heavytop.models.formulation import time, turned_phi
from heavytop.models.lagrange_form import lagrange_form
from heavytop.models.lagrangian import normal_form

FORMS = [lagrange_form(), axis_form(), axis_form("sigma"), axis_form("delta")]
IDS = ["lagrange", "axis", "axis-sigma", "axis-delta"]
SOLVED = dict(zip(lag.ACCELERATIONS, lag.accelerations(), strict=True))
SYMBOLS = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)


def in_angles(form, expression):
    """Write a function of a formulation's states as a function of the Euler angles."""
    start = dict(zip(form.states, form.start, strict=True))
    return sp.sympify(expression).subs(start).subs(dict(form.parameters))


def along_the_motion(expression):
    return lag.time_derivative(expression).subs(SOLVED)


@pytest.mark.parametrize("form", FORMS[:2], ids=IDS[:2])
def test_states_move_as_the_lagrange_equations_say(form):
    for state, derivative in zip(form.start, form.derivatives, strict=True):
        difference = along_the_motion(state) - in_angles(form, derivative)
        cleared = sp.cancel(sp.together(difference * lag.A * lag.C * sp.sin(lag.theta)))
        assert normal_form(cleared) == 0


@pytest.mark.parametrize("form", FORMS, ids=IDS)
def test_invariants_are_conserved_identically(form):
    for name, invariant in form.invariants.items():
        rate = normal_form(sp.cancel(sp.together(form.flow_derivative(invariant))))
        reduced = rate if form.name == "axis" else normal_form(rate * sp.sin(lag.theta))
        assert sp.simplify(reduced) == 0, name


def random_state(seed):
    source = random.Random(seed)
    bounds = ((0.1, 3), (0.1, 3), (-2, 2), (0.1, 3), (-3, 3), (-3, 3), (-4, 4), (-4, 4), (-9, 9))
    return {
        s: sp.Rational(source.randint(0, 10**12), 10**12) * (b - a) + a
        for s, (a, b) in zip(SYMBOLS, (map(sp.Rational, map(str, p)) for p in bounds), strict=True)
    }


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("form", FORMS, ids=IDS)
def test_outputs_are_those_of_the_angles_at_fifty_digits(form, seed):
    values = random_state(seed)
    expected = {
        **{s.name: s for s in (*lag.COORDINATES, *lag.VELOCITIES)},
        "phi_mod": sp.atan2(sp.sin(lag.phi), sp.cos(lag.phi)),
        **{f"axis_{x}": c for x, c in zip("xyz", lag.axis(), strict=True)},
        **{
            f"omega_{x}": c
            for x, c in zip("xyz", lag.rotation() * lag.angular_velocity(), strict=True)
        },
    }
    at_start = {time: 0, turned_phi: lag.phi, deviation: 0, frame_rate: 7}
    for name, output in form.outputs.items():
        ours = in_angles(form, output.subs(at_start)).subs(values).evalf(50)
        theirs = expected[name].subs(values).evalf(50)
        assert abs(ours - theirs) < mpmath.mpf(10) ** -44, name


@pytest.mark.parametrize("psi", ["sigma", "delta"])
@pytest.mark.parametrize("seed", range(3))
def test_spin_by_quadrature_turns_as_the_lagrange_equations_say(psi, seed):
    form = axis_form(psi)
    rate = sp.diff(form.outputs["psi"], time)
    rate += sp.diff(form.outputs["psi"], deviation) * form.derivatives[-1]
    rate += sp.diff(form.outputs["psi"], turned_phi) * form.outputs["phidot"]
    values = random_state(seed)
    ours = in_angles(form, rate).subs(frame_rate, 5).subs(values).evalf(50)
    assert abs(ours - lag.psidot.subs(values).evalf(50)) < mpmath.mpf(10) ** -44


@pytest.mark.parametrize("form", FORMS, ids=IDS)
def test_events_vanish_with_the_rates_they_stand_for(form):
    for event, rate in (("turning", lag.thetadot), ("reversal", lag.phidot)):
        zero = normal_form(in_angles(form, form.events[event]))
        assert normal_form(zero.subs(rate, 0)) == 0
        factor = sp.cancel(sp.together(zero / rate))
        assert factor.subs({lag.theta: sp.pi / 3, lag.A: 2, lag.C: 1, lag.phi: 1}).is_positive
