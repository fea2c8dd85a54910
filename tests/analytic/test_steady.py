"""Steady and sleeping tops: against values from outside and linearised motions."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic import steady
from heavytop.errors import NotANumber
from heavytop.numbers import Exact, cos

from ..motions import BOOK, CONE, INVERTED, MARGINAL, WEIGHTLESS


def of(top, theta=None, omega3=1, which="slow"):
    """The facts of a steady precession; without a tilt, where it stands and V is highest."""
    if theta is None:
        return ht.facts(top, ht.State(0 if top.gMR.sign() == 1 else "pi", omega3=omega3))
    return ht.facts(top, ht.State.steady(top, theta, omega3, which))


def rates(top, theta, omega3):
    """The slow and the fast rate at θ, in doubles."""
    return steady.rates(top, float(top.C) * np.asarray(omega3), float(cos(Exact.of(theta))))


@pytest.mark.reference
def test_published_rates_and_thresholds():
    """SICM exercise 2.13 by another program (14 digits printed), and Betsch & Steinmann 2002."""
    assert rates(BOOK, "0.1", 140) == pytest.approx((6.3668390938832, 21.945335558617), rel=3e-14)
    assert rates(CONE, "pi/3", 140.6) == pytest.approx((10, 23.082352941176471), rel=1e-15)
    assert steady.least_spin(BOOK, 0) == pytest.approx(117.194006935969, rel=1e-14)
    thresholds = [of(ht.Top(5, 1, gMR)).sleeping_threshold for gMR in (20, -20, 0)]
    assert thresholds == [20, 20, None]


@pytest.mark.parametrize("top", [BOOK, INVERTED])
@pytest.mark.parametrize("theta", ["0.1", "1", "pi/2", "2.8"])
@pytest.mark.parametrize("omega3", [150, -150, 1e9])
def test_the_exact_start_has_the_same_rates(top, theta, omega3):
    """And, pushed by 1e-6 at unchanged rates, the closed form nods with the frequency told."""
    for which, rate in zip(("slow", "fast"), rates(top, theta, omega3), strict=True):
        if (which, theta) == ("fast", "pi/2"):
            assert np.isinf(rate)
            continue
        start = ht.State.steady(top, theta, omega3, which)
        assert rate == pytest.approx(float(start.phidot), rel=2e-15)
        if omega3 == 150 and theta != "0.1":
            pushed = ht.State(theta, thetadot="1e-6", phidot=start.phidot, omega3=150)
            expected = 2 * np.pi / ht.facts(top, start).small_nutation_frequency
            assert ht.Motion(top, pushed).period == pytest.approx(expected, rel=1e-9)


def test_arrays_of_spins_and_where_there_is_no_rate():
    spins = np.array([118.0, 140.0, 500.0])
    slow, fast = rates(BOOK, "0.1", spins)
    assert slow.shape == (3,)
    assert slow[1] == rates(BOOK, "0.1", 140)[0]
    assert np.all(fast > slow)
    assert rates(WEIGHTLESS, 1, 10)[0] == 0
    assert np.isnan(rates(BOOK, 0, [140, 117])).tolist() == [[False, True], [False, True]]
    least = steady.least_spin(BOOK, 0)
    assert np.all(np.isfinite(rates(BOOK, 0, np.nextafter(least, 200))))
    assert np.all(np.isnan(rates(BOOK, 0, least * (1 - 1e-14))))
    assert steady.least_spin(BOOK, 2) == 0
    assert not np.any(np.isfinite(rates(BOOK, "pi/2", 0)))  # nothing holds it up


def modes(top, omega3):
    """Eigenvalues about the vertical where V is highest, e = (x, y, ±1): Newton's equations.

    With x, y ≪ 1 the axis form gives ë_x = −s b ė_y + |g| e_x and ë_y = s b ė_x + |g| e_y, where
    s = ±1 says which vertical it is.
    """
    b = float(top.C) * float(omega3) / float(top.A)
    g = float(top.gMR) / float(top.A)
    s = -1 if g < 0 else 1
    first = np.array([[0, 0, 1, 0], [0, 0, 0, 1]])
    second = np.array([[abs(g), 0, 0, -s * b], [0, abs(g), s * b, 0]])
    return np.linalg.eigvals(np.vstack([first, second]))


def fractions(low, high):
    return st.fractions(low, high, max_denominator=1000)


@settings(max_examples=100, deadline=None)
@given(fractions("0.1", 4), fractions("0.05", 2), fractions(-4, 4), fractions(-9, 9))
def test_rates_are_eigenvalues(A, flat, gMR, omega3):
    """Real parts are the growth, and the imaginary parts differ by the frequency of θ."""
    assume(gMR or omega3)  # else a tilt grows as time
    top = ht.Top(A, A * flat, gMR)
    values = modes(top, omega3)
    known = of(top, omega3=omega3)
    growth, frequency = known.growth_rate, known.small_nutation_frequency
    assert (growth is None) == known.stable == (frequency is not None)
    if growth is None:
        apart = np.ptp(np.abs(values.imag))  # both go round the same way
        assert apart == pytest.approx(frequency, rel=1e-6, abs=1e-6)
        assert np.max(values.real) < 1e-5
    else:
        assert np.max(values.real) == pytest.approx(growth, rel=1e-5, abs=1e-5)


def test_at_the_threshold():
    """There nothing grows and nothing swings back; with the last digit less, something grows."""
    for top, omega3 in ((MARGINAL, 4), (BOOK, "2*sqrt(3.28e-4*0.0456)/6.6e-5")):
        assert of(top, omega3=omega3).growth_rate is None
        assert of(top, omega3=omega3).small_nutation_frequency == 0
    below = of(MARGINAL, omega3=np.nextafter(4, 0))
    assert below.growth_rate == pytest.approx(np.sqrt(2**-51 / 2), rel=1e-9)
    assert below.small_nutation_frequency is None


@pytest.mark.parametrize("push", ["1e-8", "0.5", "1000"])
def test_the_tilt_of_a_push_at_the_threshold(push):
    """The closed form's turning point, for gMR/A = 1; for a small push δ it is √(2δ)."""
    motion = ht.Motion(ht.Top(2, 1, 2), ht.State(0, thetadot=push, psidot=4))
    tilt = steady.tilt_at_threshold(float(push))
    assert tilt == pytest.approx(motion.theta_max, rel=1e-14)
    assert steady.tilt_at_threshold(-float(push)) == tilt
    if float(push) < 1e-3:
        assert tilt == pytest.approx(np.sqrt(2 * float(push)), rel=float(push))
    with pytest.raises(NotANumber):
        steady.tilt_at_threshold(np.inf)
