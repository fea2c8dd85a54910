"""An orbit: blocks of natural steps from a start to an end, and what was seen on the way.

The same start, parameters and event functions give the same bits, however the orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from heavytop.integration.compiled import Array
from heavytop.integration.integrator import NEVER, Checkpoint, Integrator, Observed, Seen

Ending = Literal["reached", "singular", "interrupted", "step-limit"]
Keep = Callable[[Callable[[], "Orbit"]], object]


@dataclass(frozen=True, slots=True, eq=False)
class Orbit:
    """The result of an integration; it can be asked for the state at any time it covers."""

    integrator: Integrator
    checkpoints: tuple[Checkpoint, ...]
    samples: Seen
    hits: tuple[Seen, ...]
    end: float
    steps: int
    ending: Ending

    @property
    def parameters(self) -> dict[str, float]:
        """Constants of the run, by symbol name."""
        return self.integrator.parameters

    def at(self, t: Array) -> Seen:
        """Return the states at times between start and end, in any order, shape (k,)."""
        if t.size == 0:
            return Seen(t, t, self.samples.rows[:0], t)
        engine, far = self.integrator.for_this_thread(), _far(self.checkpoints[0], self.end)
        forward = math.copysign(1.0, far)
        order = np.argsort(forward * t, kind="stable")
        starts = np.array([c.time[0] for c in self.checkpoints])
        block = np.maximum(np.searchsorted(forward * starts, forward * t[order], "right") - 1, 0)
        parts = []
        for k in sorted(set(block.tolist())):
            start, asked = self.checkpoints[k], t[order[block == k]]
            longest, reach = engine.cautious_step(start, far), abs(float(start.local(asked)[-1]))
            seen = engine.block(start, start.block_steps, far, asked, longest, reach)
            parts.append(seen.samples)
        return Seen.join(parts).where(np.argsort(order, kind="stable"))


def not_begun(integrator: Integrator, start: Checkpoint) -> Orbit:
    """Return an orbit that is nothing yet but its start."""
    nothing = Seen(NEVER, NEVER, np.empty((0, start.state.size)), NEVER)
    hits = (nothing,) * len(integrator.compiled.events)
    return Orbit(integrator, (start,), nothing, hits, start.time[0], start.steps, "interrupted")


def continued(
    orbit: Orbit,
    samples: Array,
    *,
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
    on_block : callable, optional
        Called with the fraction done after each block.
    step_limit : int, optional
        Steps after which to give up.
    keep : callable, optional
        Called after each block but the last with a function that returns the orbit so far.
    """
    journey = _Journey(orbit, samples)
    ending: Ending | None = None
    try:
        while ending is None:
            ending = journey.advance()
            if keep is not None and ending is None:
                keep(lambda: journey.orbit("interrupted"))
            if on_block is not None and ending != "singular":
                on_block(journey.fraction)
            if ending is None and step_limit is not None and journey.place.steps >= step_limit:
                ending = "step-limit"
    except KeyboardInterrupt:
        if journey.place.steps == 0:  # nothing is done
            raise
        ending = "interrupted"
    return journey.orbit(ending)


def _far(start: Checkpoint, end: float) -> float:
    """Return a local time beyond the whole span, which only a step of such a length would cut."""
    return 4.0 * (end - start.time[0])


class _Journey:
    """An integration under way, behind an orbit that is known."""

    def __init__(self, orbit: Orbit, samples: Array) -> None:
        self.known, self.samples = orbit, samples
        self.integrator = orbit.integrator.for_this_thread()
        self.checkpoints = [*orbit.checkpoints]
        self.end = float(samples[-1])
        self.far = _far(self.place, self.end)
        self.blocks: list[Observed] = []
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
        first = self.known.checkpoints[-1].time[0]
        return (self.place.time[0] - first) / (self.end - first)

    def advance(self) -> Ending | None:
        """Run one block; tell how the integration ended, if it did."""
        seen = self._observed()
        self.blocks.append(seen)
        self.done += seen.samples.t.size
        if self.done == self.samples.size:
            return "reached"
        if seen.block.singular or seen.block.steps == 0:
            return "singular"
        self.checkpoints.append(seen.end)
        return None

    def _observed(self) -> Observed:
        """Run a block of full length, or of hardly more steps than it takes to the end.

        How far the steps will reach is guessed from those before. A wrong guess costs another
        run of the block and changes nothing.
        """
        start, far, waiting = self.place, self.far, self.samples[self.done :]
        longest = self.integrator.cautious_step(start, far)
        remaining = np.abs(start.local(waiting))
        end = float(remaining[-1])
        if len(self.checkpoints) > 1:
            before = self.checkpoints[-2]
            length = abs(start.time[0] - before.time[0]) / (start.steps - before.steps)
        else:
            length = self.integrator.first_step(start, far, longest)
        full = start.block_steps
        steps = min(full, math.ceil(1.02 * end / length) + 2)
        while True:
            reach = min(1.1 * steps * length, end)
            asked = waiting[remaining <= reach]
            seen = self.integrator.block(start, steps, far, asked, longest, reach)
            reached, taken = abs(seen.block.elapsed[0]), seen.block.steps
            length = reached / taken if taken else length
            if reached > reach and reach < end:
                continue  # the steps grew: look again, at all samples of the block
            if reached >= end or steps == full or seen.block.singular:
                return seen
            steps = min(full, steps + math.ceil(1.05 * (end - reached) / length) + 1)

    def orbit(self, ending: Ending) -> Orbit:
        """Return what has been seen so far.

        An interrupt may come in the middle of `advance`: what counts then is the last checkpoint.
        """
        known, first = self.known, self.known.checkpoints[-1]
        whole = len(self.checkpoints) - len(known.checkpoints)
        blocks = self.blocks[:whole] if ending == "interrupted" else self.blocks
        last, end = blocks[-1].end if blocks else first, self.end
        if ending != "reached":  # a step back, so that rounding cannot put it behind the last state
            end = float(np.nextafter(np.nextafter(last.time[0], first.time[0]), first.time[0]))
        forward = math.copysign(1.0, self.far)
        return Orbit(
            integrator=self.integrator,
            checkpoints=tuple(self.checkpoints),
            samples=Seen.join([known.samples, *(seen.samples for seen in blocks)]),
            hits=tuple(
                Seen.join([hit.where(forward * hit.t < forward * first.time[0]), *later])
                for hit, *later in zip(known.hits, *(seen.hits for seen in blocks), strict=True)
            ),
            end=end,
            steps=last.steps,
            ending=ending,
        )
