"""What the pages of the exercises of SICM section 2.10 say and do not compute."""

import sympy as sp

import heavytop as ht
from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import A, C, gMR, normal_form, phidot, psidot, theta, thetadot
from heavytop.exact import Exact, sin
from heavytop.scene.solids import ALUMINIUM, STEEL, cone, ring, rod

Omega = sp.Symbol("Omega", real=True)
quadratic = A * sp.cos(theta) * Omega**2 - lag.p_psi * Omega + gMR


def test_kinetic_energies_of_parts_add_up_to_that_of_the_body():
    parts = [
        ring(outer="0.042", inner="0.0015", thickness="0.005", centre="0.0505", density=ALUMINIUM),
        rod(radius="0.0015", length="0.178", base=0, density=STEEL),
        cone(radius="0.01", apex="0.2", base="0.18", density=STEEL),
    ]
    start = ht.State(theta="pi/6", thetadot=2, phidot=-15, psidot=140)
    across = start.thetadot**2 + (start.phidot * sin(start.theta)) ** 2
    energy = Exact.of(0)
    for each in parts:
        A = each.A_cm + each.mass * each.centre**2
        energy += (A * across + each.C_cm * start.omega3**2) / 2
    top = ht.Top.from_solids(parts, gravity="9.80665")
    assert (energy - (top.A * across + top.C * start.omega3**2) / 2).sign() == 0


def test_steady_precession_from_torque():
    """Exercise 2.13 d: dL/dt - torque is the quadratic, along the line of nodes."""
    L = (lag.rotation() * sp.diag(A, A, C) * lag.angular_velocity()).applyfunc(normal_form)
    torque = lag.axis().cross(sp.Matrix([0, 0, -gMR]))
    still = {thetadot: 0, phidot: Omega} | dict.fromkeys(lag.ACCELERATIONS, 0)
    excess = (L.applyfunc(lag.time_derivative) - torque).subs(still)
    excess = excess.subs(psidot, lag.p_psi / C - Omega * sp.cos(theta))
    nodes = sp.Matrix([sp.cos(lag.phi), sp.sin(lag.phi), 0])
    expected = -quadratic * sp.sin(theta) * nodes
    assert (excess - expected).applyfunc(lambda x: normal_form(sp.expand(x))) == sp.zeros(3, 1)
