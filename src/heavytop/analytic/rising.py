"""The closed form at rising precision: more and more bits until a result is known well enough.

`MotionNumbers` is what one motion has so: `closed_form` hands out its balls as mpmath numbers,
`enclosure` as intervals and `motion` as floats.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from operator import attrgetter
from typing import Any, Final, Generic, TypeVar

from flint import arb

from heavytop.analytic.cubic import TooFewBits, sign_of
from heavytop.analytic.solution import Solution, each
from heavytop.classification.reduced import FEW_BITS, ReducedMotion, Regime, vanishes
from heavytop.errors import Unseparated
from heavytop.exact import Exact
from heavytop.exact.balls import Interval, above, rational_ball, working
from heavytop.exact.number import rational_value

N = TypeVar("N")
Size = Callable[[arb], arb]

MOST_DIGITS: Final = 10_000
LIMIT: Final = 1 << 16
"""Bits at which an enclosure gives up."""

FLOAT_DIGITS: Final = 52
"""Decimal digits behind every float, and behind 50 digits: they share one solution."""

_LOG10_2: Final = math.log10(2)
_SPARE: Final = 40  # bits beyond those of the digits, which most motions do not use up
_EARLY: Final = 16  # of them are left for times that are not late
_BY_THE: Final = 64  # bits for late times come by so many, so that times share their solution


class Rising:
    """The closed form of one motion, at any precision up to a limit.

    Parameters
    ----------
    source : ReducedMotion
        The exact numbers of the motion.
    proved : bool
        Whether a number that is neither told from 0 nor proved to be 0 is an error.
    limit : int
        Bits at which to give up.
    """

    def __init__(self, source: ReducedMotion, proved: bool = True, limit: int = LIMIT) -> None:
        self.source, self.proved, self.limit = source, proved, limit
        with working(FEW_BITS):
            self.start = source.reduced(FEW_BITS)
        self.regime = Regime.of(source, proved, self.start)
        self._solutions: dict[int, Solution] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Rising, (self.source, self.proved, self.limit)  # what was computed is not copied

    def solution(self, bits: int) -> Solution:
        """The closed form at a precision, which must be the working one."""
        if bits not in self._solutions:
            given = self.start if bits <= FEW_BITS else self.source.reduced(bits)
            self._solutions[bits] = Solution(given, self.source.angles(bits), self.regime)
        return self._solutions[bits]

    @cached_property
    def cusps(self) -> bool:
        """Whether φ̇ is exactly 0 where a nutating axis is highest."""
        if not (self.regime.misses_top and self.regime.misses_bottom and self._vanishes("looping")):
            return False

        def sign(found: Solution, _: int) -> arb:
            return arb(sign_of(found.start.P_plus * found.start.P_minus, "P+ or P- and 0"))

        return bool(self.settled("the sign of P+ P-", sign, 30) < 0)

    @cached_property
    def starts_reversing(self) -> bool:
        """Whether φ̇ is exactly 0 at the start."""
        return self._vanishes("drift0")

    def _vanishes(self, name: str) -> bool:
        return vanishes(self.source, name, self.proved, self.start)

    @cached_property
    def rate(self) -> float:
        """The order of the fastest rate in the motion [s⁻¹]: what late times lose digits by."""
        bits = FEW_BITS
        while bits <= self.limit:
            with working(bits):
                start = self.start if bits == FEW_BITS else self.source.reduced(bits)
                square = (abs(start.g) + 2 * start.kinetic0 + start.b * start.b).upper()
                if square.is_finite():
                    return float(square.sqrt())
            bits *= 2
        return math.inf

    def lost(self, time: float) -> int:
        """Bits that a late time costs."""
        turned = min(max(1.0, abs(time) * self.rate), sys.float_info.max)
        return _BY_THE * math.ceil(max(math.log2(turned) - _EARLY, 0.0) / _BY_THE)

    def settled(
        self, name: str, value: Callable[[Solution, int], Any], digits: int, *,
        size: Size | None = None,
        of: Callable[[Any], Sequence[arb]] | None = None, lost: int = 0,
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

    def _rungs(self, digits: int, lost: int) -> Iterator[int]:
        bits = math.ceil(digits * math.log2(10)) + _SPARE + lost
        while bits < self.limit:
            yield bits
            bits *= 2
        yield self.limit


class MotionNumbers(Generic[N]):
    """The numbers of one motion, each computed when it is first asked for."""

    rising: Rising
    _digits: int

    def _number(self, ball: arb) -> N:
        """A ball as a number of this kind."""
        raise NotImplementedError

    @property
    def nutates(self) -> bool:
        """Whether θ swings between two turning points; elsewhere there is no period."""
        return self.rising.regime.name == "nutating"

    @cached_property
    def period(self) -> N | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self._known("the period", "path.period")[0]

    @cached_property
    def _turned(self) -> tuple[N | None, ...]:
        return self._known("what a period turns by", "turned") or (None, None, None)

    @property
    def precession(self) -> N | None:
        """Δφ [rad] in one period, +π for each exact pass through a pole; None without nutation."""
        return self._turned[0]

    @property
    def spin(self) -> N | None:
        """Δψ [rad] in one period, −π for a pass of the top, +π of the bottom; or None."""
        return self._turned[1]

    @property
    def relative_spin(self) -> N | None:
        """Δψ − κT [rad] in one period, without what a fast spin brings by itself; or None."""
        return self._turned[2]

    @cached_property
    def roots(self) -> tuple[N, ...]:
        """u₁ ≤ u₂ ≤ u₃, the roots of the cubic as cos θ; without the infinite one if gMR = 0.

        A double root is one by proof: its two numbers are then the same.
        """
        return self._known("a root", "cosines", one)

    @cached_property
    def tilts(self) -> tuple[N, ...]:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        return self._known("a tilt", "tilts", one)

    @property
    def theta_min(self) -> N:
        """The smallest θ [rad]; 0, never reached, where the axis tends to the top."""
        return self.tilts[not self.rising.regime.mirrored]

    @property
    def theta_max(self) -> N:
        """The largest θ [rad]; π, never reached, where the axis tends to the bottom."""
        return self.tilts[self.rising.regime.mirrored]

    @cached_property
    def nearest(self) -> tuple[N, ...]:
        """How near the axis comes to the top and to the bottom [rad], each to its own digits."""
        return self._known("how near it comes to a pole", "nearest", itself)

    @cached_property
    def mean_rates(self) -> tuple[N, ...]:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        return self._known("a rate", "mean_rates", one)

    @cached_property
    def lower_turning(self) -> N | None:
        """The time [s] of one passage of θ through u₁ (θ_max if gMR ≥ 0); others are T apart.

        Of an axis that tends to the vertical it is the only one; None where θ is constant.
        """
        return self._known("a turning point", "lower_turning")[0]

    @cached_property
    def reversal(self) -> N | None:
        """How long before and after each `lower_turning` φ̇ changes its sign [s]; None if never."""
        return None if self.rising.cusps else self._known("a reversal", "reversal")[0]

    @cached_property
    def modulus(self) -> tuple[N, ...] | None:
        """The parameter m = k² of the elliptic functions and 1 − m; None where nothing nutates."""
        return self._known("the modulus", "path.modulus", itself) or None

    @cached_property
    def growth(self) -> N | None:
        """The rate w [1/s] at which an axis tends to the vertical; None where it does not."""
        return self._known("a rate", "path.growth")[0]

    def _known(self, what: str, name: str, size: Size | None = None) -> tuple[N, ...]:
        """The number or the numbers that a `Solution` has by this name."""
        value = attrgetter(name)
        found = self.rising.settled(what, lambda found, _: value(found), self._digits, size=size)
        return self._told(found)

    def _at(
        self, what: str, t: Any, value: Callable[[Solution, arb], Any],
        size: Size | None = None, digits: int = 0,
        of: Callable[[Any], Sequence[arb]] | None = None,
    ) -> tuple[N, ...]:  # fmt: skip
        """The number or the numbers at a time [s] of any kind; floats mean their binary value."""
        exact = Exact.of(t) if isinstance(t, str | Exact) else rational_value(t)

        def time(bits: int) -> arb:
            return exact.ball(bits) if isinstance(exact, Exact) else rational_ball(exact)

        lost = self.rising.lost(float(time(FEW_BITS)))
        found = self.rising.settled(
            what, lambda found, bits: value(found, time(bits)), digits or self._digits,
            size=size, of=of, lost=lost,
        )  # fmt: skip
        return self._told(found)

    def _told(self, found: Any) -> tuple[N, ...]:
        numbers: tuple[N, ...] = each(self._number, found if isinstance(found, tuple) else (found,))
        return numbers


def one(_: arb) -> arb:
    """The size for digits that count from the decimal point."""
    return arb(1)


def itself(x: arb) -> arb:
    """The size for digits that count from the first one of a number."""
    return abs(x.mid())


def _has(digits: int, x: arb, size: Size | None) -> bool:
    if size is None:  # 2⁻ⁿ max(1, |x|) is an upper bound of the radius for this number n
        return x.is_finite() and x.rel_one_accuracy_bits() * _LOG10_2 >= digits
    return x.is_finite() and bool(x.rad() <= arb(10) ** -digits * size(x))
