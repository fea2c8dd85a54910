"""sympy.physics.mechanics: frames, a rigid body and Lagrange's method, without our symbols."""

from functools import cache

import numpy as np
import sympy as sp
from sympy.physics.mechanics import (
    LagrangesMethod,
    Point,
    ReferenceFrame,
    RigidBody,
    dynamicsymbols,
    inertia,
)
from tools import most

from heavytop.claims import Authority, claim
from heavytop.equations import lagrangian as ours
from heavytop.equations.lambdify import lambdified

SYMPY = Authority("sympy.physics.mechanics: Lagrange's method", "program")
NUMBERS = {"A": sp.Rational(13, 10), "C": sp.Rational(7, 10), "gMR": sp.Rational(21, 10)}
TOP = {getattr(ours, name): value for name, value in NUMBERS.items()}


@cache
def theirs():
    """Mass matrix and forcing as functions of angles and rates; gravity 1, arm 1/2."""
    q = dynamicsymbols("theta phi psi")
    qd = dynamicsymbols("theta phi psi", 1)
    theta, phi, psi = q
    space, body = ReferenceFrame("N"), ReferenceFrame("B")
    body.orient(space, "Body", (phi, theta, psi), "ZXZ")
    arm = sp.Rational(1, 2)
    mass = NUMBERS["gMR"] / arm
    pivot, centre = Point("O"), Point("G")
    pivot.set_vel(space, 0)
    centre.set_pos(pivot, arm * body.z)
    centre.v2pt_theory(pivot, space, body)
    across = NUMBERS["A"] - mass * arm**2
    moments = inertia(body, across, across, NUMBERS["C"])
    solid = RigidBody("top", centre, body, mass, (moments, centre))
    energy = solid.kinetic_energy(space) - mass * centre.pos_from(pivot).dot(space.z)
    method = LagrangesMethod(energy, q)
    method.form_lagranges_equations()
    names = sp.symbols("x:3 v:3")
    swap = dict(zip(qd, names[3:], strict=True)), dict(zip(q, names[:3], strict=True))
    matrices = (method.mass_matrix.subs(d).subs(c) for d, c in [swap])
    forcing = method.forcing.subs(swap[0]).subs(swap[1])
    return tuple(sp.lambdify(names, m, "numpy") for m in (*matrices, forcing))


def states(count=200):
    source = np.random.default_rng(5)
    angles = source.uniform([0.2, -3, -3], [2.9, 3, 3], (count, 3))
    return np.hstack([angles, source.uniform(-4, 4, (count, 3))])


@claim(
    "sympy-accelerations",
    SYMPY,
    2e-13,
    "rounding of a solved mass matrix near the poles, some fifty times",
    "symbols",
)
def sympy_accelerations():
    """accelerations at 200 random states vs those of sympy's mechanics, relative to 1 + |x|."""
    symbols = (*ours.COORDINATES, *ours.VELOCITIES)
    mine = lambdified([x.subs(TOP) for x in ours.accelerations()], symbols)
    mass, forcing = theirs()
    worst = 0.0
    for state in states():
        found = np.linalg.solve(mass(*state), np.ravel(forcing(*state)))
        off = np.abs(np.ravel(mine(*state)) - found) / (1 + np.abs(found))
        worst = most(worst, float(np.max(off)))
    return worst
