"""An atlas says of every pixel what is said of it alone, however the work is shared out."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray

import heavytop as ht
from heavytop.classification.arrays import VERDICT_NAMES
from heavytop.report.files import write_study
from heavytop.studies import atlas as atlas_module
from heavytop.studies.atlas_plane import Axis, Plane

from .toy import drop_line

KICKED = ht.load_scene("sicm-kicked")
SICM = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}
START = ("theta", "thetadot", "phidot", "omega3")
AXES = {"x": "phidot=-20:20:33", "y": "psidot=-150:150:29"}


@pytest.fixture
def small_tiles(monkeypatch):
    """Tiles of a few rows, so that a small atlas has many."""
    monkeypatch.setattr(atlas_module, "TILE", {"kind": 128, "rows": 128})


@pytest.fixture(scope="module")
def rows():
    return ht.atlas(KICKED, **AXES, jobs=1)


def same(one, other):
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in COLUMNS)


COLUMNS = (
    "kind", "detail", "certified", "tags", "open_tags",
    "theta_min", "theta_max", "period", "precession", "spin",
)  # fmt: skip


def plane_of(x, y, scene=KICKED):
    return Plane(scene, Axis.of(x), Axis.of(y))


def alone(plane, i, j):
    """The motion of one pixel, by itself."""
    tops = plane.at(plane.x.values[j : j + 1], plane.y.values[i : i + 1])
    numbers = {name: float(np.ravel(each)[0]) for name, each in tops.items()}
    top = ht.Top(**{name: numbers.pop(name) for name in ("A", "C", "gMR")})
    return ht.Motion(top, ht.State(**numbers))


# --- every pixel ----------------------------------------------------------------------------------


def test_pixels_are_what_their_motions_are_alone(rows):
    kind, period = rows["kind"], rows["period"]
    pick = np.random.default_rng(3)
    for i, j in zip(pick.integers(0, 29, 60), pick.integers(0, 33, 60), strict=True):
        motion = alone(plane_of(**AXES), i, j)
        assert VERDICT_NAMES[kind[i, j]] == motion.kind
        for name, own in (("theta_min", motion.theta_min), ("theta_max", motion.theta_max),
                          ("precession", motion.precession)):  # fmt: skip
            assert rows[name][i, j] == pytest.approx(own, rel=1e-13, abs=1e-13)
        assert period[i, j] == pytest.approx(motion.period, rel=1e-13)


def test_all_pixels_are_counted_and_proved(rows):
    codes, counts = np.unique(rows["kind"], return_counts=True)
    names = [VERDICT_NAMES[code] for code in codes]
    assert rows.counts == dict(zip(names, counts.tolist(), strict=True))
    assert rows.uncertified == 0


def test_impossible_pixels_are_counted_and_have_no_numbers():
    scene = ht.load_scene("sicm-kicked", ["start.theta=0.9"])
    found = ht.atlas(scene, "E=0:2:21", "p_phi=-0.02:0.02:23", jobs=1)
    out = found["kind"] == VERDICT_NAMES.index("impossible")
    assert 50 < out.sum() == found.counts["impossible"] < 21 * 23
    assert np.isnan(found["period"][out]).all()
    assert np.isfinite(found["period"][~out]).all()
    assert found.uncertified == 0


# --- however it is shared out ---------------------------------------------------------------------


@pytest.mark.usefixtures("small_tiles")
def test_tiles_workers_and_executors_change_nothing(rows):
    assert same(rows, ht.atlas(KICKED, **AXES, jobs=1))
    assert same(rows, ht.atlas(KICKED, **AXES, jobs=2))
    with ThreadPoolExecutor(2) as pool:
        assert same(rows, ht.atlas(KICKED, **AXES, executor=pool))


@pytest.mark.usefixtures("small_tiles")
def test_an_atlas_is_read_whole_or_not_at_all(rows, tmp_path):
    ht.atlas(KICKED, **AXES, folder=tmp_path, jobs=1)
    assert same(rows, ht.load_atlas(tmp_path))
    drop_line(tmp_path)
    with pytest.raises(ht.ForeignFile, match="not computed yet; heavytop resume"):
        ht.load_atlas(tmp_path)
    assert same(rows, ht.resume(tmp_path))


# --- files ----------------------------------------------------------------------------------------


def test_the_map_is_netcdf_with_flags(rows, tmp_path):
    rows.save_data(tmp_path)
    with xarray.open_dataset(tmp_path / "atlas.nc", mask_and_scale=False) as stored:
        flags = stored["kind"].attrs
        assert stored.attrs["accuracy"].startswith("1e-12: of period")
        assert flags["flag_meanings"].split() == list(VERDICT_NAMES)
        assert flags["flag_values"].tolist() == list(range(len(VERDICT_NAMES)))
        assert stored["kind"].dims == ("psidot", "phidot")
        assert stored["phidot"].attrs["units"] == "rad s-1"
        assert stored["phidot"].values.tolist() == plane_of(**AXES).x.values.tolist()
        for name in COLUMNS:
            assert np.array_equal(stored[name].values, rows[name], equal_nan=True)
    assert rows.document()["shape"] == (29, 33)
    assert rows.to_xarray()["kind"].attrs["flag_meanings"].split() == list(VERDICT_NAMES)


def test_an_atlas_is_what_its_files_say(rows, tmp_path):
    write_study(rows, tmp_path, figures=False)
    read = ht.Atlas.load(tmp_path / "atlas.json")
    assert same(rows, read)
    assert read.document()["curves"] == rows.document()["curves"]
    data = bytearray((tmp_path / "atlas.nc").read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "atlas.nc").write_bytes(data)
    with pytest.raises(ht.ForeignFile, match=r"atlas\.nc"):
        ht.Atlas.load(tmp_path / "atlas.json")
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
        found = ht.atlas(scene, x, y, jobs=1)
        plane = plane_of(x, y, scene)
        where = plane.at(*np.meshgrid(plane.x.values, plane.y.values))
        tops = {k: np.broadcast_to(each, found["kind"].shape) for k, each in where.items()}
        for at in map(tuple, np.argwhere(tops["theta"] == np.pi)):
            start = {name: float(tops[name][at]) for name in START} | {"theta": "pi"}
            if not np.isfinite(start["phidot"]):
                assert VERDICT_NAMES[found["kind"][at]] == "impossible"
                assert found["tags"][at] == 0
                continue
            motion = ht.Motion(ht.Top(**{k: float(tops[k][at]) for k in SICM}), ht.State(**start))
            assert VERDICT_NAMES[found["kind"][at]] == motion.kind
            assert found["theta_max"][at] == pytest.approx(motion.theta_max, abs=1e-13)
            assert found["theta_min"][at] == pytest.approx(motion.theta_min, abs=1e-13)
            assert bool((found["tags"][at] >> 5) & 1) == ("inverted-gravity" in motion.tags)


# --- what is wrong --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"x": "phi=0:1:5"}, "x = .*phi.*one of theta"),
        ({"x": "phidot=5:1:5", "y": "psi=0:1:2", "jobs": 0}, "(?s)x = .*y = .*jobs"),
        ({"y": "p_psi=0:1:5", "x": "psidot=0:1:5"}, "both set the spin"),
        ({"only": "rows"}, "only.*kind"),
        ({"executor": 3}, "executor.*Executor"),
        ({"x": "phidot=0:1:1000000", "y": "psidot=0:1:1000000"}, "GB are needed in memory"),
    ],
)
def test_what_is_wrong_is_said_before_anything_is_done(wrong, words):
    with pytest.raises(ht.BadScene, match=words):
        ht.atlas(KICKED, **{**AXES, **wrong})
    with pytest.raises(ht.BadScene, match=r"scene.*a Scene"):
        ht.atlas("sicm-kicked", **AXES)
