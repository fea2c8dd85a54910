"""The table of rivals: what each is, whose it is, how it is set and what it needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType

from heavytop.errors import Impossible, MissingPackage

STEPS, TOLERANCE = "steps a period", "tolerance"
FORMULATIONS = ("lagrange", "subsystem", "routh", "cubic", "attitude")  # besides the axis form


@dataclass(frozen=True, slots=True)
class Method:
    """One rival.

    Attributes
    ----------
    name : str
        The name users hold.
    formulation : str
        The equations it integrates.
    language : str
        What its steps and its right-hand side run in.
    order : int, optional
        Its order; None where it varies.
    setting : str
        What is set: ``steps a period`` or ``tolerance`` (relative and absolute alike).
    default, least, most : float
        The setting when none is given, and the bounds it may have.
    needs : tuple of str
        The packages it imports.
    source : str
        Where it is published.
    words : str
        One line of words.
    """

    name: str
    formulation: str
    language: str
    order: int | None
    setting: str
    default: float
    least: float
    most: float
    needs: tuple[str, ...]
    source: str
    words: str

    @property
    def fixed(self) -> bool:
        """Whether its steps have one length."""
        return self.setting == STEPS

    def allowed(self, setting: float) -> float:
        """Return a setting that lies within the bounds.

        Raises
        ------
        Impossible
            It does not.
        """
        if not self.least <= setting <= self.most:
            rule = f"{setting!r} is not from {self.least:g} to {self.most:g} ({self.setting})"
            raise Impossible([(self.name, rule)])
        return float(setting)


def _geometric(name: str, order: int, steps: float, source: str, words: str) -> Method:
    return Method(name, "axis", "numba", order, STEPS, steps, 1.0, 1e7, ("numba",), source, words)


def _adaptive(name: str, order: int | None, tolerance: float, source: str, words: str) -> Method:
    return Method(
        name, "axis", "python", order, TOLERANCE, tolerance, 1e-15, 1e-2, ("scipy",), source, words
    )


_DORMAND_PRINCE = (
    "J. R. Dormand & P. J. Prince's pair of order 8 as in E. Hairer, S. P. Nørsett & G. Wanner, "
    "Solving Ordinary Differential Equations I, Springer 1993"
)

_ROWS = (
    _geometric(
        "strang",
        2,
        100.0,
        "G. Strang, SIAM Journal on Numerical Analysis 5 (1968) 506",
        "half a kick, a free rotation, half a kick",
    ),
    _geometric(
        "blanes-moan-rkn6",
        6,
        32.0,
        "S. Blanes & P. C. Moan, Journal of Computational and Applied Mathematics 142 (2002) 313",
        "14 kicks between 15 free rotations, of Runge-Kutta-Nystroem type",
    ),
    _geometric(
        "kahan-li8",
        8,
        32.0,
        "W. Kahan & R.-C. Li, Mathematics of Computation 66 (1997) 1089",
        "17 Strang steps, forwards and backwards",
    ),
    _geometric(
        "sofroniou-spaletta10",
        10,
        16.0,
        "M. Sofroniou & G. Spaletta, Optimization Methods and Software 20 (2005) 597",
        "35 Strang steps, forwards and backwards, in compensated sums",
    ),
    _geometric(
        "implicit-midpoint",
        2,
        100.0,
        "E. Hairer, C. Lubich & G. Wanner, Geometric Numerical Integration, Springer 2006",
        "Gauss' collocation with one node, iterated to rounding, in compensated sums",
    ),
    _geometric(
        "gauss8",
        16,
        8.0,
        "J. C. Butcher, Mathematics of Computation 18 (1964) 50",
        "Gauss' collocation with eight nodes, iterated to rounding, in compensated sums",
    ),
    _geometric(
        "bobenko-suris",
        2,
        100.0,
        "A. I. Bobenko & Y. B. Suris, Communications in Mathematical Physics 204 (1999) 147",
        "the integrable discrete Lagrange top, its momentum half a kick on",
    ),
    _adaptive(
        "dop853-scipy", 8, 1e-12, _DORMAND_PRINCE, "scipy's DOP853, a right-hand side in Python"
    ),
    _adaptive(
        "lsoda-scipy",
        None,
        1e-9,
        "L. Petzold, SIAM Journal on Scientific and Statistical Computing 4 (1983) 136",
        "scipy's LSODA, a right-hand side in Python",
    ),
    _adaptive(
        "radau-scipy",
        5,
        1e-6,
        "E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, Springer 1996",
        "scipy's Radau IIA, a right-hand side in Python",
    ),
    Method(
        "dop853-cyrk",
        "axis",
        "compiled by CyRK",
        8,
        TOLERANCE,
        1e-12,
        1e-15,
        1e-2,
        ("CyRK", "numba"),
        _DORMAND_PRINCE,
        "CyRK's DOP853, the right-hand side compiled by numba",
    ),
)

METHODS: Mapping[str, Method] = MappingProxyType({row.name: row for row in _ROWS})


MODULES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"scipy": ("scipy.integrate",), "CyRK": ("CyRK", "CyRK.nb")}  # what is used of each
)


def named(name: str) -> Method:
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
    stem, _, formulation = name.rpartition("-")
    row = METHODS.get(stem)
    if row is not None and not row.fixed and formulation in (*FORMULATIONS, "axis"):
        return replace(row, name=name, formulation=formulation)
    nearest = get_close_matches(name, METHODS, 1, 0.0)[0]
    raise Impossible([("method", f"there is none called {name!r}; the nearest is {nearest!r}")])


class Unimportable(MissingPackage):
    """A package that is there, and that does not import; `fault` says why."""

    def __init__(self, method: str, package: str, fault: str) -> None:
        super().__init__(method, (package,))
        self.fault = fault

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        return type(self), (self.method, self.packages[0], self.fault)

    def __str__(self) -> str:
        return f"{self.method} needs {self.packages[0]}, which does not import: {self.fault}"


def imported(method: Method) -> None:
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
            for module in MODULES.get(package, (package,)):
                import_module(module)
        except Exception as fault:  # whatever it raises, it is not ours
            why = " ".join(f"{type(fault).__name__}: {fault}".split())
            raise Unimportable(method.name, package, why) from fault


def absent(method: Method) -> tuple[str, ...]:
    """Return the packages a method needs that are not installed; none of them is imported."""
    return tuple(package for package in method.needs if find_spec(package) is None)
