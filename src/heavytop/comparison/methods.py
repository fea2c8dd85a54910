"""The methods of others: what each is, how it is set, what it needs, and how it is set up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from heavytop.comparison import symplectic
from heavytop.comparison.adaptive import cyrk_stepper, scipy_stepper
from heavytop.comparison.collocation import gauss
from heavytop.comparison.own import BODY, admitted
from heavytop.comparison.own_steps import own_stepper
from heavytop.comparison.steppers import InitialValueProblem, Stepper
from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import Impossible, MissingPackage

if TYPE_CHECKING:
    from heavytop.comparison.steppers import TopConstants
    from heavytop.equations.formulation import Formulation
    from heavytop.exact.pairs import Array

STEPS, TOLERANCE = "steps a period", "tolerance"


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
        Steps in a block; 0 where the method itself chooses.
    build : callable or None
        Returns the stepper of a problem, from that, a setting and the number of steps in a block;
        None for the Taylor integrator.
    source : str
        Where it is published.
    set_by : str
        What is set: ``steps a period`` or ``tolerance`` (relative and absolute alike).
    least, most : float
        The bounds a setting may have.
    language : str
        What its steps and its right-hand side run in.
    needs : tuple of str
        The packages it imports.
    formulation : str
        The equations it integrates.
    variables : str
        What its states are called, where they are not those of a formulation.
    """

    name: str
    order: int | None
    default: float
    block: int
    build: Callable[[InitialValueProblem, float, int], Stepper] | None = field(compare=False)
    source: str
    set_by: str
    least: float
    most: float
    language: str
    needs: tuple[str, ...] = ()
    formulation: str = "axis"
    variables: str = ""

    @property
    def fixed(self) -> bool:
        """Whether its steps have one length."""
        return self.set_by == STEPS

    @property
    def absent(self) -> tuple[str, ...]:
        """Packages it needs that are not installed; none of them is imported."""
        return tuple(package for package in self.needs if find_spec(package) is None)


_DORMAND_PRINCE = (
    "J. R. Dormand & P. J. Prince's pair of order 8 as in E. Hairer, S. P. Nørsett & G. Wanner, "
    "Solving Ordinary Differential Equations I, Springer 1993"
)
_by_steps = partial(MethodEntry, set_by=STEPS, least=1.0, most=1e7)
_by_tolerance = partial(MethodEntry, set_by=TOLERANCE, least=1e-15, most=1e-2, language="python")
_fixed = partial(_by_steps, language="numba", needs=("numba",))
_scipy = partial(_by_tolerance, needs=("scipy",))

# Blocks take a fraction of a millisecond to a few of them, against microseconds around them; those
# in Python tens, and LSODA's are longer, since each starts at order 1.
_ROWS: Final = (  # order, the default setting, steps in a block
    _fixed(
        "strang", 2, 100.0, 16384, symplectic.STRANG.stepper,
        "G. Strang, SIAM J. Numer. Anal. 5 (1968) 506",
    ),
    _fixed(
        "blanes-moan-rkn6", 6, 32.0, 4096, symplectic.BLANES_MOAN.stepper,
        "S. Blanes & P. C. Moan, J. Comput. Appl. Math. 142 (2002) 313",
    ),
    _fixed(
        "sofroniou-spaletta10", 10, 16.0, 2048, symplectic.SOFRONIOU_SPALETTA.stepper,
        "M. Sofroniou & G. Spaletta, Optim. Methods Softw. 20 (2005) 597",
    ),
    _fixed(
        "implicit-midpoint", 2, 100.0, 8192, partial(gauss, 1),
        "E. Hairer, C. Lubich & G. Wanner, Geometric Numerical Integration, 2006",
    ),
    _fixed(
        "gauss8", 16, 8.0, 1024, partial(gauss, 8),
        "J. C. Butcher, Math. Comp. 18 (1964) 50",
    ),
    _fixed(
        "bobenko-suris", 2, 100.0, 32768, symplectic.BOBENKO_SURIS.stepper,
        "A. I. Bobenko & Y. B. Suris, Comm. Math. Phys. 204 (1999) 147",
    ),
    _scipy("dop853-scipy", 8, 1e-12, 500, partial(scipy_stepper, "DOP853"), _DORMAND_PRINCE),
    _scipy(
        "lsoda-scipy", None, 1e-9, 4000, partial(scipy_stepper, "LSODA"),
        "L. Petzold, SIAM J. Sci. Statist. Comput. 4 (1983) 136",
    ),
    _scipy(
        "radau-scipy", 5, 1e-6, 200, partial(scipy_stepper, "Radau"),
        "E. Hairer & G. Wanner, Solving Ordinary Differential Equations II, 1996",
    ),
    _by_tolerance(
        "dop853-cyrk", 8, 1e-12, 1000, cyrk_stepper, _DORMAND_PRINCE,
        language="compiled by CyRK", needs=("CyRK", "numba"),
    ),
)  # fmt: skip

METHODS: Final[Mapping[str, MethodEntry]] = MappingProxyType({row.name: row for row in _ROWS})


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
    top: TopConstants | None = None,
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
    top : TopConstants, optional
        What a method of one's own reads as ``f.top``.

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
    method = named(name)
    imported(method)
    setting = method.default if setting is None else setting
    if not method.least <= setting <= method.most:
        rule = f"{setting!r} is not from {method.least:g} to {method.most:g} ({method.set_by})"
        raise Impossible([(name, rule)])
    equations = formulation or FORMULATIONS[method.formulation].build()
    state, n = tuple(float(x) for x in start), len(equations.states)
    if len(state) != n:  # compiled code would read on
        raise Impossible([("start", f"{len(state)} states, where the equations have {n}")])
    problem = InitialValueProblem(name, equations, parameters, state, direction, period, top)
    assert method.build is not None
    return method.build(problem, float(setting), method.block if steps is None else steps)


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
    if row and not row.fixed and formulation in FORMULATIONS:
        return replace(row, name=name, formulation=formulation)
    nearest = get_close_matches(name, METHODS, 1, 0.0)[0]
    raise Impossible([("method", f"there is none called {name!r}; the nearest is {nearest!r}")])


def _own(name: str) -> MethodEntry:
    """Return a method of one's own, which a person has named."""
    found = admitted(name).method
    row = partial(_by_tolerance, most=1e-1) if found.solves else _by_steps
    return row(
        name,
        found.order,
        found.usual_setting,
        0,
        partial(own_stepper, found),
        source="",
        language="numba" if found.compiled else "python",
        formulation="axis" if found.formulation in BODY else found.formulation,
        variables=found.formulation if found.formulation in BODY else "",
    )


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
    if method.absent:
        raise MissingPackage(method.name, method.absent)
    for package in method.needs:
        try:
            import_module("scipy.integrate" if package == "scipy" else package)
        except Exception as fault:  # whatever it raises, it is not ours
            why = " ".join(f"{type(fault).__name__}: {fault}".split())
            raise Unimportable(method.name, package, why) from fault
