"""What a file or arrays tell: every form is read alike, and every fault is told at once."""

import h5py
import numpy as np
import pytest
import scipy.io
import xarray

from heavytop.checking.data import read
from heavytop.errors import ForeignFile, WrongType

from .made import TIMES, angles, exact, matrix, vectors

RECORD = exact()
FEW = slice(0, 40)
SPELLED = {
    "angles": angles(RECORD),
    "quaternion": vectors(RECORD),
    "matrix": {"t": TIMES, "matrix": matrix(RECORD), "omega": RECORD.omega},
    "nine": {"t": TIMES, "R": matrix(RECORD).reshape(-1, 9), "omega": RECORD.omega},
    "body": {
        "t": TIMES,
        "q": RECORD.quaternion,
        "Omega_body": np.einsum("nji,nj->ni", matrix(RECORD), RECORD.omega),
    },
    "axis": {"time": TIMES, "axis": RECORD.axis, "omega": RECORD.omega},
    "components": {
        "t [s]": TIMES,
        **{f"e_{c}": RECORD.axis[:, k] for k, c in enumerate("xyz")},
        **{f"ω{c} (rad/s)": RECORD.omega[:, k] for k, c in enumerate("xyz")},
    },
    "as MATLAB": {"t": TIMES[None], "axis": RECORD.axis.T, "omega": RECORD.omega.T},
    "backwards": {"t": TIMES[::-1], "axis": RECORD.axis[::-1], "omega": RECORD.omega[::-1]},
}
SPELLED["nine"]["rotation"] = SPELLED["nine"].pop("R")


@pytest.mark.parametrize("spelled", SPELLED)
def test_every_way_to_say_it_is_understood(spelled):
    data = read(SPELLED[spelled])
    assert np.array_equal(data.t, TIMES)
    assert abs(data.axis - RECORD.axis).max() < 1e-14
    assert abs(data.omega - RECORD.omega).max() < 1e-12
    assert abs(data.angle("theta") - RECORD.theta).max() < 1e-14
    u, speed, omega3, _ = data.spinning
    assert abs(u - RECORD.u).max() < 1e-14
    assert (
        abs(speed - RECORD.thetadot**2 - (RECORD.phidot * np.sin(RECORD.theta)) ** 2).max() < 1e-10
    )
    assert abs(omega3 - RECORD.omega3).max() < 1e-11


def test_the_spin_is_read_from_an_attitude():
    data = read(SPELLED["quaternion"])
    off = data.angle("psi") - RECORD.psi
    assert abs(off - 2 * np.pi * np.rint(off / (2 * np.pi))).max() < 1e-12


def test_without_an_azimuth_energy_and_momenta_are_known_all_the_same():
    told = {name: x for name, x in angles(RECORD).items() if name != "phi"}
    assert read(told).axis is None
    for mine, other in zip(read(told).spinning, read(angles(RECORD)).spinning, strict=True):
        assert abs(mine - other).max() < 1e-11


def columns():
    return {name: values[FEW] for name, values in angles(RECORD).items()}


def table(path, between=",", first="", header=None):
    told = columns()
    lines = [between.join(header or told)]
    lines += [between.join(map(repr, map(float, row))) for row in zip(*told.values(), strict=True)]
    path.write_text(first + "\n".join(lines) + "\n")


def hdf5(path):
    with h5py.File(path, "w") as file:
        for name, values in columns().items():
            file.create_dataset(name, data=values[:, None], compression="gzip")
        file.create_dataset("note", data="of somebody")


WRITERS = {
    "mine.csv": lambda path: table(path),
    "blanks.csv": lambda path: table(path, " ", "# "),
    "mine.tsv": lambda path: table(path, "\t", "\ufeff"),
    "semicolons.txt": lambda path: table(path, ";", "\n"),
    "mine.npz": lambda path: np.savez(path, **columns()),
    "mine.mat": lambda path: scipy.io.savemat(path, columns() | {"note": "of somebody"}),
    "mine.h5": hdf5,
    "new.mat": hdf5,
    "mine.nc": lambda path: xarray.Dataset(
        {name: ("t", x) for name, x in columns().items()}
    ).to_netcdf(path, engine="h5netcdf"),
}


@pytest.mark.parametrize("name", WRITERS)
def test_every_kind_of_file_is_read(tmp_path, name):
    if name == "new.mat":  # with what MATLAB writes before HDF5 begins
        with h5py.File(tmp_path / name, "w", userblock_size=512) as file:
            for each, values in columns().items():
                file[each] = values[None]
        head = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"
        with (tmp_path / name).open("r+b") as file:
            file.write(head)
    else:
        WRITERS[name](tmp_path / name)
    data = read(tmp_path / name)
    assert data.told.keys() == columns().keys() - {"t"}
    assert all(np.array_equal(data.told[each], columns()[each]) for each in data.told)


def test_an_xarray_dataset_is_a_mapping():
    dataset = xarray.Dataset({"theta": ("t", RECORD.theta)}, {"t": TIMES})
    assert np.array_equal(read(dataset).told["theta"], RECORD.theta)


def test_columns_have_the_names_that_they_are_given():
    told = {"Zeit": TIMES, "a": RECORD.theta, "theta": RECORD.phi}
    data = read(told, {"t": "Zeit", "theta": "a"})
    assert np.array_equal(data.told["theta"], RECORD.theta)


def ours(path, **attributes):
    """A file as a run of ours writes it, with an angle that was not followed."""
    told = columns() | {"psi": np.full(40, np.nan)}
    with h5py.File(path, "w") as file:
        for name, values in told.items():
            file[name] = values
        file.attrs.update(attributes)
    return path


def test_only_a_run_of_ours_may_lack_an_angle(tmp_path):
    data = read(ours(tmp_path / "ours.nc", plan="{}", scene="a scene"))
    assert "psi" not in data.told
    assert data.scene == "a scene"
    with pytest.raises(ForeignFile, match="psi: not a finite number in row 1"):
        read(ours(tmp_path / "theirs.nc", scene="a scene"))


@pytest.mark.parametrize("wrong", [{"plan": 3}, {"scene": np.arange(4)}, {"scene": 2.5}])
def test_an_attribute_of_another_type_is_refused(tmp_path, wrong):
    attributes = {"plan": "{}", "scene": "a scene"} | wrong
    with pytest.raises(ForeignFile, match=f"its attribute {next(iter(wrong))} is no text"):
        read(ours(tmp_path / "ours.nc", **attributes))


CLASHES = {
    "time: tells t, and so does t": {"t": TIMES, "time": TIMES, "theta": TIMES},
    "tilt: tells theta, and so does theta": {"t": TIMES, "theta": TIMES, "tilt": TIMES},
    "ex: tells axis, and so does axis": {"t": TIMES, "axis": RECORD.axis, "ex": TIMES},
    "axis: tells axis, and so does ex": {"t": TIMES, "ex": TIMES, "axis": RECORD.axis},
}


@pytest.mark.parametrize("told", CLASHES)
def test_two_columns_for_one_quantity_are_refused(told):
    with pytest.raises(ForeignFile) as error:
        read(CLASHES[told])
    assert f"data: {told}" in str(error.value).splitlines()


@pytest.mark.parametrize("name", ["mine.h5", "mine.mat"])
def test_a_column_of_a_file_that_has_no_numbers_is_refused(tmp_path, name):
    told = columns() | {"theta": columns()["theta"] + 0j}
    if name == "mine.mat":
        scipy.io.savemat(tmp_path / name, told)
    else:
        with h5py.File(tmp_path / name, "w") as file:
            for each, values in told.items():
                file[each] = values
    with pytest.raises(ForeignFile, match="theta: not numbers"):
        read(tmp_path / name)


def test_a_name_that_is_twice_in_a_header_is_refused(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("t,theta,theta\n" + "".join(f"{k},1,2\n" for k in range(6)))
    with pytest.raises(ForeignFile, match="1: theta is there twice"):
        read(path)


def test_a_component_that_is_named_goes_with_usual_ones():
    x, y, z = RECORD.axis.T
    data = read({"t": TIMES, "a": x, "ey": y, "ez": z}, {"axis_x": "a"})
    assert np.array_equal(data.axis, RECORD.axis)
    assert np.array_equal(read({"t": TIMES, "x": x, "y": y, "z": z}).axis, RECORD.axis)
    with pytest.raises(ForeignFile, match="a: one column for theta and for phi"):
        read({"t": TIMES, "a": x}, {"theta": "a", "phi": "a"})


@pytest.mark.parametrize("columns", [{None: "t"}, {"t": ["t"]}, {"t": 3}])
def test_names_that_are_no_text_are_refused(columns):
    with pytest.raises(WrongType, match="columns: texts alone"):
        read(angles(RECORD), columns)


FAULTS = {
    "t: a column of at least 5 times": {"theta": [1, 2]},
    "t: times go one way": {"t": [0, 1, 1, 2, 3], "theta": [1] * 5},
    "theta: of shape (4,), not (5,)": {"t": range(5), "theta": [1] * 4},
    "phi: not a finite number in row 3": {"t": range(5), "phi": [0, 0, np.inf, 0, 0]},
    "quaternion: 4 components are needed, and 2 are there": {"qx": [1] * 5, "qy": [1] * 5},
    "axis: its components are not of one length": {"e_x": [1] * 5, "e_y": [1], "e_z": [1] * 5},
    "theta: not a finite number in row 1": {"t": range(5), "theta": [None] * 5, "phi": [1] * 5},
    "t: not a finite number in row 1": {"t": [np.nan, 1, 2, 3, 4], "theta": [1] * 5},
    "t: not a finite number in row 5": {"t": [0, 1, 2, 3, np.inf], "theta": [1] * 5},
    "axis: a value is larger than 1e+15": {"t": range(5), "axis": np.full((5, 3), 1e200)},
    "omega: a value is larger than 1e+15": {"t": range(5), "omega": np.full((5, 3), -1e200)},
    "t: a value is larger than 1e+15": {"t": [0, 1, 2, 3, 1e200], "theta": [1] * 5},
    "theta: a value is larger than 1e+15": {"t": range(5), "theta": [1, 2, 3, 4, 1e200]},
    "phi: not numbers": {"t": range(5), "phi": np.ones(5, complex)},
    "psi: not numbers": {"t": range(5), "psi": np.arange(5).astype("datetime64[s]")},
    "theta: not numbers": {"t": range(5), "theta": ["a"] * 5},
    "axis: of length 0": {"t": range(5), "axis": np.zeros((5, 3))},
    "nothing tells where the axis is": {"t": range(5), "speed": [1] * 5},
}


@pytest.mark.parametrize("told", FAULTS)
def test_a_fault_is_told(told):
    with pytest.raises(ForeignFile) as error:
        read(FAULTS[told])
    assert told in str(error.value)


def test_every_fault_is_told_at_once(tmp_path):
    with pytest.raises(ForeignFile) as error:
        read({"t": [0, 2, 1, 3, 4], "theta": [1], "phi": ["x"]}, {"psy": "a"})
    told = str(error.value)
    assert all(x in told for x in ("t: times", "theta: of", "phi: not", "psy: no", "a: no such"))
    path = tmp_path / "bad.csv"
    path.write_text("t,theta\n0,1\n1,x\n2\n# a remark\n3,4\n")
    with pytest.raises(ForeignFile) as error:
        read(path)
    assert str(error.value) == f"{path}:3: not numbers alone\n{path}:4: 1 values under 2 names"


HEADLESS = "1: a header with the names"
FOREIGN = {
    "none.csv": (None, "No such file"),
    "headless.csv": (b"0,1\n1,2\n", HEADLESS),
    "empty.csv": (b"", HEADLESS),
    "bytes.csv": (b"\xff\xfe\x00", "not readable"),
    "no.npz": (b"PK nothing", "not readable"),
    "no.mat": (b"nothing at all" * 20, "not readable"),
    "no.nc": (b"CDF\x01", "not readable"),
}


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_file_is_refused(tmp_path, name):
    content, told = FOREIGN[name]
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ForeignFile, match=told):
        read(tmp_path / name)


def test_no_file_can_execute(tmp_path):
    np.savez(tmp_path / "mine.npz", t=np.array([object()], dtype=object))
    with pytest.raises(ForeignFile, match="not readable"):
        read(tmp_path / "mine.npz")


def test_what_is_no_data_is_refused():
    with pytest.raises(WrongType, match="data: the path of a file, or arrays"):
        read(3)
