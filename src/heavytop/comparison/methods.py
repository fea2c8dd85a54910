"""The methods of others: what each is, how it is set, what it needs, and how it is set up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from heavytop.comparison import symplectic
from heavytop.comparison.adaptive import (
    AdaptiveStepper,
    constants,
    cyrk_solver,
    ias15_solver,
    scipy_solver,
)
from heavytop.comparison.collocation import gauss
from heavytop.comparison.own import BODY, RTOL, admitted
from heavytop.comparison.own import STEPS as STEPS_GIVEN
from heavytop.comparison.own import Method as OwnMethod
from heavytop.comparison.own_steps import own_stepper
from heavytop.comparison.steppers import FixedStep, Stepper
from heavytop.errors import Impossible, MissingPackage

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation
    from heavytop.numbers.double_double import Array

STEPS, TOLERANCE = "steps a period", "tolerance"
IAS15: Final = "ias15-rebound"  # whose equations are of the second order: the axis form alone
FORMULATIONS: Final = ("axis", "lagrange", "subsystem", "routh", "cubic", "attitude")


@dataclass(frozen=True, slots=True)
class MethodEntry:
    """One method.

    Attributes
    ----------
    name : str
        The name users type.
    order : int, optional
        Its order; None where it varies.
    default : float
        The setting when none is given.
    block : int
        Steps in a block.
    build : callable
        Returns the stepper of a fixed step, or the solver that an adaptive one steps with.
    setting : str
        What is set: ``steps a period`` or ``tolerance`` (relative and absolute alike).
    least, most : float
        The bounds a setting may have.
    language : str
        What its steps and its right-hand side run in.
    needs : tuple of str
        The packages it imports.
    source : str
        Where it is published.
    formulation : str
        The equations it integrates.
    own : heavytop.comparison.own.Method or None
        What a person brought.
    """

    name: str
    order: int | None
    default: float
    block: int
    build: Callable[..., Any]
    setting: str
    least: float
    most: float
    language: str
    needs: tuple[str, ...]
    source: str
    formulation: str = "axis"
    own: OwnMethod | None = None

    @property
    def fixed(self) -> bool:
        """Whether its steps have one length."""
        return self.setting == STEPS


_DORMAND_PRINCE = (
    "J. R. Dormand & P. J. Prince's pair of order 8 as in E. Hairer, S. P. Nørsett & G. Wanner, "
    "Solving Ordinary Differential Equations I, Springer 1993"
)
_SOURCES: Final = {
    "strang": "G. Strang, SIAM J. Numer. Anal. 5 (1968) 506",
    "blanes-moan-rkn6": "S. Blanes & P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313",
    "kahan-li8": "W. Kahan & R.-C. Li, Math. Comp. 66 (1997) 1089",
    "sofroniou-spaletta10": "M. Sofroniou & G. Spaletta, Optim. Methods Softw. 20 (2005) 597",
    "implicit-midpoint": "E. Hairer, C. Lubich & G. Wanner, Geometric Numerical Integration, 2006",
    "gauss8": "J. C. Butcher, Math. Comp. 18 (1964) 50",
    "bobenko-suris": "A. I. Bobenko & Y. B. Suris, Comm. Math. Phys. 204 (1999) 147",
    "dop853-scipy": _DORMAND_PRINCE,
    "lsoda-scipy": "L. Petzold, SIAM J. Sci. Statist. Comput. 4 (1983) 136",
    "radau-scipy": "E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, 1996",
    "dop853-cyrk": _DORMAND_PRINCE,
    IAS15: "H. Rein & D. S. Spiegel, Mon. Not. R. Astron. Soc. 446 (2015) 1424",
}
_LIBRARIES: Final = {  # what is set, least and most, the language, and the packages
    "numba": (STEPS, 1.0, 1e7, "numba", ("numba",)),
    "scipy": (TOLERANCE, 1e-15, 1e-2, "python", ("scipy",)),
    "CyRK": (TOLERANCE, 1e-15, 1e-2, "compiled by CyRK", ("CyRK", "numba")),
    "REBOUND": (TOLERANCE, 1e-15, 1e-2, "python", ("rebound",)),
}
# Blocks take a fraction of a millisecond to a few of them, against microseconds around them; those
# in Python tens, and LSODA's are longer, since each starts at order 1.
_ROWS: Final = (  # order, the default setting, steps in a block
    ("strang", 2, 100.0, 16384, "numba", symplectic.STRANG.stepper),
    ("blanes-moan-rkn6", 6, 32.0, 4096, "numba", symplectic.BLANES_MOAN.stepper),
    ("kahan-li8", 8, 32.0, 4096, "numba", symplectic.KAHAN_LI.stepper),
    ("sofroniou-spaletta10", 10, 16.0, 2048, "numba", symplectic.SOFRONIOU_SPALETTA.stepper),
    ("implicit-midpoint", 2, 100.0, 8192, "numba", partial(gauss, 1)),
    ("gauss8", 16, 8.0, 1024, "numba", partial(gauss, 8)),
    ("bobenko-suris", 2, 100.0, 32768, "numba", symplectic.BOBENKO_SURIS.stepper),
    ("dop853-scipy", 8, 1e-12, 500, "scipy", partial(scipy_solver, "DOP853")),
    ("lsoda-scipy", None, 1e-9, 4000, "scipy", partial(scipy_solver, "LSODA")),
    ("radau-scipy", 5, 1e-6, 200, "scipy", partial(scipy_solver, "Radau")),
    ("dop853-cyrk", 8, 1e-12, 1000, "CyRK", cyrk_solver),
    (IAS15, 15, 1e-9, 100, "REBOUND", ias15_solver),
)

METHODS: Final[Mapping[str, MethodEntry]] = MappingProxyType(
    {
        name: MethodEntry(name, order, default, block, build, *_LIBRARIES[library], _SOURCES[name])
        for name, order, default, block, library, build in _ROWS
    }
)


def make_stepper(
    name: str,
    start: Sequence[float] | Array,
    parameters: Mapping[str, float],
    setting: float | None = None,
    period: float | None = None,
    direction: int = 1,
    *,
    steps: int | None = None,
    formulation: Formulation | None = None,
) -> Stepper:
    """Return a method set up for one start; what it compiles is compiled here.

    Parameters
    ----------
    name : str
        A name of `METHODS`, or an adaptive one of them followed by ``-FORMULATION``.
    start : array_like, shape (n,)
        The states at the start, in the order of the formulation, as doubles.
    parameters : mapping from str to float
        The formulation's parameters by name; those that the equations do not hold are not read.
        The axis form needs ``g`` = gMR/A and ``l_z`` = p_phi/A [1/s^2, 1/s].
    setting : float, optional
        Steps a period, or the tolerance; the method's default when left out.
    period : float, optional
        The nutation period [s]; of a method of fixed step, h = period/setting.
    direction : int
        1 forwards, -1 backwards in time.
    steps : int, optional
        Steps in a block, for a run shorter than the method's own blocks.
    formulation : Formulation, optional
        The equations themselves, where they are a variant of what the name says.

    Returns
    -------
    Stepper
        It also has ``compile_s``, what compiling took, now or before [s].

    Raises
    ------
    Impossible
        No such method, a setting out of its bounds, no period where one is needed, a parameter
        that is not given, or too many states or too few.
    MissingPackage
        A package the method needs is not installed, or does not import.
    """
    from heavytop.equations.formulation import FORMULATIONS

    method = named(name)
    imported(method)
    setting = method.default if setting is None else setting
    if not method.least <= setting <= method.most:
        rule = f"{setting!r} is not from {method.least:g} to {method.most:g} ({method.setting})"
        raise Impossible([(name, rule)])
    equations = formulation or FORMULATIONS[method.formulation].build()
    state, n = tuple(float(x) for x in start), len(equations.states)
    if len(state) != n:  # compiled code would read on
        raise Impossible([("start", f"{len(state)} states, where the equations have {n}")])
    block = method.block if steps is None else steps
    if method.own:
        at = direction * float(period or 0.0)
        return own_stepper(method.own, equations, parameters, state, setting, at, steps)
    if not method.fixed:
        solver, seconds = method.build(equations, parameters, float(setting))
        return AdaptiveStepper(solver, state, direction, block, seconds)
    if period is None or not 0 < period < float("inf"):
        rule = f"its steps are parts of a period, and {period!r} is none"
        raise Impossible([(name, rule)])
    h = direction * float(period) / setting
    stepper: FixedStep = method.build(state, h=h, steps=block, **constants(equations, parameters))
    return stepper


def named(name: str) -> MethodEntry:
    """Return a method by its name, which may end in a formulation: ``dop853-scipy-lagrange``.

    Raises
    ------
    Impossible
        There is none of that name; the nearest is said.

    Examples
    --------
    >>> named("dop853-scipy-lagrange").formulation
    'lagrange'
    >>> named("strang").default
    100.0
    """
    if name in METHODS:
        return METHODS[name]
    if ":" in name:
        return _own(name)
    stem, _, formulation = name.rpartition("-")
    row = METHODS.get(stem)
    if row is not None and not row.fixed and stem != IAS15 and formulation in FORMULATIONS:
        return replace(row, name=name, formulation=formulation)
    nearest = get_close_matches(name, METHODS, 1, 0.0)[0]
    raise Impossible([("method", f"there is none called {name!r}; the nearest is {nearest!r}")])


def _own(name: str) -> MethodEntry:
    """A method of one's own, which a person has named."""
    found = admitted(name).method
    steps, language = not found.solves, "numba" if found.compiled else "python"
    return MethodEntry(
        name, found.order, found.setting or (STEPS_GIVEN if steps else RTOL), 0, own_stepper,
        STEPS if steps else TOLERANCE, *((1.0, 1e7) if steps else (1e-15, 1e-1)), language, (),
        "", "axis" if found.formulation in BODY else found.formulation, found,
    )  # fmt: skip


class Unimportable(MissingPackage):
    """A package that is there, and that does not import; `fault` says why."""

    def __init__(self, method: str, package: str, fault: str) -> None:
        super().__init__(method, (package,))
        self.args, self.fault = (method, package, fault), fault

    def __str__(self) -> str:
        return f"{self.method} needs {self.packages[0]}, which does not import: {self.fault}"


def imported(method: MethodEntry) -> None:
    """Import the packages a method needs.

    Raises
    ------
    MissingPackage
        One is not installed.
    Unimportable
        One is, and raises something: built for another numpy, hidden by a file of its name.
    """
    if missing := absent(method):
        raise MissingPackage(method.name, missing)
    for package in method.needs:
        try:
            import_module("scipy.integrate" if package == "scipy" else package)
        except Exception as fault:  # whatever it raises, it is not ours
            why = " ".join(f"{type(fault).__name__}: {fault}".split())
            raise Unimportable(method.name, package, why) from fault


def absent(method: MethodEntry) -> tuple[str, ...]:
    """Return the packages a method needs that are not installed; none of them is imported."""
    return tuple(package for package in method.needs if find_spec(package) is None)
