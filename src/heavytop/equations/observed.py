"""What can be seen of the motion in the states of a formulation, in numbers of any type."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy as sp

from heavytop.equations.formulation import Formulation
from heavytop.equations.typed import typed_function


def observed(
    formulation: Formulation,
    constants: Sequence[Any],
    number: Callable[[int], Any],
    functions: Mapping[str, Callable[..., Any]],
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
        As `typed_function` takes them.

    Examples
    --------
    >>> from fractions import Fraction
    >>> from heavytop.equations.axis_form import axis_form
    >>> form = axis_form()
    >>> names = {p.name: Fraction(0) for p in form.parameters} | {"g": Fraction(1)}
    >>> see = observed(form, tuple(form.parameters), Fraction, {})
    >>> u, udot, energy, *_ = see(1, 0, 0, 0, 1, *names.values())
    >>> u, udot, energy  # the axis lies along x and turns down, about y
    (0, -1, Fraction(1, 2))
    """
    outputs = formulation.outputs
    u = outputs["axis_z"] if "axis_z" in outputs else sp.cos(outputs["theta"])
    wanted = [u, formulation.flow_derivative(u), *formulation.invariants.values()]
    arguments = (*formulation.states, *constants)
    return typed_function([*wanted, *_axis(formulation)], arguments, number, functions)


def _axis(form: Formulation) -> list[Any]:
    components = [form.outputs.get(f"axis_{x}") for x in "xyz"]
    known = set(form.states) | set(form.parameters)
    if any(x is None or not x.free_symbols <= known for x in components):
        return []
    return components
