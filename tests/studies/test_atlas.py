"""An atlas says of every pixel what is said of it alone, however the work is shared out."""

from collections import Counter

import numpy as np
import pytest
import xarray

import heavytop as ht
from heavytop.classification.arrays import VERDICT_NAMES
from heavytop.report.files import write_result
from heavytop.studies import atlas as atlas_module

from .test_atlas_plane import at, motion_of, plane
from .toy import drop_line

KICKED = ht.load_scene("sicm-kicked")
AXES = {"x": "phidot=-20:20:33", "y": "psidot=-150:150:29"}


@pytest.fixture(scope="module")
def rows():
    return ht.atlas(KICKED, **AXES, jobs=1)


def alone(where, i, j, **more):
    """The motion of one pixel, by itself, or None where no start has its numbers."""
    numbers = at(where, where.x.values[j], where.y.values[i]) | more
    return motion_of(numbers) if np.isfinite(numbers["phidot"]) else None


# --- every pixel ----------------------------------------------------------------------------------


def test_pixels_are_what_their_motions_are_alone_and_all_are_counted_and_proved(rows):
    pick = np.random.default_rng(3)
    for i, j in zip(pick.integers(0, 29, 60), pick.integers(0, 33, 60), strict=True):
        motion = alone(plane(**AXES), i, j)
        assert VERDICT_NAMES[rows["kind"][i, j]] == motion.kind
        for name in ("theta_min", "theta_max", "precession", "spin", "period"):
            own = getattr(motion, name)
            assert rows[name][i, j] == pytest.approx(own, rel=1e-13, abs=1e-13)
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
