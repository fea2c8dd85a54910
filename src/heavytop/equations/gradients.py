"""What is made of a formulation: invariants and their gradients, and what is seen of a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import sympy as sp

from heavytop.equations.formulation import Formulation, time
from heavytop.equations.lambdify import Functions, OfInteger, lambdified


class Invariants(NamedTuple):
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
    >>> from heavytop.equations.reduced_cubic import cubic_form
    >>> found = invariants_of(cubic_form())
    >>> found.values, found.constants
    ((-k_0*w - k_1*w**2/2 - k_2*w**3/3 + wdot**2/2,), (k_0, k_1, k_2))
    """
    states, found = formulation.states, formulation.invariants.values()
    values = tuple(x.as_independent(*states, as_Add=True)[1] for x in found)
    constants = tuple(formulation.constants_in(values))
    arguments = (*states, *constants)
    sizes = [sum(sp.Abs(a * sp.diff(x, a)) for a in arguments) for x in values]
    slopes = tuple(tuple(sp.diff(x, state) for state in states) for x in values)
    return Invariants(states, constants, values, slopes, lambdified(sizes, arguments))


def observed(
    formulation: Formulation, constants: Sequence[Any], number: OfInteger, functions: Functions
) -> Callable[..., Sequence[Any]]:
    """Return a function of states and constants: u, udot, the invariants, and the axis.

    u is the vertical part of the axis. The three components of the axis stand last, or are
    missing where the states do not give all of them.

    Parameters
    ----------
    formulation : Formulation
    constants : sequence of symbols
        Its parameters, in the order in which they follow the states.
    number, functions
        As `lambdified` takes them.

    Examples
    --------
    >>> from fractions import Fraction
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> form = axis_form()
    >>> names = {p.name: Fraction(0) for p in form.parameters} | {"g": Fraction(1)}
    >>> see = observed(form, tuple(form.parameters), Fraction, {})
    >>> u, udot, energy, *_ = see(1, 0, 0, 0, 1, *names.values())
    >>> u, udot, energy  # the axis lies along x and turns down, about y
    (0, -1, Fraction(1, 2))
    """
    u, known = formulation.height, {*formulation.states, *formulation.parameters}
    axis = [formulation.outputs.get(f"axis_{x}", time) for x in "xyz"]
    seen = [u, formulation.flow_derivative(u), *formulation.invariants.values()]
    seen += axis if all(x.free_symbols <= known for x in axis) else []
    return lambdified(seen, (*formulation.states, *constants), number, functions)
