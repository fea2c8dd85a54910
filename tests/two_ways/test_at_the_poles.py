"""phi and psi through the poles, at them and close beside them, against the closed form."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht

ANGLES = ("theta", "phi", "psi")
LOW, HIGH = {3: "2*pi/3", -3: "pi/3"}, {3: "pi", -3: 0}  # where V is lower, and where lowest
PLANAR = {
    "swinging": lambda g: (LOW[g], "0.5"),
    "let go": lambda g: (LOW[g], 0),
    "turning over": lambda _: (2, 5),
    "turning over, the other way": lambda _: (2, -5),
    "over from the top": lambda _: (0, 5),
    "over from the bottom": lambda _: ("pi", -5),
    "up to the pole": lambda g: (LOW[g], "1.5*sqrt(2)"),
    "down, and up to the pole": lambda g: (LOW[g], "-1.5*sqrt(2)"),
    "up to the pole, from the other": lambda g: (HIGH[g], "sqrt(6)"),
}


def run(scene, formulation):
    """In doubles at rounding's mercy beside an unstable pole, of which auto may well speak."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ht.DoubtfulWarning)
        return ht.propagate(scene, formulation=formulation)


def off(trajectory, aside=1e-3):
    """The largest errors of phi and psi, away from passes; none may be nan anywhere."""
    scene, seen = trajectory.scene, trajectory.samples
    exact = ht.Motion(scene.top, scene.start).at(seen.t)
    away = np.sin(exact.theta) > aside * np.max(np.sin(exact.theta))
    for part in (seen.phi, seen.psi, seen.thetadot, seen.phidot, seen.psidot, seen.quaternion):
        assert np.isfinite(part).all()
    assert np.isfinite(trajectory.events.phi).all()
    errors = [np.abs(getattr(seen, x) - getattr(exact, x)) for x in ("phi", "psi")]
    assert max(error[0] for error in errors) < 1e-12  # on a pole too
    return max(float(error[away].max()) for error in errors)


@pytest.mark.parametrize("formulation", ["auto", "axis", "attitude"])
@pytest.mark.parametrize("time", [7, -7])
@pytest.mark.parametrize("g", [3, -3])
@pytest.mark.parametrize("name", PLANAR)
def test_planar_motions_turn_as_the_closed_form(name, g, time, formulation):
    assert_planar(name, g, time, formulation, digits=10)


def assert_planar(name, g, time, formulation, digits):
    theta, thetadot = PLANAR[name](g)
    start = ht.State(theta, phi="0.4", psi="-0.3", thetadot=thetadot)
    scene = ht.Scene(
        ht.Top(2, 1, g), start, time=time, quantities=ANGLES, samples=29, digits=digits
    )
    if formulation == "axis" and "over" in name:
        with pytest.raises(ht.BadScene, match="through both poles; the attitude form does"):
            ht.propagate(scene, formulation=formulation)
        return
    assert off(run(scene, formulation)) < 1e-9


@pytest.mark.parametrize("name", ["swinging", "over from the bottom", "up to the pole"])
def test_planar_motions_in_long_doubles_turn_as_the_closed_form(name):
    assert_planar(name, 3, 7, "attitude", digits=15)


@pytest.mark.parametrize("digits", [10, 15, 20])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize(
    ("theta", "time", "thetadot", "g"), [(0, 6, 1, 1), ("pi", 6, -1, -1), (0, -6, -1, -1)]
)
def test_a_start_on_a_pole_has_its_angles(theta, time, thetadot, g, formulation, digits):
    """Long doubles had nan there, and at every pass: phi is that of the side it leaves to."""
    start = ht.State(theta, thetadot=thetadot, phi=7, psi=1, psidot=1)
    scene = ht.Scene(
        ht.Top("0.5", "0.1", g), start, time=time, quantities=ANGLES, samples=15, digits=digits
    )
    assert off(run(scene, formulation)) < 1e-9


@pytest.mark.parametrize("digits", [10, 17])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("theta", [0, "pi"])
def test_an_axis_that_stays_on_a_pole_has_its_angles(theta, formulation, digits):
    start = ht.State(theta, phi=7, psi=1, psidot=3)
    scene = ht.Scene(
        ht.Top(1, "0.5", -1), start, time=4, quantities=ANGLES, samples=3, digits=digits
    )
    seen = run(scene, formulation).samples
    assert np.max(np.abs(seen.phi - 7)) < 1e-15
    assert np.max(np.abs(seen.psi - 1 - 3 * seen.t)) < 1e-14
    assert np.isfinite(seen.quaternion).all()


@pytest.mark.parametrize("digits", [10, 17])
@pytest.mark.parametrize("theta", [0, "pi"])
def test_the_cubic_form_has_rates_on_a_pole(theta, digits):
    start = ht.State(theta, thetadot=-2, psidot=3)
    scene = ht.Scene(ht.Top(1, "0.5", -1), start, time=1, quantities=("theta",), digits=digits)
    seen = ht.propagate(scene, formulation="cubic").samples.at(0)
    axis = ht.propagate(scene, formulation="axis").samples.at(0)
    limit = (1 if theta == 0 else -1) * 0.5 * 3 / 2  # +- p_psi/2A
    assert abs(seen.phidot - limit) < 1e-15
    for name in ("thetadot", "phidot", "psidot"):
        assert abs(getattr(seen, name) - getattr(axis, name)) < 1e-15


@pytest.mark.parametrize("digits", [10, 15])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("tilt", ["1e-6", "1e-9", "1e-13"])
def test_a_motion_that_stays_close_to_a_pole_turns_as_the_closed_form(tilt, formulation, digits):
    """All of it closer than a state that came from afar is known; this one has its digits."""
    for pole, g in (("", -1), ("pi-", 1)):
        start = ht.State(f"{pole}{tilt}", phidot=3, psidot=2 if g < 0 else -2)
        scene = ht.Scene(
            ht.Top(1, 2, g), start, time=5, quantities=ANGLES, samples=15, digits=digits
        )
        assert off(run(scene, formulation), aside=0) < max(1e-9, 1e-16 / float(tilt))


def test_whole_turns_are_errors_through_a_pole_too():
    start = ht.State(2, thetadot=5, phi="0.4")
    scene = ht.Scene(ht.Top(2, 1, 3), start, time=3, quantities=ANGLES)
    good = ht.propagate(scene)
    assert max(ht.run_errors(good).phi, ht.run_errors(good).psi) < 1e-11
    rows = good.orbit.samples.states.copy()
    rows[200:, -2] += 2 * np.pi
    rows[200:, -1] -= 2 * np.pi
    orbit = replace(good.orbit, samples=good.orbit.samples._replace(states=rows))
    errors = ht.run_errors(replace(good, orbit=orbit))
    assert abs(errors.phi - 2 * np.pi) < 1e-9
    assert abs(errors.psi - 2 * np.pi) < 1e-9


def test_a_state_that_knows_its_pass_is_believed():
    """1e-15 rad beside the top straight from the start, on the side where phi turns by over pi."""
    start = ht.State("1.96888879e-8", thetadot="-4.736e-3", phidot="-1.521e-2", psidot="7.04e-4")
    scene = ht.Scene(
        ht.Top(1, "0.673876", "2.137209e-3"), start, time=318, quantities=ANGLES, samples=12
    )
    for formulation in ("axis", "attitude"):
        assert off(run(scene, formulation)) < 1e-9
