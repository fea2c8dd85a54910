"""The textbook form: theta, phi, psi and their rates, from the Lagrange equations.

phi and psi grow without bound in the state, which ruins the step control of an integrator that
measures its error against the largest state, and the equations have poles at theta = 0 and pi.
It is here to be compared with.
"""

from __future__ import annotations

from functools import cache

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation


@cache
def lagrange_form() -> Formulation:
    """Return the six-dimensional textbook formulation."""
    _, p_phi, p_psi = lag.momenta()
    reduced_energy = sp.expand(lag.energy() / lag.A) - p_psi**2 / (2 * lag.A * lag.C)
    return Formulation(
        name="lagrange",
        summary="theta, phi, psi and their rates, as a textbook writes them",
        states=lag.COORDINATES + lag.VELOCITIES,
        derivatives=lag.VELOCITIES + lag.accelerations(),
        start=lag.COORDINATES + lag.VELOCITIES,
        parameters={lag.A: lag.A, lag.C: lag.C, lag.gMR: lag.gMR},
        given=(),
        outputs=_outputs(),
        events={"turning": lag.thetadot, "reversal": lag.phidot},
        invariants={
            "energy": reduced_energy,
            "p_phi": p_phi / lag.A,
            "p_psi": p_psi / lag.A,
        },
        spin=p_psi / lag.A,
        starts_at_pole=False,
        unbounded=True,
    )


def _outputs() -> dict[str, object]:
    outputs = {symbol.name: symbol for symbol in lag.COORDINATES + lag.VELOCITIES}
    omega = lag.rotation() * lag.angular_velocity()
    for name, component in zip("xyz", lag.axis(), strict=True):
        outputs[f"axis_{name}"] = component
    for name, component in zip("xyz", omega, strict=True):
        outputs[f"omega_{name}"] = lag.normal_form(component)
    return outputs
