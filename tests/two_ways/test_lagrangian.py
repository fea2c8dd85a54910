"""The Lagrangian built from the rotation matrix, against what the book derives by hand."""

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import (
    A,
    C,
    gMR,
    normal_form,
    phi,
    phidot,
    psi,
    psidot,
    theta,
    thetadot,
)


def zero(expression):
    return normal_form(sp.expand(expression)) == 0


def test_rotation_is_orthogonal():
    R = lag.rotation()
    product = (R.T * R).applyfunc(normal_form)
    assert product == sp.eye(3)


def test_angular_velocity_generates_the_rotation():
    R, omega = lag.rotation(), lag.angular_velocity()
    hat = sp.Matrix([[0, -omega[2], omega[1]], [omega[2], 0, -omega[0]], [-omega[1], omega[0], 0]])
    difference = R.applyfunc(lag.time_derivative) - R * hat
    assert difference.applyfunc(normal_form) == sp.zeros(3)


def test_kinetic_energy_is_the_books():
    book = A * (thetadot**2 + phidot**2 * sp.sin(theta) ** 2) / 2
    book += C * (psidot + phidot * sp.cos(theta)) ** 2 / 2
    assert zero(lag.kinetic_energy() - book)


def test_potential_energy_is_that_of_the_centre_of_mass():
    assert lag.potential_energy() == gMR * sp.cos(theta)


def test_phi_psi_and_time_are_cyclic():
    symbols = lag.lagrangian().free_symbols
    assert not symbols & {phi, psi, sp.Symbol("t")}
    assert theta in symbols


def test_kinetic_energy_is_homogeneous_of_degree_two_so_that_energy_is_T_plus_V():
    T = lag.kinetic_energy()
    euler = sum(v * sp.diff(T, v) for v in lag.VELOCITIES) - 2 * T
    assert zero(euler)
    assert zero(lag.energy() - T - lag.potential_energy())


def test_momenta_are_the_books():
    p_theta, p_phi, p_psi = lag.momenta()
    assert zero(p_theta - A * thetadot)
    assert zero(p_psi - C * (psidot + phidot * sp.cos(theta)))
    assert zero(p_phi - A * phidot * sp.sin(theta) ** 2 - p_psi * sp.cos(theta))


def test_accelerations_solve_the_lagrange_equations():
    solved = dict(zip(lag.ACCELERATIONS, lag.accelerations(), strict=True))
    for equation in lag.lagrange_equations():
        assert normal_form(sp.cancel(equation.subs(solved)) * sp.sin(theta)) == 0


def test_momenta_and_energy_are_conserved():
    solved = dict(zip(lag.ACCELERATIONS, lag.accelerations(), strict=True))
    for constant in (*lag.momenta()[1:], lag.energy()):
        rate = lag.time_derivative(constant).subs(solved)
        assert normal_form(sp.cancel(rate * sp.sin(theta))) == 0
