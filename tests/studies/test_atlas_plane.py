"""The tops of a plane's pixels are those of the scene, and its boundaries divide the kinds."""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.classification.many import classify_many
from heavytop.errors import NotANumber, Refused
from heavytop.studies.atlas_plane import MOST_VALUES, Axis, Plane, curves

from ..starts import top_and_state

KICKED = ht.load_scene("sicm-kicked")


def plane(x, y, scene=KICKED):
    return Plane(scene, Axis.of(x), Axis.of(y))


def at(where, x, y):
    """The pixel of a plane at given values."""
    tops = where.at(np.array([float(x)]), np.array([float(y)]))
    return {name: float(np.ravel(each)[0]) for name, each in tops.items()}


def motion_of(tops):
    """The motion of one pixel."""
    return ht.Motion(*top_and_state(tops))


# --- axes -----------------------------------------------------------------------------------------


def test_values_are_the_doubles_nearest_the_exact_ones():
    axis = Axis.of("phidot=-0.3:0.7:1001")
    wanted = [float(Fraction(-3, 10) + Fraction(k, 1000)) for k in range(1001)]
    assert axis.values.tolist() == wanted
    assert axis.values[300] == 0


@pytest.mark.parametrize("text", ["C=1e-6:1e-4:5:log", "theta=0:pi:7", "theta=0:180 deg:3"])
def test_an_axis_reads_units_and_expressions_and_says_a_text_that_reads_as_itself(text):
    axis = Axis.of(text)
    assert Axis.of(axis.text) == axis
    middle = np.pi / 2 if "theta" in text else 1e-5
    assert axis.values[axis.values.size // 2] == pytest.approx(middle)


NO_AXIS = ["phidt=0:1:5", "phidot", "phidot=1:1:5", "phidot=0:1:1", "phidot=0:nan:5", "C=0:1:5:log"]
NO_AXIS += ["phidot=0:1e999:5", "phidot=0:1 deg:5", f"phidot=0:1:{MOST_VALUES + 1}"]


@pytest.mark.parametrize("text", NO_AXIS)
def test_what_is_no_axis_is_refused(text):
    with pytest.raises((Refused, NotANumber)):
        Axis.of(text)


# --- pixels ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("held", ["psidot", "omega3"])
@pytest.mark.parametrize("names", ["E p_phi", "p_psi E", "p_psi p_phi", "p_phi thetadot"])
def test_energy_and_momenta_are_those_asked_for(names, held):
    scene = ht.load_scene("sicm-kicked", ["start.theta=0.9", f"start.{held}=140"])
    values = {"E": 1.7, "p_phi": 0.004, "p_psi": 0.011, "thetadot": 2}
    axes = (f"{name}=0:{2 * values[name]}:5" for name in names.split())
    motion = motion_of(at(plane(*axes, scene), *(values[name] for name in names.split())))
    for name in {*names.split()} - {"thetadot"}:
        assert float(getattr(motion.constants, name)) == pytest.approx(values[name], rel=1e-13)


def test_what_no_start_has_is_impossible():
    scene = ht.load_scene("sicm-kicked", ["start.theta=0.9"])
    for where, *place in (
        (plane("E=-9:2:5", "p_phi=0:0.02:5", scene), -9, 0.01),
        (plane("p_phi=-1:1:5", "theta=0:1:5", ht.load_scene("sicm-forward")), 0.5, 0),
        (plane("C=-1e-5:1e-3:5", "A=1e-4:1e-3:5"), -1e-5, 1e-4),
        (plane("A=-1:1:5", "theta=0:1:5"), -1, 0.5),
        (plane("theta=-1:4:5", "phidot=0:1:5"), 4, 0.5),
    ):
        assert classify_many(**at(where, *place)).impossible


def test_a_pole_reached_with_p_phi_equal_to_p_psi_is_possible():
    where = plane("p_phi=0:0.02:5", "theta=0:1:5", ht.load_scene("sicm-forward"))
    found = classify_many(**at(where, 6.6e-5 * 140, 0))
    assert found.names[found.kind] == "sleeping"


# --- boundaries -----------------------------------------------------------------------------------

TILTED = ht.load_scene("sicm-kicked", ["start.theta=1.2"])
PLANES = {
    "kicks and spins": plane("phidot=-20:20:9", "psidot=-150:150:9"),
    "tilts and spins": plane("theta=0.01:3.1:9", "omega3=1:200:9"),
    "sideways": plane("phidot=-20:20:9", "thetadot=-10:10:9"),
    "asleep": plane("psidot=1:400:9", "A=1e-4:1e-3:9:log", ht.load_scene("sleeping")),
    "momenta": plane("p_phi=-0.02:0.02:9", "p_psi=-0.02:0.02:9", TILTED),
}
DIVIDES = {"cusp": {"loops", "waves"}, "sleeping": {"stable", "unstable"}}


@pytest.mark.parametrize("name", PLANES)
def test_curves_divide_the_kinds(name):
    where = PLANES[name]
    found = [curve for curve in curves(where) if curve.name in DIVIDES and curve.x.size > 1]
    for curve in found:
        told = both_sides(where, curve)
        for pair in told[len(told) // 4 : -len(told) // 4 or None]:
            assert pair == DIVIDES[curve.name]
    assert found or name in ("tilts and spins", "sideways")


def both_sides(where, curve):
    """The words for either side of each point of a curve, a little step across it."""
    x, y, step = curve.x, curve.y, 1e-6
    scale = np.array([np.ptp(where.x.values), np.ptp(where.y.values)])
    wide = np.clip(np.arange(x.size) + np.array([[-5], [5]]), 0, x.size - 1)  # neighbours may touch
    dx, dy = np.diff(x[wide], axis=0)[0] / scale[0], np.diff(y[wide], axis=0)[0] / scale[1]
    size = np.hypot(dx, dy)
    across = np.stack((-dy / size * scale[0], dx / size * scale[1]))
    found = [classify_many(**where.at(x + s * across[0], y + s * across[1])) for s in (step, -step)]
    asleep, of = curve.name == "sleeping", found[0]
    codes = [each.detail if asleep else each.kind for each in found]
    return [{(of.details if asleep else of.names)[k] for k in pair} for pair in np.transpose(codes)]


@pytest.mark.parametrize("name", ["kicks and spins", "momenta", "tilts and spins"])
def test_poles_steady_precession_and_the_separatrix_lie_on_their_curves(name):
    where, points = PLANES[name], 0
    for curve in curves(where):
        for k in range(0, curve.x.size, 37):
            motion = motion_of(at(where, curve.x[k], curve.y[k]))
            if (name, curve.name) == ("kicks and spins", "separatrix"):
                points += 1
                known = motion.constants.floats
                assert known["p_phi"] == pytest.approx(known["p_psi"], rel=1e-10)
                assert known["E_prime"] == pytest.approx(0.0456, rel=1e-5)
            near = {"through-top": motion.from_top, "through-bottom": motion.from_bottom}
            near |= {"steady": motion.theta_max - motion.theta_min}
            assert near.get(curve.name, 0.0) < 1e-6, (curve.name, k, motion)
    assert points == 2 * (name == "kicks and spins")


def test_the_threshold_of_sleep_is_a_point_where_the_axis_starts_upright():
    """Whether θ = 0 is an edge of the plane, or all of it and θ̇ = 0 is a line inside."""
    upright = ht.load_scene("through-top")
    top = upright.top
    threshold = 2 * float(top.A * top.gMR) ** 0.5 / float(top.C)
    for scene, x in ((KICKED, "theta=0:1:9"), (upright, "thetadot=-10:10:9")):
        found = curves(plane(x, f"omega3={threshold / 2}:{threshold * 2}:9", scene))
        [point] = [curve for curve in found if curve.name == "sleeping"]
        assert [*point.x, *point.y] == [0, pytest.approx(threshold, rel=1e-14)]
