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

from heavytop.exact import Exact
from heavytop.exact.balls import Interval, working

middles = st.one_of(
    st.fractions(max_denominator=10**30),
    st.builds(lambda n, e: n * Fraction(10) ** e, st.integers(-999, 999), st.integers(-80, 40)),
)
spreads = st.one_of(
    st.just(Fraction(0)),
    st.builds(lambda n, e: n * Fraction(10) ** e, st.integers(1, 999), st.integers(-90, 3)),
)
balls = st.builds(Interval, middles, spreads)


@given(balls)
def test_what_is_printed_holds_the_ball_and_has_all_the_digits_that_are_known(ball):
    shown, _, error = str(ball).partition(" ± ")
    assert ball in Interval(Fraction(shown), Fraction(error or 0))
    assert not ball.spread or ball.spread <= Fraction(error) <= 20 * ball.spread


@given(balls, st.integers(1, 40))
def test_bounds_are_outside_by_less_than_a_unit(ball, digits):
    ends = ball.middle - ball.spread, ball.middle + ball.spread
    low, high = map(Fraction, ball.bounds(digits))
    assert low <= ends[0] <= ends[1] <= high
    for bound, end in zip((low, high), ends, strict=True):
        assert abs(bound - end) < abs(end) * Fraction(10) ** (1 - digits) or bound == end


@given(balls)
def test_floats_are_outside_by_less_than_two_ulps(ball):
    low, high = ball.middle - ball.spread, ball.middle + ball.spread
    for found, true in ((ball.lower, low), (ball.upper, high)):
        assert abs(Fraction(found) - true) <= 2 * math.ulp(found)
    assert ball.lower <= low <= high <= ball.upper
    assert ball.mid == float(ball.middle)


@given(st.builds(Interval, middles, spreads.filter(bool)))
def test_digits_are_the_most_that_hold(ball):
    scale = max(1, abs(ball.middle))
    assert ball.spread <= scale * Fraction(10) ** -ball.digits
    assert ball.spread > scale * Fraction(10) ** -(ball.digits + 1)


@pytest.mark.parametrize(
    ("x", "held"),
    [
        (np.float64(1 / 3), True), (np.float32(1 / 3), False), ("0.3333333332", False),
        (Decimal("0.33333333339"), True), (mpmath.mp.mpf(1) / 3, True), (Exact.of("1/3"), True),
        (Interval(Fraction(1, 3), Fraction(9, 10**11)), True),
        (Interval(Fraction(1, 3), Fraction(2, 10**10)), False),
        (Interval(Fraction(1, 3) + Fraction(1, 10**10), Fraction(1, 10**11)), False),
    ],
)  # fmt: skip
def test_every_kind_of_number_can_be_looked_for(x, held):
    assert (x in Interval(Fraction(1, 3), Fraction(1, 10**10))) is held


def test_the_precision_is_put_back():
    before = ctx.prec
    with working(200):
        with working(80):
            assert ctx.prec == 80
        with pytest.raises(ZeroDivisionError), working(90):
            raise ZeroDivisionError
        assert ctx.prec == 200
    assert ctx.prec == before


@pytest.mark.parametrize(
    ("x", "digits", "text"),
    [("1/3", 5, "0.33333"), ("-2/3", 3, "-0.667"), ("200/3", 5, "66.667"), ("0", 3, "0.000"),
     ("999.96", 4, "1000.0"), ("12345", 5, "12345"), ("0.9999", 3, "1.000")],
)  # fmt: skip
def test_decimals_are_rounded_to_the_nearest(x, digits, text):
    assert Interval(Fraction(x), Fraction(0)).rounded(digits) == text


def test_what_is_not_known_is_not_rounded():
    with pytest.raises(ValueError, match="not known to 9 digits"):
        Interval(Fraction(1, 3), Fraction(1, 10**8)).rounded(9)
    with pytest.raises(ValueError, match="finite"):
        Interval.of(flint.arb.nan())
