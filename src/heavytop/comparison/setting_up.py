"""Setting a rival up for one start: from a name and numbers to a march."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from heavytop.comparison import coefficients, collocation, splitting
from heavytop.comparison.fixed import FixedStep
from heavytop.comparison.march import Array, March
from heavytop.comparison.table import Method, imported, named
from heavytop.errors import Impossible
from heavytop.numbers.double_double import two_product

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation

# Steps in a block: a fraction of a millisecond to a few of them, against microseconds around it.
_STEPS = {
    "strang": 16384,
    "blanes-moan-rkn6": 4096,
    "kahan-li8": 4096,
    "sofroniou-spaletta10": 2048,
    "implicit-midpoint": 8192,
    "gauss8": 1024,
    "bobenko-suris": 32768,
}
_COMPOSED: Mapping[str, Callable[[], tuple[Array, Array]]] = {
    "strang": lambda: coefficients.composition(coefficients.STRANG),
    "bobenko-suris": lambda: coefficients.composition(coefficients.STRANG),
    "blanes-moan-rkn6": coefficients.blanes_moan,
    "kahan-li8": lambda: coefficients.composition(coefficients.KAHAN_LI_8),
    "sofroniou-spaletta10": lambda: coefficients.composition(coefficients.SOFRONIOU_SPALETTA_10),
}


def march(
    name: str,
    start: Sequence[float] | Array,
    parameters: Mapping[str, float],
    setting: float | None = None,
    period: float | None = None,
    direction: int = 1,
    *,
    steps: int | None = None,
    formulation: Formulation | None = None,
) -> March:
    """Return a rival set up for one start; what it compiles is compiled here.

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
    March
        It also has ``compile_s``, what compiling took [s].

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
    setting = method.allowed(method.default if setting is None else setting)
    state = tuple(float(x) for x in start)
    if method.fixed:
        h = direction * _positive(method, period) / setting
        return _fixed_step(method.name, state, parameters, h, steps)
    return _adaptive(method, state, parameters, setting, direction, steps, formulation)


def _positive(method: Method, period: float | None) -> float:
    if period is None or not 0 < period < float("inf"):
        rule = f"its steps are parts of a period, and {period!r} is none"
        raise Impossible([(method.name, rule)])
    return float(period)


def _checked(start: tuple[float, ...], n: int) -> None:
    if len(start) != n:  # compiled code would read on
        raise Impossible([("start", f"{len(start)} states, where the equations have {n}")])


def _fixed_step(
    name: str,
    start: tuple[float, ...],
    parameters: Mapping[str, float],
    h: float,
    steps: int | None,
) -> FixedStep:
    _checked(start, 5)
    if lacking := [(key, "is not given") for key in ("g", "l_z") if key not in parameters]:
        raise Impossible(lacking)
    g, l_z = float(parameters["g"]), float(parameters["l_z"])
    began = time.perf_counter()
    if name == "implicit-midpoint":
        table, kernel = np.array([[h / 2]]), collocation.midpoint()
        carried, scratch, forces = 5, 5, 0
    elif name == "gauss8":
        table, kernel = _collocation_table(8, h), collocation.collocation(8)
        carried, scratch, forces = 5, 1 + 5 * 8, 0
    else:
        kicks, drifts = _COMPOSED[name]()
        table = h * np.vstack([g * kicks, np.append(drifts, 0.0)])
        compensated = name == "sofroniou-spaletta10"
        turn = "cayley" if name == "bobenko-suris" else "exact"
        kernel = splitting.splitting(turn, compensated=compensated)
        carried, scratch = (5, 0) if compensated else (0, 5)
        forces = kicks.size - (2 if kicks[0] == 0 else 1)  # the last is the next step's first
    return FixedStep(
        start=start,
        g=g,
        l_z=l_z,
        h=h,
        kernel=kernel,
        table=np.ascontiguousarray(table),
        carried=carried,
        scratch=scratch,
        forces=forces,
        steps=_STEPS[name] if steps is None else steps,
        compile_s=time.perf_counter() - began,
    )


def _collocation_table(s: int, h: float) -> Array:
    """Return h times A transposed, b, what foresees a step, transposed, and the rest of A and b."""
    (a, a_rest), (b, b_rest), beyond = coefficients.gauss(s)
    rounded = np.vstack([a.T, b])
    high, error = two_product(np.full_like(rounded, h), rounded)
    rest = error + h * np.vstack([a_rest.T, b_rest])
    return np.vstack([high, h * beyond.T, rest])


def _adaptive(
    method: Method,
    start: tuple[float, ...],
    parameters: Mapping[str, float],
    tolerance: float,
    direction: int,
    steps: int | None,
    formulation: Formulation | None,
) -> March:
    from heavytop.equations.formulation import FORMULATIONS

    equations = formulation or FORMULATIONS[method.formulation].build()
    _checked(start, len(equations.states))
    if "CyRK" in method.needs:
        from heavytop.comparison.cyrk import cyrk_march

        return cyrk_march(equations, start, parameters, tolerance, direction, steps)
    from heavytop.comparison.scipy_solvers import scipy_march

    solver = method.name.partition("-scipy")[0]
    return scipy_march(solver, equations, start, parameters, tolerance, direction, steps)
