"""Double-doubles: sums of two doubles with twice the digits; and angles reduced without loss.

The rounding error of a sum or a product of two doubles is a double too (Knuth; Dekker 1971, *Numer.
Math.* 18, 224-242), so that long sums lose almost nothing (Ogita, Rump & Oishi 2005, *SIAM J. Sci.
Comput.* 26, 1955-1988).
"""

from __future__ import annotations

from math import pi
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
from flint import arb
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Words: TypeAlias = tuple[Array, Array]  # arrays of high and low words
Doubles = TypeVar("Doubles", float, NDArray[np.float64])
DoubleDouble = tuple[float, float]

EPSILON: Final = 2.0**-52  # between 1 and the next double
UNIT: Final = 2.0**-53  # by which a double is rounded, at most, relative to it
PI_REST: Final = 1.2246467991473532e-16  # of π, beyond a double
_CIRCLE: Final = 2 * pi


def two_sum(a: Doubles, b: Doubles | float) -> tuple[Doubles, Doubles]:
    """Return a + b exactly, as rounded sum and error (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Doubles, b: Doubles | float) -> tuple[Doubles, Doubles]:
    """Return a b exactly, as rounded product and error (Dekker)."""
    product = a * b
    a_high: Any = upper(a)
    b_high: Any = upper(b)
    a_low, b_low = a - a_high, b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


def upper(a: Any) -> Any:
    """Return the upper 26 bits of a: products of two such numbers are exact."""
    high = a * 134217729.0  # 2^27 + 1
    return high - (high - a)


def add(x: tuple[Doubles, Doubles], y: tuple[Doubles, Doubles]) -> tuple[Doubles, Doubles]:
    """Return the sum of two double-doubles, to about 32 digits; arrays add elementwise."""
    high, error = two_sum(x[0], y[0])
    return two_sum(high, error + (x[1] + y[1]))


def multiply(x: Words, y: Words) -> Words:
    """Return the product of two double-doubles, to about 31 digits."""
    high, low = two_product(x[0], y[0])
    return two_sum(high, low + (x[0] * y[1] + x[1] * y[0]))


def total(high: Array, *others: Array | float, rest: Any = 0.0) -> Words:
    """Return a sum as a double-double; what is large and cancels comes first, small is the rest."""
    low = rest
    for term in others:
        high, error = two_sum(high, term)
        low = low + error
    return two_sum(high, low)


def double_double(x: arb) -> DoubleDouble:
    """Return the middle of a ball as the sum of two doubles."""
    high = float(x)
    return high, float(x.mid() - high)


class Linear:
    """The function start + n step + t rate, with constants of double-double precision."""

    def __init__(self, start: arb, step: arb, rate: arb) -> None:
        self._words = double_double(start), double_double(step), double_double(rate)

    def __call__(self, n: Array, t: Array, t_lo: Array | float, *more: Array) -> Words:
        """Return the value at the times t + t_lo plus further summands, as double-doubles."""
        start, step, rate = self._words
        in_time, rest = two_product(t, rate[0])
        in_steps, error = two_product(n, step[0])
        rest = rest + error + (rate[1] * t + rate[0] * t_lo + step[1] * n + start[1])
        return total(in_time, in_steps, start[0], *more, rest=rest)


def modulo_circle(high: Array, low: Array) -> Array:
    """Return an angle in [0, 2 pi): whole turns are dropped before anything is rounded."""
    turns = np.rint(high / _CIRCLE)
    dropped, error = two_product(turns, _CIRCLE)
    angle = (high - dropped) + (low - error - turns * (2 * PI_REST))
    angle = angle - _CIRCLE * np.floor(angle / _CIRCLE)
    return np.where((angle >= 0) & (angle < _CIRCLE), angle, 0.0)


def add_turns(angle: Array, turns: Array) -> Array:
    """Return an angle plus many whole turns, rounded as if both were exact."""
    whole, rest = two_product(turns, _CIRCLE)
    return whole + (rest + turns * (2 * PI_REST) + angle)


def long_epsilon() -> float:
    """Return the relative spacing of long doubles on this machine."""
    return float(np.finfo(np.longdouble).eps)
