"""The shipped scenes that others published or solved, against values from outside the package."""

import numpy as np
import pytest
from mpmath import mp

import heavytop as ht
from heavytop.scene.scene import shipped_scenes

NAMES = ("simo-wong", "steady-betsch", "spherical-pendulum", "separatrix")


def test_they_ship():
    assert set(NAMES) <= shipped_scenes().keys()


def near(found, exact, bound=1e-12):
    return abs(found - exact) <= bound * max(1, abs(exact))


SIMO_WONG = {
    "0.05": {
        "theta_max": 0.054551690224341661691,
        "period": 0.6854584972896153183,
        "end": (0.054220099402661058193, 4.1961910407406375175, 495.80979342433535177),
    },
    "0.3": {
        "theta_max": 0.32673371464485402109,
        "period": 0.68225601583118194041,
        "end": (0.32090876129521087044, 4.1996398174746437151, 496.01365314730270421),
    },
}


@pytest.mark.parametrize("tilt", SIMO_WONG)
def test_simo_wong_at_ten_seconds(tilt):
    """Simo & Wong 1991 and Krysl 2005; both tilts are in use.

    Exact values: the closed form of the decimal parameters at 50 digits, by another program,
    cross-checked there against a 133-bit integration.
    """
    exact = SIMO_WONG[tilt]
    scene = ht.load_scene("simo-wong", [f"start.theta={tilt}"])
    motion = ht.Motion(scene.top, scene.start)
    assert near(motion.theta_max, exact["theta_max"], 1e-15)
    assert near(motion.period, exact["period"], 1e-15)
    end = ht.propagate(scene)([10.0])
    found = (end.theta[0], end.phi[0], end.psi[0])
    assert all(map(near, found, exact["end"]))


def test_the_energy_of_simo_wong_is_the_published_one():
    """Solfec's validation page prints H = 1269.975; 1269.9750052078993249 at 20 digits."""
    scene = ht.load_scene("simo-wong")
    energy = ht.Motion(scene.top, scene.start).constants.floats["E"]
    assert near(energy, 1269.9750052078993249, 1e-15)


def test_the_cone_of_betsch_precesses_steadily():
    """Betsch & Steinmann 2002: precession 10 rad/s and spin 135.6 rad/s at theta = pi/3.

    The other steady rate of the same p_psi is 23.082352941176471 rad/s (50 digits, by another
    program).
    """
    scene = ht.load_scene("steady-betsch")
    assert (scene.start.phidot, scene.start.psidot.fraction) == (10, ht.Exact.of("135.6").fraction)
    motion = ht.Motion(scene.top, scene.start)
    assert (motion.kind, motion.tags) == ("uniform-precession", ("slow", "closed-orbit"))
    end = ht.propagate(scene)([2.0])
    other = ht.State.steady(scene.top, "pi/3", "140.6", "fast").phidot
    assert near(float(other), 23.082352941176471, 2e-16)
    assert near(end.theta[0], np.pi / 3, 2e-15)
    assert near(end.phi[0], 20.0, 1e-14)
    assert near(end.psi[0], 271.2, 1e-14)


def test_the_separatrix_decays_as_the_elementary_solution_says():
    """Whittaker, sections 71-73: 1/u = 1 + sech(gamma t), so tan(theta/2)^2 = sech(gamma t)/
    (2 + sech(gamma t)). Errors grow as exp(gamma t/2), and so do the bounds.
    """
    scene = ht.load_scene("separatrix")
    assert ht.Motion(scene.top, scene.start).kind == "separatrix"
    trajectory = ht.propagate(scene)
    t = np.linspace(0.0, 20.0, 81)
    sech = 1 / np.cosh(t)
    exact = 2 * np.arctan(np.sqrt(sech / (2 + sech)))
    error = np.abs(trajectory(t).theta - exact)
    assert np.max(error[t <= 10]) < 4e-14
    assert np.max(error) < 6e-12
    assert exact[-1] < 1e-4  # by then theta has fallen by four orders of magnitude


def test_the_closed_form_of_the_separatrix_is_the_elementary_one():
    """The same solution at 30 digits."""
    scene = ht.load_scene("separatrix")
    with mp.workdps(40):
        exact = 1 / (1 + mp.sech(20))
        found = ht.Motion(scene.top, scene.start).at(20, digits=30).u
        assert abs(found - exact) < mp.mpf("1e-30")


def test_the_spherical_pendulum_is_a_bob_on_a_wire():
    """Newton's equations of a point in Cartesian coordinates, with the tension of the wire that
    keeps it at its distance r = A/M R (the length of the equivalent simple pendulum), by mpmath's
    Taylor method at 25 digits.
    """
    scene = ht.load_scene("spherical-pendulum")
    with mp.workdps(25):
        g = scene.top.gMR.mpf(mp) / scene.top.A.mpf(mp)  # of a wire of length 1

        def newton(_, y):
            e, v = y[:3], y[3:]
            tension = g * e[2] - sum(c * c for c in v)  # (e . e)'' = 0
            return [*v, tension * e[0], tension * e[1], tension * e[2] - g]

        theta, phidot = scene.start.theta.mpf(mp), scene.start.phidot.mpf(mp)
        start = [0, -mp.sin(theta), mp.cos(theta), phidot * mp.sin(theta), 0, 0]
        bob = [float(x) for x in mp.odefun(newton, 0, start)(2)[:3]]
    assert np.max(np.abs(ht.propagate(scene)([2.0]).axis[0] - bob)) < 1e-14
