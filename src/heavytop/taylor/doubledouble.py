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


def add(x: tuple[Words, Words], y: tuple[Words, Words]) -> tuple[Words, Words]:
    """Return the sum of two double-doubles, to about 32 digits; arrays add elementwise."""
    high, error = two_sum(x[0], y[0])
    return two_sum(high, error + (x[1] + y[1]))
