"""Blocks of natural steps, and what takes them for the constants of a run.

heyoka takes its steps in the run's own unit of time. Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone: so a block has the same
bits however it was come to.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.exact.pairs import EPSILON, DoubleDouble, add
from heavytop.integration.bits import DOUBLE, precision
from heavytop.integration.engine import (
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
        self.own_constants = self.parameters
        if self.pace != 1:
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
        legs, state = self._legs(start.state, steps, far, forward * since[new], longest)
        rows = np.concatenate([leg.rows for _, leg in legs]) * self._units
        place = np.cumsum(new)
        place = place[place <= len(rows)]  # the block did not reach the others
        reached = samples[: place.size]
        hits = zip(*([hit.after(since) for hit in leg.hits] for since, leg in legs), strict=True)
        end, elapsed = self._end(start, legs, state)
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
        legs, state = self._legs(start.state, steps, far, NEVER, longest, keep=True)
        parts = []
        for begun, leg in legs:
            assert leg.polynomials is not None
            since, words = np.full(leg.steps, begun[0]), leg.polynomials.begun
            later = add((since, np.full(leg.steps, begun[1])), (words[:, 0], words[:, 1]))
            part = leg.polynomials._replace(begun=np.stack(later, axis=-1), restarted=since)
            parts.append(part)
        end, _ = self._end(start, legs, state)
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
    ) -> tuple[list[tuple[DoubleDouble, Leg]], Array]:
        """Return the legs of a block in the run's own unit of time, each with when it began.

        And the state after them. A run that is not projected has one leg; of another the projected
        state behind each is where the next begins.
        """
        engine, project, far = self.engine, self.projection, self._own_time(far)
        engine.load(self.own_constants)
        state, times = state / self._units, times * self.pace
        bound = longest = None if longest is None else longest * float(self.pace)
        if project is None:
            leg = engine.leg(state, steps, far, times, longest, keep=keep)
            return [((0.0, 0.0), leg)], leg.state
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
            if place is not None:
                leg = leg._replace(rows=leg.rows[place[place < len(leg.rows)]])
            state = project(leg.state)
            legs.append((begun, leg))
            taken, done, ended = taken + leg.steps, done + len(leg.rows), leg.steps < count
            mean, reach = mean or length / count, 2 * length
            bound, begun = project.longest(mean, len(legs), longest), add(begun, leg.elapsed)
        return legs, state

    def _end(
        self, start: Checkpoint, legs: Sequence[tuple[DoubleDouble, Leg]], state: Array
    ) -> tuple[Checkpoint, float]:
        """Return where the legs of a block end, with a state, and how long they are [s]."""
        (begun, last), pace = legs[-1], self.pace
        high, low = add(begun, last.elapsed)
        time = add(start.time, (high / pace, low / pace))
        steps = start.steps + sum(leg.steps for _, leg in legs)
        return Checkpoint(time, state * self._units, steps), float(high / pace)

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
    if not times.size:
        return times, None
    local = (times - begun[0]) - begun[1]
    local = np.where(local * far > 0, local, math.copysign(LEAST_TIME, far))
    if local.size < 2 or (np.diff(np.abs(local)) > 0).all():
        return local, None
    sizes, place = np.unique(np.abs(local), return_inverse=True)
    return np.copysign(sizes, far), place
