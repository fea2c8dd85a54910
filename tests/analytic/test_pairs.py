"""Arithmetic with twice the digits of a double, against mpmath."""

import mpmath
import numpy as np
import pytest

from heavytop.numbers.pairs import Pairs, arctangent, sin_cos, sinh_cosh, two_product, two_sum

CTX = mpmath.MPContext()
CTX.dps = 60
SOURCE = np.random.default_rng(7)


def drawn(low, high, count=40):
    """Pairs of either sign, of sizes 10^low … 10^high."""
    hi = SOURCE.choice([-1, 1], count) * 10 ** SOURCE.uniform(low, high, count)
    return Pairs(*two_sum(hi, hi * SOURCE.uniform(-1e-16, 1e-16, count)))


def exact(pairs, i):
    return CTX.mpf(float(pairs.hi[i])) + CTX.mpf(float(pairs.lo[i]))


def worst(found, function, *arguments):
    errors = [
        exact(found, i) / function(*(exact(x, i) for x in arguments)) - 1
        for i in range(found.hi.size)
    ]
    return max(abs(float(error)) for error in errors)


def test_rounding_errors_are_exact():
    a, b = drawn(-8, 8).hi, drawn(-8, 8).hi
    for (total, error), function in (
        (two_sum(a, b), lambda x, y: x + y),
        (two_product(a, b), lambda x, y: x * y),
    ):
        for i in range(a.size):
            want = function(CTX.mpf(float(a[i])), CTX.mpf(float(b[i])))
            assert CTX.mpf(float(total[i])) + CTX.mpf(float(error[i])) == want


def test_arithmetic():
    x, y = drawn(-8, 8), drawn(-8, 8)
    assert worst(x * y, lambda a, b: a * b, x, y) < 1e-31
    assert worst(x + y, lambda a, b: a + b, x, y) < 1e-30
    assert worst(x - y, lambda a, b: a - b, x, y) < 1e-30


def test_a_difference_of_neighbours_keeps_what_is_left():
    x = drawn(0, 1)
    near = Pairs(x.hi * (1 + 1e-12), x.lo)
    assert worst(near - x, lambda a, b: a - b, near, x) < 1e-19


@pytest.mark.parametrize("low", [-1, -8, -100])
def test_circular_functions(low):
    z = drawn(low, -0.001)
    sine, cosine = sin_cos(z)
    assert worst(sine, CTX.sin, z) < 1e-30
    assert worst(cosine, CTX.cos, z) < 1e-30


@pytest.mark.parametrize(("low", "high"), [(-100, 0), (-1, 0.1), (0, 1), (1, 2.47)])
def test_hyperbolic_functions(low, high):
    z = drawn(low, high)
    sine, cosine = sinh_cosh(z)
    assert worst(sine, CTX.sinh, z) < 1e-29
    assert worst(cosine, CTX.cosh, z) < 1e-29


def test_arctangent():
    y, x = drawn(-20, 20), drawn(-20, 20)
    x = Pairs(abs(x.hi), np.sign(x.hi) * x.lo)
    assert worst(arctangent(y, x), CTX.atan2, y, x) < 1e-30
    zero = Pairs(np.zeros(1), np.zeros(1))
    assert arctangent(zero, zero).hi == 0
