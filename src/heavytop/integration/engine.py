"""A formulation compiled by heyoka, in doubles or in MPFR reals, which takes natural steps.

Natural steps have the lengths that heyoka chooses. Shortening one to land on a sample would change
all later ones; counting steps does not, so that a block of them, run again from its start with
other samples, gives the same bits. Time is measured from the start of a block: the equations are
autonomous, and a small time keeps its last digits. `integration/system.py` explains its unit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from functools import cache, partial
from threading import Lock, Thread, get_ident
from typing import Any, NamedTuple, TypeVar

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.exact.decimals import DOUBLE, precision
from heavytop.exact.pairs import EPSILON, Array, DoubleDouble, add
from heavytop.integration.system import equations_of, hy, number_of

T = TypeVar("T")

HEAVY_BITS = 1024  # from which a step takes long: seconds at 3000 bits, a minute at 10 000
PARALLEL_BITS = 512  # from which the products of a step are computed in parallel threads
ABOVE = 1.25  # the bound of the first steps, in units of the natural step beside the start
NEVER = np.empty(0)  # no times
STEP_HALVINGS = 6  # most, of the bound of the first step
_OUTCOMES = hy.taylor_outcome
NATURAL = frozenset({_OUTCOMES.step_limit, _OUTCOMES.time_limit, _OUTCOMES.cb_stop})


def per_thread(build: Callable[..., T]) -> Callable[..., T]:
    """Return a function that caches what it builds, for each thread its own."""
    built = cache(lambda _thread, *given: build(*given))
    return lambda *given: built(get_ident(), *given)


def reals(texts: Any, bits: int) -> Array:
    """Return an array of texts, or of other numbers, rounded to reals of so many bits."""
    found = np.empty(np.shape(texts), hy.real)
    found[...] = np.frompyfunc(number_of(bits), 1, 1)(texts)
    return found


def in_thread(call: Callable[[], T]) -> T:
    """Run a long call in a daemon thread and return its result; Ctrl-C only stops the waiting."""
    result: Future[T] = Future()

    def work() -> None:
        try:
            result.set_result(call())
        except BaseException as error:
            result.set_exception(error)

    Thread(target=work, name="in heyoka", daemon=True).start()  # a command that ends asks for it
    return result.result()


def text(x: Any) -> str:
    """Return a decimal text from which every bit of a number can be read back."""
    bits = precision(x)
    return repr(float(x)) if bits == DOUBLE else str(hy.real(x, bits + 64))


class TimedStates(NamedTuple):
    """States at given times: times [s] as high and low words, states (k, n)."""

    t: Array
    t_low: Array
    states: Array

    @classmethod
    def join(cls, parts: Iterable[TimedStates]) -> TimedStates:
        """Return the parts one after the other."""
        parts = [*parts]
        if len(full := [part for part in parts if part.t.size]) < 2:
            return (full or parts)[0]
        return cls(*map(np.concatenate, zip(*full, strict=True)))

    def where(self, index: Any) -> TimedStates:
        """Return those that a mask, slice or array of indices selects."""
        return TimedStates(*[column[index] for column in self])

    def after(self, begun: DoubleDouble) -> TimedStates:
        """Return them with a double-double added to all times [s]."""
        start: Any = begun  # a scalar, which is added to arrays
        return TimedStates(*add(start, (self.t, self.t_low)), self.states) if any(begun) else self


class Leg(NamedTuple):
    """The result of natural steps in a row; times are measured from their start.

    Attributes
    ----------
    state : ndarray, shape (n,)
        The state after the last step.
    elapsed : tuple of two numbers
        Time, as a high and a low word [s].
    steps : int
        Steps taken.
    rows : ndarray, shape (k, n)
        States at those of the sample times that were reached.
    hits : tuple of TimedStates
        The zeros of each event function.
    singular : bool
        Whether the next step would have left the finite numbers.
    """

    state: Array
    elapsed: DoubleDouble
    steps: int
    rows: Array
    hits: tuple[TimedStates, ...]
    singular: bool = False


class Engine:
    """A compiled formulation; constants are loaded, never compiled in.

    Parameters
    ----------
    formulation : Formulation
    events : tuple of str
        Names of the event functions to be watched. They take part in the choice of the step, so
        that another set of events gives other steps. In reals none are watched: at high orders
        they would take gigabytes to compile.
    tolerance : float
        Relative error tolerance of a step in doubles; in reals it is their rounding. A tolerance
        below the rounding of doubles turns on compensated sums, as heyoka's documentation advises
        for Brouwer's law.
    bits : int
        Bits of a number.
    """

    def __init__(
        self,
        formulation: Formulation,
        events: tuple[str, ...],
        tolerance: float,
        bits: int = DOUBLE,
    ) -> None:
        began = time.perf_counter()
        self.formulation, self.events = formulation, events
        self.tolerance, self.bits, self.number = tolerance, bits, number_of(bits)
        equations, self._loaded, functions = equations_of(formulation, bits, events)
        self._zeros: list[list[tuple[float, bytes]]] = [[] for _ in events]  # times and states
        self._busy = Lock()
        start, pars = ([self.number(0.0)] * len(x) for x in (equations, self._loaded))
        if bits == DOUBLE:
            zeros = list(map(hy.nt_event, functions, map(_recorder, self._zeros)))
            kind = {"tol": tolerance, "high_accuracy": tolerance < EPSILON, "nt_events": zeros}
        else:  # without compact mode compiling takes minutes
            many = bits >= PARALLEL_BITS
            kind = {"fp_type": hy.real, "prec": bits, "compact_mode": True, "parallel_mode": many}
        build = partial(hy.taylor_adaptive, equations, start, pars=pars, **kind)
        self._taylor = build() if bits == DOUBLE else in_thread(build)
        self._own: Array = self._taylor.state  # looking it up takes time
        self.nothing: Array = np.empty((0, self._own.size), self._own.dtype)  # no rows of states
        self.order = int(self._taylor.order)
        self.compile_s = time.perf_counter() - began

    def __reduce__(self) -> tuple[Any, ...]:
        return Engine, (self.formulation, self.events, self.tolerance, self.bits)  # compiled anew

    def load(self, parameters: Mapping[str, float]) -> None:
        """Load the constants of a run, by the names of their symbols."""
        self._taylor.pars[:] = [parameters[name] for name in self._loaded]

    def leg(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array = NEVER,
        longest: float | None = None,
        on_step: Callable[[Any], bool] | None = None,
        unwatched: int = 0,
    ) -> Leg:
        """Take natural steps from a state and sample their Taylor polynomials.

        Parameters
        ----------
        state : ndarray, shape (n,)
        steps : int
            How many steps to take.
        far : float
            A time no leg of interest reaches, with the sign of the direction [s]; only a step
            longer than that is cut.
        samples : ndarray, shape (k,), optional
            Monotonic times since the leg's start, none of them 0 [s].
        longest : float, optional
            The longest step to take [s].
        on_step : callable, optional
            Called after each step with heyoka's integrator, which has the Taylor coefficients of
            the step in ``tc`` where no samples are wanted; the leg ends when it returns False.
        unwatched : int, optional
            Number of steps before the first call of it, which takes as long as a step; used only
            with samples.
        """
        bound = self.number(math.inf if longest is None else longest)
        how, end = {"max_steps": steps, "max_delta_t": bound, "callback": on_step}, self.number(far)
        if samples.size:
            grid = np.empty(samples.size + 2, self._own.dtype)
            grid[0], grid[1:-1], grid[-1] = self.number(0.0), samples, end
            some = {"max_steps": unwatched, "callback": None} if unwatched else {}
            result = self._step(state, self._taylor.propagate_grid, grid, **how | some)
            outcome, taken, rows = result[0], result[3], result[5][1 : 1 + samples.size]
            if unwatched and on_step is not None:
                if taken < unwatched or not on_step(self._taylor):  # it is past the end
                    return self.leg(state, steps, far, samples, longest, on_step)
                how["max_steps"] -= taken
                outcome, further, rows = self._continue_leg(samples, rows, end, **how)
                taken += further
        else:
            how["write_tc"] = on_step is not None
            outcome, *_, taken, _, _ = self._step(state, self._taylor.propagate_until, end, **how)
            rows = self.nothing
        if taken == steps or outcome in NATURAL:
            return Leg(self._own.copy(), self._taylor.dtime, taken, rows, self._hits())
        if taken == 0:
            nothing = self.number(0.0), self.number(0.0)
            return Leg(state.copy(), nothing, 0, rows[:0], self._hits(), singular=True)
        return self.leg(state, taken, far, samples, longest, on_step)._replace(singular=True)

    def first_step_bound(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps: a little above the natural step beside the start [s].

        None where the state does not move, or no such step can be taken. At a start with a
        symmetry, such as rest, every other Taylor coefficient vanishes, or even three of four, and
        with them the two from which heyoka chooses the length of its step.
        """
        taylor = self._taylor
        self._begin(state)
        tiny = math.copysign(float(np.finfo(float).tiny), far)
        taylor.step(tiny, write_tc=True)
        speed = float(np.max(np.abs(taylor.tc[:, 1])))
        if not 0 < speed < math.inf:
            return None
        aside = 1e-1 * max(1.0, float(np.max(np.abs(state)))) / speed
        self._begin(state)
        taylor.step(math.copysign(min(aside, abs(far)), far))
        taylor.time = 0.0
        _, length = taylor.step(far)
        if not (math.isfinite(length) and length):
            return None
        return self._shorten_for_start(state, math.copysign(ABOVE * length, far))

    def _begin(self, state: Array) -> None:
        """Set the integrator to a state at time 0, with no zeros found."""
        self._taylor.time = self.number(0.0)
        self._own[:] = state
        for found in self._zeros:
            found.clear()

    def _step(self, state: Array | None, method: Callable[..., Any], end: Any, **how: Any) -> Any:
        """Call a `propagate` method of heyoka's integrator, first set to a state unless it is None.

        Where steps take long it runs in another thread, and Ctrl-C stops the waiting for it.
        """

        def run() -> Any:
            with self._busy:  # a call that nobody waits for any more ends first
                if state is not None:
                    self._begin(state)
                return method(end, **how)

        return run() if self.bits < HEAVY_BITS else in_thread(run)

    def _continue_leg(
        self, samples: Array, rows: Array, end: Any, callback: Any, **how: Any
    ) -> tuple[Any, int, Array]:
        """Take more steps of a leg: return heyoka's outcome, their number, and all rows.

        heyoka's own `propagate_grid` cannot do this: it would first step to the high word of time.
        """
        forward = math.copysign(1.0, end)
        found, left = [*rows], [*samples[len(rows) :].tolist(), forward * math.inf]

        def sample(taylor: Any) -> bool:
            high, low = taylor.dtime
            while forward * ((left[0] - high) - low) <= 0:  # as heyoka's grid has it
                found.append(taylor.update_d_output(left.pop(0)).copy())
            return bool(callback(taylor))

        how |= {"callback": sample, "write_tc": True}
        result = self._step(None, self._taylor.propagate_until, end, **how)
        return result[0], result[3], np.array(found).reshape(-1, self._own.size)

    def _hits(self) -> tuple[TimedStates, ...]:
        """Return the zeros found of each event function."""
        hits = []
        for found in self._zeros:
            t = np.array([t for t, _ in found], dtype=float)
            states = np.frombuffer(b"".join([state for _, state in found]))
            hits.append(TimedStates(t, np.zeros_like(t), states.reshape(-1, self._own.size)))
        return tuple(hits)

    def _shorten_for_start(self, state: Array, bound: float) -> float:
        """Return the size of a bound, halved until the first step finds no zero at 0 twice [s].

        Where an event function is exactly zero at the start, heyoka may bracket the next zero
        together with it; it then finds the start a second time, and misses that zero. After
        `STEP_HALVINGS` the bound itself is returned.
        """
        shorter = bound
        for _ in range(STEP_HALVINGS if self.events else 0):
            self._begin(state)
            self._taylor.step(shorter)
            if all([t for t, _ in found].count(0) < 2 for found in self._zeros):
                return abs(shorter)
            shorter /= 2
        return abs(bound)


def _recorder(found: list[tuple[float, bytes]]) -> Callable[..., None]:
    """Return the callback of an event, of which heyoka's copies share the list."""

    def record(taylor: Any, t: float, _sign: int) -> None:
        found.append((t, taylor.update_d_output(t).tobytes()))

    return record


engine = per_thread(Engine)
"""The `Engine` of a formulation, built once for each thread."""
