"""The effective potential of the tilt, against the Routhian's, and curves of constant energy."""

import numpy as np
import pytest
import sympy as sp

from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.classification.reduced import FromScene
from heavytop.equations import lagrangian as lag
from heavytop.numbers.decimals import context
from heavytop.scene.scene import load_scene, shipped_scenes
from heavytop.scene.state import State
from heavytop.scene.top import Top

BOOK = Top("3.28e-4", "6.60e-5", "0.0456")
HANGING = Top("3.28e-4", "6.60e-5", "-0.0456")
STARTS = {
    "loops": (BOOK, State(theta="0.1", phidot=-15, psidot=140)),
    "fast": (BOOK, State(theta="0.1", phidot=3, psidot=40000)),
    "near the top": (BOOK, State(theta="1e-7", thetadot=1, psidot=140)),
    "through the top": (BOOK, State(theta=0, thetadot=3, psidot=140)),
    "over an unstable top": (BOOK, State(theta=0, thetadot=3, psidot=60)),
    "through the bottom": (BOOK, State(theta="pi", thetadot=3, psidot=60)),
    "inverted": (HANGING, State(theta="2", phidot=5, psidot=60)),
    "inverted, over the bottom": (HANGING, State(theta="pi", thetadot=3, psidot=60)),
    "swinging": (BOOK, State(theta="2", thetadot=1)),
    "rotating": (BOOK, State(theta="2", thetadot=40)),
    "spherical pendulum": (BOOK, State(theta="2", phidot=4)),
    "force-free": (Top(2, 1, 0), State(theta="0.3", phidot=4, thetadot=2, psidot=30)),
}


def potential(top, start):
    return Potential(FromScene(top, start))


def inside():
    """A start below the separatrix: p_phi = p_psi exactly, theta swinging short of the top."""
    return State.from_constants(
        BOOK, E="0.0456 * 9/10 + 6.60e-5*60**2/2", p_phi="6.60e-5*60", p_psi="6.60e-5*60",
        theta="0.9", branch="falling",
    )  # fmt: skip


def test_is_the_routhians_at_random_points():
    rng = np.random.default_rng(20260101)
    routh = (lag.effective_potential() - lag.p_psi**2 / (2 * lag.C)) / lag.A
    momenta = dict(zip((lag.p_phi, lag.p_psi), lag.momenta()[1:], strict=True))
    worst = 0.0
    for _ in range(60):
        A, C = rng.uniform(0.5, 1.0, 2)
        gMR, phidot, psidot = rng.normal(0, 3, 3)
        start, theta = rng.uniform(0.01, 3.1), rng.choice([1e-8, 1e-4, 0.1, rng.uniform(0, 3.1)])
        top = Top(*map(float, (A, C, gMR)))
        motion = FromScene(top, State(float(start), phidot=float(phidot), psidot=float(psidot)))
        symbols = (lag.A, lag.C, lag.gMR, lag.phidot, lag.psidot)
        known = dict(zip(symbols, map(rational, (A, C, gMR, phidot, psidot)), strict=True))
        known_momenta = {
            p: m.subs(known | {lag.theta: rational(start)}) for p, m in momenta.items()
        }
        exact = routh.subs(known | known_momenta | {lag.theta: rational(theta)}).evalf(30)
        V = Potential(motion)
        plus, minus = map(abs, V.momenta)  # the sum is as good as its terms are large
        size = (plus * np.tan(theta / 2) + minus / np.tan(theta / 2)) ** 2 / 8 + abs(gMR / A)
        worst = max(worst, abs(float(V(theta)) - float(exact)) / size)
    assert worst < 2e-15


def rational(x):
    return sp.Rational(*float(x).as_integer_ratio())


def test_keeps_its_digits_at_the_top():
    # p_phi = p_psi (1 - 1e-14): one by one the momenta would leave two digits of the difference
    start = State(theta="1e-7", thetadot=1, psidot=140)
    r, ctx = Motion(BOOK, start).reduced, context(60)
    theta = ctx.mpf(3e-7)
    exact = (r.a - r.b * ctx.cos(theta)) ** 2 / (2 * ctx.sin(theta) ** 2) + r.g * ctx.cos(theta)
    assert float(potential(BOOK, start)(3e-7)) == pytest.approx(float(exact), rel=1e-15)
    assert float(exact - r.g) > 1e-13


@pytest.mark.parametrize("name", STARTS)
def test_the_curve_has_one_energy_and_the_turning_points(name):
    top, start = STARTS[name]
    V = potential(top, start)
    curve = V.curve(V.excess)
    energy = curve.speed**2 / 2 + V(curve.theta)
    h = float(V.h)
    scale = max(abs(h), abs(float(V.g)), V.excess)
    assert np.abs(energy - h).max() < 2e-12 * scale
    motion = Motion(top, start)
    assert curve.theta[0] == pytest.approx(motion.theta_min, rel=1e-12, abs=1e-14)
    assert curve.theta[-1] == pytest.approx(motion.theta_max, rel=1e-12)
    assert (np.diff(curve.theta) >= 0).all()


@pytest.mark.parametrize("name", STARTS)
def test_the_least_is_the_least(name):
    V = potential(*STARTS[name])
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


@pytest.mark.parametrize("theta", ["1e-160", "1e-200"])
def test_beside_a_pole_by_less_than_doubles_hold(theta):
    V = potential(BOOK, State(theta, thetadot=1, psidot=140))
    assert V.bottom < 1e-100
    assert V.curve(V.excess).speed.max() == pytest.approx(1, rel=1e-12)


def test_a_curve_of_another_energy_keeps_the_momenta():
    V = potential(*STARTS["loops"])
    low, high = V.curve(V.excess / 4), V.curve(4 * V.excess)
    assert high.theta[0] < low.theta[0] < low.theta[-1] < high.theta[-1]
    for curve, factor in ((low, 0.25), (high, 4.0)):
        energy = curve.speed**2 / 2 + V(curve.theta) - float(V.least)
        np.testing.assert_allclose(energy, factor * V.excess, rtol=1e-10)


def test_the_curve_runs_into_a_pole_that_is_passed():
    V = potential(*STARTS["through the top"])
    curve = V.curve(V.excess)
    assert curve.theta[0] == 0
    assert curve.speed[0] == pytest.approx(3, rel=1e-14)


class TestSeparatrix:
    @pytest.mark.parametrize("name", ["over an unstable top", "swinging", "rotating"])
    def test_has_the_energy_of_the_upright_top(self, name):
        V = potential(*STARTS[name])
        curve = V.separatrix()
        energy = curve.speed**2 / 2 + V(curve.theta)
        np.testing.assert_allclose(energy, float(V.g), rtol=1e-12)
        assert curve.theta[0] == 0 == curve.speed[0]

    def test_is_between_the_swinging_and_the_passing(self):
        V = potential(BOOK, inside())
        own, separatrix = V.curve(V.excess), V.separatrix()
        assert own.theta[0] > 0
        assert own.theta[-1] < separatrix.theta[-1]
        assert own.speed.max() < separatrix.speed.max()

    def test_of_an_inverted_top_leads_to_the_bottom(self):
        V = potential(*STARTS["inverted, over the bottom"])
        curve = V.separatrix()
        assert curve.theta[-1] == np.pi
        energy = curve.speed**2 / 2 + V(curve.theta)
        np.testing.assert_allclose(energy, -float(V.g), rtol=1e-12)

    def test_is_none_where_the_upright_top_is_just_stable(self):
        threshold = State(0, thetadot=3, omega3="2*sqrt(3.28e-4*0.0456)/6.60e-5")
        V = potential(BOOK, threshold)
        assert V.separatrix() is None
        assert V.bottom < 1e-7

    @pytest.mark.parametrize("name", ["loops", "through the top", "through the bottom", "inverted"])
    def test_is_none_where_nothing_tends_to_the_vertical(self, name):
        assert potential(*STARTS[name]).separatrix() is None


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_shipped_scene_has_a_potential(name):
    scene = load_scene(name)
    V = potential(scene.top, scene.start)
    assert 0 <= V.bottom <= np.pi
    motion = Motion(scene.top, scene.start)
    again = V.raised(V.excess)
    if motion.nutates and again is not None:
        tilts, exact = (map(float, form.tilts) for form in (ClosedForm(again), motion.exact))
        assert list(tilts) == pytest.approx(list(exact), rel=1e-12)
