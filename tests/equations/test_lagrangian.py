"""The Lagrangian built from the rotation matrix, against what the book and heyoka derive."""

import heyoka as hy
import numpy as np
import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import A, C, gMR, normal_form
from heavytop.equations.lambdify import lambdified
from heavytop.integration.system import translated


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
