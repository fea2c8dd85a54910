"""The front: the points that no other point beats both in time and in error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from heavytop.studies.workprecs.point import Point

Error = Callable[[Point], float | None]
Tie = tuple[bool, str]
NOISE: Final = 0.1  # of a time: what is faster by less is not known to be


def axis_error(point: Point) -> float | None:
    """Return the error of the axis; None where there is none."""
    return point.axis_error


def theta_error(point: Point) -> float | None:
    """Return the error of theta."""
    return point.theta_error


def front(points: Sequence[Point], error: Error) -> tuple[int, ...]:
    """Return the indices of the points that none beats, from the fastest to the most accurate.

    Parameters
    ----------
    points : sequence of Point
    error : callable
        From a point to its error, or to None where it has none and takes no part.
    """
    found: list[int] = []
    least = float("inf")
    for here, _, index in sorted(_ranked(points, error)):
        if here[1] < least:
            least = here[1]
            found.append(index)
    return tuple(found)


def _ranked(points: Sequence[Point], error: Error) -> list[tuple[tuple[float, float], Tie, int]]:
    """Return time and error, what settles a tie, and the index of each point."""
    return [
        ((point.us_per_period, off), _tie(point), index)
        for index, point in enumerate(points)
        if (off := error(point)) is not None
    ]


def cheapest(
    points: Sequence[Point],
    error: Error,
    bound: float,
    among: Callable[[Point], bool] = lambda _: True,
) -> Point | None:
    """Return the fastest point with an error of at most a bound, or None."""
    within = [p for p in points if (off := error(p)) is not None and off <= bound and among(p)]
    return min(within, key=lambda p: (p.us_per_period, _tie(p)), default=None)


def most_accurate(
    points: Sequence[Point], error: Error, among: Callable[[Point], bool] = lambda _: True
) -> Point | None:
    """Return the point with the least error, or None where there is none."""
    having = [(off, p) for p in points if (off := error(p)) is not None and among(p)]
    return min(having, key=lambda pair: (pair[0], _tie(pair[1])))[1] if having else None


def _tie(point: Point) -> Tie:
    """Return what comes first of equals: what auto chose is the method's own point once more."""
    return point.trial.digits is not None, point.trial.name


def ahead_of(
    points: Sequence[Point], point: Point, error: Error, margin: float = NOISE
) -> tuple[Point, ...]:
    """Return the points that are more accurate than one, and faster by more than a margin."""
    own = error(point)
    if own is None:
        raise ValueError(f"{point.trial.text} has no such error")
    return tuple(
        other
        for other in points
        if (off := error(other)) is not None
        and off < own
        and other.us_per_period < point.us_per_period * (1 - margin)
    )
