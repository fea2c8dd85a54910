"""Reading of trajectories: the quantities of a file or of arrays, in SI units."""

from __future__ import annotations

import csv
import os
import re
import warnings
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from io import StringIO
from itertools import chain, islice
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.checking.headers import Unit, complete_set, grain_of, is_rounded, meanings, parse_unit
from heavytop.errors import ForeignFile
from heavytop.exact.pairs import Array
from heavytop.scene.arguments import expect, path_of, wrong_type
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.text import nearest, printable

DataTable = Mapping[str, Any]
Headers = dict[str, list[tuple[str, Unit | None]]]

LEAST_ROWS: Final = 5
RUN_FILE: Final = "trajectory.nc"  # in the folder of a run
ROWS_LISTED: Final = 5
COLUMNS_LISTED: Final = 20
LARGEST_VALUE: Final = 1e15  # beyond it an angle in doubles has no direction
LENGTHS: Final = {"axis": 1.0, "quaternion": 1.0, "vertical": 1.0, "matrix": np.sqrt(3)}
LENGTH: Final = 1e-6  # relative difference of a length from 1 without a remark
HEAD_LINES: Final = 40  # lines in which the header is looked for
READ_SHAPES: Final[Mapping[str, tuple[int, ...]]] = {  # of one value of each quantity
    "t": (), "quaternion": (4,), "matrix": (3, 3),
    **dict.fromkeys(("axis", "omega", "omega_body", "momentum_body", "vertical"), (3,)),
    **dict.fromkeys((*ANGLES, "elevation", *RATES, "elevationdot"), ()),
}  # fmt: skip
POSITIONS: Final = (*ANGLES, "elevation", "axis", "quaternion", "matrix", "vertical")


class Data(NamedTuple):
    """A trajectory in SI units.

    `values` has arrays by quantity, the times `t` among them; `shaken` has them with random
    roundings added, and is empty where all digits are written. `remarks` say what was done on
    reading, `declared` are the conventions that headers declare, `columns` has the quantity of
    every column, empty where it has none, `scene` is the scene in a file of this package.
    """

    name: str
    values: Mapping[str, Array]
    shaken: Mapping[str, Array]
    remarks: Sequence[str]
    declared: Sequence[str]
    columns: Mapping[str, str]
    scene: object


def read(data: Any, columns: Mapping[str, str] | None = None) -> Data:
    """Read a file, or a mapping of arrays.

    Raises
    ------
    ForeignFile
        It cannot be read, or is no trajectory; every fault is listed.
    """
    chosen = expect("columns", {} if columns is None else columns, dict)
    if wrong := [x for pair in chosen.items() for x in pair if not isinstance(x, str)]:
        raise wrong_type("columns", "texts alone, such as {'t': 'Zeit'}", wrong[0])
    name, given = "data", data
    if isinstance(data, str | os.PathLike):
        path = path_of("data", data)
        path = path / RUN_FILE if path.is_dir() else path
        name, given = printable(path), _load(path, chosen)
    elif not hasattr(data, "keys"):
        raise wrong_type("data", "the path of a file, or arrays by their names", data)
    elif any(getattr(getattr(data, "index", None), "names", ())):  # an index of pandas, such as t
        given = data.reset_index()
    table = {str(each): given[each] for each in getattr(given, "variables", given)}
    about, faults = getattr(given, "attrs", {}), list[str]()
    scene = about.get("scene") if "plan" in about else None  # in the file of a run
    numbers = {each: x for each, column in table.items() if (x := _floats(column)) is not None}
    found = choose_columns(table, numbers, chosen, faults)
    values = _si_values(numbers, found, faults)
    declared, remarks = _read_declared(found)
    rows = _usable_rows(table, values, faults, remarks)
    if faults:
        raise ForeignFile("\n".join(f"{name}: {printable(fault)}" for fault in faults))
    grain = _si_values({each: grain_of(x) for each, x in numbers.items()}, found, [])
    grain["t"] = grain["t"] * is_rounded(values["t"], grain["t"])
    random, kept = np.random.default_rng(0), {x: values[x][rows] for x in values}
    moved = {  # by the RMS of rounding, up or down
        x: y + grain[x][rows] / np.sqrt(3) * random.choice((-1, 1), y.shape)
        for x, y in kept.items()
    }
    shaken = _normalize(moved, []) if any(x[rows].any() for x in grain.values()) else {}
    used = dict.fromkeys(table, "")
    used |= {column: quantity for quantity, columns in found.items() for column, _ in columns}
    return Data(name, _normalize(kept, remarks), shaken, remarks, declared, used, scene)


# --- columns -------------------------------------------------------------------------------------


def choose_columns(
    table: DataTable, numbers: DataTable, chosen: Mapping[str, str], faults: list[str]
) -> Headers:
    """The columns of each quantity, and their units, in the order of its components."""
    split = {name: _split_unit(name, x) for name, x in table.items()}
    possible = {name: meanings(*split[name]) or meanings(name) for name in numbers}
    for key, column in chosen.items():
        plain, unit = _split_unit(column)
        alike = [n for n in table if n == column.strip()] or [
            n for n in table if split[n][0] == plain
        ]
        if not (meant := meanings(key)):
            faults.append(f"{key!r}, no quantity has this name (theta, phi, psi, axis_x, qw, …)")
        elif not alike:
            faults.append(f"{column!r}, no such column {nearest(column, table)}")
        else:
            own = next(iter(meanings(alike[0])), meant[0]).unit
            if spelled := unit or split[alike[0]][1]:
                own = parse_unit(spelled, key)
            # Before columns that mean the same by their own names.
            possible = {alike[0]: []} | possible | {alike[0]: [meant[0]._replace(unit=own)]}
    found: Headers = {}
    for quantity, shape in READ_SHAPES.items():
        here = {
            component: (name, unit)
            for name, some in reversed(possible.items())
            for meant_by, component, unit in some
            if meant_by == quantity and (not shape or component or numbers[name].ndim > 1)
        }
        if order := complete_set(quantity, here):
            found[quantity] = [here[component] for component in order]
            possible = {
                name: x for name, x in possible.items() if name not in dict(found[quantity])
            }
    return found


def _split_unit(name: str, column: Any = None) -> tuple[str, str]:
    """The name of a column, and its unit: that of its attributes, or in brackets after its name."""
    bare, _, unit = name.partition("[")
    return bare.strip(), str(getattr(column, "attrs", {}).get("units", unit.rstrip("] ")))


def _floats(column: Any) -> Array | None:
    """A column as floats, nan where it has no number; dates as seconds since the first.

    None where it has no numbers, or a component has none.
    """
    if np.ma.isMaskedArray(column):
        column = np.ma.filled(column.astype(float), np.nan)
    values = np.asarray(column)
    if values.dtype.kind == "M":
        values = (values - values.flat[0]).astype("timedelta64[ns]")
    if values.dtype.kind == "m":
        values = values / np.timedelta64(1, "s")
    if values.dtype.kind == "O":
        import pandas

        finite = [np.inf if isinstance(x, int) and abs(x) > 1e300 else x for x in values.flat]
        values = np.reshape(pandas.to_numeric(finite, errors="coerce"), values.shape)
    if values.dtype.kind not in "fiu" or not np.isfinite(values).any(axis=0).all():
        return None
    return np.atleast_1d(np.squeeze(values.astype(np.float64)))


def _si_values(numbers: DataTable, found: Headers, faults: list[str]) -> dict[str, Array]:
    """The arrays by quantity in SI units, in the shapes of `READ_SHAPES`."""
    if "t" not in found:
        return {}
    rows, values = numbers[found["t"][0][0]].size, dict[str, Array]()
    for quantity, those in found.items():
        columns = [numbers[name] * (unit.factor if unit else 1.0) for name, unit in those]
        shape = (rows, *READ_SHAPES[quantity])
        columns = [np.moveaxis(x, -1, 0) if len(x) != rows else x for x in columns]  # as MATLAB
        if all(len(x) == rows for x in columns) and sum(x.size for x in columns) == np.prod(shape):
            values[quantity] = np.stack(columns, axis=-1).reshape(shape)
        else:
            faults.append(f"{quantity}: needs the shape {shape}, not {columns[0].shape}")
    return values


def _read_declared(found: Headers) -> tuple[list[str], list[str]]:
    """The conventions that headers declare, and a remark on their units."""
    units = defaultdict[Unit, list[str]](list)
    for name, unit in chain.from_iterable(found.values()):
        if unit and unit.factor != 1:
            units[unit].append(name)
    declared = [unit.convention for unit in units] + ["elevation"] * ("elevation" in found)
    said = [f"{', '.join(names)} in {unit.text}" for unit, names in units.items()]
    named = [*dict.fromkeys(filter(None, declared))]
    return named, [f"units of the header: {'; '.join(said)}"] * bool(said)


# --- rows ----------------------------------------------------------------------------------------


def _usable_rows(
    table: DataTable, values: Mapping[str, Array], faults: list[str], remarks: list[str]
) -> Any:
    """The rows that have all values, in the order of time, no time twice."""
    may_lack = any(hasattr(x, "dims") or np.ma.isMaskedArray(x) for x in table.values())
    kept = np.ones(len(values.get("t", ())), dtype=bool)
    for name, x in values.items():
        flat = x.reshape(len(x), -1)
        missing = np.isnan(flat).any(axis=1) & may_lack
        bad = ~((abs(flat) < LARGEST_VALUE).all(axis=1) | missing)
        if name in LENGTHS:
            bad |= ~flat.any(axis=1)
        if bad.any():
            rule = f"a finite number below {LARGEST_VALUE:g}, no vector of length 0, is needed"
            faults.append(f"{name}: {rule} in {_row_list(bad)}")
        kept &= ~missing
    rows = np.flatnonzero(kept)
    if faults:
        return rows
    there = f"there are {', '.join([*table][:COLUMNS_LISTED]) or 'no columns'}"
    if "t" in values and not values.keys() & {*POSITIONS}:
        faults.append(f"numbers of angles, axis, quaternion or matrix are needed; {there}")
    if rows.size < kept.size:
        remarks.append(f"{kept.size - rows.size} masked rows are not judged")
    times = values.get("t", np.zeros(0))[rows]
    if times.size and times[-1] < times[0]:
        rows, times = rows[::-1], times[::-1]
        remarks.append("the times decrease: the rows are turned round")
    steps = np.diff(times, prepend=-np.inf)
    if (steps == 0).any():
        remarks.append(f"what repeats a time is left out: {_row_list(steps == 0)}")
    if (steps < 0).any():
        faults.append(f"t: the times must increase or decrease: {_row_list(steps < 0)}")
    if (n := np.count_nonzero(steps)) < LEAST_ROWS:
        faults.append(f"a column t of at least {LEAST_ROWS} times is needed ({n} found); {there}")
    return rows[steps != 0]


def _row_list(rows: Any) -> str:
    """Words that list the first of some rows."""
    found = np.flatnonzero(rows) + 1
    more = f", and {found.size - ROWS_LISTED} more" * (found.size > ROWS_LISTED)
    return f"row {', '.join(map(str, found[:ROWS_LISTED]))}{more}"


# --- lengths and descriptions --------------------------------------------------------------------


def _normalize(values: dict[str, Array], remarks: list[str]) -> dict[str, Array]:
    """The arrays with lengths of 1, with matrices of quaternions, and tilts for elevations.

    Vectors are divided by the first length, so that a drift of the length stays in the data.
    """
    values = dict(values)
    for name in [name for name in LENGTHS if name in values]:
        length = norm(values[name]) / LENGTHS[name]
        first = float(np.median(length[:5]))
        values[name] = values[name] / first
        if abs(first - 1) > LENGTH:
            remarks.append(f"the {name} is scaled to length 1: it has {first:.6g}")
        drift = abs(length / first - 1)
        if drift.max() > LENGTH:
            row = int(drift.argmax()) + 1
            remarks.append(f"the length of the {name} changes by {drift.max():.2g} (row {row})")
    if "quaternion" in values:
        q = values["quaternion"]
        values["matrix"] = matrices(q)
        if flips := int((np.einsum("ni,ni->n", q[1:], q[:-1]) < 0).sum()):
            remarks.append(f"the quaternion changes its sign {flips} times, which is no motion")
    elif "matrix" in values and (np.linalg.det(values["matrix"]) < 0).any():
        remarks.append("R is improper: its determinant is −1")
    if "elevation" in values and "theta" not in values:
        elevation = values.pop("elevation")
        values["theta"] = (90 if abs(elevation).max() > 2 else np.pi / 2) - elevation
    if "elevationdot" in values and "thetadot" not in values:
        values["thetadot"] = -values.pop("elevationdot")
    return values


def norm(vectors: Array) -> Array:
    """The length of each row, of a number, a vector or a matrix."""
    flat = vectors.reshape(len(vectors), -1)
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", flat, flat)))


def matrices(quaternion: Array) -> Array:
    """The rotation of quaternions, scalar first, of any length."""
    w, x, y, z = (quaternion / norm(quaternion)[:, None]).T
    entries = (
        *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack(entries, axis=-1).reshape(-1, 3, 3)


# --- files ---------------------------------------------------------------------------------------


def _load(path: Path, chosen: Mapping[str, str]) -> Any:
    """The columns of a file by name."""
    try:
        match path.suffix.lower():
            case ".npz":
                with np.load(path, allow_pickle=False) as arrays:
                    return dict(arrays)
            case ".mat":
                return _load_matlab(path)
            case ".nc" | ".h5" | ".hdf5":
                return _load_netcdf(path)
            case _:
                return _load_text(path, chosen)
    except Exception as fault:  # any error of several libraries
        why = " ".join(str(getattr(fault, "strerror", None) or fault).split())
        raise ForeignFile(f"{printable(path)}: not readable ({printable(why)})") from fault


def _load_text(path: Path, chosen: Mapping[str, str]) -> DataTable:
    """The columns of a text table; no row may have more values than the header has names."""
    import pandas

    raw = path.read_bytes()
    wide = raw[:2] in (b"\xff\xfe", b"\xfe\xff") or raw[:400].count(0) > len(raw[:400]) / 4
    try:
        text = raw.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:  # as Excel writes ° and ä
        text = raw.decode("latin-1")
    lines = [*islice(StringIO(text, newline=None), HEAD_LINES)]
    chosen_names = {_split_unit(column)[0] for column in chosen.values()}
    first, delimiter, names = _find_header(lines, chosen_names)
    comma = delimiter != "," and any("," in line for line in lines[first:])
    marks = {"sep": r"\s+" if delimiter == " " else delimiter, "decimal": "," if comma else "."}
    rows: dict[str, Any] = {"names": names, "skiprows": first, "index_col": False, "comment": "#"}
    with warnings.catch_warnings(action="error", category=pandas.errors.ParserWarning):
        return dict(pandas.read_csv(StringIO(text), skipinitialspace=True, **marks, **rows))


def _find_header(lines: Sequence[str], wanted: Collection[str]) -> tuple[int, str, list[str]]:
    """The number of the first row of values, the delimiter, and the names of the columns."""
    for at, line in enumerate(lines):
        for delimiter in (x for x in "\t;, " if x in line):
            names = _cells(line, delimiter)
            if sum(_split_unit(n)[0] in wanted or bool(meanings(n)) for n in names) < 2:
                continue
            names = [f"{n} (again {k})" if n in names[:k] else n for k, n in enumerate(names)]
            below = _cells("".join(lines[at + 1 : at + 2]), delimiter)
            if len(below) != len(names) or any(x[-1:].isdigit() or x == "nan" for x in below):
                return at + 1, delimiter, names
            units = (x.strip("[]()") for x in below)  # the next line has the units
            return at + 2, delimiter, [f"{n} [{x}]" for n, x in zip(names, units, strict=True)]
    rule = "a header with the names of t and of angles, axis, quaternion or matrix is needed"
    raise ForeignFile(f"{rule}; columns says what is yours, such as t=Zeit,theta=tilt")


def _cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without a mark of comments and empty cells at the end."""
    text = re.sub(r"^\s*[#%]+\s*", "", line).strip(" \n").rstrip(delimiter)
    row = csv.reader([text], delimiter=delimiter, skipinitialspace=True)
    return [x.strip() for x in next(row, [])]


def _load_matlab(path: Path) -> Any:
    """The arrays of a MATLAB file, also those within structures."""
    from scipy.io import loadmat

    try:
        found = loadmat(path, simplify_cells=True, appendmat=False)
    except NotImplementedError:  # since version 7.3 it is HDF5
        return _load_netcdf(path)
    parts = (x if isinstance(x, dict) else {name: x} for name, x in found.items())
    return {name: x for part in parts for name, x in part.items() if not name.startswith("__")}


def _load_netcdf(path: Path) -> Any:
    """The variables of a netCDF or HDF5 file, as CF attributes say."""
    import xarray

    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    modern: dict[str, Any] = {"engine": "h5netcdf", "phony_dims": "sort"}
    options = {"engine": "scipy"} if classic else modern
    return xarray.load_dataset(path, decode_timedelta=False, **options)
