"""An orbit: blocks of natural steps from a start to an end, and what was seen on the way.

The same start, parameters and event functions give the same bits, however the orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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


def integrate(
    integrator: Integrator,
    start: Checkpoint,
    samples: Array,
    *,
    on_block: Callable[[float], None] | None = None,
    step_limit: int | None = None,
    step_length: float = 0.0,
    keep: Keep | None = None,
) -> Orbit:
    """Integrate from a checkpoint to the last of the samples.

    Parameters
    ----------
    integrator : Integrator
    start : Checkpoint
    samples : ndarray, shape (k,), k >= 1
        Strictly monotonic times on one side of the start [s]; the last is the end.
    on_block : callable, optional
        Called with the fraction done after each block.
    step_limit : int, optional
        Steps after which to give up.
    step_length : float
        Mean step of the block before the start, where there is one [s].
    keep : callable, optional
        Called after each block but the last with a function that returns the orbit so far.
    """
    journey = _Journey(integrator, start, samples, step_length)
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


def continued(
    orbit: Orbit,
    samples: Array,
    *,
    on_block: Callable[[float], None] | None = None,
    keep: Keep | None = None,
) -> Orbit:
    """Continue an orbit from its last checkpoint to later samples.

    The blocks are those an uninterrupted integration would have run, so the result is the same
    bit for bit; samples and hits seen before are kept.
    """
    rest = integrate(
        orbit.integrator.for_this_thread(),
        orbit.checkpoints[-1],
        samples,
        on_block=on_block,
        step_length=_mean_step(orbit.checkpoints),
        keep=keep and (lambda rest: keep(lambda: _joined(orbit, rest()))),
    )
    return _joined(orbit, rest)


def _joined(orbit: Orbit, rest: Orbit) -> Orbit:
    """Return an orbit with what follows from its last checkpoint on."""
    last = orbit.checkpoints[-1]
    forward = math.copysign(1.0, _far(orbit.checkpoints[0], rest.end))
    hits = [
        Seen.join([old.where(forward * old.t < forward * last.time[0]), new])
        for old, new in zip(orbit.hits, rest.hits, strict=True)
    ]
    return replace(
        rest,
        checkpoints=orbit.checkpoints[:-1] + rest.checkpoints,
        samples=Seen.join([orbit.samples, rest.samples]),
        hits=tuple(hits),
    )


def _mean_step(checkpoints: Sequence[Checkpoint]) -> float:
    """Return the mean step of the last block, 0 where there is none [s]."""
    if len(checkpoints) < 2:
        return 0.0
    before, after = checkpoints[-2:]
    return abs(after.time[0] - before.time[0]) / (after.steps - before.steps)


def _far(start: Checkpoint, end: float) -> float:
    """Return a local time beyond the whole span, which only a step of such a length would cut."""
    return 4.0 * (end - start.time[0])


class _Journey:
    """An integration under way."""

    def __init__(
        self, integrator: Integrator, start: Checkpoint, samples: Array, step_length: float
    ) -> None:
        self.integrator, self.samples, self.step_length = integrator, samples, step_length
        self.end = float(samples[-1])
        self.far = _far(start, self.end)
        self.checkpoints = [start]
        self.blocks: list[Observed] = []
        self.done = 0  # samples seen

    @property
    def place(self) -> Checkpoint:
        """Where the next block starts."""
        return self.checkpoints[-1]

    @property
    def fraction(self) -> float:
        """How much of the span is done."""
        if self.done == self.samples.size:
            return 1.0
        first = self.checkpoints[0].time[0]
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
        self.step_length = _mean_step(self.checkpoints)
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
        length = self.step_length or self.integrator.first_step(start, far, longest)
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
        whole = len(self.checkpoints) - 1 if ending == "interrupted" else len(self.blocks)
        blocks, first = self.blocks[:whole], self.checkpoints[0]
        last, end = blocks[-1].end if blocks else first, self.end
        if ending != "reached":  # a step back, so that rounding cannot put it behind the last state
            end = float(np.nextafter(np.nextafter(last.time[0], first.time[0]), first.time[0]))
        nothing = Seen(NEVER, NEVER, np.empty((0, first.state.size)), NEVER)
        channels = range(len(self.integrator.compiled.events))
        return Orbit(
            integrator=self.integrator,
            checkpoints=tuple(self.checkpoints),
            samples=Seen.join([nothing, *(seen.samples for seen in blocks)]),
            hits=tuple(Seen.join([nothing, *(x.hits[i] for x in blocks)]) for i in channels),
            end=end,
            steps=last.steps,
            ending=ending,
        )
