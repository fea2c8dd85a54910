"""Numbers of the closed form that are arrays of doubles; times, z and long sums are pairs of them.

A pair is high + low. The constants are known to 40 digits, so that those of 2³¹ periods have their
digits.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from fractions import Fraction
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

KNOWN: Final = 10.0**-40  # what is not known of a constant, beside it
SMALL_SQUARE: Final = 1e-280  # squares beside which one that is no double any more does not count
TURNING_EDGE: Final = 1e-30  # what z is not known to at a turning point, beside what it comes from
LARGEST_Z: Final = 700.0  # z whose sinh is a double; sech is nothing beyond
BIG: Final = 1e300  # the nome has made nothing of such squares long before

MOST_PERIODS: Final = 2**31
"""Periods up to which times are reduced without loss; beyond, each is computed in balls."""

FARTHEST: Final = 2**62
"""Periods that are counted."""

TIMES_AT_ONCE: Final = 16384
"""Times computed at once, so that what is computed with them stays in the processor's cache."""

VECTOR_SHAPES: Final = {"axis": (3,), "quaternion": (4,), "omega": (3,)}
NO_TIMES: Final = "t: finite times; texts and exact numbers go with digits="
LATE_DIGITS: Final = 20  # of what is computed in balls for doubles

bits: Final = 64
quietly: Final = np.errstate(over="ignore", invalid="ignore")
atan2, sqrt = np.arctan2, np.sqrt


@quietly
def read_doubles(motion: ClosedForm, t: Any, t_lo: Any) -> Read:
    """The numbers of a motion at the times t + t_lo, in doubles."""
    time, low, shape = _times(t, t_lo)
    latest, period = abs(time).max(initial=0.0), motion.period or np.inf
    if latest > FARTHEST * period:
        raise NoClosedForm(f"more than {FARTHEST} periods in doubles: ask for digits instead")
    late = latest >= MOST_PERIODS * period
    if late or time.size <= 1:  # of one time all are scalars, which is several times as fast
        parts: Any = range(time.size)
    else:
        parts = [slice(at, at + TIMES_AT_ONCE) for at in range(0, time.size, TIMES_AT_ONCE)]

    made = dict[Constants, list[Any]]()

    def points(c: Constants) -> list[Any]:
        if c not in made:
            at = late_at if late else motion.form(c, sys.modules[__name__])
            made[c] = [at((time[part], low[part])) for part in parts]
        return made[c]

    def late_at(t: tuple[float, float]) -> Any:
        return motion.at(Fraction(t[0]) + Fraction(t[1]), LATE_DIGITS)

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
    """Finite times in one row, each the double nearest t + t_lo and the rest; their shape."""
    try:
        time, low = np.asarray(t, np.float64), np.asarray(t_lo, np.float64)
        time, low = map(np.asarray, pairs.two_sum(time, low))
        if not np.isfinite(time).all():
            raise NotANumber("t: finite times")
    except (TypeError, ValueError, OverflowError):  # of no float; shapes that do not fit
        raise NotANumber(NO_TIMES) from None
    return time.ravel(), low.ravel(), time.shape


# --- the functions that `balls` has too -----------------------------------------------------------


def number(x: arb, beside: Any = 0) -> float:
    """A constant that is known well enough, beside what it is added to."""
    return float(as_ball(x, beside))


def scaled(size: Any, row: list[arb]) -> list[float]:
    """Constants times a size that is known well enough, as they are then beside it."""
    row = [size * x for x in row]
    beside = abs(size)
    for x in row:
        if not x.rad() <= beside * KNOWN:
            as_ball(x, beside)
    return list(map(float, row))


def as_ball(x: arb, beside: Any = 0) -> arb:
    """The same as a ball."""
    if not x.rad() <= (abs(x) + beside) * KNOWN:
        raise TooFewBits("a constant of the closed form and 0", x)
    return x


def to_number(x: Any) -> Any:
    """The nearest double of a pair."""
    return x[0]


def modulo_circle(x: Any) -> Any:
    """An angle, which is a pair, in [0, 2π)."""
    return pairs.modulo_circle(*x)


def sin_cos(x: Any) -> tuple[Any, Any]:
    """Sine and cosine of an angle, which is a pair."""
    high, low = x
    sin, cos = np.sin(high), np.cos(high)
    half = low / 2  # after 2³¹ periods low is 1e-5
    return sin + low * (cos - half * sin), cos - low * (sin + half * cos)


def linear(start: arb, step: arb, rate: arb, slowest: Any = 0) -> Callable[..., Any]:
    """The pair start + n step + rate t, and what else is given; t is a pair."""
    one = 1 if slowest else 0
    summed = pairs.Linear(as_ball(start, one), as_ball(step, one), as_ball(rate, slowest))
    return lambda n, t, *more: summed(n, *t, *more)


def half_sum(x: Any, y: Any, sign: int) -> Any:
    """Half of x ± y, which are pairs."""
    return pairs.add((x[0] / 2, x[1] / 2), (sign * y[0] / 2, sign * y[1] / 2))


def nearest(c: Constants, z: Callable[..., Any]) -> Callable[[Any], tuple[Any, ...]]:
    """From times to the numbers of the turning points nearest, whether of u₂, and z since those."""
    zero = np.float64(0)
    if c.w.is_zero():
        return lambda t: (zero, zero > 0, (zero, zero))
    steps, ahead = (0.0, 0.0) if c.period is None else (float(2 / c.period), float(c.x0 / c.half))
    rate, size = float(c.rate), abs(float(c.x0))

    def locate(t: Any) -> tuple[Any, ...]:
        n = np.rint(t[0] * steps + ahead) if steps else zero
        high, low = z(n, t)
        # a turning point counts as passed at it: at an exact pass what follows has begun
        at_it = abs(high) <= TURNING_EDGE * (abs(rate * t[0]) + size)
        half = (n + c.first) / 2
        return n, half != np.floor(half), (np.where(at_it, 0.0, high), np.where(at_it, 0.0, low))

    return locate


def argument(z: Any, hyperbolic: bool) -> tuple[Any, Any, Any]:
    """S, C and S² of sin and cos, or S, C and −S² of sinh and cosh."""
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
    """The times beside u₁ and those beside u₂: where they are, which side, and the arguments."""
    count = np.count_nonzero(upper)
    if count in (0, upper.size):
        return [(None, count > 0, argument(z, hyperbolic))]
    each = ((~upper).nonzero(), False), (upper.nonzero(), True)
    return [(at, side, argument((z[0][at], z[1][at]), hyperbolic)) for at, side in each]


def join(upper: Any, parts: list[Any]) -> Any:
    """The values of all sides together."""
    if len(parts) == 1:
        return parts[0][1]
    joined = np.empty(upper.shape)
    for where, values in parts:
        joined[where] = values
    return joined


def sign(x: Any, at_zero: int) -> Any:
    """The sign of x, also of a zero."""
    return np.copysign(1.0, x)


def length(least: float, square: float, leg: Any) -> Any:
    """√(least² + leg²)."""
    return np.sqrt(square + leg * leg) if square > SMALL_SQUARE else np.hypot(least, leg)


def cosine(one_minus_u: Any, one_plus_u: Any) -> Any:
    """The cosine of θ from its distances from ±1, the less of which counts."""
    return np.where(one_minus_u < one_plus_u, 1 - one_minus_u, one_plus_u - 1)
