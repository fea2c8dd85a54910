"""How far a study is, how fast it goes, and how long it still takes."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a study stands.

    Attributes
    ----------
    fraction : float
        Part of the whole study that is done, 0 to 1.
    ended, tasks : int
        How many tasks are at their end, and how many there are.
    elapsed_s : float
        Time since this process took the study up [s].
    gained : float
        Part of the whole study that this process did.
    """

    fraction: float
    ended: int
    tasks: int
    elapsed_s: float
    gained: float

    @property
    def per_s(self) -> float:
        """Part of the whole study done per second; 0 before anything is known [1/s]."""
        return self.gained / self.elapsed_s if self.elapsed_s > 0 else 0.0

    @property
    def left_s(self) -> float | None:
        """Time left at this rate [s]; None before anything is known.

        Examples
        --------
        >>> Progress(fraction=0.75, ended=1, tasks=2, elapsed_s=10, gained=0.5).left_s
        5.0
        """
        return (1 - self.fraction) / self.per_s if self.per_s > 0 else None
