"""phi and psi by quadrature beside a formulation that has their rates, and nothing that grows.

Each angle is carried as its deviation from a uniform rotation: exact for any rate of that
rotation, and bounded when the rate is the mean one.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import time

phi_deviation, psi_deviation = sp.symbols("phi_deviation psi_deviation", real=True)
phi_rate, psi_rate = sp.symbols("phi_rate psi_rate", real=True)
phi_0, psi_0 = sp.symbols("phi_0 psi_0", real=True)

DEVIATIONS = (phi_deviation, psi_deviation)
RATES = (phi_rate, psi_rate)
STARTS = {phi_0: lag.phi, psi_0: lag.psi}


def deviation_rates(phidot: Any, psidot: Any) -> tuple[Any, Any]:
    """Return the time derivatives of the deviations."""
    return phidot - phi_rate, psidot - psi_rate


def angles() -> dict[str, Any]:
    """Return phi and psi as functions of the deviations and the time."""
    return {
        "phi": phi_0 + phi_rate * time + phi_deviation,
        "psi": psi_0 + psi_rate * time + psi_deviation,
    }


def space_vectors(theta: Any, phi: Any, psi: Any, rates: tuple[Any, Any, Any]) -> dict[str, Any]:
    """Return the axis and the angular velocity in space, by component."""
    symbols = (*lag.COORDINATES, *lag.VELOCITIES)
    values = dict(zip(symbols, (theta, phi, psi, *rates), strict=True))
    omega = lag.rotation() * lag.angular_velocity()
    named = {f"axis_{x}": c for x, c in zip("xyz", lag.axis(), strict=True)}
    named |= {f"omega_{x}": lag.normal_form(c) for x, c in zip("xyz", omega, strict=True)}
    return {name: c.subs(values, simultaneous=True) for name, c in named.items()}
