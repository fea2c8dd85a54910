"""The cubic's roots: those of mpmath at 400 digits, and what is exact of them."""

from fractions import Fraction

import mpmath
import pytest

from heavytop.analytic.roots import Roots
from heavytop.classification.reduced import Regime, reduced_from_scene
from heavytop.exact import Exact
from heavytop.exact.balls import Interval, working
from heavytop.exact.decimals import context
from heavytop.scene.state import State
from heavytop.scene.top import Top

from ..by_hand import ByHand
from ..motions import BOOK, CONE, LIE, MARGINAL

CTX = context(60)
BITS = 256


def motion(top, theta, phidot, psidot, thetadot=0):
    return top, State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot)


def roots_of(motion, bits=BITS):
    """The roots of a motion seen with g ≥ 0, each distance an interval."""
    source = reduced_from_scene(*motion)
    with working(bits):
        regime, over = Regime.of(source), source.reduced(bits)
        found = Roots.of(over.mirrored() if regime.mirrored else over, regime)
        balls = {name: getattr(found, name) for name in ("down", "up", "delta", "m", "mc", "w")}
        for name, pair in (("u1", found.lower), ("u2", found.upper)):
            balls |= dict(zip((f"one_minus_{name}", f"one_plus_{name}"), pair, strict=True))
        balls |= {"u1": found.lower[1] - 1, "u2": 1 - found.upper[0], "u3": found.u3}
        return {name: ball and Interval.of(ball) for name, ball in balls.items()}


def mpf(ball, ctx=CTX):
    return ctx.mpf(ball.middle.numerator) / ball.middle.denominator


TINY = Exact.of("1e-30")
SEPARATRIX = Exact.of("5/sqrt(3)")
KINDS = {
    "loops": motion(Top(2, 1, 3), "0.7", 2, 5, "0.3"),
    "upside down": motion(Top(2, 1, -3), "0.7", 2, 5, "0.3"),
    "next to no weight": motion(Top(2, 1, TINY), "0.7", 2, 5, "0.3"),
    "falling": motion(Top(2, 1, 3), 2, "0.1", 9, 1),
    "1e-30 off steady": motion(CONE, "pi/3", 10, "135.6", TINY),
    "1e-30 inside the separatrix": motion(MARGINAL, "pi/3", "2/sqrt(3)", SEPARATRIX - TINY),
    "1e-30 beyond the separatrix": motion(MARGINAL, "pi/3", "2/sqrt(3)", SEPARATRIX + TINY),
    "1e-30 past the top": motion(Top(2, 1, 3), TINY, 1, 3, 2),
    "1e-33 above the bottom": motion(LIE, "pi/2", Exact.of("-60/13") + Exact.of("1e-33"), 150),
    "fast": motion(Top(1, "1e-6", 1), 1, "0.3", "1e9", "0.1"),
}


@pytest.mark.reference
@pytest.mark.parametrize("name", KINDS)
def test_roots_hold_those_of_mpmath(name):
    """Every interval holds the polynomial roots found at 400 digits; each is narrow."""
    found = roots_of(KINDS[name], 640)
    by_hand = ByHand(*KINDS[name], 400, True)
    u1, u2, u3 = by_hand.roots
    with mpmath.workdps(400):
        g = by_hand.g
        truth = {
            "u1": u1, "u2": u2, "u3": u3, "delta": u2 - u1, "m": (u2 - u1) / (u3 - u1),
            "mc": (u3 - u2) / (u3 - u1), "w": by_hand.mp.sqrt(g * (u3 - u1) / 2),
            "one_minus_u1": 1 - u1, "one_plus_u1": 1 + u1,
            "one_minus_u2": 1 - u2, "one_plus_u2": 1 + u2,
        }  # fmt: skip
        for each, value in truth.items():
            ball = found[each]
            slack = Fraction(1, 10**300) * max(1, abs(ball.middle))
            assert value in Interval(ball.middle, ball.spread + slack), each
            assert ball.spread <= abs(ball.middle) / 10**60, each


def test_a_start_on_a_turning_point_is_that_turning_point():
    """θ̇₀ = 0: exactly no way left on one side."""
    nothing = Interval(Fraction(0), Fraction(0))
    assert roots_of(motion(BOOK, "0.1", -15, 140))["up"] == nothing
    assert roots_of(motion(BOOK, "0.1", 15, 140))["down"] == nothing
