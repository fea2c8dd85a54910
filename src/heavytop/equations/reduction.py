"""The top reduced by its cyclic coordinates: Routhian, effective potential, cubic.

p_phi and p_psi are constants; put in place of the velocities they belong to, they leave one
degree of freedom (SICM section 2.10, equation 2.66; Whittaker section 71).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import A, C, gMR, phidot, psidot, theta, thetadot

p_phi, p_psi, p_minus = sp.symbols("p_phi p_psi p_minus", real=True)
u, udot = sp.symbols("u udot", real=True)
E_prime = sp.Symbol("E_prime", real=True)


@cache
def cyclic_velocities() -> tuple[Any, Any]:
    """Return phidot and psidot as functions of theta and the momenta."""
    definitions = sp.Matrix(lag.momenta()[1:]).applyfunc(sp.expand)
    matrix = definitions.jacobian([phidot, psidot])
    solved = matrix.adjugate() * sp.Matrix([p_phi, p_psi]) / lag.normal_form(matrix.det())
    precession = sp.cancel(solved[0])
    return precession, p_psi / C - precession * sp.cos(theta)


@cache
def routhian() -> Any:
    """Return L - p_phi phidot - p_psi psidot, a function of theta and thetadot."""
    precession, spin = cyclic_velocities()
    values = {phidot: precession, psidot: spin}
    reduced = lag.lagrangian() - p_phi * phidot - p_psi * psidot
    return A * thetadot**2 / 2 - _gathered(A * thetadot**2 / 2 - reduced.subs(values))


@cache
def effective_potential() -> Any:
    """Return V_eff(theta): minus the Routhian without its kinetic energy of theta."""
    return A * thetadot**2 / 2 - routhian()


@cache
def reduced_energy() -> Any:
    """Return the energy as a function of theta and thetadot alone (SICM 2.66)."""
    return A * thetadot**2 / 2 + effective_potential()


@cache
def nutation_acceleration() -> Any:
    """Return the second derivative of theta, from the Routhian."""
    return -sp.diff(effective_potential(), theta) / A


@cache
def cubic() -> Any:
    """Return f(u) with udot^2 = f(u), u = cos(theta): a polynomial of degree three.

    udot = -sin(theta) thetadot, and thetadot^2 from the energy; E_prime is E - p_psi^2/(2 C).
    """
    speed = 2 * (E_prime + p_psi**2 / (2 * C) - effective_potential()) / A
    product = sp.expand((1 - u**2) * speed.subs(sp.sin(theta) ** 2, 1 - u**2))
    return sp.factor(sp.cancel(product.subs(sp.cos(theta), u)), deep=False)


def _gathered(potential: Any) -> Any:
    """Write the potential as spin energy, centrifugal term and weight, as the book does."""
    book = p_psi**2 / (2 * C) + gMR * sp.cos(theta)
    book += (p_phi - p_psi * sp.cos(theta)) ** 2 / (2 * A * sp.sin(theta) ** 2)
    difference = sp.cancel(sp.together(potential - book) * A * C * sp.sin(theta) ** 2)
    if lag.normal_form(difference) != 0:
        raise ArithmeticError("the effective potential is not the book's")
    return book
