"""Motion: what a user asks of one top and one start."""

from fractions import Fraction

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.classification.classify import classify
from heavytop.errors import NoClosedForm
from heavytop.scene.state import State
from heavytop.scene.top import Top

SICM = Top("3.28e-4", "6.60e-5", "0.0456")


def test_the_kicked_top_of_the_book():
    """SICM §2.10, φ̇₀ = −15: kind, range, period, precession, and the state at t = 2."""
    motion = Motion(SICM, State("0.1", phidot=-15, psidot=140))
    assert motion.kind == "loops"
    assert motion.nutates
    assert motion.theta_min == 0.1
    assert motion.theta_max == pytest.approx(0.51723131823843479801, rel=1e-15)
    assert motion.from_top == 0.1
    assert motion.from_bottom == pytest.approx(np.pi - motion.theta_max, rel=1e-15)
    assert motion.period == pytest.approx(0.54289551818821995785, rel=1e-15)
    assert motion.precession == pytest.approx(3.9741816546440002896, rel=1e-15)
    at = motion.at(2.0)
    assert float(at.theta) == pytest.approx(0.42694370530965690245, abs=2e-16)
    assert float(at.phi) == pytest.approx(15.116964095456707822, abs=4e-15)
    assert float(at.psi) == pytest.approx(236.55741389988304583, abs=6e-14)


def test_digits_and_many_times():
    """at(t, digits) gives numbers; many times a tuple; without digits arrays."""
    motion = Motion(SICM, State("0.1", phidot=-15, psidot=140))
    one = motion.at(2, digits=40)
    assert abs(one.theta - motion.form(60)(2).theta) < 1e-40
    many = motion.at([Fraction(1, 3), 2], digits=40)
    assert many[1].phi == one.phi
    assert motion.at([0.0, 1.0, 2.0]).theta.shape == (3,)
    assert float(motion.at([0.0, 1.0, 2.0]).theta[2]) == pytest.approx(float(one.theta), abs=1e-16)


def test_constants_have_names():
    motion = Motion(SICM, State("0.1", phidot=-15, psidot=140))
    floats = motion.constants.floats
    assert set(floats) == {"E", "E_prime", "p_phi", "p_psi"}
    assert floats == {name: float(value) for name, value in motion.constants.items()}
    assert floats["E"] - floats["E_prime"] == pytest.approx(floats["p_psi"] ** 2 / 2 / 6.6e-5)


def test_where_nothing_nutates():
    """A sleeping top has no period and no roots, one angle, and a closed form all the same."""
    motion = Motion(SICM, State(0, psidot=140))
    assert motion.kind == "sleeping"
    assert not motion.nutates
    assert motion.period is motion.precession is motion.spin is motion.roots is None
    assert motion.theta_min == motion.theta_max == 0
    assert float(motion.at(3.0).psi) == 420.0
    assert float(motion.at(3.0).phi) == 0.0


def test_steady_precession():
    """Both steady rates at θ = 0.1, ω3 = 140: 6.3668390938832 and 21.945335558617 rad/s."""
    for which, rate in (("slow", 6.3668390938832), ("fast", 21.945335558617)):
        start = State.steady(SICM, "0.1", 140, which)
        motion = Motion(SICM, start)
        assert motion.kind == "uniform-precession"
        assert which in motion.tags
        assert float(motion.at(1.0).phidot) == pytest.approx(rate, rel=1e-13)
        assert float(motion.at(1.0).theta) == pytest.approx(0.1, rel=1e-15)


@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
def test_mean_rates(gMR):
    """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ from the rates over one period."""
    motion = Motion(
        Top("3.28e-4", "6.6e-5", gMR), State("1.1", thetadot="0.3", phidot=3, psidot=70)
    )
    at = motion.at(np.arange(1024) / 1024 * motion.period)
    kappa = float(motion.reduced.kappa)
    sigma, delta = np.mean(at.phidot + at.psidot), np.mean(at.phidot - at.psidot)
    assert motion.mean_rate("sigma") == pytest.approx(sigma - kappa, rel=1e-12)
    assert motion.mean_rate("delta") == pytest.approx(delta + kappa, rel=1e-12)
    with pytest.raises(ValueError, match="sigma or delta"):
        motion.mean_rate("rho")


def test_inverted_gravity_is_the_mirrored_top():
    """gMR → −gMR with θ → π − θ, ψ̇ → −ψ̇: the same φ, and θ and ψ mirrored."""
    up = Motion(SICM, State("0.1", thetadot="0.5", phidot=-15, psidot=140))
    down = Motion(
        Top("3.28e-4", "6.60e-5", "-0.0456"),
        State("pi - 0.1", thetadot="-0.5", phidot=-15, psidot=-140),
    )
    t = np.linspace(-1, 2, 50)
    one, other = up.at(t), down.at(t)
    np.testing.assert_allclose(other.theta, np.pi - one.theta, rtol=0, atol=1e-15)
    np.testing.assert_allclose(other.phi, one.phi, rtol=1e-15)
    np.testing.assert_allclose(other.psi, -one.psi, rtol=1e-15)
    assert down.theta_max == pytest.approx(np.pi - up.theta_min, rel=1e-15)
    assert down.roots is not None
    assert down.roots[1:] == pytest.approx([-r for r in up.roots[1::-1]], rel=1e-15)
    assert "inverted-gravity" in down.tags


def test_classify_is_the_kind_of_the_motion():
    start = State("0.1", psidot=140)
    assert classify(SICM, start) == Motion(SICM, start).verdict
    assert classify(SICM, start).kind == "cusps"
    assert "spherical-top" in classify(Top(1, 1, 1), State(1, phidot=1)).tags


def test_where_the_digits_end_it_says_so():
    motion = Motion(SICM, State(theta="0.1", phidot=-15, psidot=140))
    for late in (1e19, "1e20", "1e40"):
        assert abs(motion.at(late, digits=20).theta - motion.form(50)(late).theta) < 1e-20
    with pytest.raises(NoClosedForm, match="ask for digits"):
        motion.at(1e10)


@pytest.mark.parametrize("digits", [0, -100, 10_001, 2.5, "20"])
def test_absurd_digits_are_refused(digits):
    motion = Motion(SICM, State(theta="0.1", psidot=140))
    with pytest.raises(ValueError, match="digits: a whole number from 1 to 10000"):
        motion.at(1, digits=digits)
