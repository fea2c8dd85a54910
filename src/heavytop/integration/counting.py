"""An integrator that counts turns: behind the states of a quaternion, phi and psi.

It stands where an integrator stands. The angles are no states of the equations: they are read off
the others after each block, and their turns are counted. So nothing in the integrator grows, and
the state at a block's start is enough to run it again, or to go on from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.integration.engine import Array, Block, Engine, Hits
from heavytop.integration.turns import Turns
from heavytop.integration.winding import MOST_POINTS, distinct


@dataclass(frozen=True, slots=True, eq=False)
class Counting:
    """A compiled formulation with phi and psi, less its uniform part, behind its states.

    Attributes
    ----------
    engine : Engine
        Takes the steps, in the formulation without the angles.
    formulation : Formulation
        The one with the angles.
    turns : Turns
    """

    engine: Engine
    formulation: Formulation
    turns: Turns

    @property
    def events(self) -> tuple[str, ...]:
        """Names of the event functions that are watched."""
        return self.engine.events

    @property
    def order(self) -> int:
        """Order of the Taylor polynomials."""
        return self.engine.order

    @property
    def compile_s(self) -> float:
        """Time spent in compiling [s]."""
        return self.engine.compile_s

    def load(self, parameters: dict[str, float]) -> None:
        """Load the constants of a run, by the names of their symbols."""
        self.engine.load(parameters)

    def for_this_thread(self) -> Counting:
        """Return the one like this that belongs to the calling thread."""
        return Counting(self.engine.for_this_thread(), self.formulation, self.turns)

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps [s], as the engine has it."""
        return self.engine.cautious_step(state[:-2], far)

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps from a state and sample them, angles and all.

        Parameters and result are those of `Integrator.block`; the last two states are angles.
        """
        own, asked = state[:-2], np.empty(0) if samples is None else samples
        apart = self.turns.decided(own)
        reach = steps * apart / 2  # a step is hardly ever half as long
        while True:
            t = _sorted(np.concatenate((asked, _points(apart, reach, far))), far)
            block = self.engine.block(own, steps, far, t, longest)
            reached = abs(block.elapsed[0])
            if reached <= reach or reach > MOST_POINTS * apart:
                return self._counted(block, state, t[: len(block.rows)], asked, far)
            reach = 1.5 * reached

    def _counted(self, block: Block, state: Array, t: Array, asked: Array, far: float) -> Block:
        """Return the block with the angles behind its states, and only the rows asked for."""
        end = np.array([block.elapsed[0]])
        parts = [(np.zeros(1), state[None, :-2]), (t, block.rows), (end, block.state[None])]
        parts += [(hits.t, hits.states) for hits in block.hits]
        times, rows = (np.concatenate(x) for x in zip(*parts, strict=True))
        forward = math.copysign(1.0, far)
        unique, where = distinct(forward * times)
        first = (float(state[-2]), float(state[-1]))
        angles = self.turns.followed(forward * unique, rows[where], first)

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
