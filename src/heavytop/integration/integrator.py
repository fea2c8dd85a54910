"""A formulation compiled by heyoka, and its one motion: a block of natural steps.

A trajectory is made of blocks of steps whose length the integrator chose itself. Shortening a
step to land on a sample would change every later step; counting steps does not, so a block run
again from its start, with other samples, gives the same bits. Each block measures time from its
own start: the equations are autonomous, and a small time keeps its last digits.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from functools import cache
from threading import get_ident
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.integration.compiled import Compiled
from heavytop.integration.engine import Block
from heavytop.integration.pace import FAST, SLOW, least_pace, unit_of
from heavytop.numbers.double_double import DoubleDouble

Array = NDArray[np.float64]

HALVINGS = 6  # of a first step, lest it hold a zero that is taken for the start
NATURAL = frozenset({hy.taylor_outcome.step_limit, hy.taylor_outcome.time_limit})


@dataclass(eq=False)
class Integrator:
    """A compiled formulation; parameters are loaded, never compiled in.

    Parameters
    ----------
    formulation : Formulation
    events : tuple of str
        Names of the formulation's event functions to be watched. They take part in the choice
        of the step, so another set of events is another run.
    tolerance : float
        Relative error tolerance of a step.
    """

    formulation: Formulation
    events: tuple[str, ...]
    tolerance: float
    compile_s: float = field(init=False)
    order: int = field(init=False)
    nothing: Array = field(init=False, repr=False)  # no rows of states
    _loaded: dict[str, float] = field(init=False)
    _least: float = field(init=False)  # pace
    _calm: bool = field(init=False)  # whether only a large rate asks for a unit
    _rates: tuple[int, ...] = field(init=False)
    _plain: Compiled = field(init=False, repr=False)
    _scaled: Compiled | None = field(init=False, repr=False)  # built where a motion needs it

    def __post_init__(self) -> None:
        began = time.perf_counter()
        states = self.formulation.states
        self._loaded, self._least, self._calm, self._scaled = {}, 1.0, True, None
        self._rates = tuple(i for i, s in enumerate(states) if s in self.formulation.rates)
        self._plain = Compiled(self.formulation, self.events, self.tolerance)
        self.order = int(self._plain.taylor.order)
        self.nothing = np.empty((0, len(states)))
        self.compile_s = time.perf_counter() - began

    def load(self, parameters: dict[str, float]) -> None:
        """Load the constants of a run, by the names of their symbols."""
        self._loaded, self._least = parameters, least_pace(parameters)
        self._calm = SLOW <= self._least <= FAST
        self._plain.load(parameters)
        if self._scaled is not None:
            self._scaled.load(parameters)

    def _standing(self, state: Array) -> Compiled:
        """Return what takes the steps from a state, standing there.

        Nothing but the state and the constants of the run says whether it is scaled: so a block
        has the same bits however it was come to.
        """
        if self._calm:  # every leg of a projected run asks: most tops are told at once
            for i in self._rates:
                if not -FAST <= state.item(i) <= FAST:
                    break
            else:
                self._plain.begin(state)
                return self._plain
        unit = unit_of([state.item(i) for i in self._rates], self._least)
        if unit == 1:
            self._plain.begin(state)
            return self._plain
        scaled = self._with_units()
        scaled.begin_in(unit, state)
        return scaled

    def _with_units(self) -> Compiled:
        if self._scaled is None:
            began = time.perf_counter()
            self._scaled = Compiled(self.formulation, self.events, self.tolerance, scaled=True)
            self._scaled.load(self._loaded)
            self.compile_s += time.perf_counter() - began
        return self._scaled

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps from a state, as `Engine` says."""
        compiled = self._standing(state)
        compiled.forget()
        outcome, taken, rows = _propagated(compiled, steps, far, samples, longest)
        if taken == steps or outcome in NATURAL:
            return _block(compiled, taken, rows)
        if taken == 0:
            return Block(state.copy(), (0.0, 0.0), 0, rows[:0], compiled.hits(), singular=True)
        good = self.block(state, taken, far, samples, longest)
        return Block(good.state, good.elapsed, good.steps, good.rows, good.hits, singular=True)

    def unseen(
        self, state: Array, steps: int, far: float, longest: float | None
    ) -> tuple[Array, DoubleDouble] | None:
        """Take the steps of a block of which only the end is wanted; None if it is a shorter one.

        The state may be the integrator's own: the next steps overwrite it.
        """
        compiled = self._standing(state)
        taylor = compiled.taylor
        bound = {} if longest is None else {"max_delta_t": longest}
        if taylor.propagate_until(far, max_steps=steps, **bound)[3] < steps:
            return None
        return compiled.true(compiled.own), taylor.dtime

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps: a little above the step beside the start [s].

        At a start with a symmetry, such as rest, every other Taylor coefficient vanishes or even
        three of four, and with them the two from which heyoka chooses the length of its step.
        """
        compiled = self._standing(state)
        taylor, begun = compiled.taylor, compiled.own.copy()
        tiny = math.copysign(float(np.finfo(float).tiny), far)
        taylor.step(tiny, write_tc=True)
        speed = float(np.max(np.abs(taylor.tc[:, 1])))
        if not 0 < speed < math.inf:
            return None
        aside = 1e-1 * max(1.0, float(np.max(np.abs(begun)))) / speed
        taylor.time = 0.0
        compiled.own[:] = begun
        taylor.step(math.copysign(min(aside, abs(far)), far))
        taylor.time = 0.0
        _, length = taylor.step(far)
        if not (math.isfinite(length) and length):
            return None
        return self._without_echo(state, math.copysign(1.25 * length, far))

    def _without_echo(self, state: Array, bound: float) -> float:
        """Return the size of a bound, halved until the first step loses no zero to its start [s].

        Where an event function is exactly zero at the start, heyoka may bracket the next zero
        together with it, and then find the start a second time.
        """
        shorter = bound
        for _ in range(HALVINGS if self.events else 0):
            compiled = self._standing(state)
            compiled.forget()
            compiled.taylor.step(shorter)
            if not compiled.echoes:
                return abs(shorter)
            shorter /= 2
        return abs(bound)

    def for_this_thread(self) -> Integrator:
        """Return the integrator like this one that belongs to the calling thread."""
        return integrator(self.formulation, self.events, self.tolerance)


def _propagated(
    compiled: Compiled, steps: int, far: float, samples: Array | None, longest: float | None
) -> tuple[Any, int, Array]:
    """Return how the steps ended, how many there were, and the states at the samples."""
    bound = math.inf if longest is None else longest
    if samples is None or samples.size == 0:
        result = compiled.taylor.propagate_until(far, max_steps=steps, max_delta_t=bound)
        return result[0], result[3], np.empty((0, compiled.own.size))
    grid = np.empty(samples.size + 2)
    grid[0], grid[1:-1], grid[-1] = 0.0, samples, far
    result = compiled.taylor.propagate_grid(grid, max_steps=steps, max_delta_t=bound)
    return result[0], result[3], compiled.true(result[5][1 : 1 + samples.size])


def _block(compiled: Compiled, taken: int, rows: Array) -> Block:
    end = compiled.true(compiled.own.copy())
    return Block(end, compiled.taylor.dtime, taken, rows, compiled.hits(), singular=False)


def integrator(formulation: Formulation, events: tuple[str, ...], tolerance: float) -> Integrator:
    """Return the compiled integrator of a formulation, built once per thread and process."""
    return _integrator(formulation, events, tolerance, get_ident())


@cache
def _integrator(
    formulation: Formulation, events: tuple[str, ...], tolerance: float, _thread: int
) -> Integrator:
    return Integrator(formulation, events, tolerance)
