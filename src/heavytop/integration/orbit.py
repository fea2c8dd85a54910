"""Orbits, integrated in blocks of natural steps, and the integrator of a run's constants.

An orbit has the same bits however it is sampled, split or resumed: blocks hold a fixed number of
steps, samples are read off their Taylor polynomials, and the end is a sample inside the last step.
The state at the start of a block is enough to run it again, or to go on from it. Steps are taken in
a unit of time that the start and the constants of the run choose; converting rounds nothing.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.errors import Outcome
from heavytop.exact.decimals import DOUBLE, precision
from heavytop.exact.pairs import EPSILON, Array, DoubleDouble, add
from heavytop.integration.engine import HEAVY_BITS, NEVER, Engine, Leg, TimedStates, engine, reals
from heavytop.integration.projection import Projection
from heavytop.integration.system import in_units, paces_of

Keep = Callable[[Callable[[], "Orbit"]], object]

FIRST_BLOCK = 256  # steps; each block is four times as long as the last, up to the longest
LONGEST_BLOCK = 4000
PRECISE_BLOCKS = ((256, 64), (HEAVY_BITS, 8))  # of reals: below so many bits; else one step
LONGEST_TIME = float(np.finfo(float).max)  # a time [s]
REACH = 2  # lengths of the last leg or block, within which the next one is expected to end
# steps to the end, estimated from the last ones, that no callback watches, which takes time: a
SURE_SHARE = 0.95  # share of them,
FEW_STEPS = 64  # less so many
BEYOND = 1 + 1e-9  # of the way to the last sample, lest a zero there lie a rounding behind it


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The start of a block: enough to run it, or the rest of the orbit, again."""

    time: tuple[Any, Any]  # as a high and a low word [s]
    state: Array
    steps: int  # natural ones taken before

    @property
    def block_steps(self) -> int:
        """The number of steps in the block that starts here: blocks of a short run are short."""
        bits = precision(self.state[0])
        if bits > DOUBLE:
            return next((steps for most, steps in PRECISE_BLOCKS if bits < most), 1)
        return min(3 * self.steps + FIRST_BLOCK, LONGEST_BLOCK)


@dataclass(frozen=True, slots=True)
class Block:
    """The result of a block: states at samples and at zeros of event functions, and its end.

    `singular` says that no finite step follows, or none was taken.
    """

    samples: TimedStates
    hits: tuple[TimedStates, ...]
    end: Checkpoint
    singular: bool


class Polynomials(NamedTuple):
    """Taylor polynomials of k steps, in the unit of time in which they were taken."""

    coefficients: Array  # in the time since the beginning of each step, shape (k, n, order + 1)
    begun: Array  # when each began, since the block's start, as double-doubles
    length: Array  # of each step
    restarted: Array  # when the leg of each began, since the block's start


class Integrator:
    """An engine with the constants of one run, which takes steps in the unit of time of its pace.

    `projection` and `scaled_constants` are in that unit, `parameters` are the same constants in
    seconds, `pace` is in 1/s.
    """

    def __init__(
        self, engine: Engine, parameters: Mapping[str, Any], start: Array, projected: bool
    ) -> None:
        form, doubles = engine.formulation, {name: float(x) for name, x in parameters.items()}
        self.engine, self.parameters = engine, dict(parameters)
        self.pace = np.float64(paces_of(form, start.astype(np.float64), doubles))
        self._units = np.where(form.is_rate, self.pace, 1.0)
        self.scaled_constants = in_units(form, self.pace, parameters)
        scaled = start / self._units
        self.projection = Projection.of(form, self.scaled_constants, scaled) if projected else None

    @property
    def formulation(self) -> Formulation:
        """The equations that it integrates."""
        return self.engine.formulation

    def numbers(self, values: Any) -> Array:
        """Return an array, shape (k,), in numbers of the engine."""
        if self.engine.bits == DOUBLE or values.dtype == self.engine.nothing.dtype:
            return np.asarray(values)
        return reals(values, self.engine.bits)

    def for_this_thread(self) -> Integrator:
        """Return a copy with an engine that belongs to the calling thread."""
        found, old = copy(self), self.engine
        found.engine = engine(old.formulation, old.events, old.tolerance, old.bits)
        if self.projection:
            found.projection = Projection(old.formulation, self.projection.fixed)
        return found

    def first_step_bound(self, start: Checkpoint, far: float) -> float | None:
        """Return a bound for the first steps of a run, in its own unit of time; None later on."""
        if start.steps:
            return None
        in_doubles = self.engine
        if in_doubles.bits > DOUBLE:
            in_doubles = engine(in_doubles.formulation, (), EPSILON)
        in_doubles.load({name: float(x) for name, x in self.scaled_constants.items()})
        state = (start.state / self._units).astype(np.float64)
        return in_doubles.first_step_bound(state, self._scaled_time(far))

    def block(
        self,
        start: Checkpoint,
        steps: int,
        far: float,
        samples: Array = NEVER,
        reach: float = math.inf,
    ) -> Block:
        """Take natural steps, at most `steps`, until the last sample is passed, and sample them.

        `far` is as for `Engine.leg`. Samples are monotonic times, none of them before the start.
        `reach` is a time that the steps will probably not pass: later samples are handed to heyoka
        only if they do [s].
        """
        legs, end = self._legs(start, steps, far, samples, reach)
        rows = np.concatenate([leg.rows for _, leg in legs]) * self._units
        reached, hits = samples[: len(rows)], list[TimedStates]()
        for i, _ in enumerate(self.engine.events):
            t, low, states = TimedStates.join(leg.hits[i].after(begun) for begun, leg in legs)
            zeros = TimedStates(t / self.pace, low / self.pace, states * self._units)
            hits.append(zeros.after(start.time))
        singular = legs[-1][1].singular or end.steps == start.steps
        return Block(TimedStates(reached, 0 * reached, rows), tuple(hits), end, singular)

    def polynomials(
        self, start: Checkpoint, steps: int, far: float
    ) -> tuple[Polynomials, Checkpoint]:
        """Take the steps of a block again; return their polynomials, and the end.

        Times and states of the polynomials are in the run's own unit of time.
        """
        kept = list[tuple[Array, DoubleDouble, float]]()

        def keep(taylor: Any) -> bool:
            kept.append((taylor.tc.copy(), taylor.dtime, taylor.last_h))
            return True

        legs, end = self._legs(start, steps, far, NEVER, on_step=keep)
        coefficients, ends, lengths = zip(*kept, strict=True)
        begun, restarted = list[DoubleDouble](), list[float]()
        for leg_begun, leg in legs:
            others = ends[len(begun) : len(begun) + leg.steps - 1]
            begun += [add(leg_begun, t) for t in ((0.0, 0.0), *others)]
            restarted += [leg_begun[0]] * leg.steps
        return Polynomials(*map(np.array, (coefficients, begun, lengths, restarted))), end

    def _legs(
        self,
        start: Checkpoint,
        steps: int,
        far: float,
        samples: Array,
        reach: float = math.inf,
        on_step: Callable[[Any], bool] | None = None,
    ) -> tuple[list[tuple[DoubleDouble, Leg]], Checkpoint]:
        """Return the legs of a block in the run's own unit of time, each with when it began.

        And the checkpoint at their end. Without projection there is one leg; with it each leg
        starts from the projected end of the one before.
        """
        engine, project, pace = self.engine, self.projection, self.pace
        bound = longest = self.first_step_bound(start, far)
        engine.load(self.scaled_constants)
        times = ((samples - start.time[0]) - start.time[1]) * pace  # since the start
        far, reach = self._scaled_time(far), reach * pace
        state, stride = start.state / self._units, project.stride if project else steps
        if longest is not None:
            reach = REACH * longest * stride
        distances, legs = np.abs(times).tolist(), list[tuple[DoubleDouble, Leg]]()
        begun: DoubleDouble = (engine.number(0.0), engine.number(0.0))
        taken, done, mean, ended = 0, 0, 0.0, False
        end = min([abs(far), *(BEYOND * x for x in distances[-1:])])
        while not legs or (taken < steps and not ended and abs(begun[0]) < end):
            count = min(stride, steps - taken)
            for within in (reach or math.inf, math.inf):
                last = bisect_right(distances, abs(begun[0]) + within, done)
                local = times[done:last]
                if local.size:  # nearly all legs of a long run have none
                    local = (local - begun[0]) - begun[1]
                to_the_end, unwatched = done < last == times.size, 0
                if to_the_end:
                    left = abs(float(local[-1]))
                    on_step = _stop_after(BEYOND * left)
                    sure = SURE_SHARE * REACH * count * (left / within)
                    unwatched = max(0, min(int(sure) - FEW_STEPS, count - 1))
                how = far - begun[0], local, bound, on_step, unwatched
                leg = _take_leg(engine, state, count, *how)
                length = abs(leg.elapsed[0])
                if to_the_end or not length > 0.9 * within:
                    break
            legs.append((begun, leg))
            state = project(leg.state) if project else leg.state
            taken, done, ended = taken + leg.steps, done + len(leg.rows), leg.steps < count
            if project:
                mean, reach = mean or length / count, REACH * length
                bound = project.longest(mean, len(legs), longest)
            begun = add(begun, leg.elapsed)
        time = add(start.time, (begun[0] / pace, begun[1] / pace))
        return legs, Checkpoint(time, state * self._units, start.steps + taken)

    def _scaled_time(self, far: float) -> float:
        """Return a time [s] in the run's own unit of time, at most the largest double."""
        return math.copysign(min(abs(far) * float(self.pace), LONGEST_TIME), far)


def _take_leg(engine: Engine, state: Array, steps: int, far: float, times: Array, *how: Any) -> Leg:
    """Return a leg with a row for each time that it reached.

    heyoka takes only times after the start that all differ; rounding may have made some equal to
    the start or to each other.
    """
    if not times.size:
        return engine.leg(state, steps, far, times, *how)
    new = times > 0 if far > 0 else times < 0
    new[1:] &= times[1:] != times[:-1]
    leg = engine.leg(state, steps, far, times[new], *how)
    place = np.cumsum(new)
    place = place[place <= len(leg.rows)]
    return leg._replace(rows=np.concatenate((state[None], leg.rows))[place])


def _stop_after(end: float) -> Callable[[Any], bool]:
    """Return a callback that is False after a step that passed the end."""
    return lambda taylor: abs(taylor.time) <= end


# --- the orbit -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Orbit:
    """The result of an integration, with the state at any time that it covers."""

    integrator: Integrator
    checkpoints: tuple[Checkpoint, ...]
    samples: TimedStates
    hits: tuple[TimedStates, ...]
    end: float
    steps: int
    outcome: Outcome
    between: TimedStates  # recorded on the way, at other times than the samples

    @property
    def parameters(self) -> dict[str, Any]:
        """Constants of the run by symbol name, in seconds."""
        return self.integrator.parameters

    def places_of(self, t: Array) -> NDArray[np.intp] | None:
        """Return the indices in `between` of times, shape (k,); None unless all are there."""
        recorded = self.between.t
        place = np.minimum(np.searchsorted(abs(recorded), abs(t)), recorded.size - 1)
        return place if recorded.size and (recorded[place] == t).all() else None

    def lookup(self, t: Array) -> TimedStates:
        """Return the states at times, from `between` where all of them are there."""
        place = self.places_of(t)
        return self.at(t) if place is None else self.between.where(place)

    def at(self, t: Array) -> TimedStates:
        """Return the states at times between start and end, in any order, shape (k,)."""
        t = self.integrator.numbers(t)
        if t.size == 0:
            return TimedStates(t, t, self.samples.states[:0])
        integrator = self.integrator.for_this_thread()
        far = _time_beyond(self.checkpoints[0], self.end)
        forward = np.copysign(1.0, far)
        order = np.argsort(forward * t, kind="stable")
        t = t[order]
        high, low = np.array([c.time for c in self.checkpoints]).T
        block = np.maximum(np.searchsorted(forward * high, forward * t, "right") - 1, 0)
        early = forward * ((t - high[block]) - low[block]) < 0  # a double before its start
        block = np.maximum(block - early, 0)
        parts, late = [], t[:0]
        for k in np.union1d(block, np.minimum(block + 1, high.size - 1)).tolist():
            if (times := np.concatenate((late, t[block == k]))).size:
                start = self.checkpoints[k]
                samples = integrator.block(start, start.block_steps, far, times).samples
                parts.append(samples)
                late = times[samples.t.size :]  # by rounding they are in the next block
        return TimedStates.join(parts).where(np.argsort(order, kind="stable"))


def start_orbit(integrator: Integrator, start: Checkpoint) -> Orbit:
    """Return the orbit of a start from which no step has been taken."""
    never = start.state[:0]
    nothing = TimedStates(never, never, integrator.engine.nothing)
    hits, end = (nothing,) * len(integrator.engine.events), float(start.time[0])
    interrupted = Outcome.INTERRUPTED
    return Orbit(integrator, (start,), nothing, hits, end, start.steps, interrupted, nothing)


def integrate(
    orbit: Orbit,
    samples: Array,
    *,
    between: Array | None = None,
    on_block: Callable[[float], None] | None = None,
    step_limit: float = math.inf,
    keep: Keep | None = None,
) -> Orbit:
    """Integrate from the last checkpoint of an orbit to the last of the samples.

    The blocks are those of an uninterrupted integration, so that the result is the same bit for
    bit; the samples and hits of the orbit are kept.

    `samples` are strictly monotonic times on one side of the start [s], `between` others up to
    their end, in any order. After each block `on_block` is called with the fraction done, and, but
    for the last block, `keep` with a function that returns the orbit so far.
    """
    times = samples if between is None else np.concatenate((samples, between))
    order = np.argsort(abs(times), kind="stable")
    times, is_sample, end = times[order], order < samples.size, float(samples[-1])
    integrator, first = orbit.integrator.for_this_thread(), orbit.checkpoints[-1]
    far, begun = _time_beyond(first, end), float(first.time[0])
    starts, blocks, done = [*orbit.checkpoints], list[Block](), 0
    outcome: Outcome | None = None

    def so_far(outcome: Outcome) -> Orbit:
        return _append(orbit, starts, blocks, is_sample, end, outcome)

    try:
        while outcome is None:
            if first.steps >= step_limit:
                outcome = Outcome.STEP_LIMIT
                break
            block = integrator.block(first, first.block_steps, far, times[done:], _reach(starts))
            blocks.append(block)
            first, done = block.end, done + block.samples.t.size
            if done == times.size:
                outcome = Outcome.FINISHED
            elif block.singular:
                outcome = Outcome.SINGULAR
            else:
                starts.append(first)
                if keep is not None:
                    keep(partial(so_far, Outcome.INTERRUPTED))
            if on_block is not None and outcome != Outcome.SINGULAR:
                on_block((float(first.time[0]) - begun) / (end - begun) if outcome is None else 1.0)
    except KeyboardInterrupt:
        if starts[-1].steps == 0:  # no block is complete
            raise
        del blocks[len(starts) - len(orbit.checkpoints) :]  # a block without its checkpoint
        outcome = Outcome.INTERRUPTED
    return so_far(outcome)


def _time_beyond(start: Checkpoint, end: float) -> float:
    """Return the `far` of `Engine.leg`, a time well beyond the whole span [s]."""
    return 4.0 * (end - float(start.time[0]))


def _reach(starts: Sequence[Checkpoint]) -> float:
    """Return a time that the next block will hardly reach, from the length of earlier steps [s]."""
    if len(starts) == 1:
        return math.inf
    before, start = starts[-2:]
    length = abs(float(start.time[0] - before.time[0])) / (start.steps - before.steps)
    return REACH * length * start.block_steps


def _append(
    known: Orbit,
    starts: Sequence[Checkpoint],
    blocks: Sequence[Block],
    is_sample: NDArray[np.bool_],
    end: float,
    outcome: Outcome,
) -> Orbit:
    """Return an orbit with more blocks, whose samples and other times `is_sample` tells apart."""
    first = known.checkpoints[-1]
    last, begun = blocks[-1].end if blocks else first, float(first.time[0])
    forward = np.copysign(1.0, end - begun)
    if outcome != Outcome.FINISHED:  # a step back, so that rounding cannot put it behind
        end = float(np.nextafter(np.nextafter(float(last.time[0]), begun), begun))
    states = TimedStates.join([known.samples.where(slice(0)), *(each.samples for each in blocks)])
    is_sample = is_sample[: states.t.size]
    return Orbit(
        integrator=known.integrator,
        checkpoints=tuple(starts),
        samples=TimedStates.join([known.samples, states.where(is_sample)]),
        between=states.where(~is_sample),
        hits=tuple(
            TimedStates.join([hit.where(forward * hit.t < forward * first.time[0]), *later])
            for hit, *later in zip(known.hits, *(each.hits for each in blocks), strict=True)
        ),
        end=end,
        steps=last.steps,
        outcome=outcome,
    )
