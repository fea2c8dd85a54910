"""Methods of one's own: a step or a solver that a person names, run as all other methods are.

    mine.py:rk4=200                 a function of a file, 200 steps a period
    mypackage.integrators:rk4       a function of a module
    rk4                             an entry point of the group ``heavytop.methods``

Code runs only because a person names it, on the command line or in Python: `admit` loads it.
Nothing that is read from a file does that, so that a stored study or a scene never starts code.
"""

from __future__ import annotations

import importlib
import inspect
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.comparison.adaptive import constants, derivatives
from heavytop.comparison.steppers import FixedStep, IntegrationFailed, Stepper, StepperState
from heavytop.errors import Impossible
from heavytop.numbers.double_double import Array, DoubleDouble, two_product

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation

Rates = Callable[[Array], Array]

GROUP: Final = "heavytop.methods"
STEPS, RTOL = 100.0, 1e-9  # settings where none is given
BLOCKS: Final = {"step": 200, "compiled": 4096}  # steps between two looks
SOLVED: Final = 4.0  # periods that a solver goes at once
BODY: Final = ("rotation", "quaternion")  # forms of the attitude and the body's angular velocity


@dataclass(frozen=True)
class Method:
    """A method of integration of one's own, to stand beside the package's in every study.

    Parameters
    ----------
    function : callable
        A step ``step(f, y, h)`` that returns the states after the time h, or a solver with the
        signature of `scipy.integrate.solve_ivp`, ``solver(fun, t_span, y0, *, rtol, atol)``, whose
        result has ``t`` and ``y`` as there. ``f(y)`` takes and returns an array of shape (n,). A
        function compiled by numba is given an f compiled by numba, and is looped over compiled.
    name : str, optional
        For tables; by default that of the function.
    formulation : str
        What y is: ``axis`` (e, l_x, l_y), ``attitude``, ``lagrange``, ``subsystem``, ``routh`` or
        ``cubic``; or ``rotation``, the nine numbers of the rotation matrix from body to space by
        rows and the angular velocity in the body [rad/s], or ``quaternion``, scalar first, and
        that velocity.
    setting : float, optional
        Steps a nutation period (100), or the relative tolerance of a solver (1e-9).
    order : int, optional
        Of the method, for tables.
    solver : bool, optional
        Whether it is a solver; by default whether an argument is called ``t_span`` or ``y0``.

    Raises
    ------
    Impossible
        No function; no such formulation; a setting that is not positive.

    Examples
    --------
    >>> def midpoint(f, y, h):
    ...     return y + h * f(y + h / 2 * f(y))
    >>> Method(midpoint, order=2).label
    'midpoint'
    """

    function: Callable[..., Any]
    name: str = ""
    formulation: str = "axis"
    setting: float | None = None
    order: int | None = None
    solver: bool | None = None

    def __post_init__(self) -> None:
        from heavytop.equations.formulation import FORMULATIONS

        known = (*FORMULATIONS, *BODY)
        if not callable(self.function):
            raise Impossible([("function", "a step or a solver, which can be called")])
        if self.formulation not in known:
            raise Impossible([("formulation", f"one of {', '.join(known)}")])
        if self.setting is not None and not 0 < self.setting < math.inf:
            raise Impossible([("setting", "a positive number")])

    @property
    def label(self) -> str:
        """Its name."""
        return self.name or getattr(self.function, "__name__", type(self.function).__name__)

    @property
    def solves(self) -> bool:
        """Whether it is a solver, not a step."""
        if self.solver is not None:
            return self.solver
        try:
            names = inspect.signature(self.function).parameters
        except (TypeError, ValueError):  # a builtin has none
            return False
        return bool({"t_span", "y0"} & set(names))

    @property
    def compiled(self) -> bool:
        """Whether numba compiles it."""
        return hasattr(self.function, "py_func")


# --- what a person admits ------------------------------------------------------------------------


@dataclass(frozen=True)
class Admitted:
    """A method that may run in this process, and what another process finds it by.

    Attributes
    ----------
    name : str
        As it is called in a study: ``mine.py:rk4``, ``package.module:rk4``, ``own:rk4``.
    method : Method
    digest : str
        SHA-256 of the file it stands in; empty where there is none.
    place : str
        What loads it elsewhere; empty for a function that cannot be had elsewhere.
    """

    name: str
    method: Method
    digest: str = ""
    place: str = ""


_ADMITTED: Final[dict[str, Admitted]] = {}


def admit(asked: str | Method | Callable[..., Any]) -> str:
    """Let a method run in this process because a person named it, and return its name in studies.

    A text without a method of one's own is returned as it is.

    Parameters
    ----------
    asked : str, Method or callable
        ``FILE.py:NAME``, ``MODULE:NAME`` or the name of an entry point, each with ``=SETTING`` or
        without; or what stands there itself.

    Raises
    ------
    Impossible
        There is no such file, module or name; or the code raises something.
    """
    if not isinstance(asked, str):
        found = _as_method(asked)
        return _kept(Admitted(f"own:{found.label}", found, *_origin(found.function)))
    place, equals, setting = asked.partition("=")
    if ":" not in place:
        offered = [each for each in entry_points(group=GROUP) if each.name == place]
        if not offered:
            return asked
        place = offered[0].value
    return _kept(_loaded(place)) + equals + setting


def _kept(found: Admitted) -> str:
    _ADMITTED[found.name] = found
    return found.name


def admitted(name: str) -> Admitted:
    """Return a method that a person named.

    Raises
    ------
    Impossible
        Nobody did.
    """
    if name not in _ADMITTED:
        rule = f"{name} is code of your own, which runs only where it is named (--methods)"
        raise Impossible([("method", rule)])
    return _ADMITTED[name]


def stated(texts: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return what a study remembers of methods of one's own: nothing where there are none."""
    found = digests(texts)
    return {"own": found} if found else {}


def digests(texts: Iterable[str]) -> dict[str, str]:
    """Return the fingerprints of those of some methods that are a person's own, by their names."""
    names = dict.fromkeys(text.partition("=")[0] for text in texts)
    return {name: _ADMITTED[name].digest for name in names if name in _ADMITTED}


def expect_anywhere(texts: Iterable[str]) -> None:
    """Refuse methods that no other process could load.

    Raises
    ------
    Impossible
        A function stands in no file or module.
    """
    if homeless := [name for name in digests(texts) if not _ADMITTED[name].place]:
        rule = "must stand in a file or a module, as it runs in another process"
        raise Impossible([(name, rule) for name in homeless])


def passes(names: Iterable[str]) -> tuple[tuple[str, str, str], ...]:
    """Return what lets another process load methods: name, place and digest of each."""
    found = (_ADMITTED[name] for name in names if name in _ADMITTED)
    return tuple((each.name, each.place, each.digest) for each in found if each.place)


def let_pass(those: Iterable[tuple[str, str, str]]) -> None:
    """Load in this process what a person named in another one.

    Raises
    ------
    Impossible
        The code is another one here.
    """
    for name, place, digest in those:
        if name not in _ADMITTED or _ADMITTED[name].digest != digest:
            found = _loaded(place)
            if found.digest != digest:
                raise Impossible([(name, "is another file in a worker")])
            _ADMITTED[name] = replace(found, name=name)


def _loaded(place: str) -> Admitted:
    """Load FILE.py:NAME or MODULE:NAME."""
    where, _, name = place.rpartition(":")
    is_file = where.endswith(".py")
    try:
        module = _run_file(Path(where)) if is_file else importlib.import_module(where)
        found = getattr(module, name)
    except FileNotFoundError:
        raise Impossible([("method", f"{where}: there is no such file")]) from None
    except AttributeError as missing:
        if getattr(missing, "name", None) != name:
            raise _raised(where, missing) from missing
        raise Impossible([("method", f"{where} has no {name!r}")]) from None
    except Exception as fault:  # whatever it raises, it is not ours
        raise _raised(where, fault) from fault
    digest = _digest(getattr(module, "__file__", None))
    shown = f"{Path(where).name}:{name}" if is_file else place
    place = f"{Path(where).resolve()}:{name}" if is_file else place
    return Admitted(shown, _as_method(found), digest, place)


def _raised(where: str, fault: Exception) -> Impossible:
    why = " ".join(f"{type(fault).__name__}: {fault}".split())
    return Impossible([("method", f"{where} raises {why}")])


def _run_file(path: Path) -> Any:
    """The module that a file is; what stands beside it can be imported by it."""
    if not path.is_file():
        raise FileNotFoundError(path)
    name = f"heavytop_own_{sha256(str(path.resolve()).encode()).hexdigest()[:12]}"
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module  # numba and pickle look there
    sys.path.insert(0, str(path.resolve().parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.resolve().parent))
    return module


def _as_method(found: Any) -> Method:
    return found if isinstance(found, Method) else Method(found)


def _origin(function: Callable[..., Any]) -> tuple[str, str]:
    """The digest of the file of a function, and what loads it elsewhere, if that is known."""
    function = getattr(function, "py_func", function)
    try:
        file = inspect.getsourcefile(function)
    except TypeError:
        file = None
    module, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", ".")
    found = getattr(sys.modules.get(module), name, None) if "." not in name else None
    here = getattr(found, "py_func", found) is function and module != "__main__"
    return _digest(file), f"{module}:{name}" if here else ""


def _digest(file: str | None) -> str:
    return sha256(Path(file).read_bytes()).hexdigest() if file and Path(file).is_file() else ""


# --- how it is run -------------------------------------------------------------------------------


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
