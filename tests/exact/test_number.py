"""Exact numbers against fractions, and what leaves them, balls and doubles, against mpmath."""

import pickle
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import MPContext, libmp

from heavytop.exact import PI, Exact, acos, atan, cos, sin, sqrt

rationals = st.fractions() | st.fractions(-1000, 1000, max_denominator=1000)
doubles = st.floats(1e-290, 1e290) | st.floats(-1e290, -1e-290) | st.just(0.0)
UNPROVED = sqrt(cos(2) ** 2) + cos(2)  # zero, for all that 4096 bits say


def context(bits):
    mp = MPContext()
    mp.prec = bits
    return mp


@given(rationals, rationals)
def test_rational_arithmetic_is_that_of_fractions(p, q):
    a, b = Exact.of(1) * p, Exact.of(1) * q
    found, exact = (a + b, a - b, a * b), (p + q, p - q, p * q)
    assert tuple(x.fraction for x in found) == exact
    assert q == 0 or (a / b).fraction == p / q
    assert float(a) == float(p)


@given(doubles)
def test_float_means_its_binary_value(x):
    exact = Exact.of(x)
    assert (exact.fraction, float(exact)) == (Fraction(x), x)
    assert Exact.of(str(exact)) == exact


def test_equal_numbers_hash_alike_and_survive_pickling():
    powers = 1 / (1 + PI) ** 2, (1 / cos(1)) ** Fraction(3, 2)
    for x in (sqrt(8), Exact.of("pi/3"), Exact.of(0.5), cos(0.3), acos("3/4"), *powers):
        again = pickle.loads(pickle.dumps(x))
        assert (again, str(again), hash(again)) == (x, str(x), hash(x))
        assert (hash(x * 2 / 2), Exact.of(str(x * 1))) == (hash(x), x)
    assert PI + sqrt(2) + 1 == 1 + PI + sqrt(2) != PI + sqrt(2)
    assert PI * sqrt(2) * cos(1) == cos(1) * PI * sqrt(2) != PI * sqrt(2) + cos(1)
    assert (hash(Exact.of(0.5)), len({sqrt(8), 2 * sqrt(2)})) == (hash(0.5), 1)
    cube = (2 + cos(1)) ** 3  # which two roots of it are once more
    assert (PI * sqrt(cube) * cube * sqrt(cube) - PI * cube).sign() == 1


EXACT = {"n": Exact.of, "pi": PI, "sqrt": sqrt, "cos": cos, "sin": sin, "acos": acos, "atan": atan}


SHAPES = [
    "({a} + {b})", "({a} - {b})", "{a}*{b}", "({a})**3", "cos({a})", "sin({a})", "atan({a})",
    "sqrt(1 + ({a})**2)", "{a}/(1 + ({b})**2)", "acos({a}/sqrt(({a})**2 + 1))",
]  # fmt: skip


@st.composite
def formulas(draw, depth=3):
    """Python expressions that have a value: what is divided by or under a root is positive."""
    if depth == 0 or draw(st.booleans()):
        return draw(st.sampled_from(["pi", "n('2')", "n('0.1')", "n('-7.5e-3')", "sqrt(n('6'))"]))
    inner = formulas(depth=depth - 1)
    return draw(st.sampled_from(SHAPES)).format(a=draw(inner), b=draw(inner))


def by_mpmath(formula, bits):
    mp = context(bits)
    names = {"n": mp.mpf, "pi": +mp.pi, "sqrt": mp.sqrt, "cos": mp.cos, "sin": mp.sin}
    names |= {"acos": mp.acos, "atan": mp.atan}
    value = Fraction(*libmp.to_rational(eval(formula, names)._mpf_))  # our own formula
    return value if abs(value) > Fraction(1, 2**1500) else Fraction(0)


def bounds(ball):
    """The ends of a ball, exactly."""
    (m, e), (r, f) = ball.mid().man_exp(), ball.rad().man_exp()
    middle, radius = (Fraction(int(k)) * Fraction(2) ** int(j) for k, j in ((m, e), (r, f)))
    return middle - radius, middle + radius


@given(formulas(), st.integers(2, 400))
def test_balls_hold_the_number_and_values_are_rounded_to_nearest(formula, bits):
    exact, value, slack = eval(formula, dict(EXACT)), by_mpmath(formula, 2000), Fraction(1, 2**1500)
    ball = exact.ball(bits)
    if ball.is_finite():
        low, high = bounds(ball)
        assert low - slack <= value <= high + slack
    low, high = bounds(exact.ball(1000))
    assert high - low <= Fraction(1, 2**900)
    rounded = libmp.from_rational(value.numerator, value.denominator, bits, "n")
    assert exact.mpf(context(bits)) == context(bits).make_mpf(rounded)
    assert float(exact) == float(value)
    assert Exact.of(str(exact)) == exact


def test_threads_at_different_precisions_get_what_each_gets_alone():
    x = sqrt(2 + cos("0.1")) / (PI - sqrt(3) * sin(1)) + sqrt(5) ** 3
    precisions, before = (30, 64, 150, 700) * 100, sys.getswitchinterval()
    alone = [bounds(x.ball(bits)) for bits in precisions]
    sys.setswitchinterval(1e-6)  # threads that are interrupted as often as can be
    try:
        with ThreadPoolExecutor(8) as pool:
            assert [bounds(ball) for ball in pool.map(x.ball, precisions)] == alone
    finally:
        sys.setswitchinterval(before)


def test_a_precision_that_is_none_is_refused_and_leaves_the_lock_open():
    with pytest.raises(ValueError, match="prec"):
        PI.ball(1)
    signs = []
    thread = threading.Thread(target=lambda: signs.append(cos(2).sign()))
    thread.start()
    thread.join(timeout=20)
    assert signs == [-1]


def test_cancellation_inside_costs_no_digits():
    """x = √(1 + 1e-200) − 1: 64 bits do not tell 1/x, and all digits are right."""
    x, inverse = sqrt(Exact.of("1 + 1e-200")) - 1, 2 * 10**200 + Fraction(1, 2)
    assert not (1 / x).ball(64).is_finite()
    low, high = bounds((1 / x).ball(2000))
    assert low <= inverse <= high + Fraction(1, 10**199)
    assert high - low < Fraction(1, 10**100)
    assert abs(x.mpf(context(100)) * (context(900).mpf(10) ** 200 * 2) - 1) < 1e-29
    assert (float(x), float(1 / x)) == (5e-201, 2e200)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_what_may_be_zero_is_a_narrow_ball_and_a_plain_zero(n):
    narrow = (UNPROVED**n * cos("0.1")).ball(300), 280 * n
    for ball, bits in (narrow, (sqrt(UNPROVED).ball(300), 90)):
        low, high = bounds(ball)
        assert low <= 0 <= high <= Fraction(1, 2**bits)
    assert UNPROVED.sign() is None
    assert (str(float(UNPROVED)), UNPROVED.mpf(context(100))) == ("0.0", 0)
