"""The Taylor integrator in more than double precision as a march.

A number of more bits is written down as the sum of a few doubles, the largest first, which loses
nothing: the first words of all states stand first, then their second words, and so on. Time has
two words more than a place holds; they stand behind all others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.integration.high_precision import Mark, PreciseIntegrator, Unfinished, Wanted
from heavytop.numbers.double_double import Array, DoubleDouble
from heavytop.studies.drifts.taylor_march import FAR

DOUBLE_BITS = 53
LATE_WORDS = 2  # of the time, beside the two of the place


@dataclass(frozen=True, eq=False)
class PreciseMarch:
    """A formulation compiled for more than doubles, on its way from one start.

    Attributes
    ----------
    engine : PreciseIntegrator
    start : tuple of str
        The states at the start, as decimal texts.
    period : float
        Of the nutation [s].
    longest : float or None
        The longest of the first steps [s].
    """

    engine: PreciseIntegrator
    start: tuple[str, ...]
    period: float
    longest: float | None

    @property
    def words(self) -> int:
        """How many doubles hold one number."""
        return math.ceil(self.engine.bits / DOUBLE_BITS)

    def begin(self) -> StepperState:
        """Return the start."""
        return self._place(self.engine.start(self.start))

    def block(self, place: StepperState) -> StepperState:
        """Take a block of natural steps, as `Stepper` says."""
        try:
            mark = self.engine.onward(self._mark(place), FAR * self.period, self.longest)
        except Unfinished:
            raise IntegrationFailed(f"singular, or overflow, after {place.steps} steps") from None
        return self._place(mark)

    def states_at(self, place: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a place, shape (k, n times words)."""
        wanted = [Wanted(self._moment(t)) for t in times]
        walk = self.engine.walk(self._mark(place), wanted, FAR * self.period, self.longest)
        found = [self._words(map(self.engine.text, one.state)) for one in walk.found if one]
        return np.array(found)

    def output_time(self, t: float) -> DoubleDouble:
        """Return the time itself."""
        return (t, 0.0)

    def _moment(self, words: Sequence[float]) -> Any:
        return sum(map(self.engine.wide, words[::-1]), self.engine.wide(0.0))

    def _mark(self, place: StepperState) -> Mark:
        n = len(self.start)
        words = (*place.state, *place.carry[:-LATE_WORDS])
        numbers = tuple(sum(map(self.engine.number, words[i::n][::-1])) for i in range(n))
        time = self._moment((*place.time, *place.carry[-LATE_WORDS:]))
        return Mark(time, numbers, place.steps)

    def _place(self, mark: Mark) -> StepperState:
        n = len(self.start)
        words = self._words(map(self.engine.text, mark.state))
        time: list[float] = []
        for _ in range(2 + LATE_WORDS):
            time.append(float(mark.t - self._moment(time)))
        carry = (*words[n:], *time[2:])
        return StepperState((time[0], time[1]), words[:n], carry, mark.steps, mark.steps)

    def _words(self, texts: Iterable[str]) -> tuple[float, ...]:
        columns = [_expansion(Fraction(text), self.words) for text in texts]
        return tuple(word for row in zip(*columns, strict=True) for word in row)


def _expansion(x: Fraction, words: int) -> list[float]:
    """Return doubles whose sum is x, the largest first."""
    found = []
    for _ in range(words):
        found.append(float(x))
        x -= Fraction(found[-1])
    return found
