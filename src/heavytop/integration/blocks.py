"""An orbit, in blocks of natural steps, and what takes them for the constants of a run.

The same start, parameters and event functions give the same bits, however an orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step.

heyoka takes its steps in the run's own unit of time. Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone: so a block has the same
bits however it was come to.

Nothing in the integrator grows, and the state at a block's start is enough to run it again, or to
go on from it.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.errors import Outcome
from heavytop.exact.pairs import EPSILON, DoubleDouble, add
from heavytop.integration.bits import DOUBLE, precision
from heavytop.integration.engine import (
    ABOVE,
    HEAVY_BITS,
    NEVER,
    Array,
    Engine,
    Leg,
    Polynomials,
    Seen,
    engine,
    reals,
)
from heavytop.integration.paces import in_units, paces_of
from heavytop.integration.projection import Projection

FIRST_BLOCK = 256  # steps; each block is four times as long as the last, up to the longest
LONGEST_BLOCK = 4000
PRECISE_BLOCKS = ((256, 64), (HEAVY_BITS, 8))  # of reals: below so many bits; beyond them a step
LONGEST_TIME = float(np.finfo(float).max)  # a time [s]
LEAST_TIME = float(np.finfo(float).tiny)
Keep = Callable[[Callable[[], "Orbit"]], object]


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The start of a block: enough to run it, or the rest of the orbit, again.

    Attributes
    ----------
    time : tuple of two numbers
        Time as a high and a low word [s].
    state : ndarray, shape (n,)
    steps : int
        Natural steps taken before.
    """

    time: tuple[Any, Any]
    state: Array
    steps: int

    @property
    def block_steps(self) -> int:
        """How many steps the block has that starts here: a short run needs no long block."""
        bits = precision(self.state[0])
        if bits > DOUBLE:
            return next((steps for most, steps in PRECISE_BLOCKS if bits < most), 1)
        return min(3 * self.steps + FIRST_BLOCK, LONGEST_BLOCK)

    def local(self, t: Array) -> Array:
        """Return times since then [s]."""
        since: Array = (t - self.time[0]) - self.time[1]
        return since


@dataclass(frozen=True, slots=True)
class Block:
    """A block of steps as it was seen: at samples, at zeros of events, and at its end.

    `elapsed` is its length [s], and `singular` says that no finite step follows.
    """

    samples: Seen
    hits: tuple[Seen, ...]
    end: Checkpoint
    elapsed: float
    steps: int
    singular: bool


class Integrator:
    """What takes the steps of a run.

    Attributes
    ----------
    engine : Engine
    parameters : dict from str to number
        Constants of the run, by symbol name, in the numbers of the engine.
    pace : float
        In whose unit of time steps are taken [1/s].
    own_constants : dict from str to number
        The same constants, in that unit of time.
    projection : Projection or None
        In that unit of time.
    """

    def __init__(
        self,
        engine: Engine,
        parameters: Mapping[str, Any],
        start: Array,
        *,
        projected: bool = False,
    ) -> None:
        form, known = engine.formulation, {name: float(x) for name, x in parameters.items()}
        self.engine, self.parameters = engine, dict(parameters)
        self.pace = np.float64(paces_of(form, start.astype(np.float64), known))
        self._units = np.where(form.is_rate, self.pace, 1.0)
        self.own_constants = self.parameters if self.pace == 1 else in_units(self.pace, parameters)
        started = start / self._units
        self.projection = Projection.of(form, self.own_constants, started) if projected else None

    @property
    def formulation(self) -> Formulation:
        """The equations."""
        return self.engine.formulation

    @property
    def compile_s(self) -> float:
        """Time spent in compiling [s]."""
        return self.engine.compile_s

    def numbers(self, values: Any) -> Array:
        """Return numbers, shape (k,), as those of the engine."""
        if self.engine.bits == DOUBLE or values.dtype == self.engine.nothing.dtype:
            return np.asarray(values)
        return reals(values, self.engine.bits)

    def for_this_thread(self) -> Integrator:
        """Return the one like this that belongs to the calling thread."""
        found, own = copy(self), self.engine
        found.engine = engine(own.formulation, own.events, own.tolerance, own.bits)
        if self.projection:
            found.projection = Projection(own.formulation, self.projection.fixed)
        return found

    def cautious_step(self, start: Checkpoint, far: float) -> float | None:
        """Return a bound for the first steps of a run, as `Engine` does [s]; later none."""
        if start.steps:
            return None
        own, constants = self.engine, self.own_constants
        if own.bits > DOUBLE:
            own = engine(own.formulation, (), EPSILON)
            constants = {name: float(x) for name, x in constants.items()}
        own.load(constants)
        state = (start.state / self._units).astype(np.float64)
        bound = own.cautious_step(state, self._own_time(far))
        return None if bound is None else bound / float(self.pace)

    def block(
        self,
        start: Checkpoint,
        steps: int,
        far: float,
        samples: Array = NEVER,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps and sample them.

        Parameters
        ----------
        start : Checkpoint
        steps, far, longest
            As for `Engine.leg`.
        samples : ndarray, shape (k,), optional
            Monotonic times, none of them before the start [s].
        """
        forward = np.copysign(1.0, far)
        since = forward * start.local(samples)
        later = since > 0  # by rounding the first may be before
        new = later.copy()
        new[1:] &= since[1:] != since[:-1]
        legs = self._legs(start.state, steps, far, forward * since[new], longest)
        rows = np.concatenate([leg.rows for _, leg in legs]) * self._units
        place = np.cumsum(new)
        place = place[place <= len(rows)]  # the block did not reach the others
        reached = samples[: place.size]
        hits = zip(*([hit.after(since) for hit in leg.hits] for since, leg in legs), strict=True)
        end, elapsed = self._end(start, legs)
        return Block(
            samples=Seen(reached, 0 * reached, np.concatenate((start.state[None], rows))[place]),
            hits=tuple(self._zeros(Seen.join(each)).after(start.time) for each in hits),
            end=end,
            elapsed=elapsed,
            steps=end.steps - start.steps,
            singular=legs[-1][1].singular,
        )

    def polynomials(
        self, start: Checkpoint, steps: int, far: float
    ) -> tuple[Polynomials, Checkpoint]:
        """Take the steps of a block again; return their polynomials, and the end.

        Times and states of the polynomials are in the run's own unit of time.
        """
        longest = self.cautious_step(start, far)
        legs = self._legs(start.state, steps, far, NEVER, longest, keep=True)
        parts = []
        for begun, leg in legs:
            assert leg.polynomials is not None
            since, words = np.full(leg.steps, begun[0]), leg.polynomials.begun
            later = add((since, np.full(leg.steps, begun[1])), (words[:, 0], words[:, 1]))
            part = leg.polynomials._replace(begun=np.stack(later, axis=-1), restarted=since)
            parts.append(part)
        end, _ = self._end(start, legs)
        return Polynomials(*map(np.concatenate, zip(*parts, strict=True))), end

    def _legs(
        self,
        state: Array,
        steps: int,
        far: float,
        times: Array,
        longest: float | None,
        *,
        keep: bool = False,
    ) -> list[tuple[DoubleDouble, Leg]]:
        """Return the legs of a block in the run's own unit of time, each with when it began.

        A run that is not projected has one. Else the state behind each is the projected one, which
        is where the next begins.
        """
        engine, project, far = self.engine, self.projection, self._own_time(far)
        engine.load(self.own_constants)
        state, times = state / self._units, times * self.pace
        bound = longest = None if longest is None else longest * float(self.pace)
        if project is None:
            return [((0.0, 0.0), engine.leg(state, steps, far, times, longest, keep=keep))]
        distances, legs = np.abs(times).tolist(), list[tuple[DoubleDouble, Leg]]()
        begun, taken, done, mean, reach, ended = (0.0, 0.0), 0, 0, 0.0, math.inf, False
        while taken < steps and not ended and (rest := far - begun[0]) * far > 0:
            count = min(project.stride, steps - taken)
            for within in (reach, math.inf):  # samples are looked for so far, and farther if it is
                last = bisect_right(distances, abs(begun[0]) + within, done)
                local, place = _since(begun, times[done:last], far)
                leg = engine.leg(state, count, rest, local, bound, keep=keep)
                length = abs(leg.elapsed[0])
                if not length > 0.9 * within:
                    break
            rows = leg.rows if place is None else leg.rows[place[place < len(leg.rows)]]
            state = project(leg.state)
            legs.append((begun, leg._replace(rows=rows, state=state)))
            taken, done, ended = taken + leg.steps, done + len(rows), leg.steps < count
            mean, reach = mean or length / count, 2 * length
            bound, begun = project.longest(mean, len(legs), longest), add(begun, leg.elapsed)
        return legs

    def _end(
        self, start: Checkpoint, legs: Sequence[tuple[DoubleDouble, Leg]]
    ) -> tuple[Checkpoint, float]:
        """Return where the legs of a block end, and how long they are [s]."""
        (begun, last), pace = legs[-1], self.pace
        high, low = add(begun, last.elapsed)
        time = add(start.time, (high / pace, low / pace))
        steps = start.steps + sum(leg.steps for _, leg in legs)
        return Checkpoint(time, last.state * self._units, steps), float(high / pace)

    def _zeros(self, found: Seen) -> Seen:
        """Return zeros, which are in the run's own unit of time, in seconds."""
        return Seen(found.t / self.pace, found.t_low / self.pace, found.states * self._units)

    def _own_time(self, far: float) -> float:
        """Return a time without end in the run's own unit of time, and finite."""
        return math.copysign(min(abs(far) * float(self.pace), LONGEST_TIME), far)


def _since(begun: DoubleDouble, times: Array, far: float) -> tuple[Array, NDArray[np.intp] | None]:
    """Return times since a leg began, all of them after that and different, and where each is.

    Two that rounding has made equal are one; where there are none, no places are returned.
    """
    local = (times - begun[0]) - begun[1]
    local = np.where(local * far > 0, local, math.copysign(LEAST_TIME, far))
    if local.size < 2 or (np.diff(np.abs(local)) > 0).all():
        return local, None
    sizes, place = np.unique(np.abs(local), return_inverse=True)
    return np.copysign(sizes, far), place


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
                longest = taking.cautious_step(start, far)
                seen = taking.block(start, start.block_steps, far, asked, longest)
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
        seen = self._observed()
        self.blocks.append(seen)
        self.done += seen.samples.t.size
        if self.done == self.samples.size:
            return Outcome.FINISHED
        if seen.singular or seen.steps == 0:
            return Outcome.SINGULAR
        self.checkpoints.append(seen.end)
        return None

    def _observed(self) -> Block:
        """Run a block of full length, or of hardly more steps than it takes to the end.

        How far the steps will reach is guessed from those before. A wrong guess costs another
        run of the block and changes nothing.
        """
        start, far, waiting = self.place, self.far, self.samples[self.done :]
        longest = self.integrator.cautious_step(start, far)
        remaining = abs(start.local(waiting)).astype(np.float64)
        end, full = float(remaining[-1]), start.block_steps
        length = self._step_before(longest) if full > 1 else end
        steps = min(full, math.ceil(1.1 * end / length) + 2)
        while True:
            reach = min(1.1 * steps * length, end)
            asked = waiting[remaining <= reach]
            seen = self.integrator.block(start, steps, far, asked, longest)
            reached, taken = abs(seen.elapsed), seen.steps
            length = reached / taken if taken else length
            if reached > reach and reach < end:
                continue  # the steps grew: look again, at all samples of the block
            if reached >= end or steps == full or seen.singular:
                return seen
            steps = min(full, steps + math.ceil(1.05 * (end - reached) / length) + 1)

    def _step_before(self, longest: float | None) -> float:
        """Return the mean step of the block before, or about the first of all [s]."""
        start = self.place
        if len(self.checkpoints) == 1:
            return (longest or abs(self.far)) / ABOVE
        before = self.checkpoints[-2]
        elapsed = abs(float(start.time[0] - before.time[0]))
        return elapsed / (start.steps - before.steps)

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
