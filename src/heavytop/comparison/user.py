"""Users' methods: steps or solvers, and how they are found and loaded.

``mine.py:rk4=200`` is a function of a file with 200 steps a period, ``mypackage.integrators:rk4``
one of a module. `register` loads them, only because a user names them on the command line or in
Python: nothing that is read from a file, neither a stored study nor a scene, starts code.
"""

from __future__ import annotations

import importlib
import inspect
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from importlib.util import module_from_spec, spec_from_file_location
from numbers import Real
from pathlib import Path
from typing import Any, Final, NamedTuple

from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import Impossible

HANDED_OVER: Final = "own:"  # how the name of a method begins that was given as an object
OWN_STEPS, OWN_TOLERANCE = 100.0, 1e-9  # settings where none is given
# forms of the attitude and the body's angular velocity
BODY_FORMS: Final = ("rotation", "quaternion")


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
        What y is: the states of ``axis`` (e, l_x, l_y) or another formulation; or ``rotation``, the
        nine numbers of the rotation matrix from body to space by rows and the angular velocity in
        the body [rad/s], or ``quaternion``, scalar first, and that velocity.
    setting : float, optional
        Steps a nutation period (100), or the relative tolerance of a solver (1e-9) [1]; without it
        a work-precision diagram has a whole grid of them.
    order : int, optional
        Order of the method, as it is published; what is measured is shown.
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
        known = (*FORMULATIONS, *BODY_FORMS)
        given: Any = self.setting
        right = given is None or (isinstance(given, Real) and 0 < given <= sys.float_info.max)  # type: ignore[operator]
        needed = sum(each is inspect.Parameter.empty for each in self._arguments.values())
        rules = (
            (callable(self.function), "function", "must be a function, a step or a solver"),
            (self.solves or needed <= 3, "function", "a step takes f, y and h alone"),
            (self.formulation in known, "formulation", f"one of {', '.join(known)}"),
            (right, "setting", f"a positive number, at most {sys.float_info.max:.2g}"),
            (self.order in (None, *range(1, 100)), "order", "a whole number from 1 to 99"),
        )
        if broken := [(key, rule) for holds, key, rule in rules if not holds]:
            raise Impossible(broken)

    @property
    def label(self) -> str:
        """Its name."""
        return self.name or getattr(self.function, "__name__", type(self.function).__name__)

    @property
    def solves(self) -> bool:
        """Whether it is a solver, not a step."""
        has_solver_arguments = bool({"t_span", "y0"} & self._arguments.keys())
        return has_solver_arguments if self.solver is None else self.solver

    @property
    def needs_times(self) -> bool:
        """Whether it is a solver with a mandatory argument ``t_eval``."""
        return self._arguments.get("t_eval") is inspect.Parameter.empty

    @property
    def _arguments(self) -> dict[str, Any]:
        """The arguments of its function, with their defaults."""
        try:
            names = inspect.signature(self.function).parameters
        except (TypeError, ValueError):  # a builtin has none
            return {}
        return {name: each.default for name, each in names.items()}

    @property
    def compiled(self) -> bool:
        """Whether numba compiles it."""
        return hasattr(self.function, "py_func")

    @property
    def language(self) -> str:
        """The language of its steps."""
        return "numba" if self.compiled else "python"


# --- the methods of this process -----------------------------------------------------------------


class Registered(NamedTuple):
    """A method that may run in this process, and from where another process can load it.

    Attributes
    ----------
    method : Method
    digest : str
        SHA-256 of the file it is in; empty where there is none.
    place : str
        ``FILE.py:NAME`` or ``MODULE:NAME``; empty for a function that cannot be loaded elsewhere.
    """

    method: Method
    digest: str
    place: str


Origins = Sequence[tuple[str, str, str]]
"""Name, digest and place of methods, by which another process loads them."""

_REGISTERED: Final[dict[str, Registered]] = {}
"""By the name in a study: ``mine.py:rk4``, ``package.module:rk4``, ``own:rk4``."""


def register(asked: str | Method | Callable[..., Any]) -> str:
    """Let a method that a user named run in this process, and return its name in studies.

    A text that names no user's method is returned as it is.

    Parameters
    ----------
    asked : str, Method or callable
        ``FILE.py:NAME`` or ``MODULE:NAME``, with ``=SETTING`` or without; or the method itself.

    Raises
    ------
    Impossible
        There is no such file, module or name; or the code raises something.
    """
    if not isinstance(asked, str):
        method = _as_method(asked)
        name = HANDED_OVER + method.label
        _REGISTERED[name] = Registered(method, *_origin(method.function))
        return name
    place, equals, setting = asked.partition("=")
    if ":" not in place or (place in _REGISTERED and place.startswith(HANDED_OVER)):
        return asked
    where, _, name = place.rpartition(":")
    name = f"{Path(where).name}:{name}" if where.endswith(".py") else place
    _REGISTERED[name] = _loaded(place)
    return name + equals + setting


def registered(name: str) -> Registered:
    """Return a registered method by its name in studies.

    Raises
    ------
    Impossible
        Nobody has named it.
    """
    expect_named([name])
    return _REGISTERED[name]


def expect_named(names: Iterable[str]) -> None:
    """Refuse names of which not all are registered.

    Raises
    ------
    Impossible
        The message has all that must be named.
    """
    names = [*names]
    if lacking := [name for name in names if name not in _REGISTERED]:
        rule = "is your own code, which runs only if you name it"
        raise Impossible([("method", f"{', '.join(lacking)} {rule}: --methods {','.join(names)}")])


def _registered_in(texts: Iterable[str]) -> dict[str, Registered]:
    """Return the registered methods among texts that name methods, with settings or without."""
    names = dict.fromkeys(text.partition("=")[0] for text in texts)
    return {name: _REGISTERED[name] for name in names if name in _REGISTERED}


def as_parameters(texts: Iterable[str]) -> dict[str, dict[str, str]]:
    """Return the parameters of a study for its users' methods, their digests; none without them."""
    found = {name: own.digest for name, own in _registered_in(texts).items()}
    return {"own": found} if found else {}


def origins(texts: Iterable[str]) -> Origins:
    """Return names, digests and places of those users' methods that can be loaded elsewhere."""
    return [(name, *own[1:]) for name, own in _registered_in(texts).items() if own.place]


def expect_anywhere(texts: Iterable[str]) -> None:
    """Refuse methods that no other process could load.

    Raises
    ------
    Impossible
        A function is in no file or module.
    """
    rule = "must stand in a file or a module, as it runs in another process"
    if faults := [(name, rule) for name, own in _registered_in(texts).items() if not own.place]:
        raise Impossible(faults)


def load(methods: Origins) -> None:
    """Load in this process the methods that a user named in another one.

    Raises
    ------
    Impossible
        The code here is not the same.
    """
    for name, digest, place in methods:
        if name not in _REGISTERED or _REGISTERED[name].digest != digest:
            found = _loaded(place)
            if found.digest != digest:
                raise Impossible([(name, "is another file in a worker")])
            _REGISTERED[name] = found


def _loaded(place: str) -> Registered:
    """Load FILE.py:NAME or MODULE:NAME."""
    where, _, name = place.rpartition(":")
    path = Path(where).resolve() if where.endswith(".py") else None
    if path and not path.is_file():
        raise Impossible([("method", f"{where}: there is no such file")])
    try:
        module = _run_file(path) if path else importlib.import_module(where)
    except (Exception, SystemExit) as fault:  # whatever the user's code raises
        why = " ".join(f"{type(fault).__name__}: {fault}".split())
        raise Impossible([("method", f"{where} raises {why}")]) from fault
    if not hasattr(module, name):
        raise Impossible([("method", f"{where} has no {name!r}")])
    digest = _digest(getattr(module, "__file__", None))
    method = _as_method(getattr(module, name))
    return Registered(method, digest, f"{path}:{name}" if path else place)


def _run_file(path: Path) -> Any:
    """Run a file as a module, which may import its neighbours, and return that."""
    name = f"heavytop_own_{sha256(str(path).encode()).hexdigest()[:12]}"
    spec = spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules[name] = module  # numba and pickle look there
    sys.path.insert(0, str(path.parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(path.parent))
    return module


def _as_method(found: Any) -> Method:
    """Return a method as it is, and a function as a method."""
    return found if isinstance(found, Method) else Method(found)


def _origin(function: Callable[..., Any]) -> tuple[str, str]:
    """Return the digest and the place of a function, as `Registered` has them."""
    function = getattr(function, "py_func", function)
    module, name = getattr(function, "__module__", ""), getattr(function, "__qualname__", ".")
    home = sys.modules.get(module)
    found = getattr(home, name, None)
    loadable = getattr(found, "py_func", found) is function and module != "__main__"
    return _digest(getattr(home, "__file__", None)), f"{module}:{name}" if loadable else ""


def _digest(file: str | None) -> str:
    """Return the SHA-256 of a file, or '' where there is none."""
    return sha256(Path(file).read_bytes()).hexdigest() if file and Path(file).is_file() else ""
