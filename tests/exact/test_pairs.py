"""Sums of two doubles, and reductions by multiples of a constant, against fractions."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, fmpq
from hypothesis import given
from hypothesis import strategies as st

from heavytop.exact.balls import working
from heavytop.exact.pairs import (
    Linear,
    add,
    modulo_circle,
    plus_turns,
    two_sum,
)
from heavytop.exact.pairs import total as sum_of

SOURCE = np.random.default_rng(7)
TWO_PI = Fraction("6.2831853071795864769252867665590057683943387987502116419498891846")


def drawn(low, high, count=40):
    """Doubles of either sign, of sizes 10^low … 10^high."""
    return SOURCE.choice([-1, 1], count) * 10 ** SOURCE.uniform(low, high, count)


X, Y = drawn(-3, 3), drawn(-3, 3)


def ball(q):
    return arb(fmpq(q.numerator, q.denominator))


def total(*parts):
    return sum(map(Fraction, map(float, parts)), Fraction(0))


def test_sums_of_pairs():
    (a, b), (c, d) = (two_sum(x, x * SOURCE.uniform(-1e-16, 1e-16, x.size)) for x in (X, Y))
    for i, found in enumerate(zip(*add((a, b), (c, d)), strict=True)):
        size = abs(Fraction(a[i])) + abs(Fraction(c[i]))
        assert abs(total(*found) - total(a[i], b[i], c[i], d[i])) <= Fraction(1, 10**30) * size


def test_a_sum_keeps_what_its_large_terms_leave():
    """Terms of 1e16 cancel to 1e-16, and the sum has twice the digits of a double even so."""
    terms = [drawn(16, 16), *(drawn(-3, 3) for _ in range(4)), drawn(-16, -15)]
    terms.insert(1, -terms[0])
    high, low = sum_of(*terms)
    for i in range(high.size):
        exact = total(*(term[i] for term in terms))
        assert abs(total(high[i], low[i]) - exact) <= Fraction(1, 2**96)


@given(
    st.integers(-(2**32), 2**32), st.fractions(-1000, 1000, max_denominator=10**30),
    st.floats(-1, 1), st.floats(-1, 1),
)  # fmt: skip
def test_what_is_left_of_a_time(n, x, part, since):
    """To 2e-16 of the spacing of times there, in twice the digits where the rest is small."""
    with working(400):
        linear = Linear(arb(since), -ball(x), arb(1))
    t = float((n + Fraction(part)) * x)
    low = part * np.spacing(t) / 4
    high, rest = linear(np.array([float(n)]), np.array([t]), np.array([low]))
    exact = Fraction(t) + Fraction(low) - n * x + Fraction(since)
    size = 1 + abs(n * x) + abs(Fraction(t))
    assert abs(total(high[0], rest[0]) - exact) <= Fraction(1, 2**104) * size


@pytest.mark.parametrize("turns", [0, 3, -(10**6), 2 * 10**9])
def test_angles_far_away(turns):
    """Where large terms cancel, and modulo 2π, nothing is lost but the rounding of the local."""
    start, step, rate = Fraction(5, 7), Fraction("1.2345678901234567890123"), Fraction(-8, 3)
    with working(400):
        angle = Linear(ball(start), ball(step), ball(rate))
    n = float(turns)
    t = float((turns * step - 2) / -rate)
    local = np.array([0.25, -1.5, 0.0])
    whole, rest = angle(np.full(3, n), np.full(3, t), np.full(3, 1e-9), local)
    mod = modulo_circle(whole, rest)
    for i in range(3):
        want = start + turns * step + rate * (Fraction(t) + Fraction(1e-9)) + Fraction(local[i])
        assert abs(Fraction(whole[i]) - want) <= Fraction(1, 2**52) * max(1, abs(want))
        assert 0 <= mod[i] < 2 * np.pi
        off = (Fraction(mod[i]) - want) / TWO_PI
        assert abs(off - round(off)) * TWO_PI < 3e-15


def test_turns_are_added_with_one_rounding():
    random = np.random.default_rng(5)
    angle = random.uniform(-3.2, 3.2, 400)
    turns = np.rint(10 ** random.uniform(0, 9, 400)) * random.choice([-1, 0.5, 1], 400)
    for rest, n, found in zip(angle, turns, plus_turns(angle, turns), strict=True):
        exact = Fraction(rest) + Fraction(n) * TWO_PI
        assert abs(Fraction(found) - exact) <= (abs(exact) + 6) / 2**53
    assert np.array_equal(plus_turns(angle, np.zeros(400)), angle)
