"""The Lagrangian of the axisymmetric heavy top, built from the ground (SICM section 2.10).

Rotation matrix, body angular velocity, kinetic and potential energy, Lagrange equations,
momenta and energy: every line follows from the one before by differentiation and the identity
cos^2 + sin^2 = 1. Coordinates and velocities are plain symbols, and time derivatives are taken
by the chain rule; that keeps each expression a polynomial in sines and cosines, whose normal
form costs milliseconds where a general ``simplify`` costs seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import sympy as sp

A, C, gMR = sp.symbols("A C gMR", real=True)
theta, phi, psi = sp.symbols("theta phi psi", real=True)
thetadot, phidot, psidot = sp.symbols("thetadot phidot psidot", real=True)
thetaddot, phiddot, psiddot = sp.symbols("thetaddot phiddot psiddot", real=True)

COORDINATES = (theta, phi, psi)
VELOCITIES = (thetadot, phidot, psidot)
ACCELERATIONS = (thetaddot, phiddot, psiddot)

DESCRIPTIONS: Mapping[sp.Symbol, str] = {
    A: "moment of inertia about any transverse axis through the pivot [kg m^2]",
    C: "moment of inertia about the symmetry axis [kg m^2]",
    gMR: "weight times the distance from pivot to centre of mass [kg m^2 s^-2]",
    theta: "tilt of the axis from the vertical (nutation) [rad]",
    phi: "azimuth of the axis (precession) [rad]",
    psi: "rotation about the axis (spin) [rad]",
    thetadot: "rate of tilt [rad/s]",
    phidot: "rate of precession [rad/s]",
    psidot: "rate of spin [rad/s]",
}


def normal_form(expression: Any) -> Any:
    """Expand a polynomial in sines and cosines, with even powers of cosines eliminated.

    Two such polynomials are equal as functions exactly if their normal forms are identical.

    >>> normal_form(sp.cos(theta) ** 3 + sp.cos(theta) * sp.sin(theta) ** 2)
    cos(theta)
    """

    def even_power(power: Any) -> Any:
        argument, exponent = power.base.args[0], int(power.exp)
        return (1 - sp.sin(argument) ** 2) ** (exponent // 2) * power.base ** (exponent % 2)

    expanded = sp.expand(expression)
    return sp.expand(expanded.replace(_is_power_of_cosine, even_power))


def _is_power_of_cosine(node: Any) -> bool:
    return bool(
        node.is_Pow and isinstance(node.base, sp.cos) and node.exp.is_Integer and node.exp >= 2
    )


def time_derivative(expression: Any) -> Any:
    """Return d/dt of a function of coordinates and velocities, by the chain rule."""
    rates = dict(zip(COORDINATES + VELOCITIES, VELOCITIES + ACCELERATIONS, strict=True))
    moving = sorted(expression.free_symbols & set(rates), key=str)
    return sum((sp.diff(expression, x) * rates[x] for x in moving), sp.Integer(0))


def _rotation_about_z(angle: Any) -> Any:
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def _rotation_about_x(angle: Any) -> Any:
    c, s = sp.cos(angle), sp.sin(angle)
    return sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]])


@cache
def rotation() -> Any:
    """Return R, body to space: Rz(phi) Rx(theta) Rz(psi), shape (3, 3)."""
    return sp.ImmutableMatrix(
        _rotation_about_z(phi) * _rotation_about_x(theta) * _rotation_about_z(psi)
    )


@cache
def angular_velocity() -> Any:
    """Return the body components of the angular velocity, from the antisymmetric R^T dR/dt."""
    x, y, z = (rotation()[:, i] for i in range(3))
    x_dot, y_dot, z_dot = (column.applyfunc(time_derivative) for column in (x, y, z))
    entries = (z.dot(y_dot), x.dot(z_dot), y.dot(x_dot))
    return sp.ImmutableMatrix([normal_form(entry) for entry in entries])


@cache
def axis() -> Any:
    """Return the symmetry axis in space, e = R z."""
    return rotation()[:, 2]


@cache
def kinetic_energy() -> Any:
    """Return T for principal moments A, A, C about the pivot."""
    omega = angular_velocity()
    transverse = normal_form(omega[0] ** 2 + omega[1] ** 2)
    return A * transverse / 2 + C * omega[2] ** 2 / 2


@cache
def potential_energy() -> Any:
    """Return V, the sum of m g z over the constituents, with its centre-of-mass sum removed.

    Constituent i, of mass m_i, sits at R_cm z + xi_i in the body. In the sum over i the part
    linear in xi_i vanishes, by the definition of the centre of mass; the other part has the
    same height for every constituent, and the sum of m_i is M. What is left is gMR cos(theta).
    """
    m, g, M, R_cm = sp.symbols("m_i g M R_cm", positive=True)
    xi = sp.Matrix(sp.symbols("xi_1 xi_2 xi_3", real=True))
    constituent = sp.expand(m * g * (rotation() * (xi + sp.Matrix([0, 0, R_cm])))[2])
    about_cm = sum(sp.diff(constituent, x) * x for x in xi)  # a linear form in the m_i xi_i
    common = sp.expand(constituent - about_cm)
    return sp.cancel(common / m * M).subs(g, gMR / (M * R_cm))


@cache
def lagrangian() -> Any:
    """Return L = T - V; phi, psi and the time are absent from it."""
    return kinetic_energy() - potential_energy()


@cache
def lagrange_equations() -> tuple[Any, Any, Any]:
    """Return d/dt dL/dqdot - dL/dq for theta, phi, psi: each vanishes along a motion."""
    L = lagrangian()
    pairs = zip(COORDINATES, VELOCITIES, strict=True)
    theta_eq, phi_eq, psi_eq = (
        normal_form(time_derivative(sp.diff(L, v)) - sp.diff(L, q)) for q, v in pairs
    )
    return theta_eq, phi_eq, psi_eq


@cache
def accelerations() -> tuple[Any, Any, Any]:
    """Return the second derivatives of theta, phi, psi, solved from the Lagrange equations.

    The equations are linear in the accelerations; Cramer's rule with every determinant in
    normal form gives the textbook expressions (and their pole at sin(theta) = 0).
    """
    equations = sp.Matrix(lagrange_equations())
    mass = equations.jacobian(ACCELERATIONS)
    force = -equations.subs(dict.fromkeys(ACCELERATIONS, 0))
    determinant = normal_form(mass.det())
    thetaddot_, phiddot_, psiddot_ = (
        _solved(mass, force, determinant, column) for column in range(3)
    )
    return thetaddot_, phiddot_, psiddot_


def _solved(mass: Any, force: Any, determinant: Any, column: int) -> Any:
    replaced = mass.copy()
    replaced[:, column] = force
    return sp.cancel(normal_form(replaced.det()) / determinant)


@cache
def momenta() -> tuple[Any, Any, Any]:
    """Return p_theta, p_phi, p_psi = dL/dqdot."""
    p_theta, p_phi, p_psi = (sp.diff(lagrangian(), v) for v in VELOCITIES)
    return p_theta, p_phi, p_psi


@cache
def energy() -> Any:
    """Return E, the Legendre transform of L; it is T + V because T is quadratic in velocities."""
    legendre = sum(v * p for v, p in zip(VELOCITIES, momenta(), strict=True))
    return normal_form(legendre - lagrangian())
