"""Integrate many tops at a time, as many as the vector registers hold.

Each thread has one integrator, whose lanes are loaded with one batch of tops after another. All
lanes advance until the slowest has arrived, and a lane that leaves the finite numbers stops them
all; the tops of such a batch are then run one by one. Each lane has its own unit of time. No bit of
a top depends on the others in its batch.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import IntEnum
from threading import Event, Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.exact.decimals import DOUBLE
from heavytop.exact.pairs import EPSILON, Array
from heavytop.integration.engine import per_thread
from heavytop.integration.system import equations_of, hy, in_units, paces_of

Indices = NDArray[np.int64]
NOT_FINITE = hy.taylor_outcome.err_nf_state
WINK = 20_000  # steps in a call, some hundredths of a second: heyoka itself heeds no Ctrl-C
TOPS_A_THREAD = 64  # the fewest tops that are worth another thread

_BUILDING = Lock()  # sympy is not made for threads


class Lane(IntEnum):
    """How one top of many ended."""

    REACHED = 0
    SINGULAR = 1  # it left the finite numbers
    STEP_LIMIT = 2


class Zeros(NamedTuple):
    """Zeros of event functions, ordered by top and then by time.

    Attributes
    ----------
    which, event : ndarray of int, shape (h,)
        Which top, and which event function.
    t : ndarray, shape (h,)
        When [s].
    """

    which: Indices
    event: Indices
    t: Array

    def at(self, index: Any) -> Zeros:
        """Return those that an index or mask selects."""
        return Zeros(*(each[index] for each in self))


def join_zeros(parts: Iterable[Zeros]) -> Zeros:
    """Return the zeros of several parts, ordered by top and time."""
    found = Zeros(*map(np.concatenate, zip(*parts, strict=True)))
    return found.at(np.lexsort((abs(found.t), found.which)))


@dataclass(eq=False)
class Batch:
    """An integration of many tops, each from its state at time 0 to its own end.

    Parameters
    ----------
    form : Formulation
    events : tuple of str
        Names of the event functions to be watched.
    states : ndarray, shape (k, n)
    parameters : mapping from str to ndarray, shape (k,)
    times : tuple of 2 ndarrays, shape (k,)
        Ends, and the longest first steps [s]. A first step that begins at a zero of an event
        function must not reach the next one, or heyoka brackets both, and finds the start twice.
    limit : int
        Steps after which a top is given up.
    """

    form: Formulation
    events: tuple[str, ...]
    states: Array
    parameters: Mapping[str, Array]
    times: tuple[Array, Array]
    limit: int

    def __post_init__(self) -> None:
        states, times, form = self.states, self.times, self.form
        self.halt = Event()  # once it is set no more steps are taken, and results do not count
        sound = np.isfinite(times[0]) & np.isfinite(states).all(axis=1)
        with np.errstate(all="ignore"):  # tops with numbers that are not finite are left out below
            self.pace = paces_of(form, states, self.parameters)
            self.units = np.where(form.is_rate, self.pace[:, None], 1.0)
            self.start = states / self.units
            self.ends, self.first = (t * self.pace for t in times)
            far = np.isinf(self.ends)
        self.ending = np.where(sound & far, Lane.STEP_LIMIT, Lane.SINGULAR).astype(np.int64)
        self.sound = sound & ~far
        self.reached = np.full_like(states, np.nan)
        nothing = np.empty(0, np.int64)
        self.zeros = [Zeros(nothing, nothing, np.empty(0))]

    def run(self, jobs: int | None) -> tuple[Array, Indices, Zeros]:
        """Integrate all tops, on `jobs` threads, or on one per processor.

        Returns
        -------
        ndarray, shape (k, n)
            States at the ends; nan where the end was not reached.
        ndarray of int, shape (k,)
            Codes of `Lane`.
        Zeros
            Of the event functions.
        """
        tops = np.flatnonzero(self.sound)
        tops = tops[np.argsort(self.ends[tops], kind="stable")]
        count = max(1, min(jobs or os.cpu_count() or 1, tops.size // TOPS_A_THREAD))
        if count == 1:
            self._advance(tops)
        else:
            with ThreadPoolExecutor(count) as pool:
                try:
                    list(pool.map(self._advance, [tops[i::count] for i in range(count)]))
                except BaseException:  # the pool waits for its threads
                    self.halt.set()
                    raise
        return self.reached * self.units, self.ending, join_zeros(self.zeros)

    def _advance(self, tops: Indices) -> None:
        """Integrate tops in full batches, and one by one those of a batch that was stopped."""
        engine = _engine(self.form, self.events)
        width = engine.taylor.batch_size
        spare = np.repeat(tops[-1:], -tops.size % width)  # copies of the last fill up its batch
        lanes = np.append(tops, spare).reshape(-1, width)
        real = np.arange(lanes.size).reshape(lanes.shape) < tops.size
        last, reached, marks = self._propagate(engine, lanes)
        at_end, sound = reached == self.ends[lanes], np.isfinite(reached)
        done = real & (sound.all(axis=1) | (real.sum(axis=1) == 1))[:, None]
        self.reached[lanes[done & at_end]] = last.transpose(0, 2, 1)[done & at_end]
        self.ending[lanes[done & at_end]] = Lane.REACHED
        self.ending[lanes[done & sound & ~at_end]] = Lane.STEP_LIMIT
        if engine.found:
            t, place = np.array(engine.found).reshape(-1, 2).T
            event, lane = np.divmod(place.astype(np.int64), width)
            batch = np.repeat(np.arange(len(lanes)), np.diff(marks))
            which = lanes[batch, lane]
            self.zeros.append(Zeros(which, event, t / self.pace[which]).at(done[batch, lane]))
        for top in lanes[real & ~done]:
            self._advance(np.array([top]))

    def _propagate(self, engine: _Engine, lanes: Indices) -> tuple[Array, Array, Indices]:
        """Run b batches of w lanes: last states (b, n, w), times reached (b, w), counts (b + 1,).

        The time reached is nan in lanes that left the finite numbers. The counts are those of the
        zeros found before each batch and after the last.
        """
        taylor, found = engine.taylor, engine.found
        found.clear()
        loaded = {name: self.parameters[name][lanes] for name in engine.loaded}
        constants = np.stack([*in_units(self.form, self.pace[lanes], loaded).values()], axis=1)
        states = np.ascontiguousarray(self.start[lanes].transpose(0, 2, 1))
        ends, first = self.ends[lanes], self.first[lanes]
        last, reached = np.empty_like(states), np.empty_like(ends)
        marks = np.zeros(len(lanes) + 1, dtype=np.int64)
        # lists: of an array heyoka makes a number object of each element, and takes twice as long
        bounds = zip(ends.tolist(), first.tolist(), strict=True)
        endless = [np.inf] * lanes.shape[1]
        for i, (target, bound) in enumerate(bounds):
            taylor.set_time(0.0)
            engine.state[:] = states[i]
            engine.constants[:] = constants[i]
            steps, left = WINK if bound == endless else 1, self.limit
            lost: list[bool] = []
            while left > 0 and not any(lost) and not self.halt.is_set():
                steps = min(steps, left)
                taylor.propagate_until(target, max_steps=steps, max_delta_t=bound)
                if engine.time.tolist() == target:
                    break
                lost = [each[0] == NOT_FINITE for each in taylor.propagate_res]
                steps, left, bound = WINK, left - steps, endless
            last[i], reached[i], marks[i + 1] = engine.state, engine.time, len(found) // 2
            if any(lost):
                reached[i, lost] = np.nan
        return last, reached, marks


class _Engine:
    """Equations compiled for one batch of tops."""

    def __init__(self, form: Formulation, events: tuple[str, ...]) -> None:
        self.found: list[float] = []  # of each zero its time, and event × width + lane
        with _BUILDING:
            equations, self.loaded, functions = equations_of(form, DOUBLE, events)
            width = hy.recommended_simd_size()
            states, pars = (np.zeros((len(x), width)) for x in (equations, self.loaded))
            recorders = (_recorder(i * width, self.found) for i, _ in enumerate(functions))
            zeros = [*map(hy.nt_event_batch, functions, recorders)]
            self.taylor = taylor = hy.taylor_adaptive_batch(
                equations, states, pars=pars, tol=EPSILON, nt_events=zeros
            )
        # heyoka's own arrays: looking them up takes time
        self.state, self.constants, self.time = taylor.state, taylor.pars, taylor.time


_engine = per_thread(_Engine)


def _recorder(place: int, found: list[float]) -> Callable[..., None]:
    """Return the callback of an event, of which heyoka's copies share the list."""

    def record(_taylor: Any, t: float, _sign: int, lane: int) -> None:
        found.append(t)  # numpy reads a list of numbers at once, and one of tuples tuple by tuple
        found.append(place + lane)

    return record
