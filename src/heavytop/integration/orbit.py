"""An orbit, in blocks of natural steps from its start to its end.

The same start, parameters and event functions give the same bits, however an orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step.

Nothing in the integrator grows, and the state at a block's start is enough to run it again, or to
go on from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import Outcome
from heavytop.integration.blocks import Block, Checkpoint, Integrator
from heavytop.integration.engine import Array, Seen

Keep = Callable[[Callable[[], "Orbit"]], object]


@dataclass(frozen=True, slots=True, eq=False)
class Orbit:
    """The result of an integration; it can be asked for the state at any time it covers.

    `between` was seen at other times than the samples, on the way from the start.
    """

    integrator: Integrator
    checkpoints: tuple[Checkpoint, ...]
    samples: Seen
    hits: tuple[Seen, ...]
    end: float
    steps: int
    outcome: Outcome
    between: Seen

    @property
    def parameters(self) -> dict[str, Any]:
        """Constants of the run, by symbol name."""
        return self.integrator.parameters

    def places_of(self, t: Array) -> NDArray[np.intp] | None:
        """Return which of `between` are at times, shape (k,); None where it was not seen at all."""
        there = self.between.t
        place = np.minimum(np.searchsorted(abs(there), abs(t)), there.size - 1)
        return place if there.size and (there[place] == t).all() else None

    def seen_at(self, t: Array) -> Seen:
        """Return the states at times, of those seen on the way if all of them were."""
        place = self.places_of(t)
        return self.at(t) if place is None else self.between.where(place)

    def at(self, t: Array) -> Seen:
        """Return the states at times between start and end, in any order, shape (k,)."""
        t = self.integrator.numbers(t)
        if t.size == 0:
            return Seen(t, t, self.samples.states[:0])
        taking, far = self.integrator.for_this_thread(), _far(self.checkpoints[0], self.end)
        forward = np.copysign(1.0, far)
        order = np.argsort(forward * t, kind="stable")
        t = t[order]
        high, low = np.array([c.time for c in self.checkpoints]).T
        block = np.maximum(np.searchsorted(forward * high, forward * t, "right") - 1, 0)
        early = forward * ((t - high[block]) - low[block]) < 0  # a double before its start
        block = np.maximum(block - early, 0)
        parts, late = [], t[:0]
        for k in np.union1d(block, np.minimum(block + 1, high.size - 1)).tolist():
            asked = np.concatenate((late, t[block == k]))
            if asked.size:
                start = self.checkpoints[k]
                seen = taking.block(start, start.block_steps, far, asked)
                parts.append(seen.samples)
                late = asked[seen.samples.t.size :]  # by rounding: the next block begins there
        return Seen.join(parts).where(np.argsort(order, kind="stable"))


def not_begun(integrator: Integrator, start: Checkpoint) -> Orbit:
    """Return an orbit that is nothing yet but its start."""
    never = start.state[:0]
    nothing = Seen(never, never, integrator.engine.nothing)
    hits, outcome = (nothing,) * len(integrator.engine.events), Outcome.INTERRUPTED
    end, steps = float(start.time[0]), start.steps
    return Orbit(integrator, (start,), nothing, hits, end, steps, outcome, between=nothing)


def integrate(
    orbit: Orbit,
    samples: Array,
    *,
    between: Array | None = None,
    on_block: Callable[[float], None] | None = None,
    step_limit: int | None = None,
    keep: Keep | None = None,
) -> Orbit:
    """Integrate from the last checkpoint of an orbit to the last of the samples.

    The blocks are those an uninterrupted integration would have run, so the result is the same
    bit for bit; samples and hits seen before are kept.

    Parameters
    ----------
    orbit : Orbit
    samples : ndarray, shape (k,), k >= 1
        Strictly monotonic times on one side of the start [s]; the last is the end.
    between : ndarray, shape (m,), optional
        Other times up to the end, at which the orbit is seen on its way; in any order [s].
    on_block : callable, optional
        Called with the fraction done after each block.
    step_limit : int, optional
        Steps after which to give up.
    keep : callable, optional
        Called after each block but the last with a function that returns the orbit so far.
    """
    journey = _Journey(orbit, samples, samples[:0] if between is None else between)
    outcome: Outcome | None = None
    try:
        while outcome is None:
            outcome = journey.advance()
            if keep is not None and outcome is None:
                keep(lambda: journey.orbit(Outcome.INTERRUPTED))
            if on_block is not None and outcome != Outcome.SINGULAR:
                on_block(journey.fraction)
            if outcome is None and step_limit is not None and journey.place.steps >= step_limit:
                outcome = Outcome.STEP_LIMIT
    except KeyboardInterrupt:
        if journey.place.steps == 0:  # nothing is done
            raise
        outcome = Outcome.INTERRUPTED
    return journey.orbit(outcome)


def _far(start: Checkpoint, end: float) -> float:
    """Return a local time beyond the whole span, which only a step of such a length would cut."""
    return 4.0 * (end - float(start.time[0]))


class _Journey:
    """An integration under way, behind an orbit that is known."""

    def __init__(self, orbit: Orbit, samples: Array, between: Array) -> None:
        times = np.concatenate((samples, between))
        order = np.argsort(abs(times), kind="stable")
        self.known, self.samples, self.is_sample = orbit, times[order], order < samples.size
        self.integrator = orbit.integrator.for_this_thread()
        self.checkpoints = [*orbit.checkpoints]
        self.end = float(samples[-1])
        self.far = _far(self.place, self.end)
        self.blocks: list[Block] = []
        self.done = 0  # samples seen

    @property
    def place(self) -> Checkpoint:
        """Where the next block starts."""
        return self.checkpoints[-1]

    @property
    def fraction(self) -> float:
        """How much of what was ahead is done."""
        if self.done == self.samples.size:
            return 1.0
        first, here = (float(c.time[0]) for c in (self.known.checkpoints[-1], self.place))
        return (here - first) / (self.end - first)

    def advance(self) -> Outcome | None:
        """Run one block; tell how the integration ended, if it did."""
        start, reach = self.place, math.inf
        if len(self.checkpoints) > 1:
            before = self.checkpoints[-2]
            length = abs(float(start.time[0] - before.time[0])) / (start.steps - before.steps)
            reach = 2 * length * start.block_steps
        waiting = self.samples[self.done :]
        seen = self.integrator.block(start, start.block_steps, self.far, waiting, reach)
        self.blocks.append(seen)
        self.done += seen.samples.t.size
        if self.done == self.samples.size:
            return Outcome.FINISHED
        if seen.singular or seen.end.steps == start.steps:
            return Outcome.SINGULAR
        self.checkpoints.append(seen.end)
        return None

    def orbit(self, outcome: Outcome) -> Orbit:
        """Return what has been seen so far.

        An interrupt may come in the middle of `advance`: what counts then is the last checkpoint.
        """
        known, first = self.known, self.known.checkpoints[-1]
        whole = len(self.checkpoints) - len(known.checkpoints)
        blocks = self.blocks[:whole] if outcome == Outcome.INTERRUPTED else self.blocks
        last, end = blocks[-1].end if blocks else first, self.end
        if outcome != Outcome.FINISHED:
            # a step back, so that rounding cannot put it behind the last state
            reached, begun = float(last.time[0]), float(first.time[0])
            end = float(np.nextafter(np.nextafter(reached, begun), begun))
        forward = np.copysign(1.0, self.far)
        seen = Seen.join([known.samples.where(slice(0)), *(each.samples for each in blocks)])
        is_sample = self.is_sample[: seen.t.size]
        return Orbit(
            integrator=self.integrator,
            checkpoints=tuple(self.checkpoints),
            samples=Seen.join([known.samples, seen.where(is_sample)]),
            between=seen.where(~is_sample),
            hits=tuple(
                Seen.join([hit.where(forward * hit.t < forward * first.time[0]), *later])
                for hit, *later in zip(known.hits, *(each.hits for each in blocks), strict=True)
            ),
            end=end,
            steps=last.steps,
            outcome=outcome,
        )
