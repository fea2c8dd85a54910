"""SICM, section 2.10: "the top spins faster when it is more vertical", by a run."""

import numpy as np
import pytest

import heavytop as ht


def falling(name):
    """Return the motion of a scene from a highest to a next lowest place of the axis."""
    trajectory = ht.propagate(ht.load_scene(name))
    kinds = trajectory.events.kind
    start = kinds.index("theta_min")
    end = kinds.index("theta_max", start)
    low, high = trajectory.events.t[[start, end]]
    return trajectory(np.linspace(low, high, 2001))


@pytest.fixture(scope="module")
def kicked():
    return falling("sicm-kicked")


def test_the_spin_rate_decreases_with_the_tilt(kicked):
    assert (np.diff(kicked.theta) > 0).all()
    assert (np.diff(kicked.psidot) < 0).all()
    assert kicked.psidot[0] == pytest.approx(140, abs=1e-9)


def test_to_just_short_of_the_tilt_where_it_would_turn(kicked):
    # psidot = omega3 - u (p_phi - p_psi u)/(A (1 - u^2)) is least where
    # p_phi u^2 - 2 p_psi u + p_phi = 0
    scene = ht.load_scene("sicm-kicked")
    constants = ht.Motion(scene.top, scene.start).constants.floats
    p_phi, p_psi = constants["p_phi"], constants["p_psi"]
    least = np.arccos((p_psi - np.sqrt(p_psi**2 - p_phi**2)) / p_phi)
    assert kicked.theta[-1] < least < kicked.theta[-1] + 0.02


def test_not_every_top_does():
    # kicked forwards across the axis, the precession near the vertical takes the spin away
    forward = falling("sicm-forward")
    assert (np.diff(forward.psidot)[:1000] > 0).all()
