"""How a method of one's own is run: steps or a solver as a stepper, and the forms it may ask for.

What the code of a person does wrong ends its run with a sentence that says what it was.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final, cast

import numpy as np

from heavytop.comparison.own import BODY, Method
from heavytop.comparison.steppers import (
    FixedStep,
    InitialValueProblem,
    IntegrationFailed,
    Stepper,
    StepperState,
    compiled_derivatives,
    derivatives,
)
from heavytop.exact.pairs import Array, DoubleDouble, two_product

Rates = Callable[[Array], Array]

BLOCKS: Final = {"python": 200, "numba": 4096}  # steps between two looks
SOLVED: Final = 4.0  # periods that a solver goes at once


def own_stepper(
    method: Method, problem: InitialValueProblem, setting: float, steps: int
) -> Stepper:
    """Return a method of one's own set up for a problem; with `steps` 0 blocks are as it thinks."""
    start, seen = problem.start, cast("Rates", np.copy)
    if method.formulation in BODY:
        form = BodyForm(method.formulation, problem.parameters)
        start, seen = tuple(form.start(np.array(start)).tolist()), form.seen
        rates: Rates = form.rates
    elif method.compiled and not method.solves:
        rates = _compiled_rates(problem)
    else:
        rates = _rates(problem)
    if method.solves:
        span = problem.span * (1.0 if steps else SOLVED)
        return OwnSolver(method.function, _Counted(rates), setting, start, span, seen)
    h = problem.span / setting
    take = _compiled_steps if method.compiled else _steps
    block = steps or BLOCKS["numba" if method.compiled else "python"]
    return FixedStep(start, h, take(method.function, rates, h), block, seen=seen)


# --- the right-hand side that it is given --------------------------------------------------------


def _rates(problem: InitialValueProblem) -> Rates:
    """Return f(y) for arrays; on a pole of the angles its numbers are nan."""
    function, known = derivatives(problem.equations), tuple(problem.constants.values())
    nothing = np.full(len(problem.start), np.nan)

    def f(y: Array) -> Array:
        try:
            return np.array(function(*np.asarray(y, float).tolist(), *known))
        except (ZeroDivisionError, OverflowError, ValueError):
            return nothing.copy()

    return f


def _compiled_rates(problem: InitialValueProblem) -> Any:
    """Return f(y) compiled by numba, with the constants of one top and start."""
    from numba import njit

    n, known = len(problem.start), tuple(problem.constants.values())
    rates, to_fixed_tuple = compiled_derivatives(problem.equations)

    def f(y: Any) -> Any:
        result, found = rates(*to_fixed_tuple(y, n), *known), np.empty(n)
        for i in range(n):
            found[i] = result[i]
        return found

    return njit(f)


class _Counted:
    """A right-hand side, and how often it was called."""

    def __init__(self, f: Rates) -> None:
        self.f, self.calls = f, 0

    def __call__(self, y: Array) -> Array:
        self.calls += 1
        return self.f(y)


# --- steps ---------------------------------------------------------------------------------------


def _steps(step: Callable[..., Any], f: Rates, h: float) -> Callable[[Array, Array, int], int]:
    """Return what takes steps one by one, and names what one of them did wrong."""
    counted = _Counted(f)

    def advance(state: Array, _work: Array, steps: int) -> int:
        y, before = state.copy(), counted.calls
        for _ in range(steps):
            y = _checked(step, counted, y, h)
        state[:] = y
        return counted.calls - before

    return advance


def _compiled_steps(
    step: Callable[..., Any], f: Any, h: float
) -> Callable[[Array, Array, int], int]:
    """Return what takes compiled steps in a compiled loop; the first one is looked at."""
    from numba import njit

    def many(y: Any, h: float, steps: int) -> Any:
        for _ in range(steps):
            y = step(f, y, h)
        return y

    loop, looked_at = njit(many), [False]

    def advance(state: Array, _work: Array, steps: int) -> int:
        if not looked_at[0]:
            _checked(step, f, state.copy(), h)
            looked_at[0] = True
        with _named():
            state[:] = loop(state.copy(), h, steps)
        return steps  # evaluations are not counted in compiled code: one a step at least

    return advance


def _checked(step: Callable[..., Any], f: Rates, y: Array, h: float) -> Array:
    """Take one step, and tell what it did wrong."""
    given = y.copy()
    with _named():
        after = _real(step(f, y, h))
    _unchanged(given, y)
    if after.shape != y.shape:
        raise IntegrationFailed(f"it returns an array of shape {after.shape}, not {y.shape}")
    return after


def _real(found: Any) -> Array:
    """What a person's code returned, if it is real numbers."""
    array = np.array(found)
    if array.dtype.kind not in "fiu":
        raise IntegrationFailed(f"it returns numbers of type {array.dtype}, not reals")
    return array.astype(float)


def _unchanged(given: Array, y: Array) -> None:
    if y.tobytes() != given.tobytes():
        raise IntegrationFailed("it changes the states it is given")


@contextmanager
def _named() -> Iterator[None]:
    """Name whatever the code of a person raises."""
    try:
        yield
    except IntegrationFailed:
        raise
    except Exception as fault:
        why = " ".join(f"{type(fault).__name__}: {fault}".split())
        raise IntegrationFailed(f"it raises {why:.200}") from fault


# --- a solver ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class OwnSolver:
    """A solver of one's own, called for spans of one length.

    Attributes
    ----------
    solver : callable
        With the signature of `scipy.integrate.solve_ivp`.
    rates : _Counted
    tolerance : float
    start : tuple of float
    span : float
        How far it goes in one call [s].
    seen : callable
        From the states in which it computes to those that are judged.
    """

    solver: Callable[..., Any]
    rates: _Counted
    tolerance: float
    start: tuple[float, ...]
    span: float
    seen: Callable[[Array], Array]
    compile_s: float = 0.0

    def begin(self) -> StepperState:
        """Return the start."""
        return StepperState((0.0, 0.0), self.start, (0.0,))

    def block(self, at: StepperState) -> StepperState:
        """Call the solver once; spans are counted, so that no time is summed."""
        before, count = self.rates.calls, at.carry[0] + 1
        state, steps = self._solved(np.array(at.state), self.span)
        return StepperState(
            time=two_product(self.span, count),
            state=tuple(state.tolist()),
            carry=(count,),
            steps=at.steps + steps,
            evaluations=at.evaluations + self.rates.calls - before,
        )

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times, each by a call that ends there."""
        state = np.array(at.state)
        spans = [(t[0] - at.time[0]) + (t[1] - at.time[1]) for t in times]
        return np.array([self.seen(self._solved(state, x)[0] if x else state) for x in spans])

    def output_time(self, t: float) -> DoubleDouble:
        """Return the time itself."""
        return t, 0.0

    def _solved(self, state: Array, span: float) -> tuple[Array, int]:
        """Return the states at the end of a span and the steps, and tell what went wrong."""
        y, bounds = state.copy(), {"rtol": self.tolerance, "atol": self.tolerance}
        with _named():
            found = self.solver(lambda _, y: self.rates(y), (0.0, span), y, **bounds)
            times, end = _real(found.t), _real(found.y)[:, -1]
        _unchanged(state, y)
        if not getattr(found, "success", True) or not math.isclose(times[-1], span):
            why = str(getattr(found, "message", "")).strip().rstrip(".")
            stop = f"it stops after {times[-1]:.6g} of {span:.6g} s"
            raise IntegrationFailed(f"{stop}: {why}" if why else stop)
        if end.shape != state.shape:
            raise IntegrationFailed(f"it returns {end.size} states, not {state.size}")
        if not np.isfinite(end).all():
            raise IntegrationFailed("the numbers are no longer finite")
        return end, times.size - 1


# --- the body's own rotation ---------------------------------------------------------------------


class BodyForm:
    """The attitude from body to space and the angular velocity in the body, in units A = 1.

    R' = R [w], or q' = q w/2, and I w' = I w x w + R^T (g z x e) with I = diag(1, 1, C/A).

    Parameters
    ----------
    name : {"rotation", "quaternion"}
    parameters : mapping from str to float
        Those of the axis form, whose states are `seen`.
    """

    def __init__(self, name: str, parameters: Mapping[str, float]) -> None:
        self.matrix = name == "rotation"
        self.g, n, omega3 = (parameters[key] for key in ("g", "n", "omega3"))
        self.inertia = np.array([1.0, 1.0, n / omega3 if omega3 else 1.0])
        self.known = parameters

    def rates(self, y: Array) -> Array:
        """The derivatives."""
        *attitude, w1, w2, w3 = np.asarray(y, float)
        w = np.array([w1, w2, w3])
        R = self._rotation(np.array(attitude))
        spin = self.inertia * w
        torque = self.g * np.array([R[2, 1], -R[2, 0], 0.0])
        acceleration = (np.cross(spin, w) + torque) / self.inertia
        if self.matrix:
            turning = np.array([[0, -w3, w2], [w3, 0, -w1], [-w2, w1, 0]])
            return np.concatenate([(R @ turning).ravel(), acceleration])
        a, b, c, d = attitude
        half = np.array([-b * w1 - c * w2 - d * w3, a * w1 + c * w3 - d * w2,
                         a * w2 + d * w1 - b * w3, a * w3 + b * w2 - c * w1]) / 2  # fmt: skip
        return np.concatenate([half, acceleration])

    def start(self, state: Array) -> Array:
        """The states for those of the axis form."""
        (x, y, z), l = state[:3], np.array([*state[3:], self.known["l_z"]])  # noqa: E741
        theta, psi = math.atan2(math.hypot(x, y), z), self.known["psi_0"]
        phi = math.atan2(x, -y) if x or y else self.known["phi_0"]
        near, far = math.cos(theta / 2), math.sin(theta / 2)
        q = np.array([
            near * math.cos((phi + psi) / 2), far * math.cos((phi - psi) / 2),
            far * math.sin((phi - psi) / 2), near * math.sin((phi + psi) / 2),
        ])  # fmt: skip
        R = _matrix(q)
        attitude = R.ravel() if self.matrix else q
        return np.concatenate([attitude, (R.T @ l) / self.inertia])

    def seen(self, y: Array) -> Array:
        """The states of the axis form: the axis, and the angular momentum across."""
        R = self._rotation(y[:-3])
        return np.concatenate([R[:, 2], (R @ (self.inertia * y[-3:]))[:2]])

    def _rotation(self, attitude: Array) -> Array:
        return attitude.reshape(3, 3) if self.matrix else _matrix(attitude)


def _matrix(q: Array) -> Array:
    """The matrix of a quaternion, quadratic in it."""
    a, b, c, d = q
    return np.array([
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ])  # fmt: skip
