"""The interface of all methods of integration: steppers, which take their steps in blocks.

A block leads from one `StepperState` to the next, and states between them can be computed. A state
consists of numbers alone: it can be stored, and another process goes on from it bit for bit. A
stepper is set up for an `InitialValueProblem`. Here are also the steppers of fixed step.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from heavytop.exact.pairs import Array, DoubleDouble, two_product

if TYPE_CHECKING:
    from heavytop.comparison.user_steps import BodyForm
    from heavytop.equations.formulation import Formulation

Advance = Callable[[Array, Array, int], int]
"""``advance(states, work, n)`` takes n steps, and changes both arrays in place.

Work holds what the method keeps from step to step. The result is the number of evaluations, or
negative where the steps could not be taken.
"""

Kernel = Callable[..., int]
"""Compiled steps: arguments are g, l_z, the coefficients times h, and then those of `Advance`."""

_KERNEL = "int64(float64, float64, float64[:, ::1], float64[::1], float64[::1], int64)"


class IntegrationFailed(Exception):
    """A stepper that cannot go on; the message says why in a sentence, `outcome` in a word."""

    outcome = "stalled"


class NotFinite(IntegrationFailed):
    """States that are no longer numbers."""

    outcome = "diverged"

    def __str__(self) -> str:
        return "the numbers are no longer finite"


class MethodError(IntegrationFailed):
    """A user's method that raises something, or returns what is no state."""

    outcome = "method-error"


@dataclass(frozen=True, slots=True)
class StepperState:
    """The state of a stepper between two blocks.

    Attributes
    ----------
    time : tuple of float
        Time since the start as a double-double [s].
    state : tuple of float or str
        The states, in the order of the formulation; numbers beyond doubles as texts.
    carry : tuple of float or str
        What else the method keeps: the length of its next step, lost low words.
    steps : int
        Steps taken so far.
    evaluations : int
        Evaluations of the right-hand side so far; of a splitting, of the force.
    """

    time: DoubleDouble
    state: tuple[Any, ...]
    carry: tuple[Any, ...] = ()
    steps: int = 0
    evaluations: int = 0


@dataclass(frozen=True, eq=False, kw_only=True)
class Stepper:
    """One method set up for one start: the same state always leads to the same next state.

    Attributes
    ----------
    start : tuple of float or str
        The states at the start.
    steps : int
        Steps in a block; 0 where a state says how many.
    carried : int
        Words of `StepperState.carry` at the start.
    compile_s : float
        What compiling took, whenever that was [s].
    form : BodyForm or None
        The form in which a user's method computes, where that is the rotation of the body.
    warned : Counter of str
        How often a user's method gave each warning.
    """

    start: tuple[Any, ...]
    steps: int = 0
    carried: int = 0
    compile_s: float = 0.0
    form: BodyForm | None = None
    warned: Counter[str] = field(default_factory=Counter)

    def begin(self) -> StepperState:
        """Return the state at the start, time 0."""
        return StepperState((0.0, 0.0), self.start, (0.0,) * self.carried)

    def block(self, at: StepperState) -> StepperState:
        """Take a block of steps, whose number depends on the state alone.

        Raises
        ------
        IntegrationFailed
            The step vanishes, or the numbers are no longer finite.
        """
        raise NotImplementedError

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states, shape (k, n), at times of `output_time` in the block after a state."""
        raise NotImplementedError

    def output_time(self, t: float) -> DoubleDouble:
        """Return the first time not before t at which the stepper has a state.

        That is t itself where states between steps are as accurate as steps, and the end of a step
        for a method of fixed step.
        """
        return t, 0.0


# --- what a stepper is set up for ----------------------------------------------------------------


class TopConstants(NamedTuple):
    """A, C [kg m^2] and gMR [J] of a top, as floats."""

    A: float
    C: float
    gMR: float


@dataclass(frozen=True, slots=True, eq=False)
class InitialValueProblem:
    """Equations and a start, from which a method takes its steps.

    Attributes
    ----------
    equations : Formulation
    parameters : mapping from str to float
        The formulation's parameters by name, and perhaps others.
    start : tuple of float
        The states at the start.
    direction : int
        1 forwards, -1 backwards in time.
    period : float or None
        The nutation period, of which fixed steps are parts [s].
    top : TopConstants or None
        The top itself, for users' methods.
    """

    equations: Formulation
    parameters: Mapping[str, float]
    start: tuple[float, ...]
    direction: int = 1
    period: float | None = None
    top: TopConstants | None = None

    @property
    def constants(self) -> dict[str, float]:
        """The parameters that occur in the derivatives."""
        form = self.equations
        names = [symbol.name for symbol in form.constants_in(form.derivatives)]
        return {name: float(self.parameters[name]) for name in names}

    @property
    def span(self) -> float:
        """The period, negative backwards in time [s]."""
        assert self.period is not None
        return self.direction * float(self.period)


def derivatives(
    equations: Formulation, number: Callable[[Any], Any] = float, library: Any = math
) -> Callable[..., Sequence[Any]]:
    """Return the derivatives as a function of the states and of the constants that occur in them.

    `number` makes the numbers in them, and `library` has the functions sin, cos and sqrt.
    """
    from heavytop.equations.lambdify import lambdify

    functions = {name: getattr(library, name) for name in ("sin", "cos", "sqrt")}
    arguments = (*equations.states, *equations.constants_in(equations.derivatives))
    return lambdify(equations.derivatives, arguments, number, functions)


def compiled_function(function: Callable[..., Any]) -> tuple[Any, Any]:
    """Return derivatives compiled by numba, and numba's function that makes a tuple of an array."""
    from numba import njit
    from numba.np.unsafe.ndarray import to_fixed_tuple

    return njit(error_model="numpy")(function), to_fixed_tuple  # 1/0 is inf


# --- fixed steps ---------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, kw_only=True)
class FixedStep(Stepper):
    """A stepper of equal steps: after j of them the time is exactly h j.

    Attributes
    ----------
    h : float
        The step [s], negative backwards.
    advance : Advance
    scratch : int
        Words of work that are kept within a block; those in `carried` go from block to block.
    """

    h: float
    advance: Advance
    scratch: int = 0

    def block(self, at: StepperState) -> StepperState:
        """Take a block of steps."""
        state, work = self._arrays(at)
        evaluations = self._advance(state, work, self.steps)
        steps = at.steps + self.steps
        time, carry = two_product(self.h, float(steps)), tuple(work[: self.carried].tolist())
        return StepperState(time, tuple(state.tolist()), carry, steps, at.evaluations + evaluations)

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at ends of steps in the block after a state: the orbit's own bits."""
        wanted = [round(t[0] / self.h) - at.steps for t in times]
        state, work = self._arrays(at)
        rows, done = {}, 0
        for step in sorted(set(wanted)):
            self._advance(state, work, step - done)
            rows[step], done = state.copy(), step
        return np.array([rows[step] for step in wanted])

    def output_time(self, t: float) -> DoubleDouble:
        """Return the end of the first step that is not before t."""
        near = math.ceil(t / self.h)  # or one beside it, as the quotient is rounded
        ends = [two_product(self.h, float(step)) for step in (near - 1, near, near + 1)]
        return next(end for end in ends if (end >= (t, 0.0) if self.h > 0 else end <= (t, 0.0)))

    def _arrays(self, at: StepperState) -> tuple[Array, Array]:
        """Return the two arrays that `advance` changes."""
        return np.array(at.state), np.array([*at.carry, *(0.0,) * self.scratch])

    def _advance(self, state: Array, work: Array, steps: int) -> int:
        """Take steps, and return the number of evaluations."""
        evaluations = self.advance(state, work, steps)
        if evaluations < 0:
            why = "the iteration for a step does not converge: the steps are too long"
            raise IntegrationFailed(why)
        if not np.isfinite(state).all():
            raise NotFinite
        return evaluations


def compiled(function: Callable[..., Any], signature: str = _KERNEL) -> tuple[Any, float]:
    """Return a function compiled by numba, by default the steps of a method, and the seconds.

    Sums are not reassociated, so that steps give the same bits however they are divided into calls.
    Compiled code is not kept on disk.
    """
    from numba import njit

    began = time.perf_counter()
    return njit(signature, nogil=True)(function), time.perf_counter() - began


def summation(*, compensated: bool) -> Any:
    """Return the compiled function that adds a term: from (sum, lost, term) to (sum, lost)."""
    from numba import njit

    def plain_sum(total: float, lost: float, term: float) -> tuple[float, float]:
        return total + term, lost

    def compensated_sum(total: float, lost: float, term: float) -> tuple[float, float]:
        term = term + lost
        result = total + term  # and its error: Knuth's, since e_x may be less than the term
        part = result - total
        return result, (total - (result - part)) + (term - part)

    return njit(inline="always")(compensated_sum if compensated else plain_sum)
