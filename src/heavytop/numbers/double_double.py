"""Sums of two doubles that carry twice the digits, and times and angles reduced without loss.

A sum or a product of two doubles and its rounding error are both doubles (Knuth; Dekker 1971,
*Numer. Math.* 18, 224-242), so that sums of many lose next to nothing (Ogita, Rump & Oishi 2005,
*SIAM J. Sci. Comput.* 26, 1955-1988).
"""

from __future__ import annotations

from typing import Final, TypeAlias, TypeVar

import numpy as np
from flint import arb
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Words = TypeVar("Words", float, NDArray[np.float64])
DoubleDouble = tuple[float, float]

_CIRCLE: Final = 6.283185307179586
_CIRCLE_REST: Final = 2.4492935982947064e-16  # of 2π, beyond a double


def two_sum(a: Words, b: Words | float) -> tuple[Words, Words]:
    """Return a + b exactly, as rounded sum and error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Words, b: Words | float) -> tuple[Words, Words]:
    """Return a b exactly, as rounded product and error (Dekker)."""
    product = a * b
    a_high = a * 134217729.0  # 2^27 + 1
    a_high = a_high - (a_high - a)
    b_high = b * 134217729.0
    b_high = b_high - (b_high - b)
    a_low, b_low = a - a_high, b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


def add(x: tuple[Words, Words], y: tuple[Words, Words]) -> tuple[Words, Words]:
    """Return the sum of two double-doubles, to about 32 digits; arrays add elementwise."""
    high, error = two_sum(x[0], y[0])
    return two_sum(high, error + (x[1] + y[1]))


def total(first: Array, *others: Array | float) -> tuple[Array, Array]:
    """Return a sum as a double-double; what is large and cancels comes first."""
    high, low = two_sum(first, others[0])
    for term in others[1:]:
        high, error = two_sum(high, term)
        low = low + error
    return two_sum(high, low)


def double_double(x: arb) -> DoubleDouble:
    """Return the middle of a ball as the sum of two doubles."""
    high = float(x)
    return high, float(x.mid() - high)


class Linear:
    """What grows by a step at each count and at a rate with time: start + n step + t rate."""

    def __init__(self, start: arb, step: arb, rate: arb) -> None:
        self._words = double_double(start), double_double(step), double_double(rate)

    def __call__(
        self, n: Array, t: Array, t_lo: Array | float, *more: Array
    ) -> tuple[Array, Array]:
        """Return the value at the times t + t_lo, and more added to it, as double-doubles."""
        start, step, rate = self._words
        grown, rest = two_product(t, rate[0])
        stepped, error = two_product(n, step[0])
        rest = rest + error + (rate[1] * t + rate[0] * t_lo + step[1] * n + start[1])
        return total(grown, stepped, start[0], *more, rest)


def modulo_circle(high: Array, low: Array) -> Array:
    """Return an angle in [0, 2 pi): whole turns are dropped before anything is rounded."""
    turns = np.rint(high / _CIRCLE)
    dropped, error = two_product(turns, _CIRCLE)
    angle = (high - dropped) + (low - error - turns * _CIRCLE_REST)
    angle = angle - _CIRCLE * np.floor(angle / _CIRCLE)
    return np.where((angle >= 0) & (angle < _CIRCLE), angle, 0.0)


def less_multiples(t: Array, start: Array, n: Array, step: Array) -> tuple[Array, Array]:
    """Return t - start - n step as a double-double; start and step are sums of three doubles.

    Examples
    --------
    >>> third = np.array([1 / 3, 2.0**-54 / 3, 2.0**-108 / 3])
    >>> less_multiples(np.array([3e9 + 1]), np.zeros(3), np.array([9e9]), third)
    (array([1.]), array([0.]))
    """
    whole, *parts = (-part for part in _multiples(n, step))
    return total(t, whole, *-start, *parts)


def whole_multiples(n: Array, x: Array) -> tuple[NDArray[np.int64], Array]:
    """Return n x as a whole number and a rest of at most a few halves, x as before.

    Examples
    --------
    >>> third = np.array([1 / 3, 2.0**-54 / 3, 2.0**-108 / 3])
    >>> whole_multiples(np.array([1.0, 3e9 + 1]), third)
    (array([         0, 1000000000]), array([0.33333333, 0.33333333]))
    """
    parts = np.array(_multiples(n, x))
    whole = np.rint(parts)
    return whole.astype(np.int64).sum(axis=0), (parts - whole).sum(axis=0)


def _multiples(n: Array, x: Array) -> tuple[Array, ...]:
    """Return numbers that add up to n x, the largest first."""
    return *two_product(n, x[0]), *two_product(n, x[1]), n * x[2]
