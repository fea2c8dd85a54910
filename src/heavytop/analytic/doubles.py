"""The arithmetic of the closed form in arrays of doubles; times, z and angles are pairs of them.

A pair is high + low. Constants have 40 digits, so that no digits are lost over 2³¹ periods.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from flint import arb

from heavytop.analytic.constants import Constants
from heavytop.analytic.roots import TooFewBits
from heavytop.errors import NoClosedForm, NotANumber
from heavytop.exact import pairs

if TYPE_CHECKING:
    from heavytop.analytic.form import Read
    from heavytop.analytic.motion import ClosedForm

KNOWN: Final = 10.0**-40  # error of a constant, relative
SMALL_SQUARE: Final = 1e-280  # above it an underflow of the other square does no harm
TURNING_EDGE: Final = 1e-30  # error of z at a turning point, relative to the terms it is a sum of
LARGEST_Z: Final = 700.0  # sinh z is finite; beyond, sech z is 0
BIG: Final = 1e300  # bound of sinh² z: beside it powers of the nome are 0 already

MOST_PERIODS: Final = 2**31
"""Periods up to which times are reduced without loss; beyond, each is computed in balls."""

FARTHEST: Final = 2**62
"""Periods beyond which no time is reduced."""

TIMES_AT_ONCE: Final = 16384
"""Times computed at once: their intermediate results stay in the processor's cache."""

VECTOR_SHAPES: Final = {"axis": (3,), "quaternion": (4,), "omega": (3,)}
NO_TIMES: Final = "t: finite times; texts and exact numbers go with digits="
LATE_DIGITS: Final = 20  # of numbers that are computed in balls and rounded to doubles

bits: Final = 64  # series take as many terms as these need
quietly: Final = np.errstate(over="ignore", invalid="ignore")
atan2, sqrt = np.arctan2, np.sqrt


@quietly
def read_doubles(motion: ClosedForm, t: Any, t_lo: Any) -> Read:
    """The function from the name of a quantity to its values at the times t + t_lo, in doubles."""
    time, low, shape = _times(t, t_lo)
    latest, period = abs(time).max(initial=0.0), motion.period or np.inf
    if latest > FARTHEST * period:
        raise NoClosedForm(f"more than {FARTHEST} periods in doubles: ask for digits instead")
    late = latest >= MOST_PERIODS * period
    if late or time.size <= 1:  # one time is computed in scalars, several times as fast
        parts: Any = range(time.size)
    else:
        parts = [slice(at, at + TIMES_AT_ONCE) for at in range(0, time.size, TIMES_AT_ONCE)]

    def late_at(t: tuple[float, float]) -> Any:
        return motion.at(Fraction(t[0]) + Fraction(t[1]), LATE_DIGITS)

    @cache
    def points(c: Constants) -> list[Any]:
        at = late_at if late else motion.form(c, sys.modules[__name__])
        return [at((time[part], low[part])) for part in parts]

    @quietly
    def read(name: str) -> Any:
        if name == "t":
            return time.reshape(shape)
        if name == "energy":
            return np.full(shape, float(motion.energy(17)))
        wide = VECTOR_SHAPES.get(name, ())
        found = np.empty((time.size, *wide))
        values = motion.refine(name, lambda c: [getattr(point, name) for point in points(c)])
        for part, value in zip(parts, values, strict=True):
            for column, each in zip(found.T, value, strict=True) if wide else [(found, value)]:
                column[part] = each
        if np.count_nonzero(np.isfinite(found)) < found.size:  # faster than all()
            raise NoClosedForm(f"{name} is too large for doubles: ask for digits instead")
        return found.reshape(shape + wide)

    return read


def _times(t: Any, t_lo: Any) -> tuple[Any, Any, tuple[int, ...]]:
    """The doubles nearest to t + t_lo and the remainders, each in one row, and their shape."""
    try:
        time, low = np.asarray(t, np.float64), np.asarray(t_lo, np.float64)
        time, low = map(np.asarray, pairs.two_sum(time, low))
        if not np.isfinite(time).all():
            raise NotANumber("t: finite times")
    except (TypeError, ValueError, OverflowError):  # no float, or shapes that do not broadcast
        raise NotANumber(NO_TIMES) from None
    return time.ravel(), low.ravel(), time.shape


# --- the functions that `balls` has too -----------------------------------------------------------
# What is known of a constant is judged beside what it is added to, `beside` or `slowest`.


def number(x: arb, beside: Any = 0) -> float:
    """A constant as a double."""
    return float(precise_ball(x, beside))


def scaled(size: Any, row: list[arb]) -> list[float]:
    """Constants times a size."""
    row, beside = [size * x for x in row], abs(size)
    limit = beside * KNOWN
    return [float(x if x.rad() <= limit else precise_ball(x, beside)) for x in row]


def precise_ball(x: arb, beside: Any = 0) -> arb:
    """Return a constant; raise `TooFewBits` where its error is above `KNOWN`."""
    if not x.rad() <= (abs(x) + beside) * KNOWN:
        raise TooFewBits("a constant of the closed form and 0", x)
    return x


def to_number(x: Any) -> Any:
    """The result of `linear`, a pair, as the nearest double."""
    return x[0]


def modulo_circle(x: Any) -> Any:
    """An angle, which is a pair, less whole turns: in [0, 2π)."""
    return pairs.modulo_circle(*x)


def sin_cos(x: Any) -> tuple[Any, Any]:
    """Sine and cosine of an angle, which is a pair."""
    high, low = x
    sin, cos = np.sin(high), np.cos(high)
    half = low / 2  # low is 1e-5 after 2³¹ periods
    return sin + low * (cos - half * sin), cos - low * (sin + half * cos)


def linear(start: arb, step: arb, rate: arb, slowest: Any = 0) -> Callable[..., Any]:
    """Return the function of n, t and further summands: start + n step + rate t + their sum.

    t and the result are pairs.
    """
    one = 1 if slowest else 0
    terms = precise_ball(start, one), precise_ball(step, one), precise_ball(rate, slowest)
    total = pairs.Linear(*terms)
    return lambda n, t, *more: total(n, *t, *more)


def half_sum(x: Any, y: Any, sign: int) -> Any:
    """Half of x ± y, which are results of `linear`: pairs."""
    return pairs.add((x[0] / 2, x[1] / 2), (sign * y[0] / 2, sign * y[1] / 2))


def nearest(c: Constants, z: Callable[..., Any]) -> Callable[[Any], tuple[Any, ...]]:
    """Return the function of t: the number of the nearest turning point, whether of u₂, and z."""
    zero = np.float64(0)
    if c.w.is_zero():
        return lambda t: (zero, zero > 0, (zero, zero))
    steps, ahead = (0.0, 0.0) if c.period is None else (float(2 / c.period), float(c.x0 / c.half))
    rate, size = float(c.rate), abs(float(c.x0))

    def locate(t: Any) -> tuple[Any, ...]:
        n = np.rint(t[0] * steps + ahead) if steps else zero
        high, low = z(n, t)
        # near a turning point z is exactly 0, so that an exact pass through a pole has happened
        at_it = abs(high) <= TURNING_EDGE * (abs(rate * t[0]) + size)
        half = (n + c.first) / 2
        return n, half != np.floor(half), (np.where(at_it, 0.0, high), np.where(at_it, 0.0, low))

    return locate


def argument(z: Any, hyperbolic: bool) -> tuple[Any, Any, Any]:
    """The arguments of a `Series`: sin z, cos z, sin² z, or sinh z, cosh z, −sinh² z."""
    z, low = z
    if not hyperbolic:
        S, C = np.sin(z), np.cos(z)
        S, C = S + C * low, C - S * low
        return S, C, S * S
    z = np.clip(z, -LARGEST_Z, LARGEST_Z)
    S, C = np.sinh(z), np.cosh(z)
    S, C = S + C * low, C + S * low
    return S, C, np.maximum(-S * S, -BIG)


def sides(upper: Any, z: Any, hyperbolic: bool) -> list[Any]:
    """For each side of turning points: the index of its times, whether of u₂, the arguments."""
    count = np.count_nonzero(upper)
    if count in (0, upper.size):
        return [(None, count > 0, argument(z, hyperbolic))]
    each = ((~upper).nonzero(), False), (upper.nonzero(), True)
    return [(at, side, argument((z[0][at], z[1][at]), hyperbolic)) for at, side in each]


def join(upper: Any, parts: list[Any]) -> Any:
    """The values of all sides in one array."""
    if len(parts) == 1:
        return parts[0][1]
    joined = np.empty(upper.shape)
    for where, values in parts:
        joined[where] = values
    return joined


def sign(x: Any, at_zero: int) -> Any:
    """The sign of x, −1 of −0."""
    return np.copysign(1.0, x)


def length(least: float, square: float, leg: Any) -> Any:
    """√(least² + leg²)."""
    return np.sqrt(square + leg * leg) if square > SMALL_SQUARE else np.hypot(least, leg)


def cosine(one_minus_u: Any, one_plus_u: Any) -> Any:
    """The cosine of θ from its distances from ±1, by the smaller of them."""
    return np.where(one_minus_u < one_plus_u, 1 - one_minus_u, one_plus_u - 1)
