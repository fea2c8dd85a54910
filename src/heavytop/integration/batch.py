"""A formulation compiled for as many tops at once as the processor's vector registers hold.

One integrator is reused: its lanes are loaded with the next tops, never cloned. All lanes advance
until the slowest has arrived, and a lane that leaves the finite numbers stops them all, so such a
top is found out by itself and the others are run without it. Each lane has its own unit of time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from threading import Event, Lock, local
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.integration.bits import DOUBLE
from heavytop.integration.compiled import Array, System
from heavytop.integration.pace import in_units, paces_of

Indices = NDArray[np.int64]
Hits = list[tuple[int, int, float, bytes]]  # event, lane, time, state
PACE = ("g", "h", "A", "gMR")  # constants that tell how fast a motion may become
LOST = hy.taylor_outcome.err_nf_state
WINK = 20_000  # steps at a time, some hundredths of a second: heyoka itself heeds no Ctrl-C


class Lane(IntEnum):
    """How one top of many ended."""

    REACHED = 0
    SINGULAR = 1  # it left the finite numbers
    STEP_LIMIT = 2


@dataclass(frozen=True, slots=True)
class Zeros:
    """Zeros of event functions met on the way, by top and then by time.

    Attributes
    ----------
    which, event : ndarray of int, shape (h,)
        Which top, and which event function.
    t : ndarray, shape (h,)
        When [s].
    states : ndarray, shape (h, n)
        The state there.
    """

    which: Indices
    event: Indices
    t: Array
    states: Array


@dataclass(frozen=True, slots=True)
class Arrived:
    """Many tops at their ends.

    Attributes
    ----------
    states : ndarray, shape (k, n)
        States at the ends; nan where the end was not reached.
    ending : ndarray of int, shape (k,)
        Codes of `Lane`.
    zeros : Zeros
    """

    states: Array
    ending: Indices
    zeros: Zeros


@dataclass(eq=False)
class BatchIntegrator:
    """A formulation compiled for `width` tops at a time; belongs to one thread.

    Parameters
    ----------
    formulation : Formulation
    events : tuple of str
        Names of the event functions to be watched.
    tolerance : float
        Relative error tolerance of a step.
    """

    formulation: Formulation
    events: tuple[str, ...]
    tolerance: float
    width: int = field(init=False)
    parameters: tuple[str, ...] = field(init=False)
    found: Hits = field(init=False)
    taylor: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.width, self.found = int(hy.recommended_simd_size()), []
        system = System.of(self.formulation, DOUBLE, self.events)
        loaded, known = system.loaded, {p.name for p in self.formulation.parameters}
        self.parameters = (*loaded, *(n for n in PACE if n in known and n not in loaded))
        self.taylor = hy.taylor_adaptive_batch(
            system.equations,
            np.zeros((len(system.equations), self.width)),
            pars=np.zeros((len(loaded), self.width)),
            tol=self.tolerance,
            nt_events=[
                hy.nt_event_batch(zero, _recorder(self.found, i))
                for i, zero in enumerate(system.zeros)
            ],
        )

    def run(
        self,
        states: Array,
        parameters: Array,
        ends: Array,
        step_limit: int | None = None,
        longest: Array | None = None,
        first: Array | None = None,
        halt: Event | None = None,
    ) -> Arrived:
        """Integrate each top from its state at time 0 to its own end.

        Parameters
        ----------
        states : ndarray, shape (k, n)
        parameters : ndarray, shape (k, p)
            In the order of `parameters`, of which the last may only tell the pace.
        ends : ndarray, shape (k,)
            Times [s].
        step_limit : int, optional
            Steps after which a top, with the others of its batch, is given up.
        longest : ndarray, shape (k,), optional
            The longest step of each top [s].
        first : ndarray, shape (k,), optional
            The longest first step of each top [s]: from a zero of an event function no other may
            be reached in it, or heyoka brackets both, and finds the start twice.
        halt : Event, optional
            Once it is set by another thread, no more steps are taken, and the result means nothing.
        """
        self.found.clear()
        sound = np.isfinite(ends)
        for given in (states, parameters):
            sound &= np.isfinite(given).all(axis=1)
        free = np.full(ends.size, np.inf)
        bounds = [free if each is None else each for each in (longest, first)]
        times = (ends, *bounds)
        with np.errstate(all="ignore"):  # what is no number is found out lane by lane
            journey = _Journey(self, (states, parameters, *times), step_limit or 0, halt)
        sound &= ~journey.hopeless(sound)
        ends = journey.given[2]
        order = np.argsort(np.where(sound, ends, np.inf), kind="stable")[: int(sound.sum())]
        spare = -order.size % self.width  # the last batch is filled up with its first top
        journey.advance(np.concatenate((order, np.repeat(order[-1:], spare))), spare)
        return journey.arrived()


class _Journey:
    """Many tops under way, each in its own unit of time."""

    def __init__(
        self, engine: BatchIntegrator, given: tuple[Array, ...], limit: int, halt: Event | None
    ) -> None:
        form, (states, parameters, *times) = engine.formulation, given
        self.engine, self.limit, self.halt = engine, limit, halt or Event()
        told = dict(zip(engine.parameters, parameters.T, strict=True))
        self.pace = paces_of(form, states, told)
        self.units = np.where(form.is_rate, self.pace[:, None], 1.0)
        constants = list(in_units(self.pace, told).values())[: len(engine.taylor.pars)]
        loaded = np.stack(constants, axis=-1)
        self.given = states / self.units, loaded, *(t * self.pace for t in times)
        self.states = np.full_like(states, np.nan)
        self.ending = np.full(len(states), int(Lane.SINGULAR))
        self.hits: list[tuple[Indices, Hits]] = []

    def hopeless(self, sound: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which would need more than all steps even if each were as long as it may be."""
        _, _, ends, longest, _ = self.given
        with np.errstate(invalid="ignore", over="ignore"):
            far = (np.abs(ends) > self.limit * longest) & (self.limit > 0)
        beyond: NDArray[np.bool_] = sound & (far | np.isinf(ends))
        self.ending[beyond] = Lane.STEP_LIMIT
        return beyond

    def advance(self, tops: Indices, spare: int = 0) -> None:
        """Integrate tops in full batches; those of a batch that was stopped go one by one."""
        if tops.size == 0:
            return
        width = self.engine.width
        lanes = tops.reshape(-1, width)
        ends = self.given[2][lanes]
        last, reached, marks = self._propagated(lanes, ends)
        real = np.ones(lanes.shape, dtype=bool)
        real[-1:, width - spare :] = False
        there = reached == ends
        whole = there.all(axis=1) if width > 1 else np.ones(len(lanes), dtype=bool)
        alone = (lanes == lanes[:, :1]).all(axis=1)
        limited = np.isfinite(reached) & (self.limit > 0)
        done = real & (whole | alone | limited.all(axis=1))[:, None]
        self.states[lanes[done & there]] = last.transpose(0, 2, 1)[done & there]
        self.ending[lanes[done & there]] = Lane.REACHED
        self.ending[lanes[done & ~there & limited]] = Lane.STEP_LIMIT
        self._keep(lanes, done, marks)
        for top in lanes[real & ~done].tolist():
            self.advance(np.full(width, top), width - 1)

    def arrived(self) -> Arrived:
        """What has been found."""
        width = self.states.shape[1]
        hits = [hit for _, part in self.hits for hit in part]
        which = np.concatenate([np.empty(0, np.int64), *(tops for tops, _ in self.hits)])
        event = np.array([hit[0] for hit in hits], dtype=np.int64)
        t = np.array([hit[2] for hit in hits], dtype=np.float64)
        states = np.frombuffer(b"".join(hit[3] for hit in hits)).reshape(-1, width)
        order = np.lexsort((np.abs(t), which))
        which = which[order]
        zeros = Zeros(
            which, event[order], t[order] / self.pace[which], states[order] * self.units[which]
        )
        return Arrived(self.states * self.units, self.ending, zeros)

    def _propagated(self, lanes: Indices, ends: Array) -> tuple[Array, Array, Indices]:
        """Run every batch: last states (b, n, w), times reached (b, w), zeros found after each."""
        found, taylor = self.engine.found, self.engine.taylor
        found.clear()
        states, loaded, _, longest, begin = self.given
        first = np.ascontiguousarray(states[lanes].transpose(0, 2, 1))
        constants = np.ascontiguousarray(loaded[lanes].transpose(0, 2, 1))
        last, reached = np.empty_like(first), np.empty_like(ends)
        marks = np.zeros(len(lanes) + 1, dtype=np.int64)
        bounds, begins = longest[lanes], np.minimum(begin, longest)[lanes]
        # of all or of none, so that no top's last bits depend on those beside it
        some = 1 if self.engine.events else min(self.limit or WINK, WINK)
        for i, target in enumerate(ends.tolist()):
            if self.halt.is_set():
                break
            taylor.set_time(0.0)
            taylor.state[:] = first[i]
            taylor.pars[:] = constants[i]
            taylor.propagate_until(ends[i], max_steps=some, max_delta_t=begins[i])
            lost: list[bool] = []
            if taylor.time.tolist() != target:
                lost = self._further(taylor, ends[i], bounds[i], some)
            last[i], reached[i], marks[i + 1] = taylor.state, taylor.time, len(found)
            if lost:
                reached[i, lost] = np.nan
        return last, reached, marks

    def _further(self, taylor: Any, ends: Array, longest: Array, taken: int) -> list[bool]:
        """Go on after so many steps, some at a time; tell which lanes left the finite numbers."""
        while True:
            lost = [each[0] == LOST for each in taylor.propagate_res]
            left = self.limit - taken if self.limit else WINK
            if any(lost) or left <= 0 or self.halt.is_set() or (taylor.time == ends).all():
                return lost
            taylor.propagate_until(ends, max_steps=min(left, WINK), max_delta_t=longest)
            taken += min(left, WINK)

    def _keep(self, lanes: Indices, done: NDArray[np.bool_], marks: Indices) -> None:
        """Take over the zeros found in those lanes that are done."""
        found = self.engine.found
        if not found:
            return
        batch = np.repeat(np.arange(len(lanes)), np.diff(marks))
        lane = np.array([hit[1] for hit in found], dtype=np.int64)
        kept = np.flatnonzero(done[batch, lane])
        self.hits.append((lanes[batch, lane][kept], [found[i] for i in kept.tolist()]))


def _recorder(found: Hits, event: int) -> Callable[..., None]:
    """What heyoka calls at a zero; it keeps what it closes over, though it is copied."""

    def record(taylor: Any, t: float, _sign: int, lane: int) -> None:
        taylor.update_d_output(t)
        found.append((event, lane, t, taylor.d_output[:, lane].tobytes()))

    return record


def batch_integrator(
    formulation: Formulation, events: tuple[str, ...], tolerance: float
) -> BatchIntegrator:
    """Return the batch integrator of a formulation, built once per thread; it ends with it."""
    built: dict[Any, BatchIntegrator] = _OF_THIS_THREAD.__dict__.setdefault("built", {})
    key = (formulation, events, tolerance)
    if key not in built:
        with _BUILDING:
            built[key] = BatchIntegrator(*key)
    return built[key]


_OF_THIS_THREAD, _BUILDING = local(), Lock()  # sympy is not made for threads
