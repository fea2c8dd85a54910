"""A formulation compiled by heyoka, and its one motion: a block of natural steps.

A trajectory is made of blocks of steps whose length the integrator chose itself. Shortening a
step to land on a sample would change every later step; counting steps does not, so a block run
again from its start, with other samples, gives the same bits. Each block measures time from its
own start: the equations are autonomous, and a small time keeps its last digits.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from threading import get_ident
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.doubledouble import DoubleDouble
from heavytop.models.formulation import Formulation
from heavytop.taylor.engine import Block, Hits
from heavytop.taylor.translate import translate

Array = NDArray[np.float64]

hy.set_logger_level_critical()  # heyoka logs to stdout, which belongs to the results

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
    _parameters: tuple[Any, ...] = field(init=False)
    _sinks: tuple[_Sink, ...] = field(init=False)
    _taylor: Any = field(init=False, repr=False)
    _state: Array = field(init=False, repr=False)  # looked up once: short runs feel it

    def __post_init__(self) -> None:
        began = time.perf_counter()
        watched = [self.formulation.events[name] for name in self.events]
        used = set().union(*(x.free_symbols for x in (*self.formulation.derivatives, *watched)))
        candidates = (*self.formulation.parameters, *self.formulation.given)
        self._parameters = tuple(p for p in candidates if p in used)
        self._sinks = tuple(_Sink() for _ in watched)
        self._taylor = self._compiled(watched)
        self._state = self._taylor.state
        self.order = int(self._taylor.order)
        self.nothing = np.empty((0, len(self.formulation.states)))
        self.compile_s = time.perf_counter() - began

    def _compiled(self, watched: Sequence[Any]) -> Any:
        states = hy.make_vars(*(s.name for s in self.formulation.states))
        names = dict(zip(self.formulation.states, states, strict=True))
        names |= {p: hy.par[i] for i, p in enumerate(self._parameters)}
        derivatives = translate(self.formulation.derivatives, names)
        zeros = translate(watched, names)
        return hy.taylor_adaptive(
            list(zip(states, derivatives, strict=True)),
            [0.0] * len(states),
            pars=[0.0] * len(self._parameters),
            tol=self.tolerance,
            nt_events=[
                hy.nt_event(zero, sink.recorder())
                for zero, sink in zip(zeros, self._sinks, strict=True)
            ],
        )

    def load(self, parameters: dict[str, float]) -> None:
        """Load the constants of a run, by the names of their symbols."""
        self._taylor.pars[:] = [parameters[p.name] for p in self._parameters]

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
    ) -> Block:
        """Take natural steps from a state, as `Engine` says."""
        taylor = self._taylor
        taylor.time = 0.0
        taylor.state[:] = state
        for sink in self._sinks:
            sink.clear()
        outcome, taken, rows = self._propagated(steps, far, samples, longest)
        if taken == steps or outcome in NATURAL:
            return self._block(taken, rows, singular=False)
        if taken == 0:
            return Block(state.copy(), (0.0, 0.0), 0, rows[:0], self._hits(), singular=True)
        good = self.block(state, taken, far, samples, longest)
        return Block(good.state, good.elapsed, good.steps, good.rows, good.hits, singular=True)

    def unseen(
        self, state: Array, steps: int, far: float, longest: float | None
    ) -> tuple[Array, DoubleDouble] | None:
        """Take the steps of a block of which only the end is wanted; None if it is a shorter one.

        The state is the integrator's own: the next steps overwrite it.
        """
        taylor, own = self._taylor, self._state
        taylor.time = 0.0
        own[:] = state
        bound = {} if longest is None else {"max_delta_t": longest}
        if taylor.propagate_until(far, max_steps=steps, **bound)[3] < steps:
            return None
        return own, taylor.dtime

    def _propagated(
        self, steps: int, far: float, samples: Array | None, longest: float | None
    ) -> tuple[Any, int, Array]:
        bound = math.inf if longest is None else longest
        if samples is None or samples.size == 0:
            result = self._taylor.propagate_until(far, max_steps=steps, max_delta_t=bound)
            return result[0], result[3], self.nothing
        grid = np.empty(samples.size + 2)
        grid[0], grid[1:-1], grid[-1] = 0.0, samples, far
        result = self._taylor.propagate_grid(grid, max_steps=steps, max_delta_t=bound)
        return result[0], result[3], result[5][1 : 1 + samples.size]

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps: a little above the step beside the start [s].

        At a start with a symmetry, such as rest, every other Taylor coefficient vanishes or even
        three of four, and with them the two from which heyoka chooses the length of its step.
        """
        taylor = self._taylor
        taylor.time = 0.0
        taylor.state[:] = state
        tiny = math.copysign(float(np.finfo(float).tiny), far)
        taylor.step(tiny, write_tc=True)
        speed = float(np.max(np.abs(taylor.tc[:, 1])))
        if not 0 < speed < math.inf:
            return None
        aside = 1e-1 * max(1.0, float(np.max(np.abs(state)))) / speed
        taylor.time = 0.0
        taylor.state[:] = state
        taylor.step(math.copysign(min(aside, abs(far)), far))
        taylor.time = 0.0
        _, length = taylor.step(far)
        return 1.25 * abs(length) if math.isfinite(length) and length else None

    def for_this_thread(self) -> Integrator:
        """Return the integrator like this one that belongs to the calling thread."""
        return integrator(self.formulation, self.events, self.tolerance)

    def _block(self, taken: int, rows: Array, *, singular: bool) -> Block:
        taylor = self._taylor
        return Block(taylor.state.copy(), taylor.dtime, taken, rows, self._hits(), singular)

    def _hits(self) -> tuple[Hits, ...]:
        width = len(self.formulation.states)
        return tuple([sink.hits(width) for sink in self._sinks])


class _Sink:
    """Collects the zeros of one event function; the callback must be cheap."""

    def __init__(self) -> None:
        self.t: list[float] = []
        self.states: list[bytes] = []

    def clear(self) -> None:
        self.t.clear()
        self.states.clear()

    def recorder(self) -> Any:
        # heyoka copies callbacks deeply, but a function keeps what it closes over
        mark, keep = self.t.append, self.states.append

        def record(taylor: Any, t: float, _sign: int) -> None:
            taylor.update_d_output(t)
            mark(t)
            keep(taylor.d_output.tobytes())

        return record

    def hits(self, width: int) -> Hits:
        states = np.frombuffer(b"".join(self.states)).reshape(-1, width)
        t = np.array(self.t, dtype=float)
        return Hits(t, np.zeros_like(t), states)


def integrator(formulation: Formulation, events: tuple[str, ...], tolerance: float) -> Integrator:
    """Return the compiled integrator of a formulation, built once per thread and process."""
    return _integrator(formulation, events, tolerance, get_ident())


@cache
def _integrator(
    formulation: Formulation, events: tuple[str, ...], tolerance: float, _thread: int
) -> Integrator:
    return Integrator(formulation, events, tolerance)
