"""Methods of one's own: a step or a solver that a person names, and how it is found and loaded.

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
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, Final

from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import Impossible

GROUP: Final = "heavytop.methods"
STEPS, RTOL = 100.0, 1e-9  # settings where none is given
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
        Order of the method, which is only shown.
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
        known = (*FORMULATIONS, *BODY)
        if not callable(self.function):
            raise Impossible([("function", "must be a function, a step or a solver")])
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
    def usual_setting(self) -> float:
        """The setting where a study gives none."""
        return self.setting or (RTOL if self.solves else STEPS)

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


Passes = Sequence[tuple[str, str, str]]
"""Name, place and digest of methods, which let another process load them."""

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
        rule = f"{name} is your own code, which runs only if you name it (--methods)"
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


def passes(names: Iterable[str]) -> Passes:
    """Return what lets another process load methods: name, place and digest of each."""
    found = (_ADMITTED[name] for name in names if name in _ADMITTED)
    return tuple((each.name, each.place, each.digest) for each in found if each.place)


def let_pass(those: Passes) -> None:
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
