"""The witness's constants of the motion, against the Legendre transform of sympy's Lagrangian."""

import random

import pytest
import sympy as sp

from heavytop.analytic.closed_form import constants
from heavytop.equations import lagrangian as lag
from heavytop.numbers.decimals import context
from heavytop.scene.state import State
from heavytop.scene.top import Top

CTX = context(50)


@pytest.mark.parametrize("seed", range(6))
def test_constants_are_the_legendre_transform(seed):
    source = random.Random(seed)
    A, C, g = (sp.Rational(source.randint(1, 999), 500) for _ in range(3))
    C = min(C, 2 * A)
    theta, *rates = (sp.Rational(source.randint(-999, 999), 350) for _ in range(4))
    theta = abs(theta)
    values = dict(zip((lag.A, lag.C, lag.gMR, lag.theta), (A, C, g, theta), strict=True))
    values |= dict(zip(lag.VELOCITIES, rates, strict=True))
    _, p_phi, p_psi = lag.momenta()
    E = lag.energy()
    symbolic = {"E": E, "E_prime": E - p_psi**2 / (2 * lag.C), "p_phi": p_phi, "p_psi": p_psi}
    thetadot, phidot, psidot = map(str, rates)
    found = constants(
        Top(str(A), str(C), str(g)),
        State(str(theta), thetadot=thetadot, phidot=phidot, psidot=psidot),
        50,
    )
    for name, value in found.items():
        exact = CTX.mpf(str(symbolic[name].subs(values).evalf(60)))
        assert abs(value - exact) < CTX.mpf(10) ** -46, name
