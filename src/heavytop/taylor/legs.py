"""An integrator that projects: its blocks are made of legs, each followed by a projection.

It stands where an integrator stands. Every leg measures time from its own start and takes a fixed
number of natural steps, so the same start gives the same bits however a block is sampled; samples
and events are read off the polynomials of the steps, before the projection that follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from heavytop.doubledouble import DoubleDouble, add
from heavytop.models.formulation import Formulation
from heavytop.taylor.engine import Array, Block, Hits
from heavytop.taylor.integrator import Integrator
from heavytop.taylor.projection import Projection

STRIDE = 256  # steps in a leg


@dataclass(frozen=True, slots=True, eq=False)
class Projected:
    """A compiled formulation whose runs are put back onto the invariants of their start.

    Attributes
    ----------
    engine : Integrator
    projection : Projection
    """

    engine: Integrator
    projection: Projection

    @property
    def formulation(self) -> Formulation:
        """The formulation that is integrated."""
        return self.engine.formulation

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

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps [s], as the engine has it."""
        return self.engine.cautious_step(state, far)

    def for_this_thread(self) -> Projected:
        """Return the one like this that belongs to the calling thread."""
        return Projected(self.engine.for_this_thread(), self.projection)

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps, as `Engine` says, with a projection after every leg of them."""
        asked = np.empty(0) if samples is None else samples
        legs: list[tuple[DoubleDouble, Block]] = []
        begun, taken, done, reach = (0.0, 0.0), 0, 0, math.inf
        while taken < steps:
            count = min(STRIDE, steps - taken)
            local = (asked[done:] - begun[0]) - begun[1]
            leg = self._leg(state, count, far, local, longest, reach)
            legs.append((begun, leg))
            begun = add(begun, leg.elapsed)
            taken, done = taken + leg.steps, done + len(leg.rows)
            state, reach = self.projection(leg.state), 2 * abs(leg.elapsed[0])
            if leg.steps < count:
                break
        return _joined(legs, state, begun)

    def _leg(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array,
        longest: float | None,
        reach: float,
    ) -> Block:
        """Run a leg with the samples within its probable reach, or again with all of them."""
        near = samples[np.abs(samples) <= reach]
        leg = self.engine.block(state, steps, far, near, longest)
        if near.size < samples.size and abs(leg.elapsed[0]) > reach:
            return self.engine.block(state, steps, far, samples, longest)
        return leg


def _joined(legs: list[tuple[DoubleDouble, Block]], state: Array, elapsed: DoubleDouble) -> Block:
    blocks = [leg for _, leg in legs]
    hits = zip(*([_since(begun, h) for h in leg.hits] for begun, leg in legs), strict=True)
    return Block(
        state=state,
        elapsed=elapsed,
        steps=sum(leg.steps for leg in blocks),
        rows=np.concatenate([leg.rows for leg in blocks]),
        hits=tuple(Hits.join(list(each)) for each in hits),
        singular=blocks[-1].singular,
    )


def _since(begun: DoubleDouble, hits: Hits) -> Hits:
    high, low = (np.full(hits.t.size, word) for word in begun)
    return Hits(*add((high, low), (hits.t, hits.t_low)), hits.states)
