"""Timing: runs taken in turn, so that what disturbs the machine disturbs them all alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from heavytop.comparison.steppers import Stepper, StepperState
from heavytop.numbers.double_double import DoubleDouble

MOST_ROUNDS: Final = 25
LONG_S: Final = 1.0  # what takes so long, in all its runs, is repeated twice and no more
LATE: Final = 1.5  # times as long as the first run: what one more may take

Clock = Callable[[], float]


class TooSlow(Exception):
    """A run that was stopped between two blocks."""

    def __init__(self, place: StepperState, spent: float) -> None:
        super().__init__(place, spent)
        self.place, self.spent = place, spent


@dataclass(frozen=True, slots=True)
class Lap:
    """A stepper taken from its start past a time.

    Attributes
    ----------
    last : StepperState
        Where the last block began, which passed the time.
    after : StepperState
        Where it ended.
    seconds : float
        Time in the blocks, and in nothing else.
    """

    last: StepperState
    after: StepperState
    seconds: float


def lap(march: Stepper, end: DoubleDouble, clock: Clock, patience: float = float("inf")) -> Lap:
    """Take a stepper from its start past a time.

    Raises
    ------
    TooSlow
        It is not there yet after so many seconds.
    IntegrationFailed
        It cannot go on.
    """
    place, seconds = march.begin(), 0.0
    while True:
        began = clock()
        after = march.block(place)
        seconds += clock() - began
        if after.time >= end:  # double-doubles compare as their words do
            return Lap(place, after, seconds)
        if seconds > patience:
            raise TooSlow(after, seconds)
        place = after


def in_turn(
    programs: Sequence[Callable[[], float]],
    first: Sequence[float],
    deadline: float,
    clock: Clock,
    most: int = MOST_ROUNDS,
    on_round: Callable[[float], None] | None = None,
) -> list[list[float]]:
    """Run programs in rounds, each once a round; slow ones only in some of the rounds.

    Parameters
    ----------
    programs : sequence of callable
        Each returns the seconds that count.
    first : sequence of float
        How long each took when it was run before [s].
    deadline : float
        By the clock; nothing is begun that is not expected to end before it.
    clock : callable
    most : int
        Rounds at most.
    on_round : callable, optional
        Called with the fraction of the rounds that are done.

    Returns
    -------
    list of list of float
        The seconds of each program's runs.
    """
    counts = shares(first, deadline - clock(), most)
    found: list[list[float]] = [[] for _ in programs]
    for turn in range(most):
        for i, program in enumerate(programs):
            due = (turn + 1) * counts[i] // most > turn * counts[i] // most
            if due and clock() + LATE * first[i] <= deadline:
                found[i].append(program())
        if on_round is not None:
            on_round((turn + 1) / most)
    return found


def shares(first: Sequence[float], seconds: float, most: int) -> list[int]:
    """Return how often each program is run: what fast ones leave over goes to the slow ones.

    Examples
    --------
    >>> shares([0.1, 10.0, 2.0, 100.0], 40.0, 5)
    [5, 1, 2, 0]
    """
    counts = [0] * len(first)
    quickest_first = sorted(range(len(first)), key=lambda i: first[i])
    for behind, i in enumerate(quickest_first):
        share = max(0.0, seconds) / (len(first) - behind)
        counts[i] = min(_runs(share, first[i]), max(2, _runs(LONG_S, first[i])), most)
        seconds -= counts[i] * first[i]
    return counts


def _runs(seconds: float, each: float) -> int:
    return int(min(seconds / each, 1e9)) if each else 10**9
