"""Arrays of doubles with proved bounds on their rounding errors.

Every number x is known by a double v and a size S, both arrays, and one count n for all:

    |v| ≤ S,   |v − x| ≤ n u S,   u = 2⁻⁵³.

Most numbers here are products of what is given; S is then |v| itself, and is not stored. It is
stored where terms may have cancelled. Rounding to nearest is monotonic, (1 + δ) times the exact
result with |δ| ≤ u, and 2⁻¹⁰⁷⁵ beside it for products below the normal range; sums have no such
addition. With n < 2²⁰ and S ≥ 2⁻⁹⁶⁰, where it is not 0, that gives

    x₁ + x₂   v = fl(v₁ + v₂), S = fl(S₁ + S₂), n = max(n₁, n₂) + 2, for
              |v − x₁ − x₂| ≤ (1 + max(n₁, n₂)) u (S₁ + S₂) and S₁ + S₂ ≤ S (1 + u);
    x₁ x₂     v = fl(v₁ v₂), S = fl(S₁ S₂), n = n₁ + n₂ + 2, for
              |v − x₁ x₂| ≤ (1 + n₁ + n₂ + n₁ n₂ u) u S₁ S₂ + 2⁻¹⁰⁷⁵, n₁ n₂ u < 2⁻¹³;
    x₁ / x₂   of relatively exact numbers (S = |v|): n = n₁ + n₂ + 2 as well;
    √x        of one: n = ⌊n/2⌋ + 2, for √(1 + ε) is within |ε|/2 + ε² of 1.

Where v₁, v₂ ≥ 0 are relatively exact, so is their sum. Nothing overflows, and S stays in its
range, for `low` and `high` are kept: 2^low ≤ S ≤ 2^high where S is not 0, and all becomes nan,
of which nothing is ever decided, where they leave ±960. S = 0 means that x is 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = "NDArray[np.float64]"
Mask: TypeAlias = "NDArray[np.bool_]"

GIVEN: Final = 100
"""What is given is 0 or of a magnitude within 2⁻¹⁰⁰ … 2¹⁰⁰ (8e-31 … 1e30), or is left open."""

_U: Final = 2.0**-53
_RANGE: Final = 960  # of exponents
_ROOM: Final = 40
_MOST_ULPS: Final = 2**20


@dataclass(frozen=True, slots=True)
class Bounded:
    """An array of numbers x, each within ``bound`` of ``value``.

    Parameters
    ----------
    value : ndarray of float
        The doubles v; nan where nothing is known.
    ulps : int
        n, with |v − x| ≤ n 2⁻⁵³ S.
    low, high : int
        Exponents of the range of S, where it is not 0.
    size : ndarray of float, optional
        S where it is not |v|.
    positive : bool
        Whether no v is negative.
    """

    value: Array
    ulps: int
    low: int
    high: int
    size: Array | None = None
    positive: bool = False

    @staticmethod
    def of(value: Array, positive: bool = False) -> Bounded:
        """The numbers that are exactly these doubles.

        Parameters
        ----------
        value : ndarray of float
            Any doubles; those out of range, and nan, are left open.
        positive : bool
            Whether they are meant not to be negative: those that are, are left open.
        """
        size = value if positive else np.abs(value)
        fits = (size >= 2.0**-GIVEN) & (size <= 2.0**GIVEN)
        if not fits.all():
            fits |= size == 0
            value = np.where(fits, value, np.nan)
        return Bounded(value, 0, -GIVEN, GIVEN, positive=positive)

    @property
    def magnitude(self) -> Array:
        """S ≥ |v|."""
        if self.size is not None:
            return self.size
        return self.value if self.positive else np.abs(self.value)

    @property
    def bound(self) -> Array:
        """What |v − x| is at most; the spare ulp is for the rounding of the bound itself."""
        return ((self.ulps + 1) * _U if self.ulps else 0.0) * self.magnitude

    @property
    def least(self) -> Array:
        """What |x| is at least, but for two roundings; positive just where |v| > bound."""
        if self.size is None:
            return self.magnitude * (1 - (self.ulps + 1) * _U)
        return np.abs(self.value) - self.bound

    @property
    def most(self) -> Array:
        """What |x| is at most, but for two roundings; 0 just where x is known to be 0."""
        if self.size is None:
            return self.magnitude * (1 + (self.ulps + 1) * _U)
        return np.abs(self.value) + self.bound

    def __add__(self, other: Bounded) -> Bounded:
        ulps, high = max(self.ulps, other.ulps) + 2, max(self.high, other.high) + 1
        low = min(self.low, other.low)
        value = self.value + other.value
        positive = self.positive and other.positive
        if positive and self.size is None and other.size is None:
            return _inside(value, ulps, low, high, None, True)
        size = self.magnitude + other.magnitude
        return _inside(value, ulps, low, high, size, positive)

    def __sub__(self, other: Bounded) -> Bounded:
        return self + -other

    def __neg__(self) -> Bounded:
        return Bounded(-self.value, self.ulps, self.low, self.high, self.size)

    def __abs__(self) -> Bounded:
        value = self.value if self.positive else np.abs(self.value)
        return Bounded(value, self.ulps, self.low, self.high, self.size, True)

    def __mul__(self, other: Bounded) -> Bounded:
        ulps, positive = self.ulps + other.ulps + 2, self.positive and other.positive
        size = None
        if self.size is not None or other.size is not None:
            size = self.magnitude * other.magnitude
        low, high = self.low + other.low, self.high + other.high
        return _inside(self.value * other.value, ulps, low, high, size, positive or other is self)

    def __rmul__(self, factor: int) -> Bounded:
        """An integer times the numbers; above 2⁵³ it is rounded too."""
        known = np.array([float(factor)])
        ulps = 0 if int(known[0]) == factor else 1
        return self * Bounded(known, ulps, 0, abs(factor).bit_length(), positive=factor >= 0)

    def __truediv__(self, other: Bounded) -> Bounded:
        """A quotient of relatively exact numbers; where the divisor is 0 it is left open."""
        _relative(self, other)
        ulps, positive = self.ulps + other.ulps + 2, self.positive and other.positive
        low, high = self.low - other.high, self.high - other.low
        value = np.where(other.value == 0, np.nan, self.value / other.value)
        return _inside(value, ulps, low, high, None, positive)

    def scaled(self, factor: Array, high: int) -> Bounded:
        """The numbers times powers of 2, to be added to others of order 1.

        S is taken for 2⁻⁴⁰ at least, which leaves room for products of many of them; those that
        come out above 2^high are left open.
        """
        size = np.maximum(self.magnitude * factor, 2.0**-_ROOM)
        value = np.where(size <= 2.0**high, self.value * factor, np.nan)
        return Bounded(value, self.ulps + 1, -_ROOM, high, size, self.positive)

    def sqrt(self) -> Bounded:
        """The square root of relatively exact numbers that are not negative."""
        _relative(self)
        low, high = self.low // 2, -(-self.high // 2)
        return _inside(np.sqrt(self.value), self.ulps // 2 + 2, low, high, None, True)


def total(terms: tuple[Bounded, ...]) -> Bounded:
    """The sum of some terms."""
    first, *rest = terms
    return sum(rest, first)


def _inside(
    value: Array, ulps: int, low: int, high: int, size: Array | None, positive: bool
) -> Bounded:
    if low < -_RANGE or high > _RANGE or ulps > _MOST_ULPS:
        value = np.full_like(value, np.nan)
    return Bounded(value, ulps, low, high, size, positive)


def _relative(*numbers: Bounded) -> None:
    if any(number.size is not None for number in numbers):
        raise ValueError("a sum that may cancel is neither divided nor put under a root")
