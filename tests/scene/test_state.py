"""State against the formulas that define it, evaluated the other way round."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heavytop import State, Top
from heavytop.exact import Exact, sqrt

from ..motions import BOOK, CONE

rates = st.floats(-20, 20).map(lambda x: round(x, 9))
tilts = st.floats(0.05, 3.09)


@given(tilts, rates, rates)
def test_psidot_and_omega3_say_the_same(theta, phidot, spin):
    held = State(theta, phidot=phidot, psidot=spin)
    kicked = State.kicked(theta=theta, phidot=phidot, omega3=held.omega3)
    assert (held.held, kicked.held) == ("psidot", "omega3")
    assert kicked.psidot == held.psidot


def test_spin_is_zero_where_none_is_given_and_poles_belong_to_the_tilts():
    assert State("pi/2", phidot=3).psidot == 0
    assert State("pi/3", phidot=3).omega3 == Fraction(3, 2)
    for theta in (0, math.pi, "180 deg", "3.14159265358979323846"):
        assert State(theta).theta == Exact.of(theta)


def test_a_start_from_constants_at_a_turning_point_and_through_the_vertical():
    """At θ = 0 with p_φ = p_ψ, φ̇ has the limit p_ψ/2A and θ̇² = 2(E' − gMR)/A."""
    start = State.from_constants(BOOK, "0.62983125", "0.0006825", "0.008745", "pi/3")
    assert (start.thetadot, start.phidot, start.psidot) == (0, -15, 140)
    top = Top(2, 1, 3)
    start = State.from_constants(top, E=20, p_phi=4, p_psi=4, theta=0)
    assert (start.phidot, start.thetadot) == (1, 3)
    bottom = State.from_constants(top, E=14, p_phi=-4, p_psi=4, theta="pi", branch="rising")
    assert (bottom.phidot, bottom.thetadot) == (-1, -3)


@pytest.mark.reference
def test_steady_precession_of_betschs_gyro_and_without_gravity_and_level():
    slow = State.steady(CONE, "pi/3", "140.6", "slow")
    assert (slow.phidot, slow.psidot, slow.thetadot) == (10, Fraction("135.6"), 0)
    least = 2 * sqrt(CONE.A * CONE.gMR / 2) / CONE.C
    slow, fast = (State.steady(CONE, "pi/3", least, which) for which in ("slow", "fast"))
    assert slow.phidot == fast.phidot
    assert State.steady(CONE, "pi/2", 100, "slow").phidot == CONE.gMR / (CONE.C * 100)
    top = Top(1, 1, 0)
    assert State.steady(top, "pi/3", 2, "slow").phidot == 0
    assert State.steady(top, "pi/3", 2, "fast").phidot == 4
    assert State.steady(top, "pi/3", 0, "slow").phidot == 0
