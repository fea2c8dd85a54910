"""The closed form at rising precision: the bits are doubled until a result has its digits."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from functools import cache, cached_property
from operator import attrgetter
from typing import Any, Final, TypeVar

from flint import arb, ctx

from heavytop.analytic import balls
from heavytop.analytic.constants import Constants
from heavytop.analytic.form import Form
from heavytop.analytic.roots import TooFewBits
from heavytop.classification.reduced import FEW_BITS, MOST_SIGN_BITS, Reduced, ReducedMotion, Regime
from heavytop.errors import Unseparated
from heavytop.exact import Exact
from heavytop.exact.balls import ball_of, bound_of, working
from heavytop.exact.number import rational, rational_value
from heavytop.scene.quantities import RATES

T = TypeVar("T")
SPARE_BITS: Final = 40  # beyond those of the digits: enough for most motions
EARLY_BITS: Final = 16  # of the spare bits, for times up to 2¹⁶ radians
LATE_BITS: Final = 64  # later times add a multiple of it, so that near times share constants
LOG10_2: Final = math.log10(2)

RELATIVE: Final = (
    "a fact", "nearest", "modulus", "amplitude", "theta", "one_minus_u", "one_plus_u",
    "precession", "spin", "relative_spin", "mean_rates",
)  # fmt: skip
"""Numbers with relative digits; the digits of all others are relative to max(1, |x|).

So are those of numbers that `MOST_SIGN_BITS` bits do not separate from 0. Digits of rates in a
motion slower than 1 rad/s are relative to its fastest rate.
"""


class Refined:
    """A motion whose numbers are known to any digits.

    Parameters
    ----------
    source : ReducedMotion
        Its exact numbers.
    """

    limit: int = 1 << 16  # bits at which to give up

    def __init__(self, source: ReducedMotion) -> None:
        self.source = source

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.source,)  # what was computed is not copied

    @cached_property
    def regime(self) -> Regime:
        """What is exactly 0 in the motion; a number that is not separated from 0 counts as 0."""
        with working(FEW_BITS):
            return Regime.of(self.source, self._start, self.vanishes)

    def vanishes(self, name: str) -> bool:
        """Whether a number of the reduced motion is 0, or cannot be separated from 0.

        To be called at the working precision `FEW_BITS`.
        """
        side = self.source.sign(attrgetter(name), self._start)
        if side is None and "doubt" not in self._cache:
            size, bound = self.source.bound(attrgetter(name))
            with_bits = f"with {MOST_SIGN_BITS} bits, and could not be proved to be 0"
            self._cache["doubt"] = Unseparated(f"{name} is less than {size} {with_bits}", bound)
        return not side

    @property
    def doubt(self) -> Unseparated | None:
        """The error that a number was taken for 0 without a proof; None where none was."""
        _ = self.regime  # reading it may set a doubt
        found: Unseparated | None = self._cache.get("doubt")
        return found

    def refine(
        self,
        what: str,
        value: Callable[[Constants], T],
        digits: int | None = None,
        late: float = 0.0,
    ) -> T:
        """Return the value of a function of the constants, at a precision that gives the digits.

        Parameters
        ----------
        what : str
            The name of the number, for the message and for `RELATIVE`.
        value : callable
            Function of the constants to a ball, to a tuple or dict with balls, or to anything
            without balls; it raises `TooFewBits` where it needs more bits.
        digits : int, optional
            Decimal digits: each radius is at most 10⁻ᵈ of the size.
        late : float
            The time [s] at which it is a number of the motion.

        Raises
        ------
        Unseparated
            No balls of up to `limit` bits have the digits.
        """
        why, ball, bits, last = f"{what} is known to", arb.nan(), self._bits(digits, late), 0
        while bits > last:
            with working(bits):
                try:
                    found = value(self._constants(bits))
                    found_balls = balls_in(found) if digits else ()
                    wide = [x for x in found_balls if not self._has_digits(what, x, digits or 0)]
                    if not wide:
                        return found
                    if wide[0].is_finite():
                        why, ball = f"{what} is known to", wide[0].rad()
                except TooFewBits as close:
                    why, ball = f"{close.names} differ by less than", close.difference
            last, bits = bits, min(2 * bits, self.limit)
        size, bound = bound_of(ball)
        more = f"with {self.limit} bits: more bits or fewer digits are needed"
        raise Unseparated(f"{why} {size} {more}", bound)

    def _bits(self, digits: int | None, late: float) -> int:
        """The precision to begin with."""
        bits = FEW_BITS
        if digits:
            bits = max(bits, math.ceil(digits / LOG10_2) + SPARE_BITS)
        if late:
            turned = min(max(1.0, abs(late) * self.rate), sys.float_info.max)
            bits += LATE_BITS * math.ceil(max(math.log2(turned) - EARLY_BITS, 0.0) / LATE_BITS)
        return min(bits, self.limit)

    def _has_digits(self, what: str, x: arb, digits: int) -> bool:
        """Whether a ball has the digits of a quantity."""
        if not x.is_finite():
            return False
        if what in RELATIVE and not (x.contains(0) and self._may_vanish(what)):
            return bool(x.rad() <= abs(x.mid()) * arb(10) ** -digits)
        slow = self.rate if what in RATES and 0 < self.rate < 1 else 1.0
        # 2⁻ⁿ max(1, |x|) is an upper bound of the radius for this number n
        return bool((x / slow).rel_one_accuracy_bits() * LOG10_2 >= digits)

    def _may_vanish(self, what: str) -> bool:
        """Whether a ball that holds 0 may be 0, so that no bits find its first digit."""
        return ctx.prec >= MOST_SIGN_BITS or (what != "nearest" and self._on_pole)

    @cached_property
    def _on_pole(self) -> bool:
        """Whether the axis is, or passes, exactly on the vertical."""
        return bool(self.refine("nearest", lambda c: any(x.is_zero() for x in c.nearest)))

    @cached_property
    def rate(self) -> float:
        """The order of the fastest rate of the motion [rad/s], by which late times lose digits."""
        with working(FEW_BITS):
            g, b = self._start.g, self._start.b
            square = (abs(g) + 2 * self._start.kinetic0 + b * b).upper()
            return float(square.sqrt()) if square.is_finite() else math.inf

    @cached_property
    def _start(self) -> Reduced:
        """The start in units A = 1, in balls of `FEW_BITS`."""
        with working(FEW_BITS):
            return self.source.reduced(FEW_BITS)

    @cached_property
    def _cache(self) -> dict[Any, Any]:
        """Constants by their bits, forms by constants and arithmetic, and a doubt."""
        return {}

    def _constants(self, bits: int) -> Constants:
        """The constants in balls of a precision, which must be the working precision."""
        if bits not in self._cache:
            given = self._start if bits == FEW_BITS else self.source.reduced(bits)
            self._cache[bits] = Constants(given, self.source.angles(bits), self.regime, bits)
        found: Constants = self._cache[bits]
        return found

    def form(self, c: Constants, N: Any) -> Form:
        """The closed form of constants in the arithmetic of `balls` or `doubles`, made once."""
        if (c, N) not in self._cache:
            self._cache[c, N] = Form(c, N)
        found: Form = self._cache[c, N]
        return found

    def time(self, t: Any) -> Exact:
        """The exact number of a time [s]; floats mean their binary value."""
        return Exact.of(t) if isinstance(t, str | Exact) else rational(rational_value(t))

    def reader(self, t: Any, digits: int) -> Callable[[str], Any]:
        """The function from the name of a quantity to its ball of so many digits at a time [s]."""
        time = self.time(t)
        late = abs(float(time.ball(FEW_BITS)))
        point = cache(lambda c: self.form(c, balls)(ball_of(time)))
        return lambda name: self.refine(name, lambda c: getattr(point(c), name), digits, late)


def balls_in(found: Any) -> Iterator[arb]:
    """Yield the balls in a ball, a tuple or a dict; none of anything else."""
    if isinstance(found, arb):
        yield found
    elif isinstance(found, tuple | dict):
        for each in found.values() if isinstance(found, dict) else found:
            yield from balls_in(each)
