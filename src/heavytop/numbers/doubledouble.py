"""Sums of two doubles that carry twice the digits, for times over long runs."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Words = TypeVar("Words", float, NDArray[np.float64])
DoubleDouble = tuple[float, float]


def two_sum(a: Words, b: Words) -> tuple[Words, Words]:
    """Return a + b exactly, as rounded sum and error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Words, b: Words) -> tuple[Words, Words]:
    """Return a b exactly, as rounded product and error (Dekker)."""
    product = a * b
    (a_high, a_low), (b_high, b_low) = _halves(a), _halves(b)
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


def _halves(a: Words) -> tuple[Words, Words]:
    shifted = a * 134217729.0  # 2^27 + 1
    high = shifted - (shifted - a)
    return high, a - high


def add(x: tuple[Words, Words], y: tuple[Words, Words]) -> tuple[Words, Words]:
    """Return the sum of two double-doubles, to about 32 digits; arrays add elementwise."""
    high, error = two_sum(x[0], y[0])
    return two_sum(high, error + (x[1] + y[1]))
