"""A formulation integrated in more than double precision, in any number of bits.

Numbers enter as decimal texts; they are heyoka's reals (MPFR). Steps are natural ones, so samples
change nothing. Events are not watched in the loop, where high orders would
take gigabytes to compile: whoever knows about when they are asks for them, and each is polished
here, by Newton's method on the Taylor polynomials of the step that holds it.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from threading import Thread
from typing import Any

import numpy as np

from heavytop.equations.formulation import Formulation, power_of_rate
from heavytop.equations.lambdify import NUMPY, lambdified
from heavytop.integration.compiled import System
from heavytop.integration.library import hy
from heavytop.integration.outputs import Sample, sample
from heavytop.integration.paces import in_units, paces_of
from heavytop.integration.turns import GRAIN_BITS, Turns

HEAVY = 1024  # bits from which on a step takes long: seconds at 3000 bits, a minute at 10 000
Row = Sequence[Any]
Told = tuple[float, ...]
Wanted = tuple[Any, str | None]  # a time, and perhaps an event

DONE = frozenset(
    getattr(hy.taylor_outcome, name) for name in ("success", "time_limit", "step_limit")
)
MARK = 64  # steps between the states that are kept
MOST_ITERATIONS = 100

hy.set_logger_level_critical()  # heyoka logs to stdout, which belongs to the results


def apart(call: Callable[[], Any]) -> Any:
    """Return what a long call returns; Ctrl-C leaves it to itself, and it ends with the process."""
    result: Future[Any] = Future()

    def work() -> None:
        try:
            result.set_result(call())
        except BaseException as error:
            result.set_exception(error)

    Thread(target=work, daemon=True).start()
    return result.result()


class Unfinished(ArithmeticError):
    """The next step would have left the finite numbers."""


@dataclass(frozen=True, slots=True)
class Mark:
    """A state of a run, enough to go on from.

    Attributes
    ----------
    t : real
        Time, with more than twice the bits [s].
    state : tuple of real
    steps : int
        Natural steps taken before.
    turned : tuple of float
        The angles that are counted, to double precision [rad].
    """

    t: Any
    state: tuple[Any, ...]
    steps: int = 0
    turned: Told = ()


class PreciseIntegrator:
    """A formulation compiled for numbers of so many bits.

    Parameters
    ----------
    formulation : Formulation
    bits : int
        Of the significand.
    parameters : mapping from str to str
        Constants of the run, by symbol name, as decimal texts.
    events : sequence of str
        Names of the event functions whose zeros may be wanted.
    start : sequence of str
        The states at the start of the run, as decimal texts, in whose unit of time steps are taken;
        in seconds without them.
    """

    def __init__(
        self,
        formulation: Formulation,
        bits: int,
        parameters: Mapping[str, str],
        events: Sequence[str] = (),
        start: Sequence[str] = (),
    ) -> None:
        began = time.perf_counter()
        self._asked: tuple[Any, ...] = formulation, bits, dict(parameters), events, start
        self.formulation, self.bits = formulation, bits
        self._constants = {name: self.number(text) for name, text in parameters.items()}
        self._events = {name: self._event(name) for name in events}
        self.turns: Turns | None = None  # tells phi and psi along the way
        self._pace = _pace(formulation, parameters, start)
        self._units = [self._pace ** power_of_rate(state.name) for state in formulation.states]
        self._taylor = self._compiled()
        self.order = int(self._taylor.order)
        self.compile_s = time.perf_counter() - began

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), self._asked, {"turns": self.turns}  # compiled anew

    def number(self, x: Any) -> Any:
        """Return the number of so many bits that is nearest to a decimal text or another number."""
        return hy.real(x, self.bits)

    def wide(self, x: Any) -> Any:
        """Return a time with so many bits that sums of steps lose nothing."""
        return hy.real(x, 2 * self.bits + 64)

    def constants(self, bits: int) -> dict[str, Any]:
        """Return the constants of the run as they are used, by symbol name, in reals of `bits`."""
        return {name: hy.real(x, bits) for name, x in self._constants.items()}

    def parameter_texts(self) -> dict[str, str]:
        """Return the constants of the run as they are used, by symbol name."""
        return {name: str(value) for name, value in self._constants.items()}

    def start(self, state: Sequence[str]) -> Mark:
        """Return the start of a run, from decimal texts."""
        return Mark(self.wide("0"), tuple(map(self.number, state)))

    def walk(
        self,
        mark: Mark,
        wanted: Sequence[Wanted],
        far: float,
        longest: float | None = None,
        on_mark: Callable[[float], None] | None = None,
    ) -> tuple[tuple[Mark | None, ...], tuple[Mark, ...]]:
        """Take natural steps from a mark until everything wanted is found.

        Parameters
        ----------
        mark : Mark
        wanted : sequence of (time, str or None)
            Times [s], as texts or wide numbers, in any order, none of them before the mark; with
            the name of an event function, the zero of that close to the time.
        far : float
            A time longer than any step of interest, with the sign of the direction [s].
        longest : float, optional
            The longest of the first steps [s].
        on_mark : callable, optional
            Called with the time reached [s], at every mark but the last.

        Returns
        -------
        tuple of (Mark or None)
            What was wanted, in that order; None for an event that is none at this precision.
        tuple of Mark
            States kept on the way, the first one and the last included.

        Raises
        ------
        ValueError
            A time before the mark.
        Unfinished
            The equations are singular where the motion went.
        """
        times = [self.wide(t) for t, _ in wanted]
        if any((t - mark.t) * math.copysign(1.0, far) < 0 for t in times):
            raise ValueError("a time before the mark from which the steps go on")
        order = sorted(range(len(wanted)), key=lambda i: abs(times[i] - mark.t))
        waiting = deque((i, times[i], wanted[i][1]) for i in order)
        found: list[Mark | None] = [None] * len(wanted)
        marks = [mark]
        while waiting:
            marks.append(self._stride(marks[-1], waiting, found, far, longest))
            if waiting and on_mark is not None:
                on_mark(float(marks[-1].t))
        return tuple(found), tuple(marks)

    def onward(self, mark: Mark, far: float, longest: float | None = None) -> Mark:
        """Return the next mark, a fixed number of natural steps later; arguments as in `walk`.

        Raises
        ------
        Unfinished
            The equations are singular where the motion went.
        """
        return self._stride(mark, deque([(0, mark.t + self.wide(far), None)]), [None], far, longest)

    def _compiled(self) -> Any:
        system = System.of(self.formulation, self.bits)
        # without compact mode compiling takes minutes
        kind = {"fp_type": hy.real, "prec": self.bits, "compact_mode": True}
        constants = in_units(self._pace, self._constants)
        pars = [constants[name] for name in system.loaded]
        start = [self.number("0")] * len(system.equations)
        kind["pars"] = pars
        return apart(lambda: hy.taylor_adaptive(system.equations, start, **kind))

    def _stride(
        self,
        mark: Mark,
        waiting: deque[tuple[int, Any, str | None]],
        found: list[Any],
        far: float,
        longest: float | None,
    ) -> Mark:
        """Take steps to the next mark, or until nothing is waited for; return where they end."""
        taylor, steps = self._taylor, 0
        taylor.time = self.number("0")
        for i, value in enumerate(mark.state):
            taylor.state[i] = value / self._units[i]
        while waiting and waiting[0][1] == mark.t and waiting[0][2] is None:
            found[waiting.popleft()[0]] = mark
        trail: list[tuple[float, Row]] = [(0.0, mark.state)]
        asked: dict[int, float] = {}
        cut = far if longest is None or mark.steps else math.copysign(longest, far)
        while waiting and steps < MARK:
            steps += 1
            length = self._step(self.number(repr(cut)))
            while waiting and abs(waiting[0][1] - mark.t) <= abs(self._elapsed()):
                i, t, event = waiting.popleft()
                seen = found[i] = self._seen(mark, t, length, event)
                if seen is not None:
                    asked[i] = float(seen.t - mark.t)
                    trail.append((asked[i], seen.state))
            trail += self._inside(float(length))
        end = Mark(mark.t + self._elapsed(), self._measured(taylor.state), mark.steps + steps)
        if self.turns is None or steps == 0:
            return replace(end, turned=mark.turned)
        times = np.array([t for t, _ in trail])
        rows = np.array([[float(x) for x in row] for _, row in trail])
        angles = self.turns.told(times, rows, mark.turned)
        for i, since in asked.items():
            found[i] = replace(found[i], turned=tuple(angles(since).tolist()))
        return replace(end, turned=tuple(angles(times[-1]).tolist()))

    def _inside(self, length: float) -> list[tuple[float, Row]]:
        """Return states in the last step, its end included, so close that turns are told."""
        if self.turns is None:
            return []
        end, parts = float(self._elapsed()), self.turns.parts(length)
        since = [-length * (1 - k / parts) for k in range(1, parts)]
        states = [(end + t, self._dense(self.number(t))) for t in since]
        return [*states, (end, self._measured(self._taylor.state))]

    def _step(self, longest: Any) -> Any:
        """Take a natural step and return its length [s]."""
        taylor, longest = self._taylor, longest * self._pace
        if self.bits < HEAVY:
            outcome, length = taylor.step(longest, write_tc=True)
        else:  # the same step; only this call lets other threads run meanwhile
            outcome = apart(lambda: taylor.propagate_for(longest, max_steps=1, write_tc=True))[0]
            length = taylor.last_h
        if outcome not in DONE:
            raise Unfinished(str(outcome))
        return length / self._pace

    def _elapsed(self) -> Any:
        """Return the time since the last mark, wide [s]."""
        high, low = self._taylor.dtime
        return (self.wide(high) + self.wide(low)) / self._pace

    def _measured(self, state: Sequence[Any]) -> tuple[Any, ...]:
        """Return a state in seconds from one of the integrator's."""
        return tuple(x * unit for x, unit in zip(state, self._units, strict=True))

    def _seen(self, mark: Mark, t: Any, length: Any, event: str | None) -> Mark | None:
        """Return the state at a time in the last step, or at the zero of an event close by."""
        end = mark.t + self._elapsed()
        since = self.number(t - end)
        if event is not None:
            since = self._polished(event, since, abs(length))
        return since if since is None else Mark(end + self.wide(since), self._dense(since))

    def _dense(self, since: Any) -> tuple[Any, ...]:
        self._taylor.update_d_output(since * self._pace, rel_time=True)
        return self._measured(self._taylor.d_output)

    def _polished(self, event: str, since: Any, length: Any) -> Any:
        """Return the zero of an event function by Newton's method, or None where it finds none."""
        near = length * self.number(2.0**-8)
        enough = length * self.number("2") ** -(self.bits // 2)
        first = since
        for _ in range(MOST_ITERATIONS):
            zero, slope = self._events[event](*self._dense(since))
            if slope == 0:
                return since if zero == 0 else None
            change = -zero / slope
            since = since + change
            if not abs(since - first) <= near:
                return None
            if abs(change) <= enough:  # the next change is its square
                return since
        return None

    def sample(self, form: Formulation, found: Sequence[Mark], bits: int) -> Sample:
        """Return the motion at states of a run, in reals of more bits than it has itself.

        `form` is the formulation that is integrated, or that with the angles read off it.
        """
        known, width = self.constants(bits), len(self.formulation.states)
        t = np.array([hy.real(one.t, bits) for one in found], dtype=hy.real)
        rows = [[hy.real(x, bits) for x in one.state] for one in found]
        states = np.array(rows, dtype=hy.real).reshape(len(found), width)
        if self.turns is not None:
            told = np.array([one.turned for one in found]).reshape(-1, len(form.states) - width)
            grain = hy.real(2, bits) ** (GRAIN_BITS - self.bits)
            states = np.column_stack((states, *self.turns.read(states, told, known, grain)))
        return sample(form, states, known, t)

    def _event(self, event: str) -> Callable[..., Any]:
        """Return an event function and its time derivative, as a function of the states."""
        form, zero = self.formulation, self.formulation.events[event]
        both = [zero, form.flow_derivative(zero)]
        constants = form.constants_in(both)
        values = [self._constants[p.name] for p in constants]
        function = lambdified(
            both, (*form.states, *constants), lambda i: self.number(str(i)), NUMPY
        )
        return lambda *state: function(*state, *values)


def _pace(form: Formulation, parameters: Mapping[str, str], start: Sequence[str]) -> float:
    """Return the pace of the run from a start; one without a start."""
    if not start:
        return 1.0
    constants = {name: float(text) for name, text in parameters.items()}
    return float(paces_of(form, np.array(list(map(float, start))), constants))
