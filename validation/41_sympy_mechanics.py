"""sympy.physics.mechanics: frames, a rigid body and Lagrange's method, without our symbols."""

from functools import cache

import numpy as np
import sympy as sp
import sympy.physics.mechanics as me
from tools import farthest, most

from heavytop.claims import Authority, claim
from heavytop.equations import lagrangian as ours
from heavytop.equations.lambdify import lambdify

SYMPY = Authority("sympy.physics.mechanics: Lagrange's method", "program")
NUMBERS = {"A": sp.Rational(13, 10), "C": sp.Rational(7, 10), "gMR": sp.Rational(21, 10)}
TOP = {getattr(ours, name): value for name, value in NUMBERS.items()}


@cache
def theirs():
    """Mass matrix and forcing as functions of angles and rates; gravity 1, arm 1/2."""
    theta, phi, psi = q = me.dynamicsymbols("theta phi psi")
    space, body = me.ReferenceFrame("N"), me.ReferenceFrame("B")
    body.orient(space, "Body", (phi, theta, psi), "ZXZ")
    arm = sp.Rational(1, 2)
    mass = NUMBERS["gMR"] / arm
    pivot, centre = me.Point("O"), me.Point("G")
    pivot.set_vel(space, 0)
    centre.set_pos(pivot, arm * body.z)
    centre.v2pt_theory(pivot, space, body)
    across = NUMBERS["A"] - mass * arm**2
    moments = me.inertia(body, across, across, NUMBERS["C"])
    solid = me.RigidBody("top", centre, body, mass, (moments, centre))
    energy = solid.kinetic_energy(space) - mass * centre.pos_from(pivot).dot(space.z)
    method = me.LagrangesMethod(energy, q)
    method.form_lagranges_equations()
    names = (*me.dynamicsymbols("theta phi psi", 1), *q)
    return tuple(sp.lambdify(names, m) for m in (method.mass_matrix, method.forcing))


def states(count=200):
    source = np.random.default_rng(5)
    angles = source.uniform([0.2, -3, -3], [2.9, 3, 3], (count, 3))
    return np.hstack([angles, source.uniform(-4, 4, (count, 3))])


@claim(SYMPY, 2e-13, "rounding of a solved mass matrix near the poles, some fifty times", "symbols")
def sympy_accelerations():
    """accelerations at 200 random states vs those of sympy's mechanics, relative to 1 + |x|."""
    symbols = (*ours.COORDINATES, *ours.VELOCITIES)
    mine = lambdify([x.subs(TOP) for x in ours.accelerations()], symbols)
    mass, forcing = theirs()
    worst = 0.0
    for state in states():
        swapped = (*state[3:], *state[:3])
        found = np.linalg.solve(mass(*swapped), np.ravel(forcing(*swapped)))
        size = 1 + np.abs(found)
        worst = most(worst, farthest(np.ravel(mine(*state)) / size, found / size))
    return worst
