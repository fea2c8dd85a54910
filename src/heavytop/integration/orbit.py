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

from heavytop.integration.compiled import Array, Block, Hits
from heavytop.integration.integrator import Integrator
from heavytop.integration.winding import SLACK, Winding, azimuth, distinct
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
    winding: Winding | None
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
        run = _BlockRun(engine, self.winding, checkpoint, far)
        unique = run.forward * distinct(run.forward * t)[0]
        inverse = np.searchsorted(run.forward * unique, run.forward * t)
        _, seen, _, _ = run.observed(checkpoint.block_steps, unique, abs(run.local(unique[-1:])[0]))
        return Seen(t, np.zeros_like(t), seen.rows[inverse], seen.phi[inverse])


def integrate(
    integrator: Integrator,
    start: Checkpoint,
    samples: Array,
    *,
    winding: Winding | None = None,
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
    winding : Winding, optional
        Follows phi where it is not a state.
    on_block : callable, optional
        Called with the fraction done after each block.
    step_limit : int, optional
        Steps after which to give up.
    step_length : float
        Mean step of the block before the start, where there is one [s].
    keep : callable, optional
        Called after each block but the last with a function that returns the orbit so far.
    """
    journey = _Journey(integrator, winding, start, samples)
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
        winding=orbit.winding,
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
    """One block from its checkpoint, with samples and winding."""

    def __init__(
        self,
        integrator: Integrator,
        winding: Winding | None,
        start: Checkpoint,
        far: float,
    ) -> None:
        self.integrator = integrator
        self.winding = winding
        self.start = start
        self.far = far
        self.longest = integrator.cautious_step(start.state, far) if start.steps == 0 else None
        self.forward = math.copysign(1.0, far)

    def local(self, t: Array) -> Array:
        """Return times since the start of the block [s]."""
        return (t - self.start.time[0]) - self.start.time[1]

    def _block(self, steps: int, samples: Array | None = None) -> Block:
        return self.integrator.block(self.start.state, steps, self.far, samples, self.longest)

    def first_step(self) -> float:
        """Return the length of the first natural step [s]."""
        return self._block(1).elapsed[0] or self.far

    def observed(
        self, steps: int, samples: Array, duration: float
    ) -> tuple[Block, Seen, tuple[Seen, ...], float]:
        """Run the block; return it with the samples it reached, its hits and phi at its end."""
        if samples.size == 0 and self.winding is None:
            block = self._block(steps)
            hits = tuple(self._unfollowed(h) for h in block.hits)
            return block, _nothing(block.state.size), hits, np.nan
        wanted = self.local(samples)
        block, t, rows = self._sampled(steps, wanted, duration)
        phi = self._phi(block, t, rows)
        where = np.searchsorted(self.forward * t, self.forward * wanted)
        inside = where[where < t.size]  # the block did not reach the others
        reached = samples[: inside.size]
        seen = Seen(reached, np.zeros(inside.size), rows[inside], phi(wanted[: inside.size]))
        hits = tuple(Seen(*self._global(h), h.states, phi(h.t)) for h in block.hits)
        end = float(phi(np.array([block.elapsed[0]]))[0])
        return block, seen, hits, end

    def _unfollowed(self, hits: Hits) -> Seen:
        return Seen(*self._global(hits), hits.states, np.full(hits.t.size, np.nan))

    def _sampled(self, steps: int, wanted: Array, duration: float) -> tuple[Block, Array, Array]:
        """Return the block with the times, from 0 on, at which it was sampled, and its states."""
        points = np.empty(0)
        if self.winding is not None:
            count = self.winding.intervals(duration, steps)
            points = np.linspace(0.0, self.forward * duration, count + 1)
        grid = self._ordered(np.concatenate(([0.0], wanted, points)))
        block = self._block(steps, grid[1:])
        rows = np.concatenate((self.start.state[None], block.rows))
        return block, grid[: len(rows)], rows

    def _ordered(self, t: Array) -> Array:
        return self.forward * distinct(self.forward * t)[0] if t.size > 1 else t

    def _global(self, hits: Hits) -> tuple[Array, Array]:
        high, low = (np.full(hits.t.size, word) for word in self.start.time)
        return add((high, low), (hits.t, hits.t_low))

    def _phi(self, block: Block, t: Array, rows: Array) -> Callable[[Array], Array]:
        """Return phi as a function of the times at which the block was seen."""
        winding = self.winding
        if winding is None:
            return lambda asked: np.full(asked.size, np.nan)
        times = np.concatenate((t, *(h.t for h in block.hits), [block.elapsed[0]]))
        states = np.concatenate((rows, *(h.states for h in block.hits), block.state[None]))
        unique, where = distinct(self.forward * times)
        turned = winding.turned(self.forward * unique, states[where], self._more(block.steps))
        phi = winding.on_branch(states[where], self._first_phi(winding) + turned)
        return lambda asked: phi[np.searchsorted(unique, self.forward * asked)]

    def _first_phi(self, winding: Winding) -> float:
        """Return phi at the start; on a pole that in which the axis leaves, phi_0 or phi_0 + pi."""
        state, phi = self.start.state[None], self.start.phi
        if state[0, 0] != 0 or state[0, 1] != 0 or not state[0, 3:5].any():
            return float(winding.on_branch(state, np.array([phi]))[0])
        leaving = float(azimuth(state)[0])
        return leaving + 2 * np.pi * math.ceil((phi - leaving) / (2 * np.pi) - SLACK)

    def _more(self, steps: int) -> Callable[[Array], Array]:
        return lambda t: self._block(steps, t).rows


def _nothing(width: int) -> Seen:
    return Seen(np.empty(0), np.empty(0), np.empty((0, width)), np.empty(0))


class _Journey:
    """An integration under way."""

    def __init__(
        self,
        integrator: Integrator,
        winding: Winding | None,
        start: Checkpoint,
        samples: Array,
    ) -> None:
        self.integrator = integrator
        self.winding = winding
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
        last = self.checkpoints[-1]
        run = _BlockRun(self.integrator, self.winding, last, self.far)
        remaining = np.abs(run.local(self.samples[self.done :]))
        block, seen, hits, phi = self._observed(run, remaining)
        self.seen.append(seen)
        self.hits.append(hits)
        self.done += seen.t.size
        self.steps += block.steps
        time = add(run.start.time, block.elapsed)
        # a step back from the last state, so that rounding cannot put the end behind it
        self.reached = float(self.samples[-1]) if self.arrived else _before(time[0], self.first)
        stuck = block.singular or block.steps == 0
        if not self.arrived and not stuck:
            self.checkpoints.append(Checkpoint(time, block.state, phi, self.steps))
            self.step_length = _mean_step(*self.checkpoints[-2:])
        return self.arrived or not stuck

    def _observed(
        self, run: _BlockRun, remaining: Array
    ) -> tuple[Block, Seen, tuple[Seen, ...], float]:
        """Run a block of full length, or of hardly more steps than it takes to the end.

        How far the steps will reach is guessed from those before. A wrong guess costs another
        run of the block and changes nothing.
        """
        end = float(remaining[-1])
        length = self.step_length or abs(run.first_step())
        full = run.start.block_steps
        steps = min(full, math.ceil(1.02 * end / length) + 2)
        while True:
            duration = min(1.1 * steps * length, end)
            result = run.observed(steps, self.samples[self.done :][remaining <= duration], duration)
            block = result[0]
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
            winding=self.winding,
            checkpoints=tuple(self.checkpoints),
            samples=Seen.join([none, *self.seen[:blocks]]),
            hits=tuple(Seen.join([none, *(h[i] for h in self.hits[:blocks])]) for i in channels),
            end=end,
            steps=steps,
            ending=ending,
        )
