"""An orbit: blocks of natural steps from a start to an end, and what was seen on the way.

The same start, parameters and event functions give the same bits, however the orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from heavytop.integration.compiled import Array, Block
from heavytop.integration.integrator import Integrator
from heavytop.numbers.double_double import DoubleDouble, add

FIRST_BLOCK = 256  # steps; each block is four times as long as the last, up to the longest
LONGEST_BLOCK = 4000

Ending = Literal["reached", "singular", "interrupted", "step-limit"]
Keep = Callable[[Callable[[], "Orbit"]], object]


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The start of a block: enough to run it, or the rest of the orbit, again.

    Attributes
    ----------
    time : tuple of float
        Time as a double-double [s].
    state : ndarray, shape (n,)
    phi : float
        Continuous phi [rad]; nan where it is not followed.
    steps : int
        Natural steps taken before.
    """

    time: DoubleDouble
    state: Array
    phi: float
    steps: int

    @property
    def block_steps(self) -> int:
        """How many steps the block has that starts here: a short run needs no long block."""
        return min(3 * self.steps + FIRST_BLOCK, LONGEST_BLOCK)


@dataclass(frozen=True, slots=True)
class Seen:
    """States at given times: times [s] as high and low words, rows (k, n), phi [rad] (k,)."""

    t: Array
    t_low: Array
    rows: Array
    phi: Array

    def where(self, mask: NDArray[np.bool_]) -> Seen:
        """Return those for which the mask holds."""
        return Seen(self.t[mask], self.t_low[mask], self.rows[mask], self.phi[mask])

    @classmethod
    def join(cls, parts: list[Seen]) -> Seen:
        """Return the parts one after the other."""
        return cls(
            *(np.concatenate([getattr(p, f) for p in parts]) for f in ("t", "t_low", "rows", "phi"))
        )


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
        engine = self.integrator.for_this_thread()
        if t.size == 0:
            return Seen(t, t, self.samples.rows[:0], t)
        forward = 1.0 if self.end >= self.checkpoints[0].time[0] else -1.0
        order = np.argsort(forward * t, kind="stable")
        starts = np.array([c.time[0] for c in self.checkpoints])
        block = np.maximum(np.searchsorted(forward * starts, forward * t[order], "right") - 1, 0)
        used = sorted(set(block.tolist()))
        parts = [self._within(engine, self.checkpoints[k], t[order[block == k]]) for k in used]
        seen = Seen.join(parts)
        back = np.argsort(order, kind="stable")
        return Seen(seen.t[back], seen.t_low[back], seen.rows[back], seen.phi[back])

    def _within(self, engine: Integrator, checkpoint: Checkpoint, t: Array) -> Seen:
        far = _far(self.checkpoints[0].time[0], self.end)
        run = _BlockRun(engine, checkpoint, far)
        return run.observed(checkpoint.block_steps, t, abs(float(run.local(t[-1:])[0]))).samples


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
    journey = _Journey(integrator, start, samples)
    journey.step_length = step_length
    ending: Ending = "reached"
    try:
        while not journey.arrived:
            if step_limit is not None and journey.steps >= step_limit:
                ending = "step-limit"
                break
            if not journey.advance():
                ending = "singular"
                break
            if keep is not None and not journey.arrived:
                keep(lambda: journey.orbit("interrupted"))
            if on_block is not None:
                on_block(journey.fraction)
    except KeyboardInterrupt:
        if journey.checkpoints[-1].steps == 0:  # nothing is done
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
    engine, last = orbit.integrator.for_this_thread(), orbit.checkpoints[-1]
    before = orbit.checkpoints[-2] if len(orbit.checkpoints) > 1 else None
    rest = integrate(
        engine,
        last,
        samples,
        on_block=on_block,
        step_length=_mean_step(before, last),
        keep=keep and (lambda rest: keep(lambda: _joined(orbit, rest()))),
    )
    return _joined(orbit, rest)


def _joined(orbit: Orbit, rest: Orbit) -> Orbit:
    """Return an orbit with what follows from its last checkpoint on."""
    last = orbit.checkpoints[-1]
    forward = 1.0 if rest.end >= orbit.checkpoints[0].time[0] else -1.0
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


def _mean_step(before: Checkpoint | None, after: Checkpoint) -> float:
    if before is None:
        return 0.0
    return abs(after.time[0] - before.time[0]) / (after.steps - before.steps)


def _before(time: float, start: float) -> float:
    return float(np.nextafter(np.nextafter(time, start), start))


def _far(start: float, end: float) -> float:
    """Return a local time beyond the whole span, which only a step of such a length would cut."""
    return 4.0 * (end - start)


class _BlockRun:
    """One block from its checkpoint."""

    def __init__(self, integrator: Integrator, start: Checkpoint, far: float) -> None:
        self.integrator, self.start, self.far = integrator, start, far
        self.longest = integrator.cautious_step(start.state, far) if start.steps == 0 else None

    def local(self, t: Array) -> Array:
        """Return times since the start of the block [s]."""
        return (t - self.start.time[0]) - self.start.time[1]

    def first_step(self) -> float:
        """Return the length of the first natural step [s]."""
        start = self.start
        return self.integrator.first_step(start.state, self.far, self.longest) or self.far

    def observed(self, steps: int, samples: Array, duration: float) -> _Observed:
        """Run the block, and tell the angles at the samples and up to a time since its start."""
        start = self.start
        state = start.state if math.isnan(start.phi) else np.append(start.state, start.phi)
        block = self.integrator.block(
            state, steps, self.far, self.local(samples), self.longest, duration
        )
        reached = samples[: len(block.rows)]
        seen = Seen(reached, np.zeros(reached.size), *self._apart(block.rows))
        late = [h.after(start.time) for h in block.hits]
        hits = tuple(Seen(h.t, h.t_low, *self._apart(h.states)) for h in late)
        (end,), (phi,) = self._apart(block.state[None])
        time, taken = add(start.time, block.elapsed), start.steps + block.steps
        return _Observed(block, seen, hits, Checkpoint(time, end, float(phi), taken))

    def _apart(self, rows: Array) -> tuple[Array, Array]:
        """Return the states, shape (k, n), and phi, nan where it is not followed."""
        width = self.start.state.size
        followed = rows.shape[1] > width
        return rows[:, :width], rows[:, width] if followed else np.full(len(rows), np.nan)


@dataclass(frozen=True, slots=True)
class _Observed:
    """A block that was run: the samples it reached, its zeros of event functions, and its end."""

    block: Block
    samples: Seen
    hits: tuple[Seen, ...]
    end: Checkpoint


def _nothing(width: int) -> Seen:
    return Seen(np.empty(0), np.empty(0), np.empty((0, width)), np.empty(0))


class _Journey:
    """An integration under way."""

    def __init__(
        self,
        integrator: Integrator,
        start: Checkpoint,
        samples: Array,
    ) -> None:
        self.integrator = integrator
        self.samples = samples
        self.far = _far(start.time[0], float(samples[-1]))
        self.checkpoints = [start]
        self.seen: list[Seen] = []
        self.hits: list[tuple[Seen, ...]] = []
        self.done = 0  # samples seen
        self.steps = start.steps
        self.step_length = 0.0  # mean natural step of the last block [s]
        self.reached = start.time[0]
        self.first = start.time[0]

    @property
    def arrived(self) -> bool:
        """Whether the last sample has been seen."""
        return self.done == self.samples.size

    @property
    def fraction(self) -> float:
        """How much of the span is done."""
        return (self.reached - self.first) / (float(self.samples[-1]) - self.first)

    def advance(self) -> bool:
        """Run one block; tell whether the next one can follow."""
        run = self._observed(_BlockRun(self.integrator, self.checkpoints[-1], self.far))
        self.seen.append(run.samples)
        self.hits.append(run.hits)
        self.done += run.samples.t.size
        self.steps = run.end.steps
        # a step back from the last state, so that rounding cannot put the end behind it
        end = float(self.samples[-1])
        self.reached = end if self.arrived else _before(run.end.time[0], self.first)
        stuck = run.block.singular or run.block.steps == 0
        if not self.arrived and not stuck:
            self.checkpoints.append(run.end)
            self.step_length = _mean_step(*self.checkpoints[-2:])
        return self.arrived or not stuck

    def _observed(self, run: _BlockRun) -> _Observed:
        """Run a block of full length, or of hardly more steps than it takes to the end.

        How far the steps will reach is guessed from those before. A wrong guess costs another
        run of the block and changes nothing.
        """
        waiting = self.samples[self.done :]
        remaining = np.abs(run.local(waiting))
        end = float(remaining[-1])
        length = self.step_length or abs(run.first_step())
        full = run.start.block_steps
        steps = min(full, math.ceil(1.02 * end / length) + 2)
        while True:
            duration = min(1.1 * steps * length, end)
            result = run.observed(steps, waiting[remaining <= duration], duration)
            block = result.block
            reached = abs(block.elapsed[0])
            length = reached / block.steps if block.steps else length
            if reached > duration and duration < end:
                continue  # the steps grew: look again, at all samples of the block
            if reached >= end or steps == full or block.singular:
                return result
            steps = min(full, steps + math.ceil(1.05 * (end - reached) / length) + 1)

    def orbit(self, ending: Ending) -> Orbit:
        """Return what has been seen so far.

        An interrupt may come in the middle of `advance`: what counts then is the last checkpoint.
        """
        width = len(self.integrator.formulation.states)
        none = _nothing(width)
        channels = range(len(self.integrator.compiled.events))
        blocks, steps, end = len(self.seen), self.steps, self.reached
        if ending == "interrupted":
            last = self.checkpoints[-1]
            blocks, steps = len(self.checkpoints) - 1, last.steps
            end = _before(last.time[0], self.first)
        return Orbit(
            integrator=self.integrator,
            checkpoints=tuple(self.checkpoints),
            samples=Seen.join([none, *self.seen[:blocks]]),
            hits=tuple(Seen.join([none, *(h[i] for h in self.hits[:blocks])]) for i in channels),
            end=end,
            steps=steps,
            ending=ending,
        )
