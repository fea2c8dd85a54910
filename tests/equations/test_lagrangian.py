"""The Lagrangian built from the rotation matrix, against what the book and heyoka derive."""

import heyoka as hy
import numpy as np
import pytest
import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import A, C, gMR, normal_form, theta
from heavytop.equations.lambdify import lambdified
from heavytop.integration.system import translated

SOLVED = dict(zip(lag.ACCELERATIONS, lag.accelerations(), strict=True))
T = lag.kinetic_energy()
IDENTITIES = {  # each vanishes; ``test_derivation.py`` has what the book has
    "the kinetic energy is of degree two in the velocities": (
        sum(v * sp.diff(T, v) for v in lag.VELOCITIES) - 2 * T
    ),
    "accelerations solve the Lagrange equations": sum(
        sp.Symbol(f"k_{i}") * sp.cancel(x.subs(SOLVED)) * sp.sin(theta)
        for i, x in enumerate(lag.lagrange_equations())
    ),
    "momenta and energy are conserved": sum(
        sp.Symbol(f"k_{i}") * sp.cancel(lag.time_derivative(x).subs(SOLVED) * sp.sin(theta))
        for i, x in enumerate((*lag.momenta()[1:], lag.energy()))
    ),
}


@pytest.mark.parametrize("name", IDENTITIES)
def test_identities(name):
    assert normal_form(sp.expand(IDENTITIES[name])) == 0


def test_the_rotation_is_orthogonal_and_the_angular_velocity_generates_it():
    R, omega = lag.rotation(), lag.angular_velocity()
    assert (R.T * R).applyfunc(normal_form) == sp.eye(3)
    difference = R.applyfunc(lag.time_derivative) - R * omega.hat()
    assert difference.applyfunc(normal_form) == sp.zeros(3)


# --- what heyoka derives from the same Lagrangian ------------------------------------------------

TOP = {A: sp.Rational(13, 10), C: sp.Rational(7, 10), gMR: sp.Rational(21, 10)}
COORDINATES = hy.make_vars("theta", "phi", "psi")
VELOCITIES = hy.make_vars("thetadot", "phidot", "psidot")
NAMES = {str(x): x for x in (*COORDINATES, *VELOCITIES)}


def test_accelerations_are_those_heyoka_derives():
    [L] = translated([lag.lagrangian().subs(TOP)], NAMES)
    system = hy.lagrangian(L, COORDINATES, VELOCITIES)
    derived = hy.cfunc([rhs for _, rhs in system[3:]], [*COORDINATES, *VELOCITIES])
    source = np.random.default_rng(11)
    angles = source.uniform([0.2, -3, -3], [2.9, 3, 3], (200, 3))
    at = np.ascontiguousarray(np.hstack([angles, source.uniform(-4, 4, (200, 3))]).T)
    own = [a.subs(TOP) for a in lag.accelerations()]
    ours, theirs = np.array(lambdified(own, lag.COORDINATES + lag.VELOCITIES)(*at)), derived(at)
    assert np.max(np.abs(ours - theirs) / (1 + np.abs(theirs))) < 1e-12


def test_a_run_of_heyokas_hamiltonian_ends_where_ours_does():
    """H from our Legendre transform; heyoka derives Hamilton's equations and integrates them."""
    p = sp.symbols("p_theta p_phi p_psi", real=True)
    momenta = hy.make_vars(*map(str, p))
    definitions = [m - x for m, x in zip(lag.momenta(), p, strict=True)]
    [solved] = sp.solve(definitions, lag.VELOCITIES, dict=True)
    names = {str(x): x for x in (*COORDINATES, *momenta)}
    [H] = translated([lag.energy().subs(solved).subs(TOP)], names)
    begin = [0.8, 0.1, -0.4, 0.6, -0.5, 4.0]
    start = dict(zip(lag.COORDINATES + lag.VELOCITIES, begin, strict=True))
    rhs = translated([a.subs(TOP) for a in lag.accelerations()], NAMES)
    system = [*zip(COORDINATES, VELOCITIES, strict=True), *zip(VELOCITIES, rhs, strict=True)]
    moved = begin[:3] + [float(m.subs(TOP).subs(start)) for m in lag.momenta()]
    theirs = hy.taylor_adaptive(hy.hamiltonian(H, COORDINATES, momenta), moved)
    ours = hy.taylor_adaptive(system, begin)
    for time in (1.0, 5.0):
        ours.propagate_until(time)
        theirs.propagate_until(time)
        assert np.max(np.abs(ours.state[:3] - theirs.state[:3])) < 1e-12
