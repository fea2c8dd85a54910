"""Sums of two doubles that carry twice the digits, and times and angles reduced without loss.

A sum or a product of two doubles and its rounding error are both doubles (Knuth; Dekker 1971,
*Numer. Math.* 18, 224-242). Cody and Waite's reduction t - n x cuts x into parts with so few bits
that n times a part is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np
from flint import arb
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Words = TypeVar("Words", float, NDArray[np.float64])
DoubleDouble = tuple[float, float]
ThreeWords: TypeAlias = tuple[float, float, float]

MOST_SHORT = 2**32
"""Counts up to which products with a part of `PART_BITS` bits are exact."""

PART_BITS = 21


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


def double_double(x: arb) -> DoubleDouble:
    """Return the middle of a ball as the sum of two doubles."""
    high = float(x)
    return high, float(x.mid() - high)


@dataclass(frozen=True, slots=True)
class ShortMultiples:
    """Multiples of a constant whose counts are below 2^32: each product with a part is exact.

    The constant is the sum of its parts, all of `PART_BITS` bits but the last.
    """

    parts: tuple[float, ...]

    @classmethod
    def of(cls, x: arb) -> ShortMultiples:
        """Return those of the middle of a ball, inside ``working(bits)``."""
        rest, found = x.mid(), []
        for _ in range(3):
            man, exp = (int(each) for each in rest.man_exp())
            unit = arb(2) ** (man.bit_length() + exp - PART_BITS)
            part = (rest / unit + arb(0.5)).floor() * unit
            found.append(float(part))
            rest = rest - part
        return cls((*found, float(rest)))

    def rest(
        self, t: Array, t_lo: Array | float, n: Array, since: DoubleDouble
    ) -> tuple[Array, Array]:
        """Return t + t_lo - n x + since, as double-doubles."""
        total, rest = two_sum(t, t_lo)
        rest = rest + (since[1] - n * self.parts[3])
        for part in self.parts[:3]:
            total, error = two_sum(total, -n * part)
            rest = rest + error
        total, error = two_sum(total, since[0])
        return two_sum(total, rest + error)


class CountedAngle:
    """An angle start + n step + rate t + local [rad] that has turned many times.

    Everything is added up without loss, and rounded once. Counts n are below 2^32.
    """

    def __init__(self, start: arb, step: arb, rate: arb) -> None:
        circle = 2 * arb.pi()
        turns = start / circle
        self._whole = double_double(start), ShortMultiples.of(step).parts, double_double(rate)
        self._turns = (
            double_double(turns - (turns.mid() + arb(0.5)).floor()),
            ShortMultiples.of(step / circle).parts,
            double_double(rate / circle),
        )

    def whole(self, n: Array, t: Array, t_lo: Array, local: Array) -> Array:
        """Return the angle at the times t + t_lo, continuous."""
        start, step, rate = self._whole
        total, rest = two_product(t, rate[0])
        rest = rest + (rate[1] * t + rate[0] * t_lo + start[1] + n * step[3])
        for term in (n * step[0], n * step[1], n * step[2], start[0], local):
            total, error = two_sum(total, term)
            rest = rest + error
        return total + rest

    def modulo(self, n: Array, t: Array, t_lo: Array, local: Array) -> Array:
        """Return the angle in [0, 2 pi): whole turns are dropped before anything is rounded."""
        start, step, rate = self._turns
        total, rest = two_product(t, rate[0])
        total = total - np.rint(total)
        rest = rest + (rate[1] * t + rate[0] * t_lo + start[1] + n * step[3])
        for part in step[:3]:
            total, error = two_sum(total, n * part - np.rint(n * part))
            rest = rest + error
        total = total + start[0] + rest
        circle = 2 * np.pi
        angle = np.mod(circle * (total - np.rint(total)) + local, circle)
        return np.where(angle >= circle, 0.0, angle)


@dataclass(frozen=True, slots=True)
class Multiples:
    """Multiples of a constant, as many as a double can count, to the last digit of a double.

    The constant is the sum of three doubles, 159 bits; products are exact as pairs of doubles.

    Examples
    --------
    >>> third = Multiples((1 / 3, 2.0**-54 / 3, 2.0**-108 / 3))
    >>> third.rest(np.array([1e9]), np.array([3e9 + 1]))[0]
    array([-0.33333333])
    >>> third.turns(np.array([1.0, 3e9 + 1]))
    (array([         0, 1000000000]), array([0.33333333, 0.33333333]))
    """

    words: ThreeWords

    def rest(self, t: Array, n: Array, since: ThreeWords = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
        """Return t - since - n x, as double-doubles."""
        rest = two_sum(t, -since[0])
        for part in (*self._parts(n), *(np.full_like(t, word) for word in since[1:])):
            rest = add(rest, (-part, np.zeros_like(t)))
        return rest

    def turns(self, n: Array) -> tuple[NDArray[np.int64], Array]:
        """Return n x as a whole number and a rest of at most a few halves."""
        parts = self._parts(n)
        whole = [np.rint(part) for part in parts]
        rest = sum((part - w for part, w in zip(parts, whole, strict=True)), np.zeros_like(n))
        return sum((w.astype(np.int64) for w in whole), np.zeros(n.shape, np.int64)), rest

    def _parts(self, n: Array) -> tuple[Array, ...]:
        """Return numbers that add up to n x, the largest first."""
        first, second, third = self.words
        return *two_product(n, first), *two_product(n, second), n * third
