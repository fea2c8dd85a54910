"""What a formulation is made of, differentiated by what a scene gives and by its own states."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.axis_form import kappa, omega3
from heavytop.equations.formulation import Formulation, spin, time, turned_phi
from heavytop.equations.numeric import numpy_function

Rows = tuple[tuple[Any, ...], ...]


def inputs(held: str) -> tuple[Any, ...]:
    """Return the symbols of what a scene gives, with the spin that it holds.

    The angles phi and psi of the start are left out: no rate depends on them.

    Examples
    --------
    >>> inputs("omega3")
    (A, C, gMR, theta, thetadot, phidot, omega3)
    """
    rate = {"psidot": lag.psidot, "omega3": omega3}[held]
    return (lag.A, lag.C, lag.gMR, lag.theta, lag.thetadot, lag.phidot, rate)


@cache
def start_gradient(formulation: Formulation, held: str) -> Rows:
    """Return the derivatives of the states at the start, then of the parameters: a row for each.

    The columns are those of `inputs`.
    """
    psidot = lag.psidot if held == "psidot" else omega3 - lag.phidot * sp.cos(lag.theta)
    values = (*formulation.start, *formulation.parameters.values())
    return tuple(
        tuple(sp.diff(x.subs(lag.psidot, psidot), each) for each in inputs(held))
        for x in map(sp.sympify, values)
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
    function: Callable[..., list[list[Any]]] = numpy_function(rows, formulation.arguments())
    return function


def _observables(formulation: Formulation) -> Mapping[str, Any]:
    outputs = formulation.outputs
    found = {"turning": formulation.events["turning"], **outputs}
    found["height"] = outputs.get("axis_z", sp.cos(outputs["theta"]))
    found.setdefault("phi", outputs.get("phi_mod"))
    if "psi" in outputs:
        found["psi"] = outputs["psi"].subs(turned_phi, found["phi"])
    if "quaternion_0" in outputs:
        found |= _angles_of([outputs[f"quaternion_{i}"] for i in range(4)])
    return found


def _angles_of(quaternion: list[Any]) -> dict[str, Any]:
    """Return phi and psi of the attitude, which moves smoothly through the poles."""
    turns = dict(zip(spin, (sp.cos(kappa * time / 2), sp.sin(kappa * time / 2)), strict=True))
    w, x, y, z = (component.subs(turns) for component in quaternion)
    plus, minus = sp.atan2(z, w), sp.atan2(y, x)
    return {"phi": plus + minus, "psi": plus - minus}
