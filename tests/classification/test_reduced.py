"""The reduced motion of a start, however it is given, and which special motion it is."""

from fractions import Fraction

import pytest

from heavytop.analytic.motion import ClosedForm
from heavytop.analytic.record import midpoint
from heavytop.classification.reduced import (
    Reduced,
    reduced_from_axis,
    reduced_from_constants,
    reduced_from_scene,
    through_poles,
)
from heavytop.exact.balls import Interval, rational, working
from heavytop.exact.decimals import context
from heavytop.scene.state import State
from heavytop.scene.top import Top

from ..motions import WEIGHTLESS

CTX = context(60)
BITS = 300
NAMES = ("g", "a", "b", "h", "u0", "udot0", "P_plus", "P_minus", "kinetic0", "drift0",
         "one_minus_u0", "one_plus_u0", "over_top", "over_bottom", "slope0", "cusp_number",
         "kappa")  # fmt: skip


def close(one, other, digits=50):
    return abs(one - other) <= CTX.mpf(10) ** -digits * max(1, abs(other))


def reduced(source):
    """The numbers of a reduced motion, middles of intervals, and φ₀ and ψ₀."""
    with working(BITS):
        found = source.reduced(BITS)
        numbers = {name: midpoint(CTX, getattr(found, name)) for name in NAMES}
        phi0, psi0 = (midpoint(CTX, ball) for ball in source.angles(BITS))
    return numbers | {"phi0": phi0, "psi0": psi0}


def scene_of(A, C, gMR, theta, phi, psi, thetadot, phidot, psidot):
    rates = {"thetadot": thetadot, "phidot": phidot, "psidot": psidot}
    return reduced_from_scene(Top(A, C, gMR), State(theta, phi=phi, psi=psi, **rates))


@pytest.mark.parametrize("falls", [True, False])
def test_constants_define_the_same_motion(falls):
    """So do the constants of the motion and the place, all of them rational."""
    g, b, drift, u = Fraction(3, 2), Fraction(2), Fraction(-1, 3), Fraction(1, 4)
    udot, kappa = Fraction(-1 if falls else 1, 3), Fraction(2)
    kinetic = (udot**2 + drift**2) / (2 * (1 - u**2))
    found = reduced_from_constants(Reduced(g, b, u, 1 - u, 1 + u, udot, drift, kinetic, kappa))
    at = reduced(found)
    root = CTX.sqrt(CTX.mpf(15)) / 4
    phidot = Fraction(-1, 3) / (1 - u**2)
    omega3 = 2 * b  # C = A/2, and so κ = ω₃/2
    theta = rational(CTX.acos(CTX.mpf("0.25")))
    thetadot = rational((1 if falls else -1) / (3 * root))
    scene = scene_of(1, "0.5", g, theta, 0, 0, thetadot, phidot, omega3 - phidot * u)
    for name, value in reduced(scene).items():
        assert close(at[name], value), name
    assert not ClosedForm(found).vanishes("udot0")
    assert ClosedForm(found).vanishes("P_minus") == (drift == b * (1 - u))


def test_through_a_pole_moves_no_more_than_it_must():
    """A start rounded off one that passes exactly: p_φ and E' move by the rounding, b stays."""
    off = Fraction(1, 10**17)
    rounded = scene_of(2, 1, 3, "pi/3", 0, 0, "0.5", 1 + off, "2.5")  # P₋ is about 1e-17
    passing = through_poles(rounded, top=True, bottom=False)
    regime = ClosedForm(passing).regime
    assert not regime.misses_top
    assert ClosedForm(rounded).regime.misses_top
    before, after = reduced(rounded), reduced(passing)
    assert after["P_minus"] == 0
    for name in ("g", "b", "u0", "udot0", "kappa", "phi0", "psi0"):
        assert after[name] == before[name], name
    assert all(0 < abs(after[name] - before[name]) < 1e-16 for name in ("drift0", "kinetic0"))
    f = 2 * after["kinetic0"] * after["one_minus_u0"] * after["one_plus_u0"] - after["drift0"] ** 2
    assert close(f, after["udot0"] ** 2)


def test_sums_keep_their_digits_near_a_pole():
    """P₋ of a start 1e-25 from the top has its digits: a − b as a difference has none."""
    source = scene_of(2, 1, 3, Fraction(1, 10**25), 0, 0, 0, 7, 5)
    with working(200):
        found = source.reduced(200)
        P_minus, difference = Interval.of(found.P_minus), Interval.of(found.a - found.b)
    assert P_minus.spread < abs(P_minus.middle) / 10**55
    assert difference.spread > abs(P_minus.middle) / 10**15
    with working(600):
        assert Interval.of(source.reduced(600).P_minus) in P_minus


# --- which special motion it is ------------------------------------------------------------------


def test_rounding_is_no_motion():
    """An axis along its momentum, or round the equator, without weight: steady at any precision.

    One unit in the last place of an axis is no rounding: doubles are exact.
    """
    axes = ((0.375, -0.5, 0.75), (0.375, -0.625, 0.75), (-0.9375, 0.21875, -0.25))
    along = [reduced_from_axis(e, [3 * x for x in e], 0) for e in axes]
    assert all(ClosedForm(source).regime.steady for source in along)
    assert ClosedForm(reduced_from_scene(WEIGHTLESS, State("pi/2", phidot=1))).regime.steady
    aside = (1.125, -1.5, 2.25 * (1 + 2**-52))
    assert ClosedForm(reduced_from_axis(axes[0], aside, 0)).regime.name == "nutating"
