"""The table of published methods: their settings, what they need, and how they are set up.

A new method is a stepper and a row here, which holds all that studies need to know of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, Final

from heavytop.comparison import fixed_steps
from heavytop.comparison.adaptive import cyrk_stepper, scipy_stepper
from heavytop.comparison.fixed_steps import gauss
from heavytop.comparison.steppers import InitialValueProblem, Stepper
from heavytop.comparison.user import BODY_FORMS, OWN_STEPS, OWN_TOLERANCE, registered
from heavytop.comparison.user_steps import user_stepper
from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import Impossible, MissingPackage
from heavytop.exact.decimals import DOUBLE

BY_STEPS, BY_TOLERANCE = "steps a period", "tolerance"
SLOW: Final = 10_000  # periods: the longest run of a method that takes a millisecond for each


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodEntry:
    """One method of integration, with its setting.

    Attributes
    ----------
    name : str
        The name users type.
    build : callable or None
        Returns the stepper of a problem, from that, a setting and the number of steps in a block;
        None for the Taylor integrator.
    set_by : str
        What its setting is: ``steps a period`` or ``tolerance`` (relative and absolute alike).
    default, setting : float
        The usual setting, and the one that it has.
    least, most : float
        The bounds of settings.
    language : str
        What its steps and its right-hand side run in.
    order : int, optional
        Its order; None where it varies.
    source : str
        Where it is published; empty for the Taylor integrator and for users' methods.
    block : int
        Steps in a block; 0 where the method itself chooses.
    needs : tuple of str
        The packages it imports.
    formulation : str
        The equations it integrates.
    variables : str
        The name of its states, where they are not those of a formulation.
    grid : tuple of float
        The settings of a work-precision diagram, from the loosest to the tightest.
    stress : mapping from str to float
        The settings of a stress test, by the formulation that is integrated there.
    short : str
        Its heading in a stress test.
    bits : int
        Bits of the numbers it computes with.
    projected : bool
        Whether the state is put back onto the invariants of the start every few steps.
    """

    name: str
    build: Callable[[InitialValueProblem, float, int], Stepper] | None = field(compare=False)
    set_by: str
    default: float
    setting: float
    least: float
    most: float
    language: str
    order: int | None = None
    source: str = ""
    block: int = 0
    needs: tuple[str, ...] = ()
    formulation: str = "axis"
    variables: str = ""
    grid: tuple[float, ...] = ()
    stress: Mapping[str, float] = field(default_factory=dict, hash=False)
    short: str = ""
    bits: int = DOUBLE
    projected: bool = False

    @property
    def fixed(self) -> bool:
        """Whether its steps have one length."""
        return self.set_by == BY_STEPS

    @property
    def absent(self) -> tuple[str, ...]:
        """Packages it needs that are not installed; none of them is imported."""
        return tuple(package for package in self.needs if find_spec(package) is None)

    @property
    def is_rival(self) -> bool:
        """Whether it is a published or a user's method, not the Taylor integrator."""
        return self.build is not None

    @property
    def published_order(self) -> int | None:
        """Its order; None where it varies, and for users' methods, whose order is measured."""
        return self.order if self.source else None

    @property
    def states(self) -> str:
        """The name of its states: a formulation, or the variables of a user's method."""
        return self.variables or self.formulation

    @property
    def reach(self) -> float:
        """The longest run [nutation periods], `SLOW` for slow methods."""
        return SLOW if self.bits > DOUBLE or self.language == "python" else float("inf")

    @property
    def text(self) -> str:
        """The text that names this method: its name, and the setting where it is not the usual."""
        setting = repr(self.setting).removesuffix(".0")
        return self.name if self.setting == self.default else f"{self.name}={setting}"

    @property
    def label(self) -> str:
        """The name with the setting to three digits."""
        return f"{self.name}={self.setting:.3g}"

    @property
    def set_to(self) -> str:
        """The setting in a few letters; empty for auto, which chooses it.

        Examples
        --------
        >>> METHODS["gauss8"].set_to, METHODS["dop853-scipy"].set_to
        ('8/period', '1e-12')
        """
        if self.fixed or not self.setting:
            return f"{self.setting:g}/period" if self.setting else ""
        mantissa, _, power = f"{self.setting:.1e}".partition("e")
        return f"{float(mantissa):g}e{int(power)}"


def entry(name: str, setting: float, build: Any, **about: Any) -> MethodEntry:
    """Return a method with a default setting, which it has."""
    return MethodEntry(name=name, default=setting, setting=setting, build=build, **about)


_DORMAND_PRINCE = (
    "J. R. Dormand & P. J. Prince's pair of order 8 as in E. Hairer, S. P. Nørsett & G. Wanner, "
    "Solving Ordinary Differential Equations I, Springer 1993"
)
DECADES: Final = tuple(10.0**-k for k in range(3, 16))
HALF_DECADES: Final = tuple(10.0 ** (-k / 2) for k in range(6, 31))  # a decade costs more than us
_LOW_ORDER = tuple(25.0 * 2**k for k in range(10))
_OWN_STEPS = tuple(12.5 * 2**k for k in range(8))

_by_steps = partial(entry, set_by=BY_STEPS, least=1.0, most=1e7, grid=_LOW_ORDER)
_by_tolerance = partial(entry, set_by=BY_TOLERANCE, least=1e-15, most=1e-2, grid=DECADES)
_fixed = partial(_by_steps, language="numba", needs=("numba",))
_scipy = partial(_by_tolerance, language="python", needs=("scipy",))

# Compiled blocks take a fraction of a millisecond to a few of them, so that the microseconds around
# them do not count; blocks in Python take tens, and LSODA's are longer, since each starts at order
# 1. A grid has two or three settings a decade of error, where there are so many. In stress tests
# scipy's solvers have the tightest tolerances with which each runs in good time.
_ROWS: Final = (
    _fixed(
        "strang", 100.0, fixed_steps.STRANG, order=2, block=16384,
        source="G. Strang, SIAM J. Numer. Anal. 5 (1968) 506",
    ),
    _fixed(
        "blanes-moan-rkn6", 32.0, fixed_steps.BLANES_MOAN, order=6, block=4096,
        grid=(6, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68, 80, 96, 114, 136),
        stress={"axis": 64.0}, short="rkn6",
        source="S. Blanes & P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313",
    ),
    _fixed(
        "sofroniou-spaletta10", 16.0, fixed_steps.SOFRONIOU_SPALETTA, order=10, block=2048,
        grid=(3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 20, 22, 25, 28, 32),
        source="M. Sofroniou & G. Spaletta, Optim. Methods Softw. 20 (2005) 597",
    ),
    _fixed(
        "implicit-midpoint", 100.0, partial(gauss, 1), order=2, block=8192,
        source="E. Hairer, C. Lubich & G. Wanner, Geometric Numerical Integration, 2006",
    ),
    _fixed(
        "gauss8", 8.0, partial(gauss, 8), order=16, block=1024,
        grid=(2, 3, 4, 5, 6, 7, 8, 10, 12, 16), stress={"axis": 32.0}, short="gauss8",
        source="J. C. Butcher, Math. Comp. 18 (1964) 50",
    ),
    _fixed(
        "bobenko-suris", 100.0, fixed_steps.BOBENKO_SURIS, order=2, block=32768,
        source="A. I. Bobenko & Y. B. Suris, Comm. Math. Phys. 204 (1999) 147",
    ),
    _scipy(
        "dop853-scipy", 1e-12, partial(scipy_stepper, "DOP853"), order=8, block=500,
        stress={"axis": 1e-12, "lagrange": 1e-12}, short="dop853", source=_DORMAND_PRINCE,
    ),
    _scipy(
        "lsoda-scipy", 1e-9, partial(scipy_stepper, "LSODA"), block=4000,
        stress={"axis": 1e-11, "lagrange": 1e-11}, short="lsoda",
        source="L. Petzold, SIAM J. Sci. Statist. Comput. 4 (1983) 136",
    ),
    _scipy(
        "radau-scipy", 1e-6, partial(scipy_stepper, "Radau"), order=5, block=200,
        stress={"axis": 1e-8, "lagrange": 1e-8}, short="radau",
        source="E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, 1996",
    ),
    _by_tolerance(
        "dop853-cyrk", 1e-12, cyrk_stepper, order=8, block=1000, grid=HALF_DECADES,
        stress={"axis": 1e-12}, short="cyrk", source=_DORMAND_PRINCE,
        language="compiled by CyRK", needs=("CyRK", "numba"),
    ),
)  # fmt: skip

METHODS: Final[Mapping[str, MethodEntry]] = MappingProxyType({row.name: row for row in _ROWS})


def make_stepper(
    method: MethodEntry, problem: InitialValueProblem, steps: int | None = None
) -> Stepper:
    """Return a method set up for one start; what it compiles is compiled here.

    Parameters
    ----------
    method : MethodEntry
    problem : InitialValueProblem
    steps : int, optional
        Steps in a block, for a run shorter than the method's own blocks.

    Returns
    -------
    Stepper
        It also has ``compile_s``, what compiling took, now or before [s].

    Raises
    ------
    MissingPackage
        A package the method needs is not installed.
    Impossible
        One does not import.
    """
    if method.absent:
        raise MissingPackage(method.name, method.absent)
    for package in method.needs:
        try:
            import_module(package)
        except Exception as fault:  # built for another numpy, hidden by a file of its name
            rule = f"{package} does not import: {type(fault).__name__}: {fault}"
            raise Impossible([(method.name, " ".join(rule.split()))]) from fault
    assert method.build is not None
    return method.build(problem, method.setting, method.block if steps is None else steps)


def named(name: str) -> MethodEntry:
    """Return a method by its name, which may end in a formulation: ``dop853-scipy-lagrange``.

    Raises
    ------
    Impossible
        There is none of that name.

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
        return _user_entry(name)
    stem, _, formulation = name.rpartition("-")
    row = METHODS.get(stem)
    if row and not row.fixed and formulation in FORMULATIONS:
        return replace(row, name=name, formulation=formulation)
    raise Impossible([("method", f"there is none called {name!r}")])


def _user_entry(name: str) -> MethodEntry:
    """Return the row of a user's method that was registered."""
    own = registered(name).method
    if own.solves:
        row, usual = partial(_by_tolerance, most=1e-1), OWN_TOLERANCE
        grid = HALF_DECADES if own.compiled else DECADES
    else:
        row, usual, grid = _by_steps, OWN_STEPS, _OWN_STEPS
    body = own.formulation in BODY_FORMS
    return row(
        name,
        own.setting or usual,
        partial(user_stepper, own),
        order=own.order,
        grid=grid if own.setting is None else (own.setting,),
        language=own.language,
        formulation="axis" if body else own.formulation,
        variables=own.formulation if body else "",
        short=name.rpartition(":")[2],
    )
