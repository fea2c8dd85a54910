"""The invariants of a formulation: what varies in them, their slopes and their sizes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations.formulation import Formulation
from heavytop.equations.numeric import numpy_function


@dataclass(frozen=True, slots=True, eq=False)
class Invariants:
    """Functions of the states and of the constants that occur.

    Attributes
    ----------
    states, constants : tuple of symbols
    values : tuple of expressions
        The invariants without their terms free of the states, which would only take digits.
    slopes : tuple of tuples of expressions
        Their derivatives by the states: one row for each invariant.
    sizes : callable
        The sum of |x dI/dx| over all x in an invariant I, in doubles, of the states followed by
        the constants: what it changes by, to first order, when everything in it is rounded,
        relative to that rounding.
    """

    states: tuple[Any, ...]
    constants: tuple[Any, ...]
    values: tuple[Any, ...]
    slopes: tuple[tuple[Any, ...], ...]
    sizes: Callable[..., list[float]]


@cache
def invariants_of(formulation: Formulation) -> Invariants:
    """Return the invariants of a formulation.

    Examples
    --------
    >>> from heavytop.equations.cubic_form import cubic_form
    >>> found = invariants_of(cubic_form())
    >>> found.values, found.constants
    ((-k_0*w - k_1*w**2/2 - k_2*w**3/3 + wdot**2/2,), (k_0, k_1, k_2))
    """
    states = formulation.states
    values = tuple(
        sp.sympify(x).as_independent(*states, as_Add=True)[1]
        for x in formulation.invariants.values()
    )
    used = set().union(*(x.free_symbols for x in values))
    constants = tuple(p for p in formulation.parameters if p in used)
    arguments = (*states, *constants)
    sizes = [sum(sp.Abs(a * sp.diff(x, a)) for a in arguments) for x in values]
    return Invariants(
        states=states,
        constants=constants,
        values=values,
        slopes=tuple(tuple(sp.diff(x, state) for state in states) for x in values),
        sizes=numpy_function(sizes, arguments),
    )
