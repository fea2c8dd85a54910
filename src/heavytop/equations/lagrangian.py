"""The Lagrangian of the axisymmetric heavy top, derived from the rotation matrix (SICM 2.10).

Rotation matrix, body angular velocity, energies, Lagrange equations, momenta: each follows from the
one before by differentiation and cos^2 + sin^2 = 1. Then the constants p_phi and p_psi replace
velocities: Routhian, effective potential and cubic (equation 2.66; Whittaker section 71).
Coordinates and velocities are plain symbols, time derivatives are taken by the chain rule: so each
expression is a polynomial in sines and cosines, with a fast normal form (`simplify` is slow).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import Any

import sympy as sp

A, C, gMR = sp.symbols("A C gMR", real=True)
COORDINATES = theta, phi, psi = sp.symbols("theta phi psi", real=True)
VELOCITIES = thetadot, phidot, psidot = sp.symbols("thetadot phidot psidot", real=True)
ACCELERATIONS = thetaddot, phiddot, psiddot = sp.symbols("thetaddot phiddot psiddot", real=True)
p_phi, p_psi, E_prime, u = sp.symbols("p_phi p_psi E_prime u", real=True)


def normal_form(expression: Any) -> Any:
    """Expand a polynomial in sines and cosines, with even powers of cosines eliminated.

    Two such polynomials are equal as functions exactly if their normal forms are identical.

    >>> normal_form(sp.cos(theta) ** 3 + sp.cos(theta) * sp.sin(theta) ** 2)
    cos(theta)
    """

    def of_power(base: Any, exponent: Any) -> Any:
        if not (isinstance(base, sp.cos) and exponent.is_Integer and exponent >= 2):
            return base**exponent
        return (1 - sp.sin(base.args[0]) ** 2) ** (exponent // 2) * base ** (exponent % 2)

    return sp.expand(sp.expand(expression).replace(sp.Pow, of_power))


def time_derivative(expression: Any) -> Any:
    """Return d/dt of a function of coordinates and velocities, by the chain rule."""
    rates = zip(COORDINATES + VELOCITIES, VELOCITIES + ACCELERATIONS, strict=True)
    varying = [(x, rate) for x, rate in rates if x in expression.free_symbols]
    return sum((sp.diff(expression, x) * rate for x, rate in varying), sp.Integer(0))


@cache
def rotation() -> Any:
    """Return R, body to space: Rz(phi) Rx(theta) Rz(psi), shape (3, 3)."""
    about_z, about_x = sp.rot_ccw_axis3, sp.rot_ccw_axis1
    return sp.ImmutableMatrix(about_z(phi) * about_x(theta) * about_z(psi))


@cache
def angular_velocity() -> Any:
    """Return the body components of the angular velocity, from the antisymmetric R^T dR/dt."""
    R, rate = rotation(), rotation().applyfunc(time_derivative)
    entries = (R.col(i).dot(rate.col(j)) for i, j in ((2, 1), (0, 2), (1, 0)))
    return sp.ImmutableMatrix([normal_form(entry) for entry in entries])


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
    """Return V, the sum of m g z over the constituents, without terms that cancel in it.

    Constituent i, of mass m_i, is at R_cm z + xi_i in the body. In the sum over i the terms linear
    in xi_i vanish, by the definition of the centre of mass; the other terms have the same height
    for every constituent, and the sum of m_i is M. The result is gMR cos(theta).
    """
    m, g, M, R_cm = sp.symbols("m_i g M R_cm", positive=True)
    xi = sp.Matrix(sp.symbols("xi_1 xi_2 xi_3", real=True))
    constituent = sp.expand(m * g * (rotation() * (xi + sp.Matrix([0, 0, R_cm])))[2])
    about_cm = sum(sp.diff(constituent, x) * x for x in xi)  # a linear form in the m_i xi_i
    common = sp.expand(constituent - about_cm)
    return sp.cancel(common / m * M).subs(g, gMR / (M * R_cm))


def lagrangian() -> Any:
    """Return L = T - V; phi, psi and the time are absent from it."""
    return kinetic_energy() - potential_energy()


@cache
def lagrange_equations() -> tuple[Any, ...]:
    """Return d/dt dL/dqdot - dL/dq for theta, phi, psi: each vanishes along a motion."""
    pairs = zip(COORDINATES, momenta(), strict=True)
    return tuple(normal_form(time_derivative(p) - sp.diff(lagrangian(), q)) for q, p in pairs)


@cache
def accelerations() -> tuple[Any, ...]:
    """Return the second derivatives of theta, phi, psi; they have a pole at sin(theta) = 0."""
    return _solve(lagrange_equations(), ACCELERATIONS)


def _solve(equations: Iterable[Any], unknowns: Sequence[Any]) -> tuple[Any, ...]:
    """Solve linear equations by Cramer's rule, every determinant in normal form."""
    zeros = sp.Matrix([sp.expand(equation) for equation in equations])
    matrix = zeros.jacobian(unknowns)
    numerators = matrix.adjugate() * -zeros.subs(dict.fromkeys(unknowns, 0))
    determinant = normal_form(matrix.det())
    return tuple(sp.cancel(normal_form(x) / determinant) for x in numerators)


@cache
def momenta() -> tuple[Any, ...]:
    """Return p_theta, p_phi, p_psi = dL/dqdot."""
    return tuple(sp.diff(lagrangian(), v) for v in VELOCITIES)


@cache
def energy() -> Any:
    """Return E, the Legendre transform of L; it is T + V because T is quadratic in velocities."""
    legendre = sum(v * p for v, p in zip(VELOCITIES, momenta(), strict=True))
    return normal_form(legendre - lagrangian())


@cache
def cyclic_velocities() -> tuple[Any, Any]:
    """Return phidot and psidot as functions of theta and the momenta."""
    definitions = (momenta()[1] - p_phi, momenta()[2] - p_psi)
    precession, _ = _solve(definitions, (phidot, psidot))
    return precession, p_psi / C - precession * sp.cos(theta)


def routhian() -> Any:
    """Return R = L - p_phi phidot - p_psi psidot, a function of theta and thetadot."""
    return A * thetadot**2 / 2 - effective_potential()


@cache
def effective_potential() -> Any:
    """Return V_eff(theta): minus the Routhian without its kinetic energy of theta."""
    reduced = lagrangian() - p_phi * phidot - p_psi * psidot
    values = zip((phidot, psidot), cyclic_velocities(), strict=True)
    book = p_psi**2 / (2 * C) + gMR * sp.cos(theta)
    book += (p_phi - p_psi * sp.cos(theta)) ** 2 / (2 * A * sp.sin(theta) ** 2)
    return _book_form(A * thetadot**2 / 2 - reduced.subs(dict(values)), book)


def reduced_energy() -> Any:
    """Return the energy as a function of theta and thetadot alone (SICM 2.66)."""
    return A * thetadot**2 / 2 + effective_potential()


def nutation_acceleration() -> Any:
    """Return the second derivative of theta, from the Routhian."""
    return -sp.diff(effective_potential(), theta) / A


def cubic() -> Any:
    """Return f(u) with udot^2 = f(u), u = cos(theta): a polynomial of degree three.

    udot = -sin(theta) thetadot, and thetadot^2 from the energy; E_prime is E - p_psi^2/(2 C).
    """
    speed = 2 * (E_prime + p_psi**2 / (2 * C) - effective_potential()) / A
    product = sp.expand((1 - u**2) * speed.subs(sp.sin(theta) ** 2, 1 - u**2))
    book = 2 / A * (E_prime - gMR * u) * (1 - u**2) - (p_phi - p_psi * u) ** 2 / A**2
    return _book_form(product.subs(sp.cos(theta), u), book)


def _book_form(derived: Any, book: Any) -> Any:
    """Return the book's form of a derived expression; ArithmeticError where they differ."""
    numerator, _ = sp.fraction(sp.together(derived - book))
    if normal_form(numerator) != 0:
        raise ArithmeticError(f"{book} is not {derived}")
    return book
