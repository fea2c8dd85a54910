"""Steady and sleeping tops: against values from outside and linearised motions."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht

from ..motions import MARGINAL


def of(top, omega3=1):
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


def test_with_a_last_digit_less_than_the_threshold_something_grows():
    below = of(MARGINAL, omega3=np.nextafter(4, 0))
    assert below.growth_rate == pytest.approx(np.sqrt(2**-51 / 2), rel=1e-9)
    assert below.small_nutation_frequency is None
