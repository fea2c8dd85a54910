"""The cubic's roots: published values, products of roots, and digits close to poles."""

from fractions import Fraction

import mpmath
import pytest

from heavytop.analytic.theory.course import Course, course
from heavytop.analytic.theory.nutation import nutation
from heavytop.analytic.theory.reduced import Reduced
from heavytop.errors import NoClosedForm
from heavytop.numbers import Exact
from heavytop.numbers.decimals import context

CTX = context(60)
SICM = (Fraction("3.28e-4"), Fraction("6.6e-5"), Fraction("0.0456"))
LIE = (Fraction("15.234375"), Fraction("0.46875"), Fraction("147.15"))


def start(top, theta, phidot, psidot, thetadot=0):
    return Reduced.from_angles(CTX, *top, theta, 0, 0, thetadot, phidot, psidot)


# Closed form at 50 digits for the book's decimals, cross-checked by an independent integrator.
@pytest.mark.parametrize(
    ("phidot", "low", "high"),
    [
        (-15, "0.1", "0.51723131823843479801"),
        (0, "0.1", "0.18124330588605412758"),
        (15, "0.0061062066932874334", "0.1"),
    ],
)
def test_turning_angles_of_the_book(phidot, low, high):
    roots = nutation(start(SICM, Fraction("0.1"), phidot, 140))
    assert abs(roots.theta_upper - CTX.mpf(low)) < CTX.mpf("1e-19")
    assert abs(roots.theta_lower - CTX.mpf(high)) < CTX.mpf("1e-19")


def test_roots_of_the_lie_group_benchmark():
    """u = −0.99999999999973779144, 0, 3.2053612385329505649 (50 digits, cross-checked)."""
    roots = nutation(start(LIE, CTX.pi / 2, Fraction("-4.61538"), 150))
    u1, u2, u3 = roots.roots
    assert abs(u1 + CTX.mpf("0.99999999999973779144")) < CTX.mpf("1e-20")
    assert abs(u2) < CTX.mpf("1e-50")
    assert abs(u3 - CTX.mpf("3.2053612385329505649")) < CTX.mpf("1e-19")


@pytest.mark.parametrize("gMR", [3, -3, 0, Fraction(1, 10**30)])
def test_roots_are_roots(gMR):
    """f vanishes at each finite root, for gMR of either sign, for none and for next to none."""
    r = start((2, 1, gMR), Fraction("0.7"), 2, 5, Fraction("0.3"))
    roots = nutation(r)
    for u in roots.roots:
        if abs(u) > 2:
            continue  # far outside the sphere f is a difference of large numbers
        f = 2 * (r.h - r.g * u) * (1 - u * u) - (r.a - r.b * u) ** 2
        assert abs(f) < CTX.mpf("1e-50")
    low, high = roots.tilt(*_ends(roots)[0]), roots.tilt(*_ends(roots)[1])
    assert min(low, high) < CTX.mpf("0.7") < max(low, high)


def _ends(roots):
    return (
        (roots.one_minus_u1, roots.one_plus_u1),
        (roots.one_minus_u2, roots.one_plus_u2),
    )


@pytest.mark.parametrize("tiny", ["1e-3", "1e-15", "1e-33"])
def test_distance_from_the_bottom_keeps_its_digits(tiny):
    """1 + u₁ against polynomial roots found at 400 digits, down to 1e-66."""
    phidot = Fraction(-60, 13) + Fraction(tiny)
    r = Reduced.from_angles(CTX, *LIE, CTX.pi / 2, 0, 0, 0, phidot, 150)
    found = nutation(r, 30).one_plus_u1
    with mpmath.workdps(400):
        big = r.refined(context(400))
        g, a, b, h = (mpmath.mpf(v) for v in (big.g, big.a, big.b, big.h))
        cubic = [2 * g, -(2 * h + b * b), 2 * a * b - 2 * g, 2 * h - a * a]
        lowest = min(mpmath.polyroots(cubic, maxsteps=500, extraprec=2000), key=lambda u: u.real)
        assert abs(mpmath.mpf(found) / (lowest.real + 1) - 1) < mpmath.mpf("1e-30")


def test_a_start_on_a_turning_point_is_that_turning_point():
    """θ̇₀ = 0: exactly no way left on one side."""
    above = nutation(start(SICM, Fraction("0.1"), -15, 140))
    below = nutation(start(SICM, Fraction("0.1"), 15, 140))
    assert above.up == 0
    assert below.down == 0


def test_almost_steady_keeps_half_of_nothing():
    """u₂ − u₁ = 1e-30: the expansion about the start loses none of its digits."""
    ctx = context(60)
    top = (Fraction("6.375e-3"), Fraction("7.5e-4"), Fraction("0.73575"))
    spin = Fraction("135.6") + Fraction(1, 10**28)
    r = Reduced.from_angles(ctx, *top, ctx.pi / 3, 0, 0, 0, 10, spin)
    fine = Reduced.from_angles(context(200), *top, context(200).pi / 3, 0, 0, 0, 10, spin)
    one, other = nutation(r), nutation(fine)
    assert abs(one.delta) < CTX.mpf("1e-27")
    assert abs(one.delta / other.delta - 1) < CTX.mpf("1e-25")


def test_courses():
    """Steady, asymptotic and nutating motions are told apart; only the last have roots."""
    steady = start((Fraction("6.375e-3"), Fraction("7.5e-4"), Fraction("0.73575")),
                   Exact.of("pi/3"), 10, Fraction("135.6"))  # fmt: skip
    asymptotic = start((2, 1, 2), Exact.of("pi/3"), Exact.of("2/sqrt(3)"), Exact.of("5/sqrt(3)"))
    assert course(steady) is Course.STEADY
    assert course(asymptotic) is Course.ASYMPTOTIC
    assert course(start((2, 1, 2), 1, 0, 1)) is Course.NUTATING
    for motion in (steady, asymptotic):
        with pytest.raises(NoClosedForm, match="no nutation"):
            nutation(motion)


@pytest.mark.parametrize("digits", [60, 100, 250])
def test_rounding_is_no_motion(digits):
    """An axis along its momentum, or round the equator, without weight: steady at any precision."""
    axes = ((0.375, -0.5, 0.75), (0.375, -0.625, 0.75), (-0.9375, 0.21875, -0.25))
    along = [Reduced.from_axis(CTX, e, [3 * x for x in e], 0) for e in axes]
    round_equator = start((2, 1, 0), Exact.of("pi/2"), 1, 0)
    for motion in (*along, round_equator):
        assert course(motion.refined(context(digits))) is Course.STEADY


def test_an_axis_a_hair_off_its_momentum_moves():
    """One unit in the last place is no rounding: doubles are exact."""
    e = (0.375, -0.5, 0.75)
    l = (1.125, -1.5, 2.25 * (1 + 2**-52))  # noqa: E741
    assert course(Reduced.from_axis(CTX, e, l, 0)) is Course.NUTATING
