"""The effective potential against the Routhian's, and where its separatrix is."""

import numpy as np
import pytest
import sympy as sp

from heavytop import Motion, State, Top
from heavytop.analytic.potential import Potential
from heavytop.equations import lagrangian as lag

from ..motions import BOOK, INVERTED


def potential(top, start):
    return Potential(Motion(top, start))


def test_is_the_routhians_at_random_points():
    rng = np.random.default_rng(20260101)
    routh = (lag.effective_potential() - lag.p_psi**2 / (2 * lag.C)) / lag.A
    momenta = dict(zip((lag.p_phi, lag.p_psi), lag.momenta()[1:], strict=True))
    symbols = (lag.A, lag.C, lag.gMR, lag.phidot, lag.psidot)
    for _ in range(60):
        numbers = [*rng.uniform(0.5, 1.0, 2).tolist(), *rng.normal(0, 3, 3).tolist()]
        A, C, gMR, phidot, psidot = numbers
        start, theta = rng.uniform(0.01, 3.1), rng.choice([1e-8, 1e-4, 0.1, rng.uniform(0, 3.1)])
        V = potential(Top(A, C, gMR), State(float(start), phidot=phidot, psidot=psidot))
        known = dict(zip(symbols, map(sp.Rational, numbers), strict=True))
        at_start = known | {lag.theta: sp.Rational(start)}
        kept = {p: momentum.subs(at_start) for p, momentum in momenta.items()}
        exact = routh.subs(known | kept | {lag.theta: sp.Rational(theta)}).evalf(30)
        plus, minus = map(abs, V.momenta)  # the sum is as good as its terms are large
        size = (plus * np.tan(theta / 2) + minus / np.tan(theta / 2)) ** 2 / 8 + abs(gMR / A)
        assert abs(float(V(theta)) - float(exact)) < 2e-15 * size


@pytest.mark.parametrize(("name", "numbers"), {
    "over an unstable top": (BOOK, State(theta=0, thetadot=3, psidot=60)),
    "inverted, over the bottom": (INVERTED, State(theta="pi", thetadot=3, psidot=60)),
    "swinging": (BOOK, State(theta="2", thetadot=1)),
    "rotating": (BOOK, State(theta="2", thetadot=40)),
}.items())  # fmt: skip
def test_the_separatrix_has_the_energy_of_the_upright_top(name, numbers):
    V, inverted = potential(*numbers), "inverted" in name
    upright, turn = V.separatrix[inverted], V.separatrix[not inverted]
    assert upright == (np.pi if inverted else 0)
    ends = [upright] if V.momenta == (0, 0) else [upright, turn]  # a pendulum turns nowhere
    np.testing.assert_allclose(V(ends), abs(V.g), rtol=1e-12)
