"""Steady and sleeping tops: against values from outside and linearised motions."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic import steady
from heavytop.errors import NotANumber
from heavytop.numbers import Exact, cos

from ..motions import BOOK, CONE, INVERTED, WEIGHTLESS


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
    slow, fast = rates(BOOK, "0.1", 140)
    assert slow == pytest.approx(6.3668390938832, rel=2e-14)
    assert fast == pytest.approx(21.945335558617, rel=3e-14)
    assert steady.least_spin(BOOK, 0) == pytest.approx(117.194006935969, rel=1e-14)
    slow, fast = rates(CONE, "pi/3", 140.6)
    assert slow == pytest.approx(10, rel=1e-15)
    assert fast == pytest.approx(23.082352941176471, rel=1e-15)
    nodding = of(CONE, "pi/3", "140.6").small_nutation_frequency
    assert nodding == pytest.approx(10.852971464966503, rel=1e-15)
    assert 2 * np.pi / nodding == pytest.approx(0.57893686788560806, rel=1e-15)
    thresholds = [of(ht.Top(5, 1, gMR)).sleeping_threshold for gMR in (20, -20, 0)]
    assert thresholds == [20, 20, None]
    assert of(BOOK).sleeping_threshold == steady.least_spin(BOOK, 0)


@pytest.mark.parametrize("top", [BOOK, INVERTED])
@pytest.mark.parametrize("theta", ["0.1", "1", "pi/2", "2.8"])
@pytest.mark.parametrize("omega3", [150, -150, 1e9])
def test_the_exact_start_has_the_same_rates(top, theta, omega3):
    """And, pushed by 1e-6 at unchanged rates, the closed form nods with the frequency told."""
    for name, rate in zip(("slow", "fast"), rates(top, theta, omega3), strict=True):
        if (name, theta) == ("fast", "pi/2"):
            assert np.isinf(rate)
            continue
        start = ht.State.steady(top, theta, omega3, name)
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


def linearised(g, b, theta, precession):
    """Eigenvalues of small motions about a steady one, in the frame that precesses with it.

    There the axis form ė = ℓ × e, ℓ̇ = g (−e_y, e_x, 0) is e′ = (ℓ − Ωẑ) × e,
    ℓ′ = −Ωẑ × ℓ + g (−e_y, e_x, 0), and stands still.
    """

    def cross(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    z = np.array([0.0, 0.0, 1.0])
    e = np.array([np.sin(theta), 0.0, np.cos(theta)])
    moment = b * e + np.cross(e, precession * np.cross(z, e))
    pull = g * np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 0]])
    rest = np.concatenate(
        [np.cross(moment - precession * z, e), pull @ e - precession * np.cross(z, moment)]
    )
    assert np.max(np.abs(rest)) < 1e-9 * (1 + b * b + abs(g) + precession**2)
    jacobian = np.block(
        [[cross(moment - precession * z), -cross(e)], [pull, -precession * cross(z)]]
    )
    return np.linalg.eigvals(jacobian)


def fractions(low, high):
    return st.fractions(low, high, max_denominator=1000)


@settings(max_examples=100, deadline=None)
@given(fractions(-4, 4), fractions(-8, 8), fractions("0.05", "3.09"), fractions("0.1", 4))
def test_nodding_is_an_eigenvalue_of_the_linearised_motion(gMR, omega3, theta, A):
    """Of six, four are zero (|e|, e·ℓ, ℓ_z and where φ starts) and two are ± i ω."""
    assume(omega3**2 > 4 * gMR / A * Fraction(np.cos(float(theta))))
    found = of(ht.Top(A, A, gMR), theta, omega3)
    slow, fast = found.mean_precession_rate, found.other_precession_rate
    frequencies = found.small_nutation_frequency, found.other_nutation_frequency
    assert fast is None or abs(slow) <= abs(fast) * (1 + 1e-15)
    for rate, nodding in zip((slow, fast), frequencies, strict=True):
        if rate is not None and abs(rate) < 1e3:
            values = linearised(float(gMR / A), float(omega3), float(theta), rate)
            scale = 1 + abs(rate) + abs(float(omega3))
            assert np.min(np.abs(values - 1j * nodding)) < 1e-6 * scale or nodding < 0.1
            assert np.max(np.abs(values)) == pytest.approx(nodding, abs=1e-3 * scale)


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
    top = ht.Top(2, 1, 2)
    assert of(top, omega3=4).growth_rate is None
    assert of(top, omega3=4).small_nutation_frequency == 0
    assert of(BOOK, omega3="2*sqrt(3.28e-4*0.0456)/6.6e-5").growth_rate is None
    assert of(BOOK, omega3="2*sqrt(3.28e-4*0.0456)/6.6e-5").small_nutation_frequency == 0
    assert of(top, omega3=np.nextafter(4, 0)).growth_rate == pytest.approx(
        np.sqrt(2**-51 / 2), rel=1e-9
    )
    assert of(top, omega3=np.nextafter(4, 0)).small_nutation_frequency is None
    assert of(top, omega3="4 - 1e-30").growth_rate == pytest.approx(np.sqrt(0.5e-30), rel=1e-15)


@pytest.mark.parametrize("push", ["1e-8", "1e-4", "0.01", "0.5", "3", "1000"])
def test_the_tilt_of_a_push_at_the_threshold(push):
    """The closed form's turning point, for gMR/A = 1; for a small push δ it is √(2δ)."""
    motion = ht.Motion(ht.Top(2, 1, 2), ht.State(0, thetadot=push, psidot=4))
    tilt = steady.tilt_at_threshold(float(push))
    assert tilt == pytest.approx(motion.theta_max, rel=1e-14)
    assert steady.tilt_at_threshold(-float(push)) == tilt
    if float(push) < 1e-3:
        assert tilt == pytest.approx(np.sqrt(2 * float(push)), rel=float(push))


def test_no_number_is_refused():
    with pytest.raises(NotANumber):
        steady.tilt_at_threshold(np.inf)
