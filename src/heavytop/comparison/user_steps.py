"""Steppers of users' methods, for steps and for solvers, and the body's rotation as equations.

An error in a user's code ends its run with a `MethodError`, which says what was wrong.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from typing import Any, Final, TypeVar

import numpy as np

from heavytop.comparison import steppers
from heavytop.comparison.adaptive import AdaptiveStepper, Solver, TakenSteps
from heavytop.comparison.steppers import FixedStep, InitialValueProblem, IntegrationFailed, Stepper
from heavytop.comparison.user import BODY_FORMS, Method
from heavytop.exact.pairs import Array

Rates = Callable[[Array], Array]
T = TypeVar("T")

STEPS_A_BLOCK: Final = {"python": 200, "numba": 4096}
HUGE: Final = 1e30  # of larger numbers nan comes by overflow, and is no error of the code
SOLVED: Final = 4.0  # periods in a call of a solver
FIRST_CALL: Final = 1e-3  # the part of that in a first call, in which it imports and compiles


def user_stepper(own: Method, problem: InitialValueProblem, setting: float, steps: int) -> Stepper:
    """Return a user's method set up for a problem; with `steps` 0 blocks have their usual length.

    A first step is taken here and its result dropped, so that importing and compiling is no part
    of a block and counts towards no limit of time.
    """
    start, form = problem.start, None
    if own.formulation in BODY_FORMS:
        form = BodyForm(own.formulation, problem.parameters)
        start = tuple(form.start(np.array(start)).tolist())
        function: Any = form.derivatives
        constants: tuple[float, ...] = form.constants
    else:
        constants = tuple(problem.constants.values())
        function = steppers.derivatives(problem.equations)
    warned, f = Counter[str](), RightHandSide(function, constants, problem.top)
    about: dict[str, Any] = {"start": start, "form": form, "warned": warned}
    if own.solves:
        span = problem.span * (1.0 if steps else SOLVED)
        solve = _solver(_count_warnings(own.function, warned), f, setting, own.needs_times)
        with suppress(IntegrationFailed):
            solve(np.array(start), span * FIRST_CALL)
        warned.clear()  # with the result
        about |= {"solver": solve, "direction": problem.direction}
        return AdaptiveStepper(steps=1, far=abs(span), **about)
    h, block = problem.span / setting, steps or STEPS_A_BLOCK[own.language]
    if own.compiled:
        take = _compiled_steps(own.function, _compiled_rates(function, constants, len(start)), h)
    else:
        take = _steps(own.function, f, h)
    take = _count_warnings(take, warned)
    with suppress(IntegrationFailed):
        take(np.array(start), np.empty(0), 1)
    warned.clear()  # with the step
    return FixedStep(h=h, advance=take, steps=block, **about)


# --- the right-hand side that a method is given --------------------------------------------------


def _compiled_rates(function: Callable[..., Any], constants: tuple[float, ...], n: int) -> Any:
    """Return f(y) compiled by numba, with the constants of one top and start."""
    from numba import njit

    rates, to_fixed_tuple = steppers.compiled_function(function)

    def f(y: Any) -> Any:
        result, found = rates(*to_fixed_tuple(y, n), *constants), np.empty(n)
        for i in range(n):
            found[i] = result[i]
        return found

    return njit(f)


class RightHandSide:
    """The f(y) that a step is given, which counts its calls; on a pole its values are nan.

    Attributes
    ----------
    top : TopConstants or None
        A, C and gMR as floats.
    calls : int
    """

    def __init__(self, function: Callable[..., Any], constants: Sequence[float], top: Any) -> None:
        self.function, self.constants, self.top, self.calls = function, constants, top, 0

    def __call__(self, y: Any) -> Any:
        """Return the derivatives, as an array of the library of y (of JAX, for its tracers)."""
        self.calls += 1
        if not isinstance(y, np.ndarray) and hasattr(y, "__array_namespace__"):
            return y.__array_namespace__().stack(self.function(*y, *self.constants))
        try:
            return np.array(self.function(*np.asarray(y, float).tolist(), *self.constants))
        except (ZeroDivisionError, OverflowError, ValueError):
            return np.full(len(y), np.nan)


# --- steps ---------------------------------------------------------------------------------------


def _steps(step: Callable[..., Any], f: RightHandSide, h: float) -> steppers.Advance:
    """Return the `Advance` of a step in Python, which checks every step."""

    def advance(state: Array, _work: Array, steps: int) -> int:
        y, before = state.copy(), f.calls
        for _ in range(steps):
            y = _take_step(step, f, y, h)
        state[:] = y
        return f.calls - before

    return advance


def _compiled_steps(step: Callable[..., Any], f: Any, h: float) -> steppers.Advance:
    """Return the `Advance` of a compiled step, a compiled loop; it checks only the first step."""
    from numba import njit

    def many(y: Any, h: float, steps: int) -> Any:
        for _ in range(steps):
            y = step(f, y, h)
        return y

    loop, checked = njit(many), [False]

    def advance(state: Array, _work: Array, steps: int) -> int:
        if not checked[0]:
            _take_step(step, f, state.copy(), h)
            checked[0] = True
        with _name_errors():
            state[:] = loop(state.copy(), h, steps)
        return steps  # evaluations are not counted in compiled code: one a step at least

    return advance


def _count_warnings(function: Callable[..., T], warned: Counter[str]) -> Callable[..., T]:
    """Return a function whose warnings are counted and not printed."""

    def counted(*given: Any, **options: Any) -> T:
        with warnings.catch_warnings(record=True, action="always") as caught:
            try:
                return function(*given, **options)
            finally:
                warned.update(f"{each.category.__name__}: {each.message}" for each in caught)

    return counted


def _take_step(step: Callable[..., Any], f: Rates, y: Array, h: float) -> Array:
    """Return the state after one step; raise MethodError where it is none."""
    with _name_errors():
        after = _read_reals(step(f, y.copy(), h))
    if after.shape != y.shape:
        raise steppers.MethodError(f"it returns an array of shape {after.shape}, not {y.shape}")
    if np.isnan(after).any() and (np.abs([y, f(y)]) < HUGE).all():
        raise steppers.MethodError("it returns nan")
    return after


def _read_reals(found: Any) -> Array:
    """Return the result of a user's code as an array of floats, if it is real numbers."""
    array = np.array(found)
    if array.dtype.kind not in "fiu":
        raise steppers.MethodError(f"it returns numbers of type {array.dtype}, not reals")
    return array.astype(float)


@contextmanager
def _name_errors() -> Iterator[None]:
    """Turn whatever a user's code raises into a MethodError that names it."""
    try:
        yield
    except IntegrationFailed:
        raise
    except (Exception, SystemExit) as fault:
        why = " ".join(f"{type(fault).__name__}: {fault}".split())
        raise steppers.MethodError(f"it raises {why:.200}") from fault


# --- a solver ------------------------------------------------------------------------------------


def _solver(
    solver: Callable[..., Any], rates: RightHandSide, tolerance: float, at_times: bool
) -> Solver:
    """Return the `Solver` that calls a user's solver once for a span; only the end is used."""

    def fun(_: float, y: Any) -> Any:
        return rates(y)

    fun.top = rates.top  # type: ignore[attr-defined]

    def solve(state: Array, span: float, *_: float) -> TakenSteps:
        before, ends = rates.calls, (0.0, span)
        times_too: dict[str, Any] = {"t_eval": np.array(ends)} if at_times else {}
        with _name_errors():
            found = solver(fun, ends, state.copy(), rtol=tolerance, atol=tolerance, **times_too)
            times, end = _read_reals(found.t), _read_reals(found.y)[:, -1]
        if not getattr(found, "success", True) or not math.isclose(times[-1], span):
            why = str(getattr(found, "message", "")).strip().rstrip(".")
            stop = f"it stops after {times[-1]:.6g} of {span:.6g} s"
            raise IntegrationFailed(f"{stop}: {why}" if why else stop)
        if end.shape != state.shape:
            raise steppers.MethodError(f"it returns {end.size} states, not {state.size}")
        rows, evaluations = np.array([state, end]), rates.calls - before
        return TakenSteps(np.array(ends), rows, evaluations, steps=times.size - 1)

    return solve


# --- the body's own rotation ---------------------------------------------------------------------


class BodyForm:
    """The attitude from body to space and the angular velocity in the body, in units A = 1.

    R' = R [w], or q' = q w/2, and I w' = I w x w + R^T (g z x e) with I = diag(1, 1, C/A).

    Parameters
    ----------
    name : {"rotation", "quaternion"}
    parameters : mapping from str to float
        The constants of the axis form.
    """

    def __init__(self, name: str, parameters: Mapping[str, float]) -> None:
        self.derivatives = _rotation_rates if name == "rotation" else _quaternion_rates
        self.matrix = name == "rotation"
        g, n, self.omega3 = (parameters[key] for key in ("g", "n", "omega3"))
        self.constants = g, n / self.omega3 if self.omega3 else 1.0
        self.parameters = parameters

    def start(self, state: Array) -> Array:
        """Return the states of this form for those of the axis form."""
        constants = self.parameters
        (x, y, z), l = state[:3], np.array([*state[3:], constants["l_z"]])  # noqa: E741
        theta, psi = math.atan2(math.hypot(x, y), z), constants["psi_0"]
        phi = math.atan2(x, -y) if x or y else constants["phi_0"]
        near, far = math.cos(theta / 2), math.sin(theta / 2)
        q = np.array([
            near * math.cos((phi + psi) / 2), far * math.cos((phi - psi) / 2),
            far * math.sin((phi - psi) / 2), near * math.sin((phi + psi) / 2),
        ])  # fmt: skip
        R = _matrix(q)
        attitude = R.ravel() if self.matrix else q
        return np.concatenate([attitude, (R.T @ l) / (1.0, 1.0, self.constants[1])])

    def axis_states(self, y: Array) -> Array:
        """Return the states of the axis form: the axis, and the horizontal angular momentum."""
        R = self._rotation(y[:-3])
        return np.concatenate([R[:, 2], (R @ (y[-3:] * (1.0, 1.0, self.constants[1])))[:2]])

    def observe(self, y: Sequence[Any], sqrt: Callable[[Any], Any]) -> Sequence[Any]:
        """Return u, udot, the invariants and the axis of a state, in any arithmetic.

        The invariants are energy, p_phi and p_psi over A, |e|^2 or |q|^2, and the distance of
        R^T R from 1. E' is E less the spin's energy at the start.
        """
        (g, inertia), w, R = self.constants, np.array(y[-3:]), self._rotation(np.array(y[:-3]))
        spin = w * np.array([1, 1, inertia])
        energy = (w @ spin - inertia * self.omega3 * self.omega3) / 2 + g * R[2, 2]
        off = R.T @ R - np.eye(3, dtype=int)
        square, distance = R[:, 2] @ R[:, 2], sqrt((off * off).sum())
        length = square if self.matrix else sqrt(square)
        udot = R[2, 0] * w[1] - R[2, 1] * w[0]
        return R[2, 2], udot, energy, R[2] @ spin, spin[2], length, distance, *R[:, 2]

    def _rotation(self, attitude: Array) -> Array:
        return attitude.reshape(3, 3) if self.matrix else _matrix(attitude)


OBSERVED: Final = ("energy", "p_phi", "p_psi", "length", "orthogonality")
"""The invariants of `BodyForm.observe`."""


def _rotation_rates(*y: float) -> Any:
    """The derivatives of the matrix by rows and of the rates in the body."""
    a, b, c, d, e, f, x, y_, z, u, v, w, g, inertia = y
    return (
        b * w - c * v, c * u - a * w, a * v - b * u,
        e * w - f * v, f * u - d * w, d * v - e * u,
        y_ * w - z * v, z * u - x * w, x * v - y_ * u,
        (1 - inertia) * v * w + g * y_, (inertia - 1) * u * w - g * x, 0.0,
    )  # fmt: skip


def _quaternion_rates(*y: float) -> Any:
    """The derivatives of the quaternion, scalar first, and of the rates in the body."""
    a, b, c, d, u, v, w, g, inertia = y
    return (
        (-b * u - c * v - d * w) / 2, (a * u + c * w - d * v) / 2,
        (a * v + d * u - b * w) / 2, (a * w + b * v - c * u) / 2,
        (1 - inertia) * v * w + 2 * g * (c * d + a * b),
        (inertia - 1) * u * w - 2 * g * (b * d - a * c), 0.0,
    )  # fmt: skip


def _matrix(q: Array) -> Array:
    """The rotation matrix of a quaternion, quadratic in it: not normalised."""
    a, b, c, d = q
    return np.array([
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ])  # fmt: skip
