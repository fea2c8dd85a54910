"""What takes the steps of a run: a compiled formulation, projected or not, and turns counted.

heyoka takes its steps in the run's own unit of time (`pace`). Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone: so a block has the same
bits however it was come to.

phi and psi of the attitude form are no states of the equations: they are read off the others after
each block, and their turns are counted. So nothing in the integrator grows, and the state at a
block's start is enough to run it again, or to go on from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.integration.compiled import Array, Block, Compiled, Hits
from heavytop.integration.legs import Projected
from heavytop.integration.pace import in_units, paces_of
from heavytop.integration.projection import Projection
from heavytop.integration.turns import Turns
from heavytop.integration.winding import MOST_POINTS, distinct

LONGEST = float(np.finfo(float).max)


@dataclass(frozen=True, slots=True, eq=False)
class Integrator:
    """What takes the steps of one run.

    Attributes
    ----------
    formulation : Formulation
        Where its last two states are angles that are read off, `compiled` is without them.
    compiled : Compiled
    parameters : dict from str to float
        Constants of the run, by symbol name.
    pace : float
        In whose unit of time steps are taken [1/s].
    projection : Projection or None
        In that unit of time.
    turns : Turns or None
        What counts the turns of the angles that are read off.
    """

    formulation: Formulation
    compiled: Compiled
    parameters: dict[str, float]
    pace: float
    projection: Projection | None
    turns: Turns | None
    _units: Array
    _constants: dict[str, float]

    @classmethod
    def of(
        cls,
        formulation: Formulation,
        compiled: Compiled,
        parameters: dict[str, float],
        start: Array,
        *,
        projected: bool = False,
    ) -> Self:
        """Return what takes the steps of the run from a start, shape (n,)."""
        own = compiled.formulation
        state = start[: len(own.states)]
        pace = float(paces_of(own, state, parameters))
        units, constants = np.where(own.is_rate, pace, 1.0), in_units(pace, parameters)
        projection = Projection.of(own, constants, state / units) if projected else None
        turns = Turns.of(parameters) if formulation.integrated else None
        return cls(formulation, compiled, parameters, pace, projection, turns, units, constants)

    @property
    def compile_s(self) -> float:
        """Time spent in compiling [s]."""
        return self.compiled.compile_s

    def for_this_thread(self) -> Self:
        """Return the one like this that belongs to the calling thread."""
        projection = self.projection and self.projection.for_this_thread()
        return replace(self, compiled=self.compiled.for_this_thread(), projection=projection)

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps [s], as `Compiled` does."""
        self.compiled.load(self._constants)
        own = state[: self._units.size] / self._units
        bound = self.compiled.cautious_step(own, self._own_time(far))
        return None if bound is None else bound / self.pace

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps from a state and sample them, as `Compiled` does, angles and all."""
        turns = self.turns
        if turns is None:
            return self._taken(state, steps, far, samples, longest)
        own, asked = state[:-2], np.empty(0) if samples is None else samples
        apart = turns.decided(own)
        reach = steps * apart / 2  # a step is hardly ever half as long
        while True:
            t = _sorted(np.concatenate((asked, _points(apart, reach, far))), far)
            block = self._taken(own, steps, far, t, longest)
            reached = abs(block.elapsed[0])
            if reached <= reach or reach > MOST_POINTS * apart:
                return _counted(turns, block, state, t[: len(block.rows)], asked, far)
            reach = 1.5 * reached

    def _own_time(self, far: float) -> float:
        """Return a time without end in the run's own unit of time, and finite."""
        return math.copysign(min(abs(far) * self.pace, LONGEST), far)

    def _taken(
        self, state: Array, steps: int, far: float, samples: Array | None, longest: float | None
    ) -> Block:
        """Take steps in the run's own unit of time; the block is measured in seconds."""
        compiled, pace, units = self.compiled, self.pace, self._units
        compiled.load(self._constants)
        taking = Projected(compiled, self.projection) if self.projection else compiled
        if pace == 1:
            return taking.block(state, steps, far, samples, longest)
        done = taking.block(
            state / units,
            steps,
            self._own_time(far),
            None if samples is None else samples * pace,
            None if longest is None else longest * pace,
        )
        high, low = done.elapsed
        return replace(
            done,
            state=done.state * units,
            elapsed=(high / pace, low / pace),
            rows=done.rows * units,
            hits=tuple(Hits(h.t / pace, h.t_low / pace, h.states * units) for h in done.hits),
        )


def _counted(turns: Turns, block: Block, state: Array, t: Array, asked: Array, far: float) -> Block:
    """Return the block with the angles behind its states, and only the rows asked for."""
    end = np.array([block.elapsed[0]])
    parts = [(np.zeros(1), state[None, :-2]), (t, block.rows), (end, block.state[None])]
    parts += [(hits.t, hits.states) for hits in block.hits]
    times, rows = (np.concatenate(x) for x in zip(*parts, strict=True))
    forward = math.copysign(1.0, far)
    unique, where = distinct(forward * times)
    first = (float(state[-2]), float(state[-1]))
    angles = turns.followed(forward * unique, rows[where], first)

    def with_angles(t: Array, rows: Array) -> Array:
        return np.concatenate((rows, angles[np.searchsorted(unique, forward * t)]), axis=1)

    place = np.searchsorted(forward * t, forward * asked)
    place = place[place < t.size]  # the block did not reach the others
    return Block(
        state=with_angles(end, block.state[None])[0],
        elapsed=block.elapsed,
        steps=block.steps,
        rows=with_angles(t[place], block.rows[place]),
        hits=tuple(Hits(h.t, h.t_low, with_angles(h.t, h.states)) for h in block.hits),
        singular=block.singular,
    )


def _points(apart: float, reach: float, far: float) -> Array:
    """Return times so close together that the turns between them are decided."""
    if not math.isfinite(apart):
        return np.empty(0)
    count = min(math.ceil(min(reach, 0.99 * abs(far)) / apart), MOST_POINTS)
    points: Array = math.copysign(apart, far) * np.arange(1.0, count + 1)
    return points[np.abs(points) < abs(far)]


def _sorted(t: Array, far: float) -> Array:
    forward = 1 if far > 0 else -1
    return forward * distinct(forward * t)[0]
