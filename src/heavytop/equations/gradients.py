"""What is made of a formulation: its invariants, what is seen of the motion, and gradients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations.formulation import Formulation, spin, time, turned_phi
from heavytop.equations.lambdify import Functions, lambdified

A, C, gMR, theta, thetadot, phidot, psidot, omega3, kappa = sp.symbols(
    "A C gMR theta thetadot phidot psidot omega3 kappa", real=True
)


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
    >>> from heavytop.equations.reduced_cubic import cubic_form
    >>> found = invariants_of(cubic_form())
    >>> found.values, found.constants
    ((-k_0*w - k_1*w**2/2 - k_2*w**3/3 + wdot**2/2,), (k_0, k_1, k_2))
    """
    states = formulation.states
    values = tuple(
        x.as_independent(*states, as_Add=True)[1] for x in formulation.invariants.values()
    )
    constants = tuple(formulation.constants_in(values))
    arguments = (*states, *constants)
    sizes = [sum(sp.Abs(a * sp.diff(x, a)) for a in arguments) for x in values]
    slopes = tuple(tuple(sp.diff(x, state) for state in states) for x in values)
    return Invariants(states, constants, values, slopes, lambdified(sizes, arguments))


def observed(
    formulation: Formulation,
    constants: Sequence[Any],
    number: Callable[[int], Any],
    functions: Functions,
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
    components = (formulation.outputs.get(f"axis_{x}") for x in "xyz")
    axis = [x for x in components if x is not None and x.free_symbols <= known]
    seen = [u, formulation.flow_derivative(u), *formulation.invariants.values()]
    seen += axis if len(axis) == 3 else []
    return lambdified(seen, (*formulation.states, *constants), number, functions)


def inputs(held: str) -> tuple[Any, ...]:
    """Return the symbols of what a scene gives, with the spin that it holds.

    The angles phi and psi of the start are left out: no rate depends on them.

    Examples
    --------
    >>> inputs("omega3")
    (A, C, gMR, theta, thetadot, phidot, omega3)
    """
    return A, C, gMR, theta, thetadot, phidot, {"psidot": psidot, "omega3": omega3}[held]


@cache
def start_gradient(formulation: Formulation, held: str) -> tuple[tuple[Any, ...], ...]:
    """Return the derivatives of the states at the start, then of the parameters: a row for each.

    The columns are those of `inputs`.
    """
    spinning = {"psidot": psidot, "omega3": omega3 - phidot * sp.cos(theta)}[held]
    values = (*formulation.start, *formulation.parameters.values())
    return tuple(
        tuple(sp.diff(x.subs(psidot, spinning), each) for each in inputs(held)) for x in values
    )


@cache
def observed_gradient(
    formulation: Formulation, names: tuple[str, ...]
) -> Callable[..., list[list[Any]]]:
    """Return a function of the formulation's arguments, with a row for each name.

    ``turning`` is its event function, ``height`` cos(theta); ``phi`` and ``psi`` are up to whole
    turns. A row holds the derivatives by the states and by the parameters, and last that by time
    along the motion.
    """
    by = (*formulation.states, *formulation.parameters)
    rows = [
        [*(sp.diff(x, each) for each in by), formulation.flow_derivative(x) + sp.diff(x, time)]
        for x in map(_observables(formulation).get, names)
    ]
    return lambdified(rows, formulation.arguments())


def _observables(formulation: Formulation) -> Mapping[str, Any]:
    outputs = formulation.outputs
    found = {"turning": formulation.events["turning"], "height": formulation.height, **outputs}
    found.setdefault("phi", outputs.get("phi_mod"))
    if "psi" in outputs:
        found["psi"] = outputs["psi"].subs(turned_phi, found["phi"])
    if "quaternion_0" in outputs:  # the attitude moves smoothly through the poles
        turns = dict(zip(spin, (sp.cos(kappa * time / 2), sp.sin(kappa * time / 2)), strict=True))
        w, x, y, z = (outputs[f"quaternion_{i}"].subs(turns) for i in range(4))
        plus, minus = sp.atan2(z, w), sp.atan2(y, x)
        found |= {"phi": plus + minus, "psi": plus - minus}
    return found
