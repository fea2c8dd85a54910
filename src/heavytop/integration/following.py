"""Turns followed along the steps of a precise run: its own states, rounded to doubles for it.

A run in doubles that comes near a separatrix has lost its phase there, and would pass a pole a
turn too often or too seldom. So turns are counted on the steps whose digits they belong to. Near
a pole a rounded state keeps its relative digits, and the constants of the motion say the rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from heavytop.integration.turns import Turns
from heavytop.integration.winding import MOST_POINTS, More, Winding, distinct

Array = NDArray[np.float64]
Told = tuple[float, float]
Row = Sequence[Any]

NOT_TOLD: Final = (math.nan, math.nan)
FITTING: Final = 5.7  # radians between the bounds of a change, so that one value fits
MOST_PARTS: Final = 8  # of a step, before its turns are told by where it goes


class Following(Protocol):
    """What tells the turns between states of a formulation."""

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided [s], for turns to be told in each.

        Where bounds would take more parts than `most`, they are as many; 0 without `most`.
        """

    def followed(self, t: Array, rows: Array, first: Told, more: More | None) -> Array:
        """Return phi and psi at some times, shape (k, 2), from those at the first [rad]."""


@dataclass(frozen=True, slots=True)
class FollowingAxis:
    """Phi of the axis; psi is not told."""

    winding: Winding

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided, as `Following` does."""
        parts = (self.winding.fastest - self.winding.slowest) * abs(length) / FITTING
        return max(1, math.ceil(parts)) if parts < (most or MOST_PARTS) else most or 0

    def followed(self, t: Array, rows: Array, first: Told, more: More | None) -> Array:
        """Return phi and nan at some times, shape (k, 2), from phi at the first [rad]."""
        started = self.winding.started(rows[0], first[0])
        phi = self.winding.on_branch(rows, started + self.winding.turned(t, rows, more))
        return np.stack((phi, np.full(t.size, math.nan)), axis=-1)


@dataclass(frozen=True, slots=True)
class FollowingAttitude:
    """Phi and psi, less its uniform part, of the quaternion; `apart` is decided at once [s]."""

    turns: Turns
    apart: float

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided [s]."""
        return max(1, math.ceil(min(abs(length) / self.apart, MOST_POINTS)))

    def followed(self, t: Array, rows: Array, first: Told, more: More | None) -> Array:
        """Return phi and psi at some times, shape (k, 2), from those at the first [rad]."""
        return self.turns.followed(t, rows, first)


class Trail:
    """The states of some steps, in doubles, and phi and psi there.

    Times are since the first of them [s]; `told` has the angles that were asked for, and `last`
    those at the end of the last step.
    """

    def __init__(self, following: Following, row: Row, first: Told) -> None:
        self.following, self.last = following, first
        self.told: dict[int, Told] = {}
        self._t, self._rows = [0.0], [_rounded(row)]
        self._seen: list[tuple[int, float]] = []
        self._inside: list[tuple[int, float, Row]] = []

    def see(self, key: int, t: float, row: Row) -> None:
        """Ask for the angles at a state of the step that is to be added next."""
        self._inside.append((key, t, row))

    def step(self, end: float, length: float, row: Row, dense: Callable[[float], Row]) -> None:
        """Add a step: its end, its length and its last state; `dense` counts from its end."""
        parts = self.following.parts(length)
        if parts == 0:  # close to a pole, perhaps: told while it can be divided
            self.tell()
        for key, t, seen in self._inside:
            self._add(t, seen)
            self._seen.append((key, t))
        self._inside = []
        for k in range(1, parts):
            before = -length * (1 - k / parts)
            self._add(end + before, dense(before))
        self._add(end, row)
        if parts == 0:
            self._tell(lambda t: np.array([_rounded(dense(x - end)) for x in t.tolist()]))

    def tell(self) -> None:
        """Tell the angles at everything added."""
        if len(self._t) > 1:
            self._tell(None)

    def _add(self, t: float, row: Row) -> None:
        self._t.append(t)
        self._rows.append(_rounded(row))

    def _tell(self, more: More | None) -> None:
        forward = math.copysign(1.0, self._t[-1])
        unique, where = distinct(forward * np.array(self._t))
        rows = np.array(self._rows)[where]
        angles = self.following.followed(forward * unique, rows, self.last, more)
        for key, t in self._seen:
            phi, psi = angles[np.searchsorted(unique, forward * t)].tolist()
            self.told[key] = (phi, psi)
        phi, psi = angles[-1].tolist()
        self.last, self._seen = (phi, psi), []
        self._t, self._rows = [forward * float(unique[-1])], [rows[-1].tolist()]


def _rounded(row: Row) -> list[float]:
    return [float(x) for x in row]
