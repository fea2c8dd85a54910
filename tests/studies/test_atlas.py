"""An atlas says of every pixel what is said of it alone; its boundaries divide the kinds."""

from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
import xarray

import heavytop as ht
from heavytop.classification.arrays import VERDICT_NAMES
from heavytop.classification.many import classify_many
from heavytop.errors import NotANumber, Refused
from heavytop.report.files import write_result
from heavytop.studies import atlas as atlas_module
from heavytop.studies.atlas_plane import MOST_VALUES, Axis, Plane, curves

from ..starts import top_and_state
from .toy import drop_line

KICKED = ht.load_scene("sicm-kicked")
AXES = {"x": "phidot=-20:20:33", "y": "psidot=-150:150:29"}


def plane(x, y, scene=KICKED):
    return Plane(scene, Axis.of(x), Axis.of(y))


def at(where, x, y):
    """The pixel of a plane at given values."""
    tops = where.at(np.array([float(x)]), np.array([float(y)]))
    return {name: float(np.ravel(each)[0]) for name, each in tops.items()}


def motion_of(tops):
    """The motion of one pixel."""
    return ht.Motion(*top_and_state(tops))


def alone(where, i, j, **more):
    """The motion of one pixel, by itself, or None where no start has its numbers."""
    numbers = at(where, where.x.values[j], where.y.values[i]) | more
    return motion_of(numbers) if np.isfinite(numbers["phidot"]) else None


@pytest.fixture(scope="module")
def rows():
    return ht.atlas(KICKED, **AXES, jobs=1)


# --- axes -----------------------------------------------------------------------------------------


def test_values_are_the_doubles_nearest_the_exact_ones():
    axis = Axis.of("phidot=-0.3:0.7:1001")
    wanted = [float(Fraction(-3, 10) + Fraction(k, 1000)) for k in range(1001)]
    assert axis.values.tolist() == wanted
    assert axis.values[300] == 0


MIDDLES = {"top.C=1e-6:1e-4:5:log": 1e-5, "theta=0:pi:7": np.pi / 2, "theta=0:180deg:3": np.pi / 2}


@pytest.mark.parametrize("text", MIDDLES)
def test_an_axis_reads_units_and_expressions_and_says_a_text_that_reads_as_itself(text):
    axis = Axis.of(text)
    assert Axis.of(axis.text) == axis
    assert axis.values[axis.count // 2] == pytest.approx(MIDDLES[text])


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
    "falling": plane("phidot=-9:9:9", "psidot=-150:-9:9", KICKED.changed("start.thetadot", 0.05)),
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
        sides = both_sides(where, curve)
        for pair in sides[len(sides) // 4 : -len(sides) // 4 or None]:
            assert pair == DIVIDES[curve.name]
    assert found or name in ("tilts and spins", "sideways")


def both_sides(where, curve):
    """The words for either side of each point of a curve, a little step across it."""
    x, y, step = curve.x, curve.y, 1e-6
    scale = np.array([np.ptp(where.x.values), np.ptp(where.y.values)])
    wide = np.clip(np.arange(x.size) + np.array([[-5], [5]]), 0, x.size - 1)  # neighbours may touch
    dx, dy = np.diff(x[wide], axis=0)[0] / scale[0], np.diff(y[wide], axis=0)[0] / scale[1]
    across = np.stack((-dy * scale[0], dx * scale[1])) / np.hypot(dx, dy)
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


# --- every pixel ----------------------------------------------------------------------------------


def test_pixels_are_what_their_motions_are_alone_and_all_are_counted_and_proved(rows):
    pick = np.random.default_rng(3)
    for i, j in zip(pick.integers(0, 29, 60), pick.integers(0, 33, 60), strict=True):
        motion = alone(plane(**AXES), i, j)
        assert VERDICT_NAMES[rows["kind"][i, j]] == motion.kind
        for name in ("theta_min", "theta_max", "precession", "spin", "period"):
            assert rows[name][i, j] == pytest.approx(getattr(motion, name), rel=1e-13, abs=1e-13)
    counted = Counter(VERDICT_NAMES[code] for code in rows["kind"].ravel())
    assert (rows.counts, rows.uncertified) == (counted, 0)


# --- however it is shared out ---------------------------------------------------------------------


def test_however_it_is_shared_out_it_is_the_same_and_whole(rows, tmp_path, monkeypatch):
    monkeypatch.setattr(atlas_module, "TILE", {"kind": 128, "rows": 128})
    for jobs in (1, 2):
        assert rows.map.equals(ht.atlas(KICKED, **AXES, jobs=jobs, folder=tmp_path / str(jobs)).map)
    assert rows.map.equals(ht.load_atlas(tmp_path / "1").map)
    drop_line(tmp_path / "1")
    with pytest.raises(ht.ForeignFile, match="not computed yet; heavytop resume"):
        ht.load_atlas(tmp_path / "1")
    assert rows.map.equals(ht.resume(tmp_path / "1").map)


# --- files ----------------------------------------------------------------------------------------


def test_the_map_is_netcdf_with_flags(rows, tmp_path):
    write_result(rows, tmp_path, figures=False)
    with xarray.open_dataset(tmp_path / "atlas.nc", mask_and_scale=False) as stored:
        flags = stored["kind"].attrs
        assert flags["flag_meanings"].split() == list(VERDICT_NAMES)
        assert flags["flag_values"].tolist() == list(range(len(VERDICT_NAMES)))
        assert stored["kind"].dims == ("psidot", "phidot")
        assert stored["phidot"].attrs["units"] == "rad s-1"
        assert stored["phidot"].values.tolist() == plane(**AXES).x.values.tolist()
    read = ht.Atlas.load(tmp_path / "atlas.json")
    assert rows.map.equals(read.map)
    stored = {"files": read.files, "command": None, "kinds_per_s": None, "rows_per_s": None}
    assert read.document() == rows.document() | stored
    (tmp_path / "atlas.nc").unlink()
    bare = ht.Atlas.load(tmp_path / "atlas.json")
    assert (bare.map, bare.figure()) == (None, None)
    with pytest.raises(LookupError):
        bare["kind"]


# --- the vertical --------------------------------------------------------------------------------


@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
def test_the_double_nearest_pi_means_pi(gMR):
    """From the bottom a top hangs, or sleeps, or passes through it: as from π itself."""
    scene = ht.load_scene("sicm-kicked", ["start.theta=pi", f"top.gMR={gMR}"])
    for x, y in (("thetadot=-10:10:5", "omega3=0:200:5"), ("theta=2:pi:3", "omega3=0:200:5"),
                 ("p_phi=-0.0132:0.0132:5", "p_psi=-0.0132:0.0132:5")):  # fmt: skip
        found, where = ht.atlas(scene, x, y, jobs=1), plane(x, y, scene)
        theta = where.at(*np.meshgrid(where.x.values, where.y.values))["theta"]
        for i, j in np.argwhere(np.broadcast_to(theta, where.shape) == np.pi):
            motion = alone(where, i, j, theta="pi")
            assert VERDICT_NAMES[found["kind"][i, j]] == (motion.kind if motion else "impossible")
            if motion is None:
                assert found["tags"][i, j] == 0
                continue
            for name in ("theta_min", "theta_max", "spin"):
                own = np.float64(getattr(motion, name))  # nan where there is none
                assert found[name][i, j] == pytest.approx(own, abs=1e-12, nan_ok=True)
            assert bool((found["tags"][i, j] >> 5) & 1) == ("inverted-gravity" in motion.tags)
