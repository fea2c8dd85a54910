"""The effective potential against the Routhian's, its curves, and times by quadrature."""

import numpy as np
import pytest
import sympy as sp

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential, quadrature_period, quadrature_time
from heavytop.classification.reduced import FromScene
from heavytop.equations import lagrangian as lag
from heavytop.errors import NoClosedForm
from heavytop.scene.state import State
from heavytop.scene.top import Top

from ..motions import BOOK, INVERTED, KICKED, WEIGHTLESS, motion, named

STARTS = {
    "loops": (BOOK, KICKED),
    "fast": (BOOK, State(theta="0.1", phidot=3, psidot=40000)),
    "near the top": (BOOK, State(theta="1e-7", thetadot=1, psidot=140)),
    "through the top": (BOOK, State(theta=0, thetadot=3, psidot=140)),
    "over an unstable top": (BOOK, State(theta=0, thetadot=3, psidot=60)),
    "through the bottom": (BOOK, State(theta="pi", thetadot=3, psidot=60)),
    "inverted": (INVERTED, State(theta="2", phidot=5, psidot=60)),
    "inverted, over the bottom": (INVERTED, State(theta="pi", thetadot=3, psidot=60)),
    "swinging": (BOOK, State(theta="2", thetadot=1)),
    "rotating": (BOOK, State(theta="2", thetadot=40)),
    "spherical pendulum": (BOOK, State(theta="2", phidot=4)),
    "force-free": (WEIGHTLESS, State(theta="0.3", phidot=4, thetadot=2, psidot=30)),
}


def potential(top, start):
    return Potential(FromScene(top, start))


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


@pytest.mark.parametrize("name", STARTS)
def test_the_curve_has_one_energy_and_the_turning_points(name):
    top, start = STARTS[name]
    V, motion = potential(top, start), Motion(top, start)
    curve = V.curve(V.excess)
    energy = curve.speed**2 / 2 + V(curve.theta)
    scale = max(abs(float(V.h)), abs(float(V.g)), V.excess)
    assert np.abs(energy - float(V.h)).max() < 2e-12 * scale
    assert curve.theta[0] == pytest.approx(motion.theta_min, rel=1e-12, abs=1e-14)
    assert curve.theta[-1] == pytest.approx(motion.theta_max, rel=1e-12)
    assert (np.diff(curve.theta) >= 0).all()
    around = np.clip(V.bottom + np.linspace(-1, 1, 2001) * 0.01, 1e-12, np.pi - 1e-12)
    assert float(V.least) <= V(around).min() + 1e-13 * abs(V(around)).max()
    assert V.excess > 0
    assert V.curve(0.0) is None


G, B60, B140 = 0.0456 / 3.28e-4, 6.60e-5 * 60 / 3.28e-4, 6.60e-5 * 140 / 3.28e-4


@pytest.mark.parametrize(
    ("name", "tilt"),
    [
        ("through the top", 0.0),
        ("swinging", np.pi),
        ("over an unstable top", np.arccos(B60 / np.sqrt(G) - 1)),
        ("inverted, over the bottom", np.pi - np.arccos(B60 / np.sqrt(G) - 1)),
        ("near the top", 1e-7 * np.sqrt(B140 / np.sqrt(B140**2 - 4 * G))),
    ],
)
def test_the_lowest_tilt(name, tilt):
    """A pole where the axis can stay on it; at P₋ = 0, b² < 4g the steady tilt of Ω = √g.

    Beside a stable top 1 − cosθ is |P₋|/√(b² − 4g), here with P₋ = −½ b θ₀², θ₀ = 1e-7.
    """
    assert potential(*STARTS[name]).bottom == pytest.approx(tilt, rel=1e-13, abs=0)


@pytest.mark.parametrize(
    "name", ["over an unstable top", "swinging", "rotating", "inverted, over the bottom"]
)
def test_the_separatrix_has_the_energy_of_the_upright_top(name):
    V = potential(*STARTS[name])
    curve, end = V.separatrix(), -1 if "inverted" in name else 0
    energy = curve.speed**2 / 2 + V(curve.theta)
    np.testing.assert_allclose(energy, abs(float(V.g)), rtol=1e-12)
    assert (curve.theta[end], curve.speed[end]) == (np.pi if end else 0, 0)


def test_there_is_no_separatrix_where_nothing_tends_to_the_vertical():
    V = potential(BOOK, State(0, thetadot=3, omega3="2*sqrt(3.28e-4*0.0456)/6.60e-5"))
    assert V.separatrix() is None
    assert V.bottom < 1e-7
    for name in ("loops", "through the top", "through the bottom", "inverted"):
        assert potential(*STARTS[name]).separatrix() is None


# --- plain quadrature of u̇² = f(u): two ways to the same times ----------------------------------

NEAR = (2, 1, 2, "pi/3", 0, 0, 0, "2/sqrt(3)", "5/sqrt(3) + 1e-24")  # 1 − m = 1e-24
TIMED = ("kicked", "rising", "hanging upside down", "planar swing", "near a separatrix")


@pytest.mark.parametrize("name", TIMED)
def test_quadrature(name):
    """T is that of K(m) to 48 digits; t(θ) from u₁ that of θ(t), to 38."""
    known = motion(*NEAR) if name == "near a separatrix" else named(name)
    form = known.form(60)
    ctx = form.ctx
    assert abs(ctx.mpf(quadrature_period(known.rising)) / form.period - 1) < 1e-48
    for part in ("0.07", "0.31"):
        age = ctx.mpf(part) * form.period
        theta = form(age + form.lower_turning).theta
        assert abs(ctx.mpf(quadrature_time(known.rising, theta, 50)) / age - 1) < 1e-38
        at = known.at(float(age + form.lower_turning))
        # where θ̇ is small, rounding of θ matters
        slack = 1e-14 * (age + known.period + 1 / abs(at.thetadot))
        assert abs(float(quadrature_time(known.rising, float(at.theta))) - age) < slack


def test_what_does_not_nutate_has_no_period():
    with pytest.raises(NoClosedForm, match="no nutation"):
        quadrature_period(named("sleeping").rising)
