"""Enclosures where numbers break: double roots, the separatrix, poles, late times, few bits."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.enclosure import enclose, enclose_axis
from heavytop.errors import Impossible, NotANumber, Unseparated
from heavytop.numbers import Exact, cos, sin, sqrt
from heavytop.numbers.intervals import Interval

UNIT = ht.Top(A=1, C=1, gMR=1)
BOOK = ht.Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
KICKED = ht.State(theta="0.1", phidot=-15, psidot=140)
BETSCH = ht.Top(A="6.375e-3", C="7.5e-4", gMR="0.73575")
ONE, ZERO = Interval(Fraction(1), Fraction(0)), Interval(Fraction(0), Fraction(0))
WHITTAKER = {"theta": "pi/3", "phidot": "2/sqrt(3)", "psidot": "2/sqrt(3)"}


def agrees(ball, value, digits=100):
    return value in Interval(
        ball.middle, ball.spread + Fraction(1, 10**digits) * max(1, abs(ball.mid))
    )


# --- double roots ----------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [10, 20, 40])
@pytest.mark.parametrize("rate", ["thetadot", "phidot"])
def test_near_double_roots(rate, exponent):
    """Disturbed by ε, u₂ − u₁ is of order ε; both balls are a digit narrower than that."""
    small = Fraction(1, 10**exponent)
    given = {"phidot": Fraction(10), "omega3": "140.6"}
    given[rate] = given.get(rate, 0) + small
    start = ht.State(theta="pi/3", **given)
    found = enclose(BETSCH, start, digits=exponent + 15)
    low, middle, _ = found.roots
    assert low.spread + middle.spread < (middle.middle - low.middle) / 10
    assert small / 100 < middle.middle - low.middle < small
    form = ht.Motion(BETSCH, start).form(150)
    for ball, value in zip(found.roots, form.roots, strict=True):
        assert agrees(ball, value)
    assert agrees(found.period, form.period)
    assert agrees(found.precession, form.precession)
    assert agrees(found.theta("0.7"), form("0.7").theta)


def test_too_few_bits_for_near_double_roots_name_what_is_known():
    start = ht.State(theta="pi/3", thetadot="1e-40", phidot=10, omega3="140.6")
    with pytest.raises(
        Unseparated, match=r"u1 and u2 differ by less than .* with 128 bits"
    ) as told:
        _ = enclose(BETSCH, start, limit=128).roots
    assert 1e-40 < told.value.bound < 1e-15
    with pytest.raises(Unseparated, match="differ by less than"):
        _ = enclose(BETSCH, start, limit=128).period


@pytest.mark.parametrize("which", ["slow", "fast"])
def test_steady_is_a_double_root_by_proof(which):
    """The third root lies where 2 (h − g u)(1 − u²) = (a − b u)²."""
    start = ht.State.steady(BETSCH, "pi/3", "150", which)
    low, middle, high = enclose(BETSCH, start, digits=40).roots
    assert low == middle == Interval(Fraction(1, 2), Fraction(0))
    assert high.lower > 1
    A, gMR, u = BETSCH.A, BETSCH.gMR, high.middle
    p_psi, across = BETSCH.C * start.omega3, A * start.phidot * Fraction(3, 4)
    left = (across * start.phidot + gMR - 2 * gMR * u) * A * (1 - u**2)
    right = (across + p_psi / 2 - p_psi * u) ** 2
    assert abs(float(left - right)) < 1e-38 * float(right)


@pytest.mark.parametrize(("omega3", "roots"), [(1, (-0.5, 1, 1)), (2, (1, 1, 1)), (3, (1, 1, 3.5))])
def test_the_roots_of_a_sleeping_top(omega3, roots):
    """Twice 1, and b²/2g − 1."""
    found = enclose(UNIT, ht.State(0, omega3=omega3))
    assert [round(float(root.middle), 14) for root in found.roots] == list(roots)
    assert found.theta("1e9") == ZERO


# --- the separatrix --------------------------------------------------------------------------


@pytest.mark.parametrize("exponent", [3, 10, 20, 40, 60])
def test_near_the_separatrix(exponent):
    """T → (1/w) ln 16/(1 − m), and the roots 1 − u₂, u₃ − 1 are kept apart."""
    start = ht.State(**WHITTAKER | {"phidot": Exact.of("2/sqrt(3)") + Fraction(1, 10**exponent)})
    found = enclose(UNIT, start)
    u1, u2, u3 = enclose(UNIT, start, digits=2 * exponent + 15).roots
    assert u2.middle + u2.spread < 1 < u3.middle - u3.spread
    with mpmath.mp.workdps(200):
        value = [mpmath.mp.mpf(r.middle.numerator) / r.middle.denominator for r in (u1, u2, u3)]
        mc = (value[2] - value[1]) / (value[2] - value[0])
        near = mpmath.mp.log(16 / mc) / mpmath.sqrt((value[2] - value[0]) / 2)
        assert abs(near - found.period.mid) < 10 * mc * near + 1e-14 * near
    form = ht.Motion(UNIT, start).form(150)
    for t in (1, 30, "1e4"):
        assert agrees(found.theta(t), form(t).theta)


def test_on_the_separatrix_by_proof():
    found = enclose(UNIT, ht.State(**WHITTAKER))
    assert found.roots[1:] == (ONE, ONE)
    assert found.period is found.precession is found.spin is None
    assert found.theta("1e15").upper < 1e-300
    down = ht.State(theta="2*pi/3", phidot="2/sqrt(3)", psidot="-2/sqrt(3)")
    from_below = enclose(ht.Top(1, 1, -1), down)
    assert from_below.roots[:2] == (Interval(Fraction(-1), Fraction(0)),) * 2
    assert abs(from_below.theta(3).middle + found.theta(3).middle - Fraction(math.pi)) < 1e-15


@pytest.mark.parametrize("side", [1, -1])
def test_a_planar_pendulum_on_its_separatrix(side):
    """tan(θ/2) = 1/|sinh x|, x = γt − asinh 1 where it falls from the horizontal."""
    start = ht.State(theta="pi/2", thetadot=side * sqrt(2))
    found = enclose(UNIT, start, digits=40)
    for t in (0.5, 3, 25):
        with mpmath.mp.workdps(60):
            x = t - side * mpmath.asinh(1)
            assert agrees(found.theta(t), 2 * mpmath.atan(1 / abs(mpmath.sinh(x))), 55)


# --- poles -----------------------------------------------------------------------------------


def test_an_exact_pass_through_the_top():
    """u₂ = 1 by proof; φ jumps by π, which is all that P₋ = 0 leaves of one half of Δφ."""
    start = ht.State(theta=0, thetadot=2, omega3=3)
    found = enclose(UNIT, start, digits=30)
    assert found.roots[1] == ONE
    assert found.theta_min == ZERO
    assert found.theta(0).upper < 1e-30
    form = ht.Motion(UNIT, start).form(100)
    assert agrees(found.precession, form.precession)
    assert agrees(found.spin, form.spin)
    near = enclose(UNIT, ht.State(theta="1e-30", thetadot=2, phidot="1e-30", omega3=3), digits=30)
    assert near.theta_min.lower > 0
    assert found.theta(found.period.middle).upper < 1e-29


def test_an_exact_pass_through_the_bottom():
    start = ht.State(theta="pi/2", thetadot=3, phidot=1, omega3=-1)
    found = enclose(UNIT, start, digits=30)
    assert found.roots[0] == Interval(Fraction(-1), Fraction(0))
    assert found.theta_max.bounds(20)[0] == "3.1415926535897932384"
    assert agrees(found.precession, ht.Motion(UNIT, start).form(100).precession)


@pytest.mark.parametrize(
    ("thetadot", "roots", "turned"),
    [("1", (-1, 0.5, 1), 1), ("2", (-1, 1, 2), 2)],
)
def test_a_planar_pendulum(thetadot, roots, turned):
    """E'/A = θ̇²/2 at θ = π/2: the third root is h/g; φ gains π at each pole that is passed."""
    found = enclose(UNIT, ht.State(theta="pi/2", thetadot=thetadot), digits=30)
    assert tuple(float(root.middle) for root in found.roots) == roots
    assert not any(root.spread for root in found.roots if abs(root.middle) == 1)
    with mpmath.mp.workdps(50):
        assert agrees(found.precession, turned * mpmath.mp.pi, 45)
        m = mpmath.mp.mpf(roots[1] + 1) / (roots[2] + 1)
        period = 2 * mpmath.ellipk(m) / mpmath.sqrt(mpmath.mp.mpf(roots[2] + 1) / 2)
        assert agrees(found.period, period, 45)


@pytest.mark.parametrize("exponent", [10, 20, 40])
def test_near_a_pole(exponent):
    start = ht.State(theta="pi/2", thetadot=3, phidot=1 + Fraction(1, 10**exponent), omega3=1)
    found = enclose(UNIT, start, digits=exponent + 15)
    assert found.theta_min.spread * 10**10 < found.theta_min.middle < Fraction(1, 10**exponent)
    assert agrees(found.precession, ht.Motion(UNIT, start).form(150).precession)


# --- no weight, no end -----------------------------------------------------------------------


def test_the_period_without_weight():
    """T = 2π/√(2h + b²), h = ½ (θ̇² + φ̇² sin²θ)."""
    start = ht.State(theta="pi/2", thetadot=1, phidot=2, omega3=2)
    found = enclose(ht.Top(1, 1, 0), start, digits=30)
    with mpmath.mp.workdps(50):
        assert agrees(found.period, 2 * mpmath.mp.pi / 3, 45)
    assert len(found.roots) == 2


@pytest.mark.parametrize(("digits", "t"), [(15, "1e6"), (50, "1e6"), (15, "1e12"), (50, "-1e12")])
def test_late_times(digits, t):
    """1e6 and 1e12 seconds are 1.8e6 and 1.8e12 periods of the kicked top."""
    ball = enclose(BOOK, KICKED, digits).theta(t)
    assert ball.decimals >= digits
    assert agrees(ball, ht.Motion(BOOK, KICKED).form(120)(t).theta)


def test_late_times_near_the_separatrix():
    """The digits of t are lost once: 60 bits for t = 1e18, 66 for the roots, 50 for θ."""
    start = ht.State(**WHITTAKER | {"phidot": Exact.of("2/sqrt(3)") + Fraction(1, 10**10)})
    ball = enclose(UNIT, start, limit=200).theta("1e18")
    assert agrees(ball, ht.Motion(UNIT, start).form(150)("1e18").theta)


def test_digits_of_large_numbers_are_relative():
    """A top so light that its period is 2π/√(2h + b²) = 1e30 of them."""
    small = Fraction(1, 10**30)
    start = ht.State(theta=1, thetadot=small)
    period = enclose(ht.Top(1, 1, Fraction(1, 10**90)), start, limit=120).period
    assert period.digits >= 15
    assert abs(period.mid / 1e30 / (2 * math.pi) - 1) < 1e-14


def test_too_few_bits_for_a_late_time_name_what_is_known():
    found = enclose(BOOK, KICKED, limit=96)
    assert found.theta(1).decimals >= 15
    with pytest.raises(Unseparated, match=r"theta is known to .* with 96 bits") as told:
        found.theta("1e15")
    assert 1e-15 < told.value.bound < 1


def test_what_cannot_be_proved_is_refused_by_name():
    """√(5 + 2√6) = √2 + √3 is beyond the algebra of exact numbers."""
    nothing = sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3)
    with pytest.raises(
        Unseparated, match=r"udot0 is less than .* with 4096 bits, and could not"
    ) as told:
        enclose(UNIT, ht.State(theta=1, thetadot=nothing, phidot=1))
    assert 0 < told.value.bound < 1e-300
    proved = cos(1) ** 2 + sin(1) ** 2 - 1
    same = enclose(UNIT, ht.State(theta=1, thetadot=proved, phidot=1, psidot=2), digits=30)
    plain = enclose(UNIT, ht.State(theta=1, phidot=1, psidot=2), digits=30)
    assert abs(same.period.middle - plain.period.middle) <= same.period.spread + plain.period.spread


@pytest.mark.parametrize("asked", [{"digits": 1}, {"limit": 0}])
def test_no_digits_and_no_bits_are_refused(asked):
    with pytest.raises(Impossible, match="a whole number from 2 to"):
        enclose(UNIT, KICKED, **asked)


# --- the axis form ---------------------------------------------------------------------------


def test_proofs_on_binary_numbers():
    """|e| = 5: l ∥ e sleeps, l = (0, 1, 3) with g = 1/2 tends to the top, and so on."""
    assert enclose_axis((0, 0, 5), (0, 0, 2.0), 1.0).roots[1] == ONE
    tending = enclose_axis((0, 3, 4), (0, 1, 3), 0.5)
    assert (tending.period, tending.roots[1:]) == (None, (ONE, ONE))
    assert enclose_axis((0, 3, 4), (0, 1, 3), np.nextafter(0.5, 0)).roots[1] == ONE
    assert enclose_axis((0, 3, 4), (0, 1, 3), np.nextafter(0.5, 1)).roots[2] == ONE
    passing = enclose_axis((1, 1, 0), (1, -1, 1.0), 1.0)
    assert passing.period is not None
    assert passing.roots[1] != ONE
    below = enclose_axis((0, 3, -4), (0, -1, 3), -0.5)
    assert below.roots[:2] == (Interval(Fraction(-1), Fraction(0)),) * 2


def test_an_axis_of_no_length_or_no_number():
    with pytest.raises(Impossible, match="not the zero vector"):
        enclose_axis((0, 0, 0), (1, 0, 0), 1)
    with pytest.raises(Impossible, match="rational"):
        enclose_axis((0, 0, 1), (1, 0, sqrt(2)), 1)
    with pytest.raises(NotANumber):
        enclose_axis((0, 0, math.nan), (1, 0, 0), 1)


# --- the error of a number -------------------------------------------------------------------


def test_the_error_of_theta_is_bounded_and_sharp():
    found = enclose(BOOK, KICKED)
    true = ht.Motion(BOOK, KICKED).form(60)(2).theta
    near = float(true)
    for theta in (near, near + 1e-12, near - 3e-7, 0.0):
        error = abs(theta - true)
        assert error <= found.theta_error(2, theta) < error + mpmath.mp.mpf("2e-25") + 1e-15 * error
    with pytest.raises(NotANumber):
        found.theta_error(2, math.nan)
    passing = enclose(UNIT, ht.State(theta=0, thetadot=2, omega3=3))
    assert 0 < passing.theta_error(0, 0.0) < 1e-25  # θ(0) is known no better


# --- starts beside the bottom, whose tilt few bits do not tell from π -----------------------------


@pytest.mark.parametrize("k", [15, 26, 60, 150])
def test_few_digits_from_beside_the_bottom(k):
    """The tilt of the start is a ball around π at first; more bits are taken then."""
    motion = ht.Motion(
        ht.Top(1, "1/2", 1), ht.State(f"pi - 1e-{k}", thetadot=1, phidot=1, omega3=2)
    )
    few, many = motion.form(2)("0.3"), motion.form(200)("0.3")
    for name in ("theta", "phi", "psi"):
        exact = getattr(many, name)
        assert abs(getattr(few, name) - exact) < 1e-2 * max(1, abs(exact))


@pytest.mark.parametrize("k", [37, 38, 50, 150])
def test_the_rate_of_a_start_beside_the_bottom_is_finite(k):
    motion = ht.Motion(ht.Top(1, 1, 0), ht.State(f"pi - 1e-{k}", phidot=1, omega3=0))
    assert 0 <= motion.rising.rate < 10
    seen = motion.form(30)(1)
    assert abs(seen.theta - motion.form(60)(1).theta) < 1e-30


def test_heights_keep_their_own_digits_in_a_pass_through_a_pole():
    top = ht.Top("0.163", "0.037164", "0.088850568120709")
    motion = ht.Motion(top, ht.State("pi - 1e-40"))
    few, many = (motion.form(digits)("0.501").one_plus_u for digits in (30, 80))
    assert 0 < many < 1e-79
    assert abs(few / many - 1) < 1e-30
