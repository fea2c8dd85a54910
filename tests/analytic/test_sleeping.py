"""Sleeping tops: thresholds from outside, eigenvalues of the linearised motion, the closed form."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic import steady
from heavytop.errors import NotANumber

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")


def asleep(top, omega3):
    """The facts of a top that stands where V is highest."""
    return ht.facts(top, ht.State(0 if top.gMR.sign() == 1 else "pi", omega3=omega3))


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


def test_thresholds_from_outside():
    """117.194006935969 rad/s for the book's top; 20 for Simo and Wong's, 2 √(5·20)/1."""
    assert asleep(BOOK, 1).sleeping_threshold == pytest.approx(117.194006935969, rel=1e-14)
    assert asleep(ht.Top(5, 1, 20), 1).sleeping_threshold == 20
    assert asleep(ht.Top(5, 1, -20), 1).sleeping_threshold == 20
    assert asleep(ht.Top(5, 1, 0), 1).sleeping_threshold is None
    assert asleep(BOOK, 1).sleeping_threshold == steady.least_spin(BOOK, 0)


def fractions(low, high):
    return st.fractions(low, high, max_denominator=1000)


@settings(max_examples=100, deadline=None)
@given(fractions("0.1", 4), fractions("0.05", 2), fractions(-4, 4), fractions(-9, 9))
def test_rates_are_eigenvalues(A, flat, gMR, omega3):
    """Real parts are the growth, and the imaginary parts differ by the frequency of θ."""
    assume(gMR or omega3)  # else a tilt grows as time
    top = ht.Top(A, A * flat, gMR)
    values = modes(top, omega3)
    known = asleep(top, omega3)
    growth, frequency = known.growth_rate, known.small_nutation_frequency
    assert (growth is None) == known.stable == (frequency is not None)
    if growth is None:
        apart = np.ptp(np.abs(values.imag))  # both go round the same way
        assert apart == pytest.approx(frequency, rel=1e-6, abs=1e-6)
        assert np.max(values.real) < 1e-5
    else:
        assert np.max(values.real) == pytest.approx(growth, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("gMR", ["1", "-1"])
def test_a_small_tilt_grows_at_the_rate(gMR):
    """The closed form, set off along the growing mode: θ̇ = λθ, and φ̇ = ± p_ψ/2A, at θ = 1e-9."""
    top = ht.Top(1, "0.5", gMR)
    rate = asleep(top, 2).growth_rate
    tilt, side = ("1e-9", 1) if top.gMR.sign() > 0 else ("pi - 1e-9", -1)
    start = ht.State(tilt, thetadot=side * rate * 1e-9, phidot=side * 0.5, omega3=2)
    motion = ht.Motion(top, start)
    t = np.array([1.0, 5.0, 10.0])
    at = motion.at(t)
    small = at.theta if side > 0 else 2 * np.arcsin(np.sqrt(at.one_plus_u / 2))
    assert small == pytest.approx(1e-9 * np.exp(rate * t), rel=1e-6)


@pytest.mark.parametrize("omega3", [117.5, 140, -140, 1000])
@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
def test_a_small_tilt_nods_with_the_frequency(omega3, gMR):
    """2π/T of the closed form, for a top let go 1e-8 from the vertical where V is highest."""
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    tilt = "1e-8" if top.gMR.sign() > 0 else "pi - 1e-8"
    period = ht.Motion(top, ht.State(tilt, omega3=omega3)).period
    assert asleep(top, omega3).small_nutation_frequency == pytest.approx(
        2 * np.pi / period, rel=1e-9
    )


def test_at_the_threshold():
    """There nothing grows and nothing swings back; with the last digit less, something grows."""
    top = ht.Top(2, 1, 2)
    assert asleep(top, 4).growth_rate is None
    assert asleep(top, 4).small_nutation_frequency == 0
    assert asleep(BOOK, "2*sqrt(3.28e-4*0.0456)/6.6e-5").growth_rate is None
    assert asleep(BOOK, "2*sqrt(3.28e-4*0.0456)/6.6e-5").small_nutation_frequency == 0
    assert asleep(top, np.nextafter(4, 0)).growth_rate == pytest.approx(
        np.sqrt(2**-51 / 2), rel=1e-9
    )
    assert asleep(top, np.nextafter(4, 0)).small_nutation_frequency is None
    assert asleep(top, "4 - 1e-30").growth_rate == pytest.approx(np.sqrt(0.5e-30), rel=1e-15)


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
