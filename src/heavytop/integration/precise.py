"""A formulation integrated in more than double precision: long double, or any number of bits.

Numbers enter and leave as decimal texts; inside they are numpy long doubles or heyoka's reals
(MPFR). Steps are natural ones, so samples change nothing. Events are not watched in the loop,
where high orders would take gigabytes to compile: whoever knows about when they are asks for them,
and each is polished here, by Newton's method on the Taylor polynomials of the step that holds it.
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

import heyoka as hy
import numpy as np

from heavytop.equations.formulation import Formulation, power_of_rate
from heavytop.equations.lambdify import NUMPY, lambdified
from heavytop.integration.bits import LONG_DOUBLE
from heavytop.integration.compiled import System
from heavytop.integration.following import NOT_TOLD, Following, Told, Trail
from heavytop.integration.pace import in_units, paces_of

HEAVY = 1024  # bits from which on a step takes long: seconds at 3000 bits, a minute at 10 000
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
class Wanted:
    """A state that is wanted: at a time [s], or at the zero of an event function close to it."""

    t: str
    event: str | None = None


@dataclass(frozen=True, slots=True)
class Found:
    """A state and its time [s], as decimal texts that hold every bit; and phi and psi there.

    The angles `turned` are followed from the start to double precision [rad]; nan where they are
    not, and psi less its uniform part.
    """

    t: str
    state: tuple[str, ...]
    turned: Told = NOT_TOLD


@dataclass(frozen=True, slots=True)
class Walk:
    """What a run of natural steps left behind.

    Attributes
    ----------
    found : tuple of (Found or None)
        What was wanted, in that order; None for an event that is none at this precision.
    marks : tuple of Mark
        The states kept on the way, the first one included.
    steps : int
        Natural steps taken.
    """

    found: tuple[Found | None, ...]
    marks: tuple[Mark, ...]
    steps: int


@dataclass(frozen=True, slots=True)
class Mark:
    """A natural step's end: enough to go on from. `t` has more than twice the bits."""

    t: Any
    state: tuple[Any, ...]
    steps: int
    turned: Told = NOT_TOLD


class Precise:
    """Equations compiled for numbers of so many bits.

    Parameters
    ----------
    system : System
        With constants of as many bits.
    bits : int
        Of the significand; `LONG_DOUBLE` means the machine's own.
    parameters : mapping from str to str
        Constants of the run, by symbol name, as decimal texts.
    quick : bool
        Whether compiling is to be quick rather than the steps, which are the same bit for bit.
    pace : float
        In whose unit of time steps are taken [1/s].
    """

    def __init__(
        self,
        system: System,
        bits: int,
        parameters: Mapping[str, str],
        *,
        quick: bool = False,
        pace: float = 1.0,
    ) -> None:
        began = time.perf_counter()
        self.bits, self.hardware = bits, bits == LONG_DOUBLE
        self._constants = {name: self.number(text) for name, text in parameters.items()}
        self._events: dict[str, Callable[..., Any]] = {}
        self.following: Following | None = None  # tells phi and psi along the way
        self._turned = NOT_TOLD
        self._pace = pace
        self._units = [self._pace ** power_of_rate(str(state)) for state, _ in system.equations]
        self._taylor = self._compiled(system, 0 if quick else 3)
        self.order = int(self._taylor.order)
        self.compile_s = time.perf_counter() - began

    def number(self, text: str) -> Any:
        """Return the number of so many bits that is nearest to a decimal text."""
        return np.longdouble(text) if self.hardware else hy.real(text, self.bits)

    def text(self, number: Any) -> str:
        """Return a decimal text that holds every bit of a number."""
        if not self.hardware:
            return str(number)
        return np.format_float_scientific(number, precision=2 * self.bits, unique=False)

    def wide(self, text: str) -> Any:
        """Return a time with so many bits that sums of steps lose nothing."""
        return hy.real(text, 2 * self.bits + 64)

    def parameter_texts(self) -> dict[str, str]:
        """Return the constants of the run as they are used, by symbol name."""
        return {name: self.text(value) for name, value in self._constants.items()}

    def total(self, words: Sequence[float]) -> Any:
        """Return the number that is the sum of doubles, the largest first."""
        exactly = np.longdouble if self.hardware else (lambda x: hy.real(x, self.bits))
        return sum(map(exactly, reversed(words)), exactly(0.0))

    def moment(self, *words: float) -> Any:
        """Return a time, the sum of doubles, the largest first [s]."""
        bits = 2 * self.bits + 64
        return sum((hy.real(word, bits) for word in reversed(words)), hy.real(0.0, bits))

    def start(self, state: Sequence[str]) -> Mark:
        """Return the start of a run, from decimal texts."""
        return Mark(self.wide("0"), tuple(map(self.number, state)), 0)

    def walk(
        self,
        mark: Mark,
        wanted: Sequence[Wanted],
        far: float,
        longest: float | None = None,
        on_mark: Callable[[float], None] | None = None,
    ) -> Walk:
        """Take natural steps from a mark until everything wanted is found.

        Parameters
        ----------
        mark : Mark
        wanted : sequence of Wanted
            In any order, none of them before the mark.
        far : float
            A time longer than any step of interest, with the sign of the direction [s].
        longest : float, optional
            The longest of the first steps [s].
        on_mark : callable, optional
            Called with the time reached [s], at every mark.

        Raises
        ------
        ValueError
            A time before the mark.
        Unfinished
            The equations are singular where the motion went.
        """
        times = [self.wide(each.t) for each in wanted]
        if any((t - mark.t) * math.copysign(1.0, far) < 0 for t in times):
            raise ValueError("a time before the mark from which the steps go on")
        order = sorted(range(len(wanted)), key=lambda i: abs(times[i] - mark.t))
        waiting = deque((i, times[i], wanted[i].event) for i in order)
        found: list[Found | None] = [None] * len(wanted)
        marks, steps = [mark], 0
        while waiting:
            last = marks[-1]
            cut = far if longest is None or last.steps else math.copysign(longest, far)
            steps += self._stride(last, waiting, found, cut)
            if waiting:
                marks.append(self._mark(last))
                if on_mark is not None:
                    on_mark(float(marks[-1].t))
        return Walk(tuple(found), tuple(marks), steps)

    def onward(self, mark: Mark, far: float, longest: float | None = None) -> Mark:
        """Return the next mark, a fixed number of natural steps later; arguments as in `walk`.

        Raises
        ------
        Unfinished
            The equations are singular where the motion went.
        """
        cut = far if longest is None or mark.steps else math.copysign(longest, far)
        self._stride(mark, deque([(0, self.moment(far) + mark.t, None)]), [None], cut)
        return self._mark(mark)

    def _compiled(self, system: System, opt_level: int) -> Any:
        number_type: dict[str, Any] = {"fp_type": np.longdouble}
        if not self.hardware:  # without compact mode compiling takes minutes
            number_type = {"fp_type": hy.real, "prec": self.bits, "compact_mode": True}
        constants = in_units(self._pace, self._constants)
        pars = [constants[name] for name in system.loaded]
        start = [self.number("0")] * len(system.equations)
        number_type |= {"pars": pars, "opt_level": opt_level}
        return apart(lambda: hy.taylor_adaptive(system.equations, start, **number_type))

    def _stride(
        self, mark: Mark, waiting: deque[tuple[int, Any, str | None]], found: list[Any], cut: float
    ) -> int:
        """Take the steps up to the next mark, finding what they pass; return how many."""
        taylor = self._taylor
        taylor.time = self.number("0")
        for i, value in enumerate(mark.state):
            taylor.state[i] = value / self._units[i]
        while waiting and waiting[0][1] == mark.t and waiting[0][2] is None:
            one = self._found(mark.t, mark.state)
            found[waiting.popleft()[0]] = replace(one, turned=mark.turned)
        trail = Trail(self.following, mark.state, mark.turned) if self.following else None
        steps = self._steps(mark, waiting, found, cut, trail)
        if trail is not None:
            trail.tell()
            self._turned = trail.last
            for i, turned in trail.told.items():
                found[i] = replace(found[i], turned=turned)
        return steps

    def _steps(
        self,
        mark: Mark,
        waiting: deque[tuple[int, Any, str | None]],
        found: list[Any],
        cut: float,
        trail: Trail | None,
    ) -> int:
        longest = self.number(repr(cut))
        for step in range(MARK):
            if not waiting:
                return step
            length = self._step(longest)
            elapsed = self._elapsed()
            while waiting and abs(waiting[0][1] - mark.t) <= abs(elapsed):
                i, t, event = waiting.popleft()
                since = self._narrowed(t - mark.t - elapsed)
                found[i] = self._seen(mark, since, length, event)
                if trail is not None and found[i] is not None:
                    moment = float(self.wide(found[i].t) - mark.t)
                    trail.see(i, moment, found[i].state)
            if trail is not None:
                state = self._measured(self._taylor.state)
                trail.step(float(elapsed), float(length), state, self._before)
        return MARK

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

    def _before(self, since: float) -> tuple[Any, ...]:
        """Return the state at a time since the end of the last step, in double."""
        return self._dense(self.number(repr(since)))

    def _mark(self, mark: Mark) -> Mark:
        state = self._measured(self._taylor.state)
        return Mark(mark.t + self._elapsed(), state, mark.steps + MARK, self._turned)

    def _elapsed(self) -> Any:
        """Return the time since the last mark [s]."""
        return self._widened(*self._taylor.dtime) / self._pace

    def _measured(self, state: Sequence[Any]) -> tuple[Any, ...]:
        """Return a state in seconds from one of the integrator's."""
        return tuple(x * unit for x, unit in zip(state, self._units, strict=True))

    def _widened(self, high: Any, low: Any) -> Any:
        return hy.real(high, 2 * self.bits + 64) + hy.real(low, 2 * self.bits + 64)

    def _narrowed(self, x: Any) -> Any:
        return np.longdouble(str(x)) if self.hardware else hy.real(x, self.bits)

    def _found(self, t: Any, state: Sequence[Any]) -> Found:
        return Found(str(t), tuple(map(self.text, state)))

    def _seen(self, mark: Mark, since: Any, length: Any, event: str | None) -> Found | None:
        """Return the state at a time since the end of the last step, or at the zero close by."""
        if event is not None:
            since = self._polished(event, since, abs(length))
        if since is None:
            return None
        t = mark.t + self._elapsed() + self._widened(since, self.number("0"))
        return self._found(t, self._dense(since))

    def _dense(self, since: Any) -> tuple[Any, ...]:
        self._taylor.update_d_output(since * self._pace, rel_time=True)
        return self._measured(self._taylor.d_output)

    def _polished(self, event: str, since: Any, length: Any) -> Any:
        """Return the zero of an event function by Newton's method, or None where it finds none."""
        near = length * self.number(repr(2.0**-8))
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


class PreciseIntegrator(Precise):
    """A formulation compiled for numbers of so many bits.

    Parameters
    ----------
    formulation : Formulation
    bits, parameters
        As for `Precise`.
    events : sequence of str
        Names of the event functions whose zeros may be wanted.
    start : sequence of str
        The states at the start of the run, as decimal texts: they tell its pace.
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
        self._asked = formulation, bits, dict(parameters), tuple(events), tuple(start)
        self.formulation = formulation
        pace = _pace(formulation, parameters, start)
        super().__init__(System.of(formulation, bits), bits, parameters, pace=pace)
        self._events |= {name: self._event(name) for name in events}
        self.compile_s = time.perf_counter() - began

    def __reduce__(self) -> tuple[Any, ...]:
        return PreciseIntegrator, self._asked, {"following": self.following}  # compiled anew

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
