"""The exercises of SICM section 2.10, each answered two ways that have to agree."""

import numpy as np
import pytest
import sympy as sp

import heavytop as ht
from heavytop.equations import lagrangian as lag
from heavytop.equations.lagrangian import A, C, gMR, normal_form, phidot, psidot, theta, thetadot
from heavytop.exact import Exact, sin
from heavytop.scene.solids import ALUMINIUM, STEEL, cone, ring, rod

from ..motions import BOOK

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


def test_range_and_period_of_figure_2_5():
    """Exact values at 50 digits, by another program."""
    events = ht.propagate(ht.load_scene("sicm-kicked")).events
    highest = np.array(events.kind) == "theta_min"
    assert max(events.theta) == pytest.approx(0.51723131823843479801, abs=1e-14)
    assert np.diff(events.t[highest]) == pytest.approx(0.54289551818821995785, abs=1e-13)


def test_steady_precession_from_the_effective_potential():
    """Exercise 2.13 a and b: with p_phi of a precession Omega, theta'' is the quadratic."""
    p_phi = A * Omega * sp.sin(theta) ** 2 + lag.p_psi * sp.cos(theta)
    precession, _ = lag.cyclic_velocities()
    assert sp.simplify(precession.subs(lag.p_phi, p_phi) - Omega) == 0
    force = A * lag.nutation_acceleration().subs(lag.p_phi, p_phi)
    assert sp.simplify(force - quadratic * sp.sin(theta)) == 0


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


@pytest.mark.parametrize("which", ["slow", "fast"])
@pytest.mark.parametrize("theta0", ["0.1", "1", "2.5"])
def test_steady_precession_by_integration(which, theta0):
    """Exercise 2.13 e, at the rates that solve the quadratic."""
    for omega3 in (120, 300, 2000):
        start = ht.State.steady(BOOK, theta0, omega3, which)
        found = ht.propagate(ht.Scene(BOOK, start, time=1, events=(), samples=2))
        rate = float(start.phidot)
        values = {A: 3.28e-4, gMR: 0.0456, theta: float(theta0), lag.p_psi: 6.6e-5 * omega3}
        assert abs(quadratic.subs(values | {Omega: rate})) < 1e-15 * (
            1 + 6.6e-5 * abs(omega3 * rate)
        )
        assert found.phi[-1] == pytest.approx(rate, rel=1e-12)
        assert found.theta[-1] == pytest.approx(float(theta0), abs=1e-12)
