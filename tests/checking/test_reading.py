"""What a file or arrays tell: every form is read alike, and every fault is told at once."""

import re

import h5py
import numpy as np
import pandas
import pytest
import scipy.io
import xarray

from heavytop.checking.comparison import Comparison
from heavytop.checking.headers import meanings
from heavytop.checking.reading import read
from heavytop.errors import ForeignFile

from .made import START, TIMES, TOP, angles, exact, matrix, vectors

RECORD = exact()
ACROSS = RECORD.thetadot**2 + (RECORD.phidot * np.sin(RECORD.theta)) ** 2
BODY = np.einsum("nji,nj->ni", matrix(RECORD), RECORD.omega)
SPELLED = {
    "angles": pandas.DataFrame(angles(RECORD)).set_index("t"),
    "quaternion": vectors(RECORD),
    "matrix": {"t": TIMES, "matrix": matrix(RECORD), "omega": RECORD.omega},
    "nine": {"t": TIMES, "rotation": matrix(RECORD).reshape(-1, 9), "omega": RECORD.omega},
    "body": {"t": TIMES, "q": RECORD.quaternion, "Omega_body": BODY},
    "axis": {"time": TIMES, "axis": RECORD.axis, "omega": RECORD.omega},
    "components": {"t [s]": TIMES}
    | {f"e_{c}": RECORD.axis[:, k] for k, c in enumerate("xyz")}
    | {f"ω{c} (rad/s)": RECORD.omega[:, k] for k, c in enumerate("xyz")},
    "as MATLAB": {"t": TIMES[None], "axis": RECORD.axis.T, "omega": RECORD.omega.T},
    "backwards": {"t": TIMES[::-1], "axis": RECORD.axis[::-1], "omega": RECORD.omega[::-1]},
}


def compared(data):
    return Comparison(read(data).values, TOP, START)


@pytest.mark.parametrize("spelled", SPELLED)
def test_every_way_to_say_it_is_understood(spelled):
    data = compared(SPELLED[spelled])
    assert np.array_equal(data.t, TIMES)
    omega, e, upward = data.spin
    for mine, true, bound in (
        (data.derived["axis"], RECORD.axis, 1e-14),
        (data.derived["theta"], RECORD.theta, 1e-14),
        ((e * upward).sum(axis=1), RECORD.u, 1e-14),
        ((np.cross(omega, e) ** 2).sum(axis=1), ACROSS, 1e-10),
        ((omega * e).sum(axis=1), RECORD.omega3, 1e-11),
    ):
        assert abs(mine - true).max() < bound


def test_without_an_azimuth_energy_and_momenta_are_known_all_the_same():
    data = {name: x for name, x in angles(RECORD).items() if name != "phi"}
    assert "axis" not in compared(data).derived
    mine, e, upward = compared(data).spin
    energy = (np.cross(mine, e) ** 2).sum(axis=1) / 2 + float(TOP.gMR / TOP.A) * e[:, 2]
    assert np.ptp(energy) < 1e-11
    assert np.ptp(mine @ upward[0] + float(TOP.C / TOP.A - 1) * RECORD.omega3 * e[:, 2]) < 1e-11


def columns():
    return {name: values[:40] for name, values in angles(RECORD).items()}


def written(path):
    """A file of the kind that its name tells, with all columns."""
    data, name = columns(), path.name
    tables = {"mine.csv": (",", ""), "blanks.csv": (" ", "# "), "semicolons.txt": (";", "\n")}
    if name in tables or name == "mine.tsv":
        between, first = tables.get(name, ("\t", "\ufeff"))
        options = {"header": first + between.join(data), "comments": "", "encoding": "utf-8"}
        np.savetxt(path, np.transpose([*data.values()]), "%.17g", between, **options)
    elif name.startswith("index"):  # a column without a name
        pandas.DataFrame(data).to_csv(path, sep=",\t"[name.endswith("tsv")])
    elif name == "mine.npz":
        np.savez(path, **data)
    elif name == "old.mat":
        scipy.io.savemat(path, data | {"note": "of somebody"})
    elif name == "mine.nc":
        dataset = xarray.Dataset({each: ("t", x) for each, x in data.items()})
        dataset.to_netcdf(path, engine="h5netcdf")
    else:
        with h5py.File(path, "w", userblock_size=512) as file:
            for each, values in data.items():
                shape = values[None] if name == "new.mat" else values[:, None]
                file.create_dataset(each, data=shape, compression="gzip")
            file.create_dataset("note", data="of somebody")
    if name == "new.mat":  # what MATLAB writes before HDF5 begins
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")
    return path


KINDS = "mine.csv blanks.csv semicolons.txt mine.tsv mine.npz old.mat new.mat mine.nc index"


@pytest.mark.parametrize("name", [*KINDS.split(), "index.tsv"])
def test_every_kind_of_file_is_read(tmp_path, name):
    np.testing.assert_equal(dict(read(written(tmp_path / name)).values), columns())


def test_a_component_that_is_named_goes_with_usual_ones():
    x, y, z = RECORD.axis.T
    named = read({"t": TIMES, "ex": z, "a": x, "ey": y, "ez": z}, {"axis_x": "a"})
    for data in (named, read({"t": TIMES, "x": x, "y": y, "z": z})):
        assert abs(data.values["axis"] - RECORD.axis).max() < 1e-15


FIVE = {"t": range(5)}


@pytest.mark.parametrize(("fault", "data"), {
    "a column t of at least 5 times": {"theta": [1, 2]},
    "5 times is needed (1 found)": {"t": [1] * 9, "theta": [1] * 9},
    "t: the times must increase or decrease: row 5": {"t": [0, 1, 2, 3, 1], "theta": [1] * 5},
    "theta: needs the shape (5,), not (4,)": FIVE | {"theta": [1] * 4},
    "is needed in row 3": FIVE | {"phi": [0, 0, np.inf, 0, 0]},
    "is needed in row 2": FIVE | {"phi": [0, 10**400, 0, 0, 0]},
    "no vector of length 0": FIVE | {"axis": np.zeros((5, 3))},
    "numbers of angles, axis": FIVE | {"theta": [np.nan] * 5},
    "there are t, roll, pitch, yaw": FIVE | dict.fromkeys(("roll", "pitch", "yaw"), [1] * 5),
}.items())  # fmt: skip
def test_a_fault_is_told(fault, data):
    with pytest.raises(ForeignFile, match=re.escape(fault)):
        read(data)


def test_what_is_masked_is_not_judged():
    theta = np.ma.array([1, 1, 99, 1, 1, 1], mask=[0, 0, 1, 0, 0, 0])
    assert read({"t": range(6), "theta": theta}).values["theta"].tolist() == [1] * 5


def test_elevations_are_tilts_in_their_own_unit():
    for quarter, step in ((90, 10), (np.pi / 2, 0.1)):
        data = read(FIVE | {"elevation": step * np.arange(-2, 3)})
        assert data.values["theta"] == pytest.approx(quarter - step * np.arange(-2, 3))
        assert "elevation" in data.declared


def test_a_unit_of_a_header_declares_the_convention_of_what_it_measures():
    """A milliradian is a thousandth, as a millisecond is."""
    for t, declared in (("t [ms]", "milliseconds"), ("t [min]", "minutes"), ("t [s]", None)):
        data = read({t: range(5), "theta [mrad]": [1] * 5, "phidot [rad/min]": [1] * 5})
        assert [*data.declared] == [declared] * bool(declared)


PER = dict.fromkeys(("1/s", "s-1", "s^-1", "s⁻¹", "s^{-1}"), 1.0)
PER |= dict.fromkeys(("rpm", "1/min", "min^-1", "tr/min", "U/min"), np.pi / 30)


@pytest.mark.parametrize("unit", PER)
def test_a_rate_may_leave_out_the_radians_and_in_so_many_a_minute_is_in_turns(unit):
    for header in (f"spin [{unit}]", f"spin, {unit}", f"psidot {unit}"):
        (found,) = meanings(header)
        meaning = found.quantity, found.unit.kind, found.unit.factor
        assert meaning == ("psidot", "rate", pytest.approx(PER[unit]))


def test_what_is_not_understood_is_listed_and_stops_nothing():
    more = {"phi": np.ones(5, complex), "qx": [1] * 5, "time": [1] * 5, "omega": [2] * 5}
    found = read(FIVE | {"theta": [1] * 5, "note": ["a"] * 5} | more)
    used = {name for name, quantity in found.columns.items() if quantity}
    assert used == found.values.keys() == {"t", "theta"}


def test_faults_of_all_columns_have_their_rows(tmp_path):
    with pytest.raises(ForeignFile) as error:
        read(FIVE | {"theta": [1] * 5}, {"psy": "a", "phi": "b"})
    assert all(each in str(error.value) for each in ("'psy', no quantity", "'b', no such column"))
    path = tmp_path / "bad.csv"
    path.write_text("t,theta,phi\n" + "0,1,1\n" * 3 + "1,x,2\n" * 8 + "2,1\n# a remark\n3,4,5\n")
    with pytest.raises(ForeignFile) as error:
        read(path)
    ends = [line.partition("in row ")[2] for line in str(error.value).splitlines()]
    assert ends == ["4, 5, 6, 7, 8, and 3 more", "12"]


FOREIGN = {
    "none.csv": (None, "No such file"),
    "headless.csv": (b"0,1\n1,2\n", "a header with the names of t and of angles.* columns says"),
    "no.nc": (b"CDF\x01", "not readable"),
    "wide.csv": (b"t,theta\n" + b"0,1\n" * 5 + b"1,2,3\n", r"line 7, saw 3\)$"),
    "few.csv": (b"t theta\n" + b"0 0 1\n" * 6, "Length of header"),
    "code.npz": (np.array([object()], dtype=object), "not readable"),  # which could execute
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_file_is_refused(tmp_path, name):
    content, fault = FOREIGN[name]
    if name == "code.npz":
        np.savez(tmp_path / name, t=content)
    elif content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ForeignFile, match=fault):
        read(tmp_path / name)
