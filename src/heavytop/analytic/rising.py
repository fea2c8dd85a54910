"""The closed form at rising precision: more and more bits until a result is known well enough."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cached_property, partial
from typing import Any, Final

from flint import arb

from heavytop.analytic.cubic import TooFewBits
from heavytop.analytic.solution import Solution
from heavytop.classification.reduced import FEW_BITS, MotionSource, Regime, vanishes
from heavytop.classification.signs import rational_ball
from heavytop.errors import Unseparated
from heavytop.numbers import Exact
from heavytop.numbers.exact import rational_value
from heavytop.numbers.intervals import Interval, above, working

LIMIT: Final = 1 << 16
"""Bits at which an enclosure gives up."""

_LOG10_2: Final = math.log10(2)
_SPARE: Final = 40  # bits beyond those of the digits, which most motions do not use up
_EARLY: Final = 16  # of them are left for times that are not late
_BY_THE: Final = 64  # bits for late times come by so many, so that times share their solution


class Rising:
    """The closed form of one motion, at any precision up to a limit.

    Parameters
    ----------
    source : MotionSource
        The exact numbers of the motion.
    proved : bool
        Whether a number that is neither told from 0 nor proved to be 0 is an error.
    limit : int
        Bits at which to give up.
    """

    def __init__(self, source: MotionSource, proved: bool = True, limit: int = LIMIT) -> None:
        self.source, self.proved, self.limit = source, proved, limit
        with working(FEW_BITS):
            self._start = source.reduced(FEW_BITS)
        self.regime = Regime.of(source, proved, self._start)
        self._solutions: dict[int, Solution] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Rising, (self.source, self.proved, self.limit)  # what was computed is not copied

    def solution(self, bits: int) -> Solution:
        """The closed form at a precision, which must be the working one."""
        if bits not in self._solutions:
            self._solutions[bits] = Solution(self.source, self.regime, bits)
        return self._solutions[bits]

    @cached_property
    def cusps(self) -> bool:
        """Whether φ̇ is exactly 0 where a nutating axis is highest."""
        if not (self.regime.misses_top and self.regime.misses_bottom and self._vanishes("looping")):
            return False
        for bits in self._rungs(30, 0):
            with working(bits):
                start = self.source.reduced(bits)
                if not (product := start.P_plus * start.P_minus).contains(0):
                    break
        return bool(product < 0)

    @cached_property
    def starts_reversing(self) -> bool:
        """Whether φ̇ is exactly 0 at the start."""
        return self._vanishes("drift0")

    def _vanishes(self, name: str) -> bool:
        return vanishes(self.source, name, self.proved, self._start)

    @cached_property
    def rate(self) -> float:
        """The order of the fastest rate in the motion [s⁻¹]: what late times lose digits by."""
        start = self._start
        with working(FEW_BITS):
            return float((abs(start.g) + 2 * start.kinetic0 + start.b * start.b).sqrt().upper())

    def lost(self, time: float) -> int:
        """Bits that a late time costs."""
        turned = min(max(1.0, abs(time) * self.rate), sys.float_info.max)
        return _BY_THE * math.ceil(max(math.log2(turned) - _EARLY, 0.0) / _BY_THE)

    def settled(
        self, name: str, value: Callable[[Solution, int], Any], digits: int, *,
        size: Callable[[arb], arb] | None = None,
        of: Callable[[Any], tuple[arb, ...]] | None = None, lost: int = 0,
    ) -> Any:  # fmt: skip
        """The first ball, or tuple of balls, that has the digits.

        Parameters
        ----------
        name : str
            What it is, for the message.
        value : callable
            The ball or balls from a solution and its bits, the working precision meanwhile.
        digits : int
            Decimal digits: each radius is at most 10⁻ᵈ of the size.
        size : callable, optional
            What a ball's radius is held against, by default max(1, |x|).
        of : callable, optional
            The balls that matter in what `value` gives; by default it gives one, a tuple, or None.
        lost : int
            Bits known to be lost.

        Raises
        ------
        Unseparated
            No balls of up to `limit` bits have the digits.
        """
        why, bound = f"{name} is not bounded", math.inf
        for bits in self._rungs(digits, lost):
            with working(bits):
                try:
                    found = value(self.solution(bits), bits)
                except TooFewBits as close:
                    why, bound = close.told
                    continue
                balls = of(found) if of else found if isinstance(found, tuple) else (found,)
                wide = [x for x in balls if x is not None and not _has(digits, x, size)]
                if not wide:
                    return found
                if wide[0].is_finite():
                    bound = Interval.of(wide[0]).radius
                    why = f"{name} is known to {above(bound)}"
        why += f" with {self.limit} bits: more bits or fewer digits are needed"
        raise Unseparated(why, bound)

    def settled_at(
        self, name: str, t: Any, value: Callable[[Solution, arb], Any], digits: int,
        size: Callable[[arb], arb] | None = None,
        of: Callable[[Any], tuple[arb, ...]] | None = None,
    ) -> Any:  # fmt: skip
        """The same of a time [s], a number of any kind: floats mean their binary value."""
        known = isinstance(t, str | Exact)
        time = Exact.of(t).ball if known else partial(_exactly, rational_value(t))
        with working(FEW_BITS):
            lost = self.lost(float(time(FEW_BITS)))
        return self.settled(
            name, lambda found, bits: value(found, time(bits)), digits, size=size, of=of, lost=lost
        )

    def _rungs(self, digits: int, lost: int) -> Iterator[int]:
        bits = math.ceil(digits * math.log2(10)) + _SPARE + lost
        while bits < self.limit:
            yield bits
            bits *= 2
        yield self.limit


def one(_: arb) -> arb:
    """The size for digits that count from the decimal point."""
    return arb(1)


def itself(x: arb) -> arb:
    """The size for digits that count from the first one of a number."""
    return abs(x.mid())


def _has(digits: int, x: arb, size: Callable[[arb], arb] | None) -> bool:
    if size is None:  # 2⁻ⁿ max(1, |x|) is an upper bound of the radius for this number n
        return x.is_finite() and x.rel_one_accuracy_bits() * _LOG10_2 >= digits
    return x.is_finite() and bool(x.rad() <= arb(10) ** -digits * size(x))


def _exactly(q: Fraction, bits: int) -> arb:
    return rational_ball(q)
