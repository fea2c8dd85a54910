"""What a block of natural steps leaves behind, and what takes the steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.numbers.double_double import DoubleDouble

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Hits:
    """Zeros of one event function: times since the block's start and full states there.

    The times [s] are high and low words: a block's start may itself be a sum.
    """

    t: Array
    t_low: Array
    states: Array

    @classmethod
    def join(cls, parts: Sequence[Hits]) -> Hits:
        """Return the parts one after the other."""
        columns = (np.concatenate([getattr(p, name) for p in parts]) for name in cls.__slots__)
        return cls(*columns)


@dataclass(frozen=True, slots=True)
class Block:
    """What a block of natural steps left behind.

    Attributes
    ----------
    state : ndarray, shape (n,)
        The state after the last step.
    elapsed : tuple of float
        Time since the block's start, as a double-double [s].
    steps : int
        Steps taken.
    rows : ndarray, shape (k, n)
        States at those of the sample times that the block reached.
    hits : tuple of Hits, one per event function
    singular : bool
        Whether the next step would have left the finite numbers.
    """

    state: Array
    elapsed: DoubleDouble
    steps: int
    rows: Array
    hits: tuple[Hits, ...]
    singular: bool


class Engine(Protocol):
    """What takes natural steps: an integrator, or one that projects between them."""

    @property
    def formulation(self) -> Formulation:
        """The formulation that is integrated."""

    @property
    def events(self) -> tuple[str, ...]:
        """Names of the event functions that are watched."""

    @property
    def order(self) -> int:
        """Order of the Taylor polynomials."""

    @property
    def compile_s(self) -> float:
        """Time spent in compiling [s]."""

    def load(self, parameters: dict[str, float]) -> None:
        """Load the constants of a run, by the names of their symbols."""

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps [s]."""

    def for_this_thread(self) -> Engine:
        """Return the one like this that belongs to the calling thread."""

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps from a state and sample their Taylor polynomials.

        Parameters
        ----------
        state : ndarray, shape (n,)
        steps : int
            How many steps to take.
        far : float
            A time no block of interest reaches, with the sign of the direction [s]; only a step
            longer than that is cut.
        samples : ndarray, shape (k,), optional
            Monotonic times since the block's start, none of them 0 [s].
        longest : float, optional
            The longest step to take [s].
        """
