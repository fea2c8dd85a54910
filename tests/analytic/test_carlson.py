"""Carlson's R_J in doubles, against mpmath."""

import mpmath
import numpy as np

from heavytop.theory.carlson import elliprj

SOURCE = np.random.default_rng(5)


def worst(x, y, p):
    ctx = mpmath.MPContext()
    ctx.dps = 30
    found = elliprj(x, y, 1.0, p)
    exact = [ctx.elliprj(a, b, 1, c) for a, b, c in zip(x, y, p, strict=True)]
    return max(abs(f / e - 1) for f, e in zip(found, exact, strict=True))


def test_arguments_of_an_elliptic_integral():
    x = SOURCE.uniform(0, 1, 200)
    y = SOURCE.uniform(0, 1, 200)
    p = 10 ** SOURCE.uniform(-3, 3, 200)
    assert worst(x, y, p) < 4e-15


def test_extreme_characteristics():
    x = SOURCE.uniform(0, 1, 100) ** 8
    y = SOURCE.uniform(1e-9, 1, 100)
    p = 10 ** SOURCE.uniform(-16, 16, 100)
    assert worst(x, y, p) < 4e-15


def test_a_complete_integral_has_a_zero_argument():
    y = SOURCE.uniform(1e-6, 1, 50)
    assert worst(np.zeros(50), y, 10 ** SOURCE.uniform(-10, 10, 50)) < 4e-15


def test_equal_arguments():
    x = SOURCE.uniform(0.1, 1, 50)
    assert worst(x, np.ones(50), np.ones(50)) < 4e-15
    assert worst(np.ones(50), np.ones(50), 1 + SOURCE.uniform(-1e-3, 1e-3, 50)) < 4e-15
