"""An orbit in blocks of natural steps, and what takes them for the constants of a run.

heyoka takes its steps in the run's own unit of time. Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone.

The same start, parameters and event functions give the same bits, however an orbit is sampled,
split or resumed: blocks hold a fixed number of steps, samples are read off their Taylor
polynomials, and the end is a sample like any other, inside the last step. Nothing in the
integrator grows, and the state at a block's start is enough to run it again, or to go on from it.
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
PRECISE_BLOCKS = ((256, 64), (HEAVY_BITS, 8))  # of reals: below so many bits; beyond them a step
LONGEST_TIME = float(np.finfo(float).max)  # a time [s]
REACH = 2  # lengths of the last leg or block, within which the next one is taken to end
SURE_SHARE = 0.95  # of the steps to the end, as the last ones were: these are not watched,
FEW_STEPS = 64  # but for so many
BEYOND = 1 + 1e-9  # of the way to the last sample, lest a zero there lie a rounding behind it


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The start of a block: enough to run it, or the rest of the orbit, again."""

    time: tuple[Any, Any]  # as a high and a low word [s]
    state: Array
    steps: int  # natural ones taken before

    @property
    def block_steps(self) -> int:
        """How many steps the block has that starts here: a short run needs no long block."""
        bits = precision(self.state[0])
        if bits > DOUBLE:
            return next((steps for most, steps in PRECISE_BLOCKS if bits < most), 1)
        return min(3 * self.steps + FIRST_BLOCK, LONGEST_BLOCK)


@dataclass(frozen=True, slots=True)
class Block:
    """A block of steps as it was seen: at samples, at zeros of events, and at its end.

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
    restarted: Array  # when time was last set to zero before each, since the block's start


class Integrator:
    """What takes the steps of a run, in the unit of time of its pace [1/s].

    In that unit are its `projection` and `scaled_constants`; in seconds these are its `parameters`.
    """

    def __init__(
        self, engine: Engine, parameters: Mapping[str, Any], start: Array, projected: bool
    ) -> None:
        form, known = engine.formulation, {name: float(x) for name, x in parameters.items()}
        self.engine, self.parameters = engine, dict(parameters)
        self.pace = np.float64(paces_of(form, start.astype(np.float64), known))
        self._units = np.where(form.is_rate, self.pace, 1.0)
        self.scaled_constants = in_units(form, self.pace, parameters)
        started = start / self._units
        self.projection = Projection.of(form, self.scaled_constants, started) if projected else None

    @property
    def formulation(self) -> Formulation:
        """The equations."""
        return self.engine.formulation

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

    def first_step_bound(self, start: Checkpoint, far: float) -> float | None:
        """Return a bound for the first steps of a run, in its own unit of time; later none."""
        if start.steps:
            return None
        own = self.engine
        if own.bits > DOUBLE:
            own = engine(own.formulation, (), EPSILON)
        own.load({name: float(x) for name, x in self.scaled_constants.items()})
        state = (start.state / self._units).astype(np.float64)
        return own.first_step_bound(state, self._scaled_time(far))

    def block(
        self,
        start: Checkpoint,
        steps: int,
        far: float,
        samples: Array = NEVER,
        reach: float = math.inf,
    ) -> Block:
        """Take natural steps, so many or until the last sample is passed, and sample them.

        `far` is as for `Engine.leg`. Samples are monotonic times, none of them before the start;
        `reach` is how far the steps will hardly go: later ones are looked for only if they do [s].
        """
        legs, end = self._legs(start, steps, far, samples, reach)
        rows = np.concatenate([leg.rows for _, leg in legs]) * self._units
        reached, hits = samples[: len(rows)], list[TimedStates]()
        for i, _ in enumerate(self.engine.events):
            t, low, states = TimedStates.join(leg.hits[i].after(since) for since, leg in legs)
            found = TimedStates(t / self.pace, low / self.pace, states * self._units)
            hits.append(found.after(start.time))
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
        coefficients, times, lengths = zip(*kept, strict=True)
        begun, restarted = list[DoubleDouble](), list[float]()
        for since, leg in legs:
            others = times[len(begun) : len(begun) + leg.steps - 1]
            begun += [add(since, t) for t in ((0.0, 0.0), *others)]
            restarted += [since[0]] * leg.steps
        found = Polynomials(*map(np.array, (coefficients, begun, lengths, restarted)))
        return found, end

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

        And where they end. A run that is not projected has one leg; of another the projected
        state behind each is where the next begins.
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
                    sure = SURE_SHARE * REACH * count * (left / within)  # a call takes as long
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
        """Return a time without end in the run's own unit of time, and finite."""
        return math.copysign(min(abs(far) * float(self.pace), LONGEST_TIME), far)


def _take_leg(engine: Engine, state: Array, steps: int, far: float, times: Array, *how: Any) -> Leg:
    """Return a leg with a row for each time that it reached.

    heyoka wants times that differ and are after the start; by rounding they may be neither.
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
    """Return what tells after each step whether another is to follow."""
    return lambda taylor: abs(taylor.time) <= end


# --- the orbit -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Orbit:
    """The result of an integration; it can be asked for the state at any time it covers."""

    integrator: Integrator
    checkpoints: tuple[Checkpoint, ...]
    samples: TimedStates
    hits: tuple[TimedStates, ...]
    end: float
    steps: int
    outcome: Outcome
    between: TimedStates  # at other times than the samples, on the way from the start

    @property
    def parameters(self) -> dict[str, Any]:
        """Constants of the run, by symbol name."""
        return self.integrator.parameters

    def places_of(self, t: Array) -> NDArray[np.intp] | None:
        """Return which of `between` are at times, shape (k,); None where it was not seen at all."""
        there = self.between.t
        place = np.minimum(np.searchsorted(abs(there), abs(t)), there.size - 1)
        return place if there.size and (there[place] == t).all() else None

    def lookup(self, t: Array) -> TimedStates:
        """Return the states at times, of those seen on the way if all of them were."""
        place = self.places_of(t)
        return self.at(t) if place is None else self.between.where(place)

    def at(self, t: Array) -> TimedStates:
        """Return the states at times between start and end, in any order, shape (k,)."""
        t = self.integrator.numbers(t)
        if t.size == 0:
            return TimedStates(t, t, self.samples.states[:0])
        taking, far = self.integrator.for_this_thread(), _time_beyond(self.checkpoints[0], self.end)
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
        return TimedStates.join(parts).where(np.argsort(order, kind="stable"))


def start_orbit(integrator: Integrator, start: Checkpoint) -> Orbit:
    """Return an orbit that is nothing yet but its start."""
    never = start.state[:0]
    nothing = TimedStates(never, never, integrator.engine.nothing)
    hits, outcome = (nothing,) * len(integrator.engine.events), Outcome.INTERRUPTED
    end, steps = float(start.time[0]), start.steps
    return Orbit(integrator, (start,), nothing, hits, end, steps, outcome, between=nothing)


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

    The blocks are those an uninterrupted integration would have run, so the result is the same
    bit for bit; samples and hits seen before are kept.

    `samples` are strictly monotonic times on one side of the start [s], `between` others up to
    their end, in any order. `on_block` is given the fraction done after each block, and `keep`,
    after each but the last, what returns the orbit so far.
    """
    times = samples if between is None else np.concatenate((samples, between))
    order = np.argsort(abs(times), kind="stable")
    times, is_sample, end = times[order], order < samples.size, float(samples[-1])
    taking, first = orbit.integrator.for_this_thread(), orbit.checkpoints[-1]
    far, begun = _time_beyond(first, end), float(first.time[0])
    places, blocks, done = [*orbit.checkpoints], list[Block](), 0
    outcome: Outcome | None = None

    def so_far(outcome: Outcome) -> Orbit:
        return _append(orbit, places, blocks, is_sample, end, outcome)

    try:
        while outcome is None:
            if first.steps >= step_limit:
                outcome = Outcome.STEP_LIMIT
                break
            block = taking.block(first, first.block_steps, far, times[done:], _reach(places))
            blocks.append(block)
            first, done = block.end, done + block.samples.t.size
            if done == times.size:
                outcome = Outcome.FINISHED
            elif block.singular:
                outcome = Outcome.SINGULAR
            else:
                places.append(first)
                if keep is not None:
                    keep(partial(so_far, Outcome.INTERRUPTED))
            if on_block is not None and outcome != Outcome.SINGULAR:
                on_block((float(first.time[0]) - begun) / (end - begun) if outcome is None else 1.0)
    except KeyboardInterrupt:
        if places[-1].steps == 0:  # nothing is done
            raise
        del blocks[len(places) - len(orbit.checkpoints) :]  # what is not whole
        outcome = Outcome.INTERRUPTED
    return so_far(outcome)


def _time_beyond(start: Checkpoint, end: float) -> float:
    """Return a local time beyond the whole span, which only a step of such a length would cut."""
    return 4.0 * (end - float(start.time[0]))


def _reach(places: Sequence[Checkpoint]) -> float:
    """Return how far the next block will hardly go, from the length of the steps before [s]."""
    if len(places) == 1:
        return math.inf
    before, start = places[-2:]
    length = abs(float(start.time[0] - before.time[0])) / (start.steps - before.steps)
    return REACH * length * start.block_steps


def _append(
    known: Orbit,
    places: Sequence[Checkpoint],
    blocks: Sequence[Block],
    is_sample: NDArray[np.bool_],
    end: float,
    outcome: Outcome,
) -> Orbit:
    """Return an orbit with blocks behind it."""
    first = known.checkpoints[-1]
    last, begun = blocks[-1].end if blocks else first, float(first.time[0])
    forward = np.copysign(1.0, end - begun)
    if outcome != Outcome.FINISHED:  # a step back, so that rounding cannot put it behind
        end = float(np.nextafter(np.nextafter(float(last.time[0]), begun), begun))
    seen = TimedStates.join([known.samples.where(slice(0)), *(each.samples for each in blocks)])
    is_sample = is_sample[: seen.t.size]
    return Orbit(
        integrator=known.integrator,
        checkpoints=tuple(places),
        samples=TimedStates.join([known.samples, seen.where(is_sample)]),
        between=seen.where(~is_sample),
        hits=tuple(
            TimedStates.join([hit.where(forward * hit.t < forward * first.time[0]), *later])
            for hit, *later in zip(known.hits, *(each.hits for each in blocks), strict=True)
        ),
        end=end,
        steps=last.steps,
        outcome=outcome,
    )
