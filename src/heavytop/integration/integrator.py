"""An orbit, in blocks of natural steps, and what takes them: a compiled formulation, turns counted.

The same start, parameters and event functions give the same bits, however an orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step.

heyoka takes its steps in the run's own unit of time. Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone: so a block has the same
bits however it was come to.

phi of the axis form, phi and psi of the attitude form are no states of the equations: they are
read off the others after each block, and their turns are counted. So nothing in the integrator
grows, and the state at a block's start is enough to run it again, or to go on from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.errors import Outcome
from heavytop.exact.pairs import DoubleDouble, add
from heavytop.integration.compiled import (
    Array,
    Block,
    Compiled,
    Polynomials,
    Seen,
    compiled,
)
from heavytop.integration.paces import in_units, paces_of
from heavytop.integration.projection import Projected, Projection
from heavytop.integration.turns import distinct, turns_of

FIRST_BLOCK = 256  # steps; each block is four times as long as the last, up to the longest
LONGEST_BLOCK = 4000
LONGEST = float(np.finfo(float).max)  # a time [s]
NEVER = np.empty(0)
Keep = Callable[[Callable[[], "Orbit"]], object]


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The start of a block: enough to run it, or the rest of the orbit, again.

    Attributes
    ----------
    time : tuple of float
        Time as a double-double [s].
    state : ndarray, shape (n,)
        With the angles that are counted.
    steps : int
        Natural steps taken before.
    """

    time: DoubleDouble
    state: Array
    steps: int

    @property
    def block_steps(self) -> int:
        """How many steps the block has that starts here: a short run needs no long block."""
        return min(3 * self.steps + FIRST_BLOCK, LONGEST_BLOCK)

    def local(self, t: Array) -> Array:
        """Return times since then [s]."""
        return (t - self.time[0]) - self.time[1]


@dataclass(frozen=True, slots=True)
class Observed:
    """A block of steps, what was seen on the way at samples and at zeros of events, and its end."""

    block: Block
    samples: Seen
    hits: tuple[Seen, ...]
    end: Checkpoint


class Integrator:
    """What takes the steps of the run from a start, shape (n,), and counts angles.

    Attributes
    ----------
    formulation : Formulation
        Where its last states are angles that are counted, `compiled` is without them.
    compiled : Compiled
    parameters : dict from str to float
        Constants of the run, by symbol name.
    pace : float
        In whose unit of time steps are taken [1/s].
    own_constants : dict from str to float
        The same constants, in that unit of time.
    projection : Projection or None
        In that unit of time.
    turns : Turns or None
        What counts these angles.
    """

    def __init__(
        self,
        formulation: Formulation,
        compiled: Compiled,
        parameters: dict[str, float],
        start: Array,
        *,
        projected: bool = False,
    ) -> None:
        own = compiled.formulation
        state = start[: len(own.states)]
        self.formulation, self.compiled, self.parameters = formulation, compiled, parameters
        self.pace = float(paces_of(own, state, parameters))
        self._units = np.where(own.is_rate, self.pace, 1.0)
        self.own_constants = in_units(self.pace, parameters)
        started = state / self._units
        self.projection = Projection.of(own, self.own_constants, started) if projected else None
        self.turns = turns_of(formulation, parameters, state)

    @property
    def compile_s(self) -> float:
        """Time spent in compiling [s]."""
        return self.compiled.compile_s

    def for_this_thread(self) -> Integrator:
        """Return the one like this that belongs to the calling thread."""
        found, own = copy(self), self.compiled
        found.compiled = compiled(own.formulation, own.events, own.tolerance)
        if self.projection:
            found.projection = Projection(own.formulation, self.projection.fixed)
        return found

    def cautious_step(self, start: Checkpoint, far: float) -> float | None:
        """Return a bound for the first steps of a run, as `Compiled` does [s]; later none."""
        if start.steps:
            return None
        self.compiled.load(self.own_constants)
        own = start.state[: self._units.size] / self._units
        bound = self.compiled.cautious_step(own, self._own_time(far))
        return None if bound is None else bound / self.pace

    def first_step(self, start: Checkpoint, far: float, longest: float | None) -> float:
        """Return the length of the first natural step [s]."""
        own = start.state[: self._units.size]
        return abs(self._taken(own, 1, far, NEVER, longest).elapsed[0] or far)

    def block(
        self,
        start: Checkpoint,
        steps: int,
        far: float,
        samples: Array = NEVER,
        longest: float | None = None,
        reach: float = 0.0,
    ) -> Observed:
        """Take natural steps and sample them, angles and all.

        Parameters
        ----------
        start : Checkpoint
        steps, far, longest
            As for `Compiled.block`.
        samples : ndarray, shape (k,), optional
            Monotonic times, none of them before the start [s].
        reach : float
            How long after the start angles are told, at samples, at zeros of events and at the
            block's end [s]: what is later may be turns off.
        """
        turns, own = self.turns, start.state[: self._units.size]
        forward = math.copysign(1.0, far)
        asked = np.maximum(forward * start.local(samples), 0.0)
        parts = 0 if turns is None else turns.parts(reach)
        points = np.linspace(0.0, reach, parts + 1) if parts else np.zeros(1)
        t = distinct(np.concatenate((points, asked)))[0]
        block = self._taken(own, steps, far, forward * t[1:], longest)
        rows = np.concatenate((own[None], block.rows))
        t = forward * t[: len(rows)]
        place = np.searchsorted(forward * t, asked)
        place = place[place < t.size]  # the block did not reach the others
        end = np.array([block.elapsed[0]])
        told = self._told(start, block, [(t, rows), (end, block.state[None])])

        def seen(since: Array, rows: Array, t: Array, t_low: Array) -> Seen:
            return Seen(t, t_low, np.concatenate((rows, told(since)), axis=1))

        last = seen(end, block.state[None], end, end)
        late = [h.after(start.time) for h in block.hits]
        reached = samples[: place.size]
        return Observed(
            block=replace(block, rows=block.rows[:0].copy()),  # told: most are those of the turns
            samples=seen(t[place], rows[place], reached, np.zeros(reached.size)),
            hits=tuple(
                seen(h.t, h.states, x.t, x.t_low) for h, x in zip(block.hits, late, strict=True)
            ),
            end=Checkpoint(
                add(start.time, block.elapsed), last.states[0], start.steps + block.steps
            ),
        )

    def polynomials(
        self, start: Checkpoint, steps: int, far: float
    ) -> tuple[Polynomials, Checkpoint]:
        """Take the steps of a block again; return their polynomials, and the end without angles.

        Times and states of the polynomials are in the run's own unit of time.
        """
        longest, pace = self.cautious_step(start, far), self.pace
        self.compiled.load(self.own_constants)
        taking = Projected(self.compiled, self.projection) if self.projection else self.compiled
        own = start.state[: self._units.size] / self._units
        longest = None if longest is None else longest * pace
        kept, done = taking.polynomials(own, steps, self._own_time(far), longest)
        high, low = done.elapsed
        end = add(start.time, (high / pace, low / pace))
        return kept, Checkpoint(end, done.state * self._units, start.steps + done.steps)

    def _told(
        self, start: Checkpoint, block: Block, seen: list[tuple[Array, Array]]
    ) -> Callable[[Array], Array]:
        """Return the angles, shape (k, c), as a function of the times at which a block was seen."""
        if self.turns is None:
            return lambda t: np.empty((t.size, 0))
        seen = [*seen, *((h.t, h.states) for h in block.hits)]
        times, rows = map(np.concatenate, zip(*seen, strict=True))
        return self.turns.told(times, rows, start.state[self._units.size :].tolist())

    def _own_time(self, far: float) -> float:
        """Return a time without end in the run's own unit of time, and finite."""
        return math.copysign(min(abs(far) * self.pace, LONGEST), far)

    def _taken(
        self, state: Array, steps: int, far: float, samples: Array, longest: float | None
    ) -> Block:
        """Take steps in the run's own unit of time; the block is measured in seconds."""
        compiled, pace, units = self.compiled, self.pace, self._units
        compiled.load(self.own_constants)
        taking = Projected(compiled, self.projection) if self.projection else compiled
        done = taking.block(
            state / units,
            steps,
            self._own_time(far),
            samples * pace,
            None if longest is None else longest * pace,
        )
        high, low = done.elapsed
        return replace(
            done,
            state=done.state * units,
            elapsed=(high / pace, low / pace),
            rows=done.rows * units,
            hits=tuple(Seen(h.t / pace, h.t_low / pace, h.states * units) for h in done.hits),
        )


# --- an orbit: blocks from the start to the end --------------------------------------------------


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
    between: Seen | None = None

    @property
    def parameters(self) -> dict[str, float]:
        """Constants of the run, by symbol name."""
        return self.integrator.parameters

    def at(self, t: Array) -> Seen:
        """Return the states at times between start and end, in any order, shape (k,)."""
        if t.size == 0:
            return Seen(t, t, self.samples.states[:0])
        engine, far = self.integrator.for_this_thread(), _far(self.checkpoints[0], self.end)
        forward = math.copysign(1.0, far)
        order = np.argsort(forward * t, kind="stable")
        t = t[order]
        high, low = np.array([c.time for c in self.checkpoints]).T
        block = np.maximum(np.searchsorted(forward * high, forward * t, "right") - 1, 0)
        early = forward * ((t - high[block]) - low[block]) < 0  # a double before its start
        block = np.maximum(block - early, 0)
        parts, late = [], NEVER
        for k in np.union1d(block, np.minimum(block + 1, high.size - 1)).tolist():
            asked = np.concatenate((late, t[block == k]))
            if asked.size:
                start = self.checkpoints[k]
                longest, reach = (
                    engine.cautious_step(start, far),
                    abs(float(start.local(asked)[-1])),
                )
                seen = engine.block(start, start.block_steps, far, asked, longest, reach)
                parts.append(seen.samples)
                late = asked[seen.samples.t.size :]  # by rounding: the next block begins there
        return Seen.join(parts).where(np.argsort(order, kind="stable"))


def not_begun(integrator: Integrator, start: Checkpoint) -> Orbit:
    """Return an orbit that is nothing yet but its start."""
    nothing = Seen(NEVER, NEVER, np.empty((0, start.state.size)))
    hits, outcome = (nothing,) * len(integrator.compiled.events), Outcome.INTERRUPTED
    return Orbit(integrator, (start,), nothing, hits, start.time[0], start.steps, outcome)


def continued(
    orbit: Orbit,
    samples: Array,
    *,
    between: Array = NEVER,
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
    journey = _Journey(orbit, samples, between)
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
    return 4.0 * (end - start.time[0])


class _Journey:
    """An integration under way, behind an orbit that is known."""

    def __init__(self, orbit: Orbit, samples: Array, between: Array) -> None:
        times = np.concatenate((samples, between))
        order = np.argsort(np.abs(times), kind="stable")
        self.known, self.samples, self.is_sample = orbit, times[order], order < samples.size
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

    def advance(self) -> Outcome | None:
        """Run one block; tell how the integration ended, if it did."""
        seen = self._observed()
        self.blocks.append(seen)
        self.done += seen.samples.t.size
        if self.done == self.samples.size:
            return Outcome.FINISHED
        if seen.block.singular or seen.block.steps == 0:
            return Outcome.SINGULAR
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

    def orbit(self, outcome: Outcome) -> Orbit:
        """Return what has been seen so far.

        An interrupt may come in the middle of `advance`: what counts then is the last checkpoint.
        """
        known, first = self.known, self.known.checkpoints[-1]
        whole = len(self.checkpoints) - len(known.checkpoints)
        blocks = self.blocks[:whole] if outcome == Outcome.INTERRUPTED else self.blocks
        last, end = blocks[-1].end if blocks else first, self.end
        if (
            outcome != Outcome.FINISHED
        ):  # a step back, so that rounding cannot put it behind the last state
            end = float(np.nextafter(np.nextafter(last.time[0], first.time[0]), first.time[0]))
        forward = math.copysign(1.0, self.far)
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
