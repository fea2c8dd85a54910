"""How a method of one's own is run: steps or a solver as a stepper, and the forms it may ask for.

What the code of a person does wrong ends its run with a sentence that says what it was.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.comparison.adaptive import constants, derivatives
from heavytop.comparison.own import BODY, Method
from heavytop.comparison.steppers import FixedStep, IntegrationFailed, Stepper, StepperState
from heavytop.numbers.double_double import Array, DoubleDouble, two_product

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation

Rates = Callable[[Array], Array]

BLOCKS: Final = {"step": 200, "compiled": 4096}  # steps between two looks
SOLVED: Final = 4.0  # periods that a solver goes at once


@dataclass(frozen=True, slots=True, eq=False)
class OwnSteps(FixedStep):
    """Equal steps of one's own, whose states may be others than those that are judged."""

    seen: Callable[[Array], Array] | None = None

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at ends of steps, as the formulation has them."""
        rows = FixedStep.states_at(self, at, times)
        return rows if self.seen is None else np.array([self.seen(row) for row in rows])


@dataclass(frozen=True, slots=True, eq=False)
class OwnSolver:
    """A solver of one's own, called for spans of one length.

    Attributes
    ----------
    solve : callable
        From states and a span [s] to the states at its end, steps and evaluations.
    start : tuple of float
    span : float
        How far it goes in one call [s].
    """

    solve: Callable[[Array, float], tuple[Array, int, int]]
    start: tuple[float, ...]
    span: float
    seen: Callable[[Array], Array] | None = None
    compile_s: float = 0.0

    def begin(self) -> StepperState:
        """Return the start."""
        return StepperState((0.0, 0.0), self.start, (0.0,))

    def block(self, at: StepperState) -> StepperState:
        """Call the solver once; spans are counted, so that no time is summed."""
        state, steps, evaluations = self.solve(np.array(at.state), self.span)
        count = at.carry[0] + 1
        return StepperState(
            two_product(self.span, count), tuple(state.tolist()), (count,),
            at.steps + steps, at.evaluations + evaluations,
        )  # fmt: skip

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times, each by a call that ends there."""
        state = np.array(at.state)
        spans = [(t[0] - at.time[0]) + (t[1] - at.time[1]) for t in times]
        rows = [self.solve(state, span)[0] if span else state for span in spans]
        return np.array([self.seen(row) if self.seen else row for row in rows])

    def output_time(self, t: float) -> DoubleDouble:
        """Return the time itself."""
        return t, 0.0


def own_stepper(
    method: Method,
    equations: Formulation,
    parameters: Mapping[str, float],
    state: tuple[float, ...],
    setting: float,
    period: float,
    steps: int | None = None,
) -> Stepper:
    """Return a method of one's own set up for a start; `period` is negative backwards."""
    given, seen = state, None
    if method.formulation in BODY:
        form = BodyForm(method.formulation, parameters)
        rates: Rates = form.rates
        given, seen = tuple(form.start(np.array(state)).tolist()), form.seen
    elif method.compiled and not method.solves:
        rates = _compiled_rates(equations, tuple(constants(equations, parameters).values()))
    else:
        rates = _rates(equations, parameters)
    if method.solves:
        span = period * (1.0 if steps else SOLVED)
        return OwnSolver(_solving(method.function, rates, setting), given, span, seen)
    advance = (_compiled_steps if method.compiled else _steps)(method.function, rates)
    block = steps or BLOCKS["compiled" if method.compiled else "step"]
    h = period / setting

    def taken(y: Array, _: Array, count: int) -> int:
        return advance(y, h, count)

    return OwnSteps(given, h, taken, block, seen=seen)


def _rates(equations: Formulation, parameters: Mapping[str, float]) -> Rates:
    """f(y) for arrays; on a pole of the angles its numbers are nan."""
    function, known = derivatives(equations), tuple(constants(equations, parameters).values())
    nothing = np.full(len(equations.states), np.nan)

    def f(y: Array) -> Array:
        try:
            return np.array(function(*np.asarray(y, float).tolist(), *known))
        except (ZeroDivisionError, OverflowError, ValueError):
            return nothing.copy()

    return f


def _counted(f: Rates) -> tuple[Rates, list[int]]:
    count = [0]

    def counting(y: Array) -> Array:
        count[0] += 1
        return f(y)

    return counting, count


def _steps(step: Callable[..., Any], f: Rates) -> Callable[[Array, float, int], int]:
    """What takes steps one by one, and names what one of them did wrong."""
    f, count = _counted(f)

    def advance(state: Array, h: float, steps: int) -> int:
        y, before = state.copy(), count[0]
        for _ in range(steps):
            y = _checked(step, f, y, h)
        state[:] = y
        return count[0] - before

    return advance


def _checked(step: Callable[..., Any], f: Rates, y: Array, h: float) -> Array:
    given = y.tobytes()
    with _named():
        after = np.array(step(f, y, h), float)
    if y.tobytes() != given:
        raise IntegrationFailed("it changes the states it is given")
    if after.shape != y.shape:
        raise IntegrationFailed(f"it returns an array of shape {after.shape}, not {y.shape}")
    return after


@contextmanager
def _named() -> Iterator[None]:
    """Whatever the code of a person raises, named."""
    try:
        yield
    except IntegrationFailed:
        raise
    except Exception as fault:
        why = " ".join(f"{type(fault).__name__}: {fault}".split())
        raise IntegrationFailed(f"it raises {why:.200}") from fault


def _compiled_rates(equations: Formulation, known: tuple[float, ...]) -> Any:
    """f(y) compiled by numba, with the constants of one top and start."""
    from numba import njit
    from numba.np.unsafe.ndarray import to_fixed_tuple

    n, rates = len(equations.states), njit(error_model="numpy")(derivatives(equations))

    def f(y: Any) -> Any:
        result, found = rates(*to_fixed_tuple(y, n), *known), np.empty(n)
        for i in range(n):
            found[i] = result[i]
        return found

    return njit(f)


def _compiled_steps(step: Callable[..., Any], f: Any) -> Callable[[Array, float, int], int]:
    """What takes compiled steps in a compiled loop; the first one is looked at."""
    from numba import njit

    def many(y: Any, h: float, steps: int) -> Any:
        for _ in range(steps):
            y = step(f, y, h)
        return y

    loop, looked_at = njit(many), [False]

    def advance(state: Array, h: float, steps: int) -> int:
        if not looked_at[0]:
            _checked(step, f, state.copy(), h)
            looked_at[0] = True
        with _named():
            state[:] = loop(state.copy(), h, steps)
        return steps  # evaluations are not counted in compiled code: one a step at least

    return advance


def _solving(
    solver: Callable[..., Any], f: Rates, tolerance: float
) -> Callable[[Array, float], tuple[Array, int, int]]:
    """What calls a solver for a span, and names what it did wrong."""
    f, count = _counted(f)

    def solve(state: Array, span: float) -> tuple[Array, int, int]:
        y, before = state.copy(), count[0]
        with _named():
            found = solver(lambda _, y: f(y), (0.0, span), y, rtol=tolerance, atol=tolerance)
            times, end = np.array(found.t, float), np.array(found.y, float)[:, -1]
        if y.tobytes() != state.tobytes():
            raise IntegrationFailed("it changes the states it is given")
        if not getattr(found, "success", True) or not math.isclose(times[-1], span):
            why = str(getattr(found, "message", "")).strip().rstrip(".")
            stop = f"it stops after {times[-1]:.6g} of {span:.6g} s"
            raise IntegrationFailed(f"{stop}: {why}" if why else stop)
        if end.shape != state.shape:
            raise IntegrationFailed(f"it returns {end.size} states, not {state.size}")
        if not np.isfinite(end).all():
            raise IntegrationFailed("the numbers are no longer finite")
        return end, times.size - 1, count[0] - before

    return solve


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
