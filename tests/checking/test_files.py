"""Files as public demos, textbooks' programs and game engines write them: each is understood."""

import csv
from pathlib import Path

import numpy as np
import pytest
import xarray

from heavytop.checking.judge import check
from heavytop.checking.reading import read

from .made import SCENE, exact

T = np.linspace(0, 1.5, 151)
RECORD = exact(T)
DATA = Path(__file__).parent / "data"
DEGREES = np.degrees(np.array([RECORD.theta, RECORD.phi, RECORD.psi]))

# Of each stored file: what is sure, and the least digits then.


def names(found):
    return {each.name for each in found.conventions}


@pytest.mark.parametrize(("name", "expected"), {
    "exchanged-angles-millimetres": ({"exchanged-angles", "axis-with-spin"}, 3),
    "body-rates-scalar-last": ({"quaternion-xyzw", "omega-body", "degrees"}, 7),
    "steady-in-doubles-y-up": ({"y-up"}, 10),
    "degrees-first-order": ({"degrees"}, 0),
    "elevation-in-degrees-motor": ({"degrees", "elevation", "motor"}, 1),
    "momentum-and-vertical-in-body": ({"spin-origin"}, 1),
    "square-root-of-f": (set(), 0),
    "friction": ({"friction"}, 0),
    "omega-is-tilt-rate": (set(), 6),
    "engine-y-up-first-order": ({"y-up", "omega-body"}, 1),
    "engine-spin-sign": ({"spin-sign"}, 14),
    "engine-omega-sign": ({"omega-sign"}, 14),
    "engine-mirrored-world": ({"mirrored"}, 9),
    "engine-inverse-and-azimuth": ({"inverse-rotation", "azimuth-origin"}, 9),
    "degrees-and-milliseconds-in-header": ({"degrees", "milliseconds"}, 14),
}.items())  # fmt: skip
def test_a_stored_file_is_answered(name, expected):
    found = check(DATA / f"{name}.csv", DATA / f"{name}.toml")
    sure, digits = expected
    assert (names(found), found.digits >= digits) == (sure, True)


def table(path, header, columns, between=",", comma=".", encoding="utf-8"):
    with path.open("w", encoding=encoding, newline="") as file:
        rows = csv.writer(file, delimiter=between)
        rows.writerow(header)
        for row in zip(*columns, strict=True):
            rows.writerow([f"{x:.14g}".replace(".", comma) for x in row])
    return path


def french(path):
    header = ["Temps [ms]", "nutation [deg]", "précession [deg]", "rotation propre [tr/min]"]
    columns = [1000 * T, *DEGREES[:2], RECORD.psidot * 30 / np.pi]
    return table(path / "a.txt", header, columns, "\t", ",", "utf-16")


def netcdf(path):
    """Packed degrees, with rows that are masked, and times that are dates."""
    theta = DEGREES[0].copy()
    theta[50] = np.nan
    times = np.datetime64("2020-01-01", "ns") + (1e9 * T).round().astype("timedelta64[ns]")
    dataset = xarray.Dataset(
        {"tilt": ("time", theta, {"units": "degrees"}),
         "azimuth": ("time", DEGREES[1], {"units": "degree"})},
        coords={"time": times},
    )  # fmt: skip
    packed = {"dtype": "int32", "scale_factor": 1e-7, "add_offset": 20.0, "_FillValue": -(2**31)}
    dataset.to_netcdf(path / "a.nc", engine="h5netcdf", encoding={"tilt": packed})
    return path / "a.nc"


def backwards_from_below(path):
    """Besides one row twice, an azimuth that is wrapped, and a column that is none."""
    rows, header = np.r_[150, 150:-1:-1], ["t", "theta", "Präzession [°]", "note"]
    below, around = np.pi - RECORD.theta, DEGREES[1] % 360
    columns = [T[rows], below[rows], around[rows], rows]
    return table(path / "a.csv", header, columns, encoding="latin-1")


OWN = {
    french: ({"degrees", "rpm", "milliseconds"}, 11),
    netcdf: ({"degrees"}, 6),
    backwards_from_below: ({"from-below", "degrees"}, 11),
}


@pytest.mark.parametrize("make", OWN)
def test_a_file_of_such_a_kind_is_answered(make, tmp_path):
    found = check(make(tmp_path), SCENE)
    sure, digits = OWN[make]
    assert names(found) == sure, str(found)
    assert found.digits >= digits


def test_columns_of_any_name_have_units(tmp_path):
    path = table(tmp_path / "a.csv", ["a", "b [deg]", "c"], [T, *DEGREES[:2]])
    assert check(path, SCENE, {"t": "a", "theta": "b [deg]", "phi": "c [deg]"}).digits > 11


def test_a_row_of_units_below_the_header_is_read(tmp_path):
    path = tmp_path / "units.csv"
    path.write_text("t,theta,phi\nms,deg,deg\n" + "".join(f"{k},{k},{2 * k}\n" for k in range(5)))
    data = read(path)
    assert data.values["t"].tolist() == pytest.approx([0.001 * k for k in range(5)])
    assert data.values["theta"] == pytest.approx(np.radians(range(5)))


def test_a_run_brings_its_scene_as_a_file_and_in_memory(tmp_path):
    about = {"plan": "{}", "scene": SCENE.to_toml()}
    run = xarray.Dataset({"theta": ("t", RECORD.theta), "phi": ("t", RECORD.phi)}, {"t": T}, about)
    run.to_netcdf(tmp_path / "trajectory.nc", engine="h5netcdf")
    for data in (tmp_path, run):
        found = check(data)
        assert (found.origin, found.digits > 14) == ("scene", True)
    del run.attrs["plan"]  # as in a file of others
    assert read(run).scene is None
