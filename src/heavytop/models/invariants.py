"""The invariants of a formulation as functions: their values, their slopes and their sizes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy as sp

from heavytop.models.formulation import Formulation
from heavytop.models.typed import typed_function

_NUMPY = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt}


@dataclass(frozen=True, slots=True)
class Invariants:
    """Functions of the states, followed by the constants that occur.

    Attributes
    ----------
    constants : tuple of str
        Names of the parameters that occur.
    values : callable
        The invariants, of and in numpy long doubles.
    slopes : callable
        Their derivatives by the states, in doubles: one row for each invariant.
    sizes : callable
        The sum of |x dI/dx| over all x in an invariant I, in doubles: what it changes by, to
        first order, when everything in it is rounded, relative to that rounding.
    """

    constants: tuple[str, ...]
    values: Callable[..., list[Any]]
    slopes: Callable[..., list[list[float]]]
    sizes: Callable[..., list[float]]


@cache
def invariants_of(formulation: Formulation) -> Invariants:
    """Return the invariants of a formulation as functions.

    Examples
    --------
    >>> from heavytop.models.cubic_form import cubic_form
    >>> invariants_of(cubic_form()).constants
    ('P', 'k_0', 'k_1', 'k_2', 'h')
    """
    expressions = tuple(formulation.invariants.values())
    used = set().union(*(x.free_symbols for x in expressions))
    constants = tuple(p for p in formulation.parameters if p in used)
    arguments = (*formulation.states, *constants)
    slopes = [[sp.diff(x, state) for state in formulation.states] for x in expressions]
    sizes = [sum(sp.Abs(a * sp.diff(x, a)) for a in arguments) for x in expressions]
    return Invariants(
        constants=tuple(p.name for p in constants),
        values=typed_function(expressions, arguments, np.longdouble, _NUMPY),
        slopes=typed_function(slopes, arguments, float, _NUMPY),
        sizes=typed_function(sizes, arguments, float, _NUMPY),
    )
