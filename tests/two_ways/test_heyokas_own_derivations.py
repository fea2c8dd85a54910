"""Our equations of motion, against those heyoka derives from the same Lagrangian."""

import heyoka as hy
import numpy as np
import pytest
import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.lambdify import lambdified
from heavytop.integration.compiled import translated

A, C, gMR = 1.3, 0.7, 2.1
TOP = {lag.A: sp.Rational(13, 10), lag.C: sp.Rational(7, 10), lag.gMR: sp.Rational(21, 10)}
COORDINATES = hy.make_vars("theta", "phi", "psi")
VELOCITIES = hy.make_vars("thetadot", "phidot", "psidot")
MOMENTA = hy.make_vars("p_theta", "p_phi", "p_psi")
NAMES = {str(x): x for x in (*COORDINATES, *VELOCITIES)}
OURS = lambdified([a.subs(TOP) for a in lag.accelerations()], lag.COORDINATES + lag.VELOCITIES)
SOURCE = np.random.default_rng(11)


def states(count=200):
    angles = SOURCE.uniform([0.2, -3, -3], [2.9, 3, 3], (count, 3))
    return np.hstack([angles, SOURCE.uniform(-4, 4, (count, 3))]).T


def test_accelerations_are_those_heyoka_derives():
    [L] = translated([lag.lagrangian().subs(TOP)], NAMES)
    system = hy.lagrangian(L, COORDINATES, VELOCITIES)
    derived = hy.cfunc([rhs for _, rhs in system[3:]], [*COORDINATES, *VELOCITIES])
    at = np.ascontiguousarray(states())
    ours, theirs = np.array(OURS(*at)), derived(at)
    assert np.max(np.abs(ours - theirs) / (1 + np.abs(theirs))) < 1e-12


@pytest.mark.parametrize("time", [1.0, 5.0])
def test_a_run_of_heyokas_hamiltonian_ends_where_ours_does(time):
    """H from our Legendre transform; heyoka derives Hamilton's equations and integrates them."""
    p = sp.symbols("p_theta p_phi p_psi", real=True)
    momenta = lag.momenta()
    solved = sp.solve([m - x for m, x in zip(momenta, p, strict=True)], lag.VELOCITIES, dict=True)
    hamiltonian = lag.energy().subs(solved[0]).subs(TOP)
    names = {str(x): x for x in (*COORDINATES, *MOMENTA)}
    [H] = translated([hamiltonian], names)
    start = {
        lag.theta: 0.8,
        lag.phi: 0.1,
        lag.psi: -0.4,
        lag.thetadot: 0.6,
        lag.phidot: -0.5,
        lag.psidot: 4.0,
    }
    begin = [float(start[q]) for q in lag.COORDINATES]
    begin += [float(m.subs(TOP).subs(start)) for m in momenta]
    theirs = hy.taylor_adaptive(hy.hamiltonian(H, COORDINATES, MOMENTA), begin)
    theirs.propagate_until(time)
    rhs = translated([a.subs(TOP) for a in lag.accelerations()], NAMES)
    system = [*zip(COORDINATES, VELOCITIES, strict=True), *zip(VELOCITIES, rhs, strict=True)]
    ours = hy.taylor_adaptive(system, [float(v) for v in start.values()])
    ours.propagate_until(time)
    assert np.max(np.abs(ours.state[:3] - theirs.state[:3])) < 1e-12
