"""scipy's solvers as a textbook uses them: one call from the start to the end, and what it says.

Here nothing is guarded: the right-hand side divides by zero as numpy does, with no numbers and a
warning that nobody reads; zeros of event functions are where they change sign from one step to
the next, which is the rule of `scipy.integrate.solve_ivp`.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from heavytop.comparison.equations import constants, values
from heavytop.comparison.march import Array
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import lambdified

SOLVERS: Final = {"rk45": "RK45", "dop853": "DOP853", "lsoda": "LSODA", "radau": "Radau"}
_NUMPY: Final = {name: getattr(np, name) for name in ("sin", "cos", "sqrt")}

Rates = Callable[[float, Array], Sequence[Any]]


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked of a solver.

    Attributes
    ----------
    solver : str
        A key of `SOLVERS`.
    rtol, atol : float
    end : float
        The time to reach, from 0 [s].
    step_limit : int
    """

    solver: str
    rtol: float
    atol: float
    end: float
    step_limit: int


@dataclass(frozen=True, slots=True)
class Told:
    """What came of it.

    Attributes
    ----------
    status : str
        ``finished`` or ``failed``, as the solver has it, or ``step-limit``.
    message : str
        What the solver says of its failure.
    t : float
        The time reached [s].
    state : ndarray, shape (n,)
    steps : int
    smallest : float or None
        The shortest step, but for the last, which is cut off [s].
    zeros : tuple of int
        How often each event function changed its sign.
    finite : bool
        Whether the derivatives at the state reached are numbers.
    """

    status: str
    message: str
    t: float
    state: Array
    steps: int
    smallest: float | None
    zeros: tuple[int, ...]
    finite: bool = True


def rates_of(equations: Formulation, parameters: dict[str, float]) -> Rates:
    """Return f(t, y) as one writes it by hand: it returns whatever numpy makes of a pole."""
    known = tuple(np.float64(x) for x in values(equations, parameters))
    arguments = (*equations.states, *constants(equations))
    function = lambdified(equations.derivatives, arguments, np.float64, _NUMPY)
    return lambda _, y: function(*y, *known)


def solved(
    rates: Rates, start: Array, asked: Asked, watched: Sequence[Callable[[Array], float]] = ()
) -> Told:
    """Let a solver go from the start to the end.

    Parameters
    ----------
    rates : callable
        The derivatives, of time and states.
    start : ndarray, shape (n,)
    asked : Asked
    watched : sequence of callable
        Event functions of the states.
    """
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # what a solver warns of, its user has not read either
        try:
            told = _walked(rates, start, asked, watched)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
            told = Told("failed", str(error), 0.0, start, 0, None, (0,) * len(watched))
        return replace(told, finite=bool(np.isfinite(rates(told.t, told.state)).all()))


def _walked(
    rates: Rates, start: Array, asked: Asked, watched: Sequence[Callable[[Array], float]]
) -> Told:
    import scipy.integrate

    kind = getattr(scipy.integrate, SOLVERS[asked.solver])
    solver = kind(rates, 0.0, start, asked.end, rtol=asked.rtol, atol=asked.atol)
    before = [zero(start) for zero in watched]
    counts, lengths, message = [0] * len(watched), [np.inf, np.inf], ""
    steps = 0
    while solver.status == "running" and steps < asked.step_limit:
        message = solver.step() or ""
        steps += 1
        lengths = [min(lengths), abs(solver.t - (solver.t_old or 0.0))]
        after = [zero(solver.y) for zero in watched]
        pairs = zip(before, after, strict=True)
        counts = [n + _changed(*pair) for n, pair in zip(counts, pairs, strict=True)]
        before = after
    status = "step-limit" if solver.status == "running" else solver.status
    smallest = lengths[0] if np.isfinite(lengths[0]) else None
    return Told(status, message, float(solver.t), solver.y, steps, smallest, tuple(counts))


def _changed(before: float, after: float) -> bool:
    return (before <= 0 <= after) or (before >= 0 >= after)
