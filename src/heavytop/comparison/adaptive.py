"""Steppers of adaptive solvers: scipy's and CyRK's.

A block is a fixed number of steps of a new solver, whose first step has the length that the block
before would have taken next: so it depends on its start alone. LSODA starts again at order 1 and
chooses its first step itself. States between two steps are computed by a separate run from the
earlier step: scipy's interpolants of DOP853 and Radau are of lower order than the steps.
"""

from __future__ import annotations

import itertools
import math
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from heavytop.comparison import steppers
from heavytop.comparison.steppers import InitialValueProblem, IntegrationFailed, StepperState
from heavytop.exact.pairs import Array, DoubleDouble, add

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation

RTOL_LEAST: Final = 100 * 2.0**-52  # scipy raises any smaller relative tolerance to this
_FAR: Final = 2.0**40  # periods: a bound that no block reaches

RightSide = Callable[[float, Any], Sequence[Any]]


class Singular(IntegrationFailed):
    """Derivatives that are not finite."""

    outcome = "singular"

    def __str__(self) -> str:
        return "the equations became singular or overflowed"


def right_hand_side(problem: InitialValueProblem, *, guarded: bool = True) -> RightSide:
    """Return f(t, y), y a numpy array, that raises `Singular` where derivatives are not finite.

    With guarded=False it returns what numpy makes of a pole, as a function written by hand does.
    """
    fixed = problem.constants.values()
    if not guarded:
        bare, array = steppers.derivatives(problem.equations, np.float64, np), np.array([*fixed])
        return lambda _, y: bare(*y, *array)
    rates = steppers.derivatives(problem.equations)

    def guarded_rates(_: float, y: Any) -> Sequence[float]:
        try:
            result: Sequence[float] = rates(*y.tolist(), *fixed)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            raise Singular from error
        if not math.isfinite(sum(result)):
            raise Singular
        return result

    return guarded_rates


class TakenSteps(NamedTuple):
    """Steps that a solver took from time 0."""

    times: Array  # with the start, shape (k + 1,)
    states: Array  # at these times
    evaluations: int
    carry: tuple[float, ...] = ()  # the length of the next step, if the solver takes one
    steps: int = 0  # their number, where not all are in `times`


Solver = Callable[..., TakenSteps]


@dataclass(frozen=True, eq=False, kw_only=True)
class AdaptiveStepper(steppers.Stepper):
    """A stepper of an adaptive solver; a block ends after its steps, or at `far`.

    Attributes
    ----------
    solver : Solver
        Takes steps from time 0; its arguments are a state, the end, the most steps, and the length
        of the first one (by default of its own choice).
    direction : int
        1 forwards, -1 backwards.
    far : float
        A time that no block passes [s].
    on_steps : callable
        Called with the steps of each block.
    """

    solver: Solver
    direction: int
    far: float
    on_steps: Callable[[TakenSteps], object] = id

    def block(self, at: StepperState) -> StepperState:
        """Take a block of steps."""
        taken = self._take_steps(np.array(at.state), self.direction * self.far, *at.carry)
        self.on_steps(taken)
        time = add(at.time, (float(taken.times[-1]), 0.0))
        count = taken.steps or len(taken.times) - 1
        short = count < self.steps and abs(taken.times[-1]) < self.far
        if short or time == at.time:  # which LSODA takes for success
            raise IntegrationFailed("the solver gave up: its steps vanish, or its derivatives")
        state, evaluations = taken.states[-1].tolist(), at.evaluations + taken.evaluations
        return StepperState(time, tuple(state), taken.carry, at.steps + count, evaluations)

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a state, by a separate run for each."""
        local = [add(t, (-at.time[0], -at.time[1]))[0] for t in times]
        ahead = [self.direction * t for t in local]
        taken = self._take_steps(np.array(at.state), self.direction * self.far, *at.carry)
        last = np.searchsorted(self.direction * taken.times, ahead, "right") - 1
        steps = zip(taken.states[last], taken.times[last].tolist(), local, strict=True)
        rows = [self._integrate_over(t - begun, state) for state, begun, t in steps]
        return np.array(rows).reshape(-1, len(self.start))

    def _integrate_over(self, span: float, state: Array) -> Array:
        """Return the state after a part of a step."""
        if span == 0:
            return state
        times, states, *_ = self._take_steps(state, span)
        if times[-1] != span:
            raise IntegrationFailed("the solver gave up between two steps")
        return np.asarray(states[-1])

    def _take_steps(self, state: Array, end: float, *first: float) -> TakenSteps:
        """Return the steps of the solver from a state, if they are finite."""
        taken = self.solver(state, end, self.steps, *first)
        if not np.isfinite(taken.states).all():
            raise steppers.NotFinite
        return taken


def scipy_stepper(
    name: str,
    problem: InitialValueProblem,
    tolerance: float,
    steps: int,
    *,
    atol: float | None = None,
    guarded: bool = True,
) -> AdaptiveStepper:
    """Return the stepper of a solver of `scipy.integrate`, by its name there.

    With 0 steps in a block it is called once for the span of the problem, as users call it.
    """
    import scipy.integrate

    rates = right_hand_side(problem, guarded=guarded)
    kind = getattr(scipy.integrate, name)
    bounds = {"rtol": max(tolerance, RTOL_LEAST), "atol": tolerance if atol is None else atol}

    def solver(state: Array, end: float, most: int, first: float | None = None) -> TakenSteps:
        times, states, calls = [0.0], [state], itertools.count()

        def counted_rates(t: float, y: Any) -> Sequence[float]:
            next(calls)  # `nfev` leaves out those of Radau's Jacobians
            return rates(t, y)

        with warnings.catch_warnings(action="ignore"):  # what they warn of is checked below
            try:
                run = kind(counted_rates, 0.0, state, end, first_step=first, **bounds)
                while run.status == "running" and len(times) <= most:
                    if message := run.step():
                        raise ValueError(message.rstrip("."))
                    times.append(float(run.t))
                    states.append(run.y.copy())
            except (ValueError, np.linalg.LinAlgError) as error:  # as Radau's, of infinite numbers
                if not np.isfinite(rates(0.0, states[-1])).all():
                    raise Singular from error
                raise IntegrationFailed(f"the solver gave up: {error}") from error
        carry = () if name == "LSODA" else (float(run.h_abs),)
        return TakenSteps(np.array(times), np.array(states), next(calls), carry)

    reach, steps = (_FAR, steps) if steps else (1.0, sys.maxsize)
    return AdaptiveStepper(solver=solver, start=problem.start, direction=problem.direction,
                           steps=steps, far=reach * abs(problem.span))  # fmt: skip


def cyrk_stepper(problem: InitialValueProblem, tolerance: float, steps: int) -> AdaptiveStepper:
    """Return the stepper of CyRK's DOP853 over a compiled right-hand side.

    A block is a call that stops after a number of steps, before its end. CyRK does not return the
    length of the next step: the next block starts with that of the last one.
    """
    arguments = np.array([*problem.constants.values(), 0.0])  # the last counts the evaluations
    (rates, seconds), (solve, more) = _cyrk_rates(problem.equations), _cyrk_solve()
    far, compile_s = _FAR * abs(problem.span), seconds + more

    def solver(state: Array, end: float, most: int, first: float = 0.0) -> TakenSteps:
        times, rows = solve(rates.address, state, end, arguments, tolerance, first, most)
        if times.size < 2:
            raise IntegrationFailed("the solver gave up at its start")
        carry = (abs(float(times[-1] - times[-2])),)
        return TakenSteps(times, rows[:, :-1], int(rows[-1, -1]), carry)

    return AdaptiveStepper(solver=solver, start=problem.start, direction=problem.direction,
                           steps=steps, far=far, compile_s=compile_s)  # fmt: skip


@cache
def _cyrk_solve() -> tuple[Any, float]:
    """Return a compiled function that calls CyRK, and the time of compiling, mostly CyRK's [s]."""
    from CyRK import nbsolve2_ivp

    def solve(
        address: int, y0: Array, end: float, args: Array, tolerance: float, first: float, most: int
    ) -> tuple[Array, Array]:
        # one more number, the count of the evaluations, is kept beside the states
        solution = nbsolve2_ivp(address, (0.0, end), y0, method="DOP853", args=args, num_extra=1,
                                rtol=tolerance, atol=tolerance, expected_size=most + 1,
                                first_step=first, max_num_steps=most, max_step=np.inf)  # fmt: skip
        times, rows = solution.t.copy(), solution.y.T.copy()
        solution.free()
        return times, rows

    words = "int64, float64[::1], float64, float64[::1], float64, float64, int64"
    return steppers.compiled(solve, f"Tuple((float64[::1], float64[:, ::1]))({words})")


@cache
def _cyrk_rates(equations: Formulation) -> tuple[Any, float]:
    """Return the derivatives as a C function that counts its calls, and the compile time [s]."""
    from CyRK import cyjit
    from numba import carray

    began = time.perf_counter()
    n, k = len(equations.states), len(equations.constants_in(equations.derivatives))
    rates, to_fixed_tuple = steppers.compiled_function(steppers.derivatives(equations))

    def counted_rates(dy: Any, t: float, y: Any, arguments: Any) -> None:
        constants = carray(arguments, (k + 1,))
        result = rates(*to_fixed_tuple(carray(y, (n,)), n), *to_fixed_tuple(constants[:k], k))
        for i in range(n):
            dy[i] = result[i]
        constants[k] += 1
        dy[n] = constants[k]

    return cyjit(counted_rates), time.perf_counter() - began
