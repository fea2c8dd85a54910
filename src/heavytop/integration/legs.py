"""Blocks of steps with projections: they are made of legs, each followed by a projection.

Every leg measures time from its own start and takes a fixed number of natural steps, so the same
start gives the same bits however a block is sampled; samples and events are read off the
polynomials of the steps, before the projection that follows.

Natural steps depend on where they begin, and so they may fall into a cycle: the same points period
after period, rounded the same way each time, and what should be a random walk is a drift. Steps
that are no longer than the mean of those of the first leg, and in no two legs of the same length,
do not.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from heavytop.integration.compiled import Array, Block, Compiled, Hits
from heavytop.integration.projection import Projection
from heavytop.numbers.double_double import DoubleDouble, add

ROOM = 260  # states in a leg: steps take longer the more they have, a projection hardly
EVEN = 0.12  # how much shorter than the mean of the first leg the longest steps of a leg may be
GOLDEN = (math.sqrt(5) - 1) / 2  # its multiples, less the whole numbers, are never close again


@dataclass(frozen=True, slots=True, eq=False)
class Projected:
    """A compiled formulation whose steps are put back onto the invariants of a start."""

    compiled: Compiled
    projection: Projection

    @property
    def stride(self) -> int:
        """Steps in a leg."""
        return max(1, ROOM // len(self.compiled.formulation.states))

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps, as `Compiled` does, with a projection after every leg of them."""
        waiting = _Waiting([] if samples is None else samples.tolist())
        legs: list[tuple[DoubleDouble, Block]] = []
        begun, taken, reach, ended = (0.0, 0.0), 0, math.inf, False
        stride, bound, even = self.stride, longest, _Even()
        while taken < steps and not ended and (rest := far - begun[0]) * far > 0:
            count, near = min(stride, steps - taken), waiting.since(begun, reach)
            quick = self._quickly(state, count, rest, bound, reach) if near is None else None
            if quick is not None:
                reached, elapsed = quick
                taken += count
            else:
                leg = self.compiled.block(state, count, rest, near, bound)
                if abs(leg.elapsed[0]) > 0.9 * reach:  # so far samples were not looked for
                    leg = self.compiled.block(state, count, rest, waiting.since(begun), bound)
                legs.append((begun, leg))
                reached, elapsed, ended = leg.state, leg.elapsed, leg.steps < count
                taken, waiting.done = taken + leg.steps, waiting.done + len(leg.rows)
            bound = even.after(abs(elapsed[0]) / count, longest)
            begun, state, reach = add(begun, elapsed), self.projection(reached), 2 * abs(elapsed[0])
        return self._joined(legs, state, begun, taken)

    def _quickly(
        self, state: Array, steps: int, far: float, longest: float | None, reach: float
    ) -> tuple[Array, DoubleDouble] | None:
        """Take the steps of a leg without samples and events; None if it is no such leg."""
        if self.compiled.events:
            return None
        leg = self.compiled.unseen(state, steps, far, longest)
        return None if leg is None or abs(leg[1][0]) > 0.9 * reach else leg

    def _joined(
        self,
        legs: list[tuple[DoubleDouble, Block]],
        state: Array,
        elapsed: DoubleDouble,
        steps: int,
    ) -> Block:
        hits = zip(*([h.after(begun) for h in leg.hits] for begun, leg in legs), strict=True)
        return Block(
            state=state,
            elapsed=elapsed,
            steps=steps,
            rows=np.concatenate([self.compiled.nothing, *(leg.rows for _, leg in legs)]),
            hits=tuple(Hits.join(list(each)) for each in hits),
            singular=bool(legs) and legs[-1][1].singular,
        )


class _Even:
    """The longest step of every leg but the first."""

    def __init__(self) -> None:
        self.mean, self.legs = 0.0, 0

    def after(self, mean: float, longest: float | None) -> float:
        """Return the bound for the leg after one of this mean step [s]."""
        self.mean, self.legs = self.mean or mean, self.legs + 1
        even = self.mean * (1 - EVEN * (self.legs * GOLDEN % 1))
        return even if longest is None else min(even, longest)


class _Waiting:
    """The samples of a block, of which so many are done."""

    def __init__(self, times: list[float]) -> None:
        self.times = times
        self.distances = list(map(abs, times))
        self.done = 0

    def since(self, begun: DoubleDouble, reach: float = math.inf) -> Array | None:
        """Return the times within reach of a leg's start, since then; None if there are none."""
        if self.done == len(self.times):
            return None
        last = bisect_right(self.distances, abs(begun[0]) + reach, self.done)
        if last == self.done:
            return None
        return np.array([_local(t, begun) for t in self.times[self.done : last]])


def _local(t: float, begun: DoubleDouble) -> float:
    """Return a time since a leg's start; one that is the start, within rounding, is just after."""
    local = (t - begun[0]) - begun[1]
    return local if local * t > 0 else math.copysign(float(np.finfo(float).tiny), t)
