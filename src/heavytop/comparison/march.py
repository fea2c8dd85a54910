"""A march: one method on its way from one start, in blocks of steps it chose itself.

Whatever takes the steps, a long run is the same thing: from a place a block leads to the next
place, and between the two the states can be looked at. A place is numbers and nothing else, so
that it can be written down and taken up again, bit for bit, by another process.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from heavytop.numbers.double_double import DoubleDouble

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Place:
    """Where a march is between two blocks.

    Attributes
    ----------
    time : tuple of float
        Time since the start as a double-double [s].
    state : tuple of float
        The states, in the order of the formulation.
    carry : tuple of float
        What else the method takes along: the length of its next step, lost low words.
    steps : int
        Steps taken so far.
    evaluations : int
        Evaluations of the right-hand side so far; of a splitting, of the force.
    """

    time: DoubleDouble
    state: tuple[float, ...]
    carry: tuple[float, ...] = ()
    steps: int = 0
    evaluations: int = 0


class March(Protocol):
    """One method set up for one start: the same place always leads to the same next place."""

    def begin(self) -> Place:
        """Return the place at the start, time 0."""

    def block(self, place: Place) -> Place:
        """Take a block of steps; how many depends on nothing but the place.

        Raises
        ------
        Stopped
            The method cannot go on: its step vanishes, its numbers are no longer finite.
        """

    def seen(self, place: Place, times: Sequence[DoubleDouble]) -> Array:
        """Return the states, shape (k, n), at times of `offered` in the block after a place."""

    def offered(self, t: float) -> DoubleDouble:
        """Return the first time not before t at which the march can be looked at.

        That is t itself where the method has states in between that are as good as its steps, or
        can step there aside; of a method of fixed step, the end of a step.
        """


class Stopped(Exception):
    """A march that cannot go on; the message says why, for a person."""
