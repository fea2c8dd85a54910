"""The order of first runs: a rung of each method, then another of each, until time is out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from heavytop.integration.bits import DOUBLE
from heavytop.studies.workprecs.ladder import SLOWEST, Trial

LATER: Final = 3  # rungs of all others come before what is slow


def schedule(tried: Sequence[Trial]) -> tuple[int, ...]:
    """Return the indices of trials in the order in which they are begun.

    The middle of each ladder first, then the middles of its halves, and so on: whenever time is
    out, the rungs that were run are spread, and no method is without one for another's sake. In
    each turn the Taylor integrator's methods and the rivals alternate.

    Parameters
    ----------
    tried : sequence of Trial
        The rungs of a method from the loosest to the tightest.
    """
    sides: tuple[dict[str, list[int]], ...] = ({}, {})
    for index, trial in enumerate(tried):
        sides[trial.method.is_rival].setdefault(trial.name, []).append(index)
    ranked = [
        (turn + _late(tried[ladder[place]]), rank, ladder[place])
        for ladders in sides
        for rank, ladder in enumerate(ladders.values())
        for turn, place in _turns(tried[ladder[0]], len(ladder))
    ]
    return tuple(index for _, _, index in sorted(ranked))


def _turns(first: Trial, n: int) -> Iterator[tuple[int, int]]:
    """Yield in which turn each rung is begun; auto's few choices all in the first."""
    if first.digits is not None:
        return ((0, place) for place in range(n))
    return enumerate(middles(n))


def middles(n: int) -> Iterator[int]:
    """Yield 0 to n - 1: the middle, the middles of the halves, and so on.

    Examples
    --------
    >>> list(middles(7))
    [3, 1, 5, 0, 2, 4, 6]
    """
    parts = [(0, n)]
    for low, high in parts:
        if low < high:
            middle = (low + high) // 2
            yield middle
            parts += [(low, middle), (middle + 1, high)]


def _late(trial: Trial) -> int:
    """Return how many turns later a method is begun: what is asked of auto is never late."""
    slow = trial.method.bits > DOUBLE or trial.method.name == SLOWEST
    return LATER if slow and trial.digits is None else 0
