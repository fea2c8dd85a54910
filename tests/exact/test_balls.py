"""Interval: what it says of the numbers in it, against rational arithmetic."""

import math
from decimal import Decimal
from fractions import Fraction

import flint
import mpmath
import numpy as np
import pytest
from flint import ctx
from hypothesis import given
from hypothesis import strategies as st

from heavytop.errors import Impossible
from heavytop.exact import Exact
from heavytop.exact.balls import Interval, working


def scaled(n, e):
    return n * Fraction(10) ** e


middles = st.builds(scaled, st.integers(-999, 999), st.integers(-80, 40))
middles |= st.fractions(max_denominator=10**30)
spreads = st.builds(scaled, st.integers(1, 999), st.integers(-90, 3)) | st.just(Fraction(0))
balls = st.builds(Interval, middles, spreads)


@given(balls)
def test_what_is_printed_holds_the_ball_and_has_all_the_digits_that_are_known(ball):
    shown, _, error = str(ball).partition(" ± ")
    assert ball in Interval(Fraction(shown), Fraction(error or 0))
    assert not ball.spread or ball.spread <= Fraction(error) <= 20 * ball.spread


@given(balls, st.integers(1, 40))
def test_bounds_are_outside_by_less_than_a_unit_and_floats_by_two_ulps(ball, digits):
    ends = ball.middle - ball.spread, ball.middle + ball.spread
    low, high = map(Fraction, ball.bounds(digits))
    assert low <= ends[0] <= ends[1] <= high
    assert ball.lower <= ends[0] <= ends[1] <= ball.upper
    assert ball.mid == float(ball.middle)
    for bound, found, end in zip((low, high), (ball.lower, ball.upper), ends, strict=True):
        assert abs(bound - end) < abs(end) * Fraction(10) ** (1 - digits) or bound == end
        assert abs(Fraction(found) - end) <= 2 * math.ulp(found)


@given(st.builds(Interval, middles, spreads.filter(bool)))
def test_digits_are_the_most_that_hold(ball):
    scale = max(1, abs(ball.middle))
    assert ball.spread <= scale * Fraction(10) ** -ball.digits
    assert ball.spread > scale * Fraction(10) ** -(ball.digits + 1)


def test_every_kind_of_number_can_be_looked_for():
    third, unit = Fraction(1, 3), Fraction(1, 10**10)
    ball, number = Interval(third, unit), (np.float64(1 / 3), mpmath.mp.mpf(1) / 3, Exact.of("1/3"))
    held = (*number, Decimal("0.33333333339"), Interval(third, unit * 9 / 10))
    aside = (np.float32(1 / 3), "0.3333333332", Interval(third, 2 * unit))
    assert all(x in ball for x in held)
    assert not any(x in ball for x in (*aside, Interval(third + unit, unit / 10)))


def test_the_precision_is_put_back():
    before = ctx.prec
    with working(200):
        with working(80):
            assert ctx.prec == 80
        with pytest.raises(ZeroDivisionError), working(90):
            raise ZeroDivisionError
        assert ctx.prec == 200
    assert ctx.prec == before


@pytest.mark.parametrize(("x", "digits", "text"), [
    ("1/3", 5, "0.33333"), ("-2/3", 3, "-0.667"), ("200/3", 5, "66.667"), ("0", 3, "0.000"),
    ("999.96", 4, "1000.0"), ("12345", 5, "12345"), ("0.9999", 3, "1.000"),
])  # fmt: skip
def test_decimals_are_rounded_to_the_nearest(x, digits, text):
    assert Interval(Fraction(x), Fraction(0)).rounded(digits) == text


def test_what_is_not_known_is_not_rounded():
    with pytest.raises(Impossible, match="not known to 9 digits"):
        Interval(Fraction(1, 3), Fraction(1, 10**8)).rounded(9)
    with pytest.raises(ValueError, match="finite"):
        Interval.of(flint.arb.nan())
