"""Blocks of natural steps, and what takes them for the constants of a run.

heyoka takes its steps in the run's own unit of time. Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone: so a block has the same
bits however it was come to.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.exact.pairs import EPSILON, DoubleDouble, add
from heavytop.integration.bits import DOUBLE, precision
from heavytop.integration.engine import HEAVY_BITS, NEVER, Array, Engine, Leg, Seen, engine, reals
from heavytop.integration.paces import in_units, paces_of
from heavytop.integration.projection import Projection

FIRST_BLOCK = 256  # steps; each block is four times as long as the last, up to the longest
LONGEST_BLOCK = 4000
PRECISE_BLOCKS = ((256, 64), (HEAVY_BITS, 8))  # of reals: below so many bits; beyond them a step
LONGEST_TIME = float(np.finfo(float).max)  # a time [s]
BEYOND = 1 + 1e-9  # of the way to the last sample, lest a zero there lie a rounding behind it


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


@dataclass(frozen=True, slots=True)
class Block:
    """A block of steps as it was seen: at samples, at zeros of events, and at its end.

    `singular` says that no finite step follows.
    """

    samples: Seen
    hits: tuple[Seen, ...]
    end: Checkpoint
    singular: bool


class Polynomials(NamedTuple):
    """Taylor polynomials of steps, in the unit of time in which they were taken.

    Attributes
    ----------
    coefficients : ndarray, shape (k, n, order + 1)
        Of n states, in the time since the beginning of each step.
    begun : ndarray, shape (k, 2)
        When each began, since the block's start, as double-doubles.
    length : ndarray, shape (k,)
        Of each step.
    restarted : ndarray, shape (k,)
        When time was last set to zero before each, since the block's start.
    """

    coefficients: Array
    begun: Array
    length: Array
    restarted: Array


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
        self.own_constants = in_units(form, self.pace, parameters)
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
        """Return a bound for the first steps of a run, in its own unit of time; later none."""
        if start.steps:
            return None
        own = self.engine
        if own.bits > DOUBLE:
            own = engine(own.formulation, (), EPSILON)
        own.load({name: float(x) for name, x in self.own_constants.items()})
        state = (start.state / self._units).astype(np.float64)
        return own.cautious_step(state, self._own_time(far))

    def block(
        self,
        start: Checkpoint,
        steps: int,
        far: float,
        samples: Array = NEVER,
        reach: float = math.inf,
    ) -> Block:
        """Take natural steps, so many or until the last sample is passed, and sample them.

        Parameters
        ----------
        start : Checkpoint
        steps, far
            As for `Engine.leg`.
        samples : ndarray, shape (k,), optional
            Monotonic times, none of them before the start [s].
        reach : float
            How far the steps will hardly go [s]: later samples are looked for only if they do.
        """
        legs, end = self._legs(start, steps, far, samples, reach)
        rows = np.concatenate([leg.rows for _, leg in legs]) * self._units
        reached = samples[: len(rows)]
        hits = zip(*([hit.after(since) for hit in leg.hits] for since, leg in legs), strict=True)
        return Block(
            samples=Seen(reached, 0 * reached, rows),
            hits=tuple(self._zeros(Seen.join(each)).after(start.time) for each in hits),
            end=end,
            singular=legs[-1][1].singular,
        )

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
        bound = longest = self.cautious_step(start, far)
        engine.load(self.own_constants)
        times = ((samples - start.time[0]) - start.time[1]) * pace  # since the start
        far, reach = self._own_time(far), reach * pace
        state, stride = start.state / self._units, project.stride if project else steps
        distances, legs = np.abs(times).tolist(), list[tuple[DoubleDouble, Leg]]()
        begun: DoubleDouble = (engine.number(0.0), engine.number(0.0))
        taken, done, mean, ended = 0, 0, 0.0, False
        while taken < steps and not ended and (rest := far - begun[0]) * far > 0:
            count = min(stride, steps - taken)
            for within in (reach, math.inf):
                last = bisect_right(distances, abs(begun[0]) + within, done)
                local = times[done:last]
                if local.size:  # nearly all legs of a long run have none
                    local = (local - begun[0]) - begun[1]
                to_the_end = done < last == times.size
                if to_the_end:
                    on_step = _until(BEYOND * abs(float(local[-1])))
                leg = _sampled(engine, state, count, rest, local, bound, on_step)
                length = abs(leg.elapsed[0])
                if to_the_end or not length > 0.9 * within:
                    break
            legs.append((begun, leg))
            state = project(leg.state) if project else leg.state
            taken, done, ended = taken + leg.steps, done + len(leg.rows), leg.steps < count
            if project:
                mean, reach = mean or length / count, 2 * length
                bound = project.longest(mean, len(legs), longest)
            begun = add(begun, leg.elapsed)
        time = add(start.time, (begun[0] / pace, begun[1] / pace))
        return legs, Checkpoint(time, state * self._units, start.steps + taken)

    def _zeros(self, found: Seen) -> Seen:
        """Return zeros, which are in the run's own unit of time, in seconds."""
        return Seen(found.t / self.pace, found.t_low / self.pace, found.states * self._units)

    def _own_time(self, far: float) -> float:
        """Return a time without end in the run's own unit of time, and finite."""
        return math.copysign(min(abs(far) * float(self.pace), LONGEST_TIME), far)


def _sampled(engine: Engine, state: Array, steps: int, far: float, times: Array, *how: Any) -> Leg:
    """Return a leg with a row for each time that it reached.

    heyoka wants times that differ and are after the start; by rounding they may be neither.
    """
    if not times.size:
        return engine.leg(state, steps, far, times, *how)
    new = times * far > 0
    new[1:] &= times[1:] != times[:-1]
    leg = engine.leg(state, steps, far, times[new], *how)
    place = np.cumsum(new)
    place = place[place <= len(leg.rows)]
    return leg._replace(rows=np.concatenate((state[None], leg.rows))[place])


def _until(end: float) -> Callable[[Any], bool]:
    """Return what tells after each step whether another is to follow."""
    return lambda taylor: abs(taylor.time) <= end
