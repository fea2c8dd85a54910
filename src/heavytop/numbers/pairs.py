"""Arrays of numbers with twice the digits of a double, each the unevaluated sum of two doubles.

A sum or a product of two doubles and its rounding error are both doubles (Knuth; Dekker 1971,
*Numer. Math.* 18, 224–242), and arithmetic with about 32 digits is made of these. It serves where
an angle is a small difference of large ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import factorial
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.numbers.decimals import Number

Array: TypeAlias = npt.NDArray[np.float64]
"""Doubles, one for each time."""

Doubles: TypeAlias = "Array | float"

_SPLIT = 134217729.0  # 2²⁷ + 1
_TERMS = 15  # of the sine of an angle up to 1, to 1e-33
_LONG = 9  # of which the others are less than 1e-15


def two_sum(a: Doubles, b: Doubles) -> tuple[Doubles, Doubles]:
    """The sum a + b, and the rounding error of that sum, exactly (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Doubles, b: Doubles) -> tuple[Doubles, Doubles]:
    """The product a × b, and the rounding error of that product, exactly (Dekker)."""
    product = a * b
    a1 = a * _SPLIT
    a1 = a1 - (a1 - a)
    b1 = b * _SPLIT
    b1 = b1 - (b1 - b)
    a2, b2 = a - a1, b - b1
    return product, a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2)


@dataclass(frozen=True, slots=True)
class Pairs:
    """Numbers hi + lo, with |lo| at most half a unit in the last place of hi.

    Parameters
    ----------
    hi, lo : array or float
        The two parts.

    Notes
    -----
    Accuracy: 1e-30 relative in every operation and function, 1e-29 in the hyperbolic ones, by
    ``tests/analytic/test_pairs.py``.
    """

    hi: Doubles
    lo: Doubles

    @classmethod
    def of(cls, value: Number) -> Pairs:
        """A number of an mpmath context, or a fraction."""
        hi = float(value)
        return cls(hi, float(value - type(value)(hi)))

    def __add__(self, other: Pairs) -> Pairs:
        hi, error = two_sum(self.hi, other.hi)
        lo, rest = two_sum(self.lo, other.lo)
        hi, error = two_sum(hi, error + lo)
        return Pairs(*two_sum(hi, error + rest))

    def __neg__(self) -> Pairs:
        return Pairs(-self.hi, -self.lo)

    def __sub__(self, other: Pairs) -> Pairs:
        return self + -other

    def __mul__(self, other: Pairs) -> Pairs:
        hi, error = two_product(self.hi, other.hi)
        return Pairs(*two_sum(hi, error + (self.hi * other.lo + self.lo * other.hi)))


def sin_cos(z: Pairs) -> tuple[Pairs, Pairs]:
    """Sine and cosine, for |z| ≤ 1.

    Parameters
    ----------
    z : Pairs
        The angles [rad].
    """
    return _odd_even(z, -(z * z))


def sinh_cosh(z: Pairs) -> tuple[Pairs, Pairs]:
    """Hyperbolic sine and cosine, for |z| ≤ 300.

    Parameters
    ----------
    z : Pairs
        The arguments. With k = z/ln 2 to the nearest integer, sinh z and cosh z are those of k ln 2
        and of the rest, added up.
    """
    k = np.rint(np.asarray(z.hi) / _LN2.hi)
    rest = z - Pairs(k, 0.0 * k) * _LN2
    odd, even = _odd_even(rest, rest * rest)
    power = k.astype(np.int64)
    up, down = np.ldexp(0.5, power), np.ldexp(0.5, -power)
    sinh, cosh = Pairs(*two_sum(up, -down)), Pairs(*two_sum(up, down))
    return odd * cosh + even * sinh, even * cosh + odd * sinh


def arctangent(y: Pairs, x: Pairs) -> Pairs:
    """The angle of the point (x, y) [rad], for x ≥ 0.

    Parameters
    ----------
    y, x : Pairs
        The coordinates; both zero give zero.
    """
    angle = np.arctan2(y.hi, x.hi)
    s, c = sin_cos(Pairs(angle / 2, 0.0 * angle))
    sine, cosine = _TWO * s * c, _ONE - _TWO * s * s
    across = y * cosine - x * sine
    along = x.hi * cosine.hi + y.hi * sine.hi
    return Pairs(*two_sum(angle, across.hi / np.where(along == 0, 1.0, along)))


def _odd_even(z: Pairs, square: Pairs) -> tuple[Pairs, Pairs]:
    """Σ z s^k/(2k + 1)! and Σ s^k/(2k)! of a square s = ±z²."""
    odd, even = (_plain(terms[_LONG:], square.hi) for terms in (_ODD, _EVEN))
    for a, b in zip(_ODD[_LONG - 1 :: -1], _EVEN[_LONG - 1 :: -1], strict=True):
        odd, even = a + square * odd, b + square * even
    return z * odd, even


def _plain(terms: list[Pairs], square: Doubles) -> Pairs:
    """The last terms, in doubles."""
    total: Doubles = 0.0 * square
    for a in reversed(terms):
        total = a.hi + square * total
    return Pairs(total, 0.0 * square)


_ONE, _TWO = Pairs(1.0, 0.0), Pairs(2.0, 0.0)
_LN2 = Pairs(0.6931471805599453, 2.3190468138462996e-17)
_ODD = [Pairs.of(Fraction(1, factorial(2 * k + 1))) for k in range(_TERMS)]
_EVEN = [Pairs.of(Fraction(1, factorial(2 * k))) for k in range(_TERMS)]
QUARTER_TURN = Pairs(1.5707963267948966, 6.123233995736766e-17)
"""½π."""
