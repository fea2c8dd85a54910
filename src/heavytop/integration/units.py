"""A scaled integrator as it looks from outside: its states go in and come out in true units.

Powers of two: nothing is rounded on the way.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, eq=False)
class TrueStates:
    """The states of an integrator, to be read and written in true units.

    Attributes
    ----------
    own : sequence of numbers
        As the integrator has them.
    units : sequence of numbers
    """

    own: Any
    units: Sequence[Any]

    def __len__(self) -> int:
        return len(self.units)

    def __iter__(self) -> Iterator[Any]:
        return (y * unit for y, unit in zip(self.own, self.units, strict=True))

    def __getitem__(self, i: int) -> Any:
        return self.own[i] * self.units[i]

    def __setitem__(self, i: int, x: Any) -> None:
        self.own[i] = x / self.units[i]


@dataclass(slots=True, eq=False)
class InTrueUnits:
    """What `precise` uses of heyoka's integrator, of one whose equations are scaled.

    Attributes
    ----------
    taylor : heyoka's integrator
    units : sequence of numbers
        Of its states.
    """

    taylor: Any
    units: Sequence[Any]

    @property
    def order(self) -> int:
        """Order of the Taylor polynomials."""
        return int(self.taylor.order)

    @property
    def time(self) -> Any:
        """Time [s]."""
        return self.taylor.time

    @time.setter
    def time(self, t: Any) -> None:
        self.taylor.time = t

    @property
    def dtime(self) -> Any:
        """Time as two words [s]."""
        return self.taylor.dtime

    @property
    def state(self) -> TrueStates:
        """The states."""
        return TrueStates(self.taylor.state, self.units)

    @property
    def d_output(self) -> TrueStates:
        """The states at the time last looked at."""
        return TrueStates(self.taylor.d_output, self.units)

    def step(self, *longest: Any, **options: Any) -> Any:
        """Take a step, as heyoka does."""
        return self.taylor.step(*longest, **options)

    @property
    def last_h(self) -> Any:
        """The length of the last step [s]."""
        return self.taylor.last_h

    def propagate_for(self, *longest: Any, **options: Any) -> Any:
        """Take steps, as heyoka does."""
        return self.taylor.propagate_for(*longest, **options)

    def update_d_output(self, *at: Any, **options: Any) -> None:
        """Look at a time within the last step, as heyoka does."""
        self.taylor.update_d_output(*at, **options)
