"""Times of turning points, of reversals of φ̇ and of cusps, in balls, and their proved counts."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from flint import arb

from heavytop.analytic.constants import Constants
from heavytop.analytic.roots import TooFewBits, floor, sign_of
from heavytop.classification.reduced import FEW_BITS
from heavytop.errors import Impossible
from heavytop.exact.balls import ball_of
from heavytop.scene.arguments import expect, integer
from heavytop.scene.scene_file import EVENTS

if TYPE_CHECKING:
    from heavytop.analytic.motion import ClosedForm

KINDS_OF_EVENTS: Final = (*EVENTS, "theta_min", "theta_max")
"""Kinds of events: a cusp is a turning point too, but no theta_min or theta_max."""

MOST_COUNTED: Final = 10**100
# distance from the end of a span, in periods for each period, where a count in doubles is unsure
COUNT_EDGE: Final = 1e-9
MOST_LISTED: Final = 10_000_000
EVENT_DIGITS: Final = 20
AT_AN_END: Final = "an event and the end of the span"


class EventTimes:
    """The times of the events of one kind, which repeat after each period.

    Made by `Motion.events`. Numbers of events count from the start: 0 is the first one not before
    it, −1 the last before it.

    Attributes
    ----------
    first : arb or None
        The time of the event 0 [s], a ball of 20 digits; None where there are no events.
    spacing : arb or None
        The period after which all events happen again [s]; None where there is one at most.
    """

    def __init__(self, motion: ClosedForm, kind: str) -> None:
        if expect("event", kind, str) not in KINDS_OF_EVENTS:
            raise Impossible([("event", f"turning, reversal or cusp, not {kind!r}")])
        self.motion, self.kind = motion, kind
        self.below, self.above = ("theta_max", "theta_min")[:: -1 if motion.regime.mirrored else 1]

    @property
    def first(self) -> arb | None:
        """The time of the event 0 [s]."""
        return self.nth(0) if self.fractions else None

    @property
    def spacing(self) -> arb | None:
        """The period after which all events happen again [s]."""
        period: arb | None = self.motion.ball("period", EVENT_DIGITS)
        return period

    @property
    def fractions(self) -> list[float]:
        """The events of one period, in periods after the start, in [0, 1); 0 exactly at it."""
        return [float(x) for x in self.motion.refine("an event", self._fractions)]

    def count(self, a: Any, b: Any) -> int:
        """The proved number of events from one time to another, both included.

        Parameters
        ----------
        a, b : number
            Times since the start [s], exact, a ≤ b.

        Raises
        ------
        Unseparated
            An event is so near to one of the times that no bits separate them.
        """
        return max(0, self._number_after(b) - self._number_from(a))

    def times(self, a: Any, b: Any, digits: int = EVENT_DIGITS) -> list[arb]:
        """The times of the events from one time to another, both included: balls of so many digits.

        Parameters
        ----------
        a, b : number
            Times since the start [s], exact, a ≤ b.
        digits : int
            Decimal digits.
        """
        first, end = self._number_from(a), self._number_after(b)
        if end - first > MOST_LISTED:
            rule = f"there are {end - first} events, and {MOST_LISTED} are the most"
            raise Impossible([("b", rule)])
        return [self.nth(n, digits) for n in range(first, end)]

    def nth(self, n: int, digits: int = EVENT_DIGITS) -> arb:
        """The time of one event [s], a ball of so many digits.

        Parameters
        ----------
        n : int
            Its number: 0 is the first event not before the start, −1 the last before it.
        digits : int
            Decimal digits.

        Raises
        ------
        Impossible
            n is no whole number up to 10¹⁰⁰ in magnitude, or there is no such event.
        """
        n = integer("n", n, -MOST_COUNTED, MOST_COUNTED)

        def time(c: Constants) -> arb | None:
            fractions = self._fractions(c)
            if c.period is None:
                return next((at for at in fractions if n == (0 if _is_past(at) else -1)), None)
            turns, which = divmod(n, len(fractions) or 1)
            return (turns + fractions[which]) * c.period if fractions else None

        late = (self.motion.period or 0.0) * abs(n)
        found = self.motion.refine(f"the time of {self.kind} {n}", time, digits, late)
        if found is None:
            rule = f"an event that there is: {self.kind} {n} does not happen"
            raise Impossible([("n", rule)])
        return found

    def _number_after(self, t: Any) -> int:
        """The number of the first event after a time."""
        return self._number(t, lambda ahead: floor(ahead) + 1)

    def _number_from(self, t: Any) -> int:
        """The number of the first event not before a time."""
        return self._number(t, lambda ahead: -floor(-ahead))

    def _number(self, t: Any, rank: Callable[[arb], int]) -> int:
        """The sum of rank(t − event) over the events of the first period [periods]."""
        exact = self.motion.time(t)

        def number(c: Constants) -> int:
            time, fractions = ball_of(exact), self._fractions(c)
            if c.period is not None:
                return sum(rank(time / c.period - at) for at in fractions)
            # of one event alone the rank is that within the first period, or outside of it
            return sum(min(max(rank(time - at), 0), 1) - (not _is_past(at)) for at in fractions)

        late = abs(float(exact.ball(FEW_BITS)))
        return self.motion.refine(f"the count of {self.kind}", number, late=late)

    def _fractions(self, c: Constants) -> list[arb]:
        """The events in periods after the start, in [0, 1); without a period the only time [s]."""
        if c.period is None:
            only = c.lower_turning if self.kind in ("turning", self.below) else None
            return [] if only is None else [only]
        found = sorted((x - floor(x) for x in self._positions(c)), key=lambda x: x.mid())
        for low, high in pairwise(found):
            if not low < high:
                raise TooFewBits("two events", high - low)
        return found

    def _positions(self, c: Constants) -> list[arb]:
        """The events of a nutation in periods after the start, up to whole ones."""
        lower, half = -c.phase, arb(0.5)
        if self.kind != "reversal":
            upper = "cusp" if self.motion.cusps else self.above
            kinds = {"turning": [lower, lower + half], self.below: [lower], upper: [lower + half]}
            return kinds.get(self.kind, [])
        if self.motion.cusps or c.reversal is None or c.period is None:
            return []
        part = c.reversal / c.period
        if not self.motion.vanishes("drift0"):
            return [lower + part, lower - part]
        return [arb(0), lower - part if c.upright.udot0 > 0 else lower + part]


def _is_past(time: arb) -> bool:
    """Whether the start is not after a time."""
    return sign_of(time, AT_AN_END) > 0
