"""Read a trajectory: what a file or arrays give, by quantity and in SI units."""

from __future__ import annotations

import csv
import os
import re
from array import array
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.checking.headers import QUANTITY_SHAPES, Meaning, complete_set, meanings, parse_unit
from heavytop.errors import ForeignFile
from heavytop.scene.arguments import expect, path_of, wrong_type
from heavytop.text import harmless, nearest

Array = NDArray[np.float64]
Table = Mapping[str, Any]

LEAST_ROWS: Final = 5
RUN: Final = "trajectory.nc"  # in the folder of a run
FIRST_FAULTS: Final = 5  # of each kind that are listed
LARGEST_VALUE: Final = 1e15  # of any value: beyond it an angle in doubles has no direction
HEAD_LINES: Final = 40  # among which the header is looked for
POSITIONS: Final = ("theta", "phi", "psi", "elevation", "axis", "quaternion", "matrix", "vertical")
READ_RATES: Final = ("thetadot", "phidot", "psidot", "elevationdot")
DECLARED: Final = {  # by the kind and the size of a unit
    ("angle", 0.017453293): ("degrees", "the header says that angles are in degrees"),
    ("rate", 0.017453293): ("degrees", "the header says that rates are in degrees"),
    ("rate", 0.104719755): ("rpm", "the header says that rates are in turns a minute"),
    ("time", 0.001): ("milliseconds", "the header says that times are in milliseconds"),
}


@dataclass(frozen=True)
class Data:
    """A trajectory in SI units.

    `values` has arrays by quantity, `columns` the quantity of every column, empty where it has
    none; `declared` are the conventions that headers declare, `remarks` what was done on reading.
    `scene` is the scene that a file of ours holds.
    """

    name: str
    t: Array
    values: Mapping[str, Array]
    scene: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    declared: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def updated(self, **values: Array | None) -> Data:
        """The same with other values; None takes one away."""
        changed = {k: v for k, v in (dict(self.values) | values).items() if v is not None}
        return replace(self, values=changed)

    def rows(self, which: Any) -> Data:
        """Some of the rows."""
        some = {name: x[which] for name, x in self.values.items()}
        return replace(self, t=self.t[which], values=some)


class Faults:
    """Faults of a file by their rules: the first five of each, then how many more."""

    def __init__(self, file: str) -> None:
        self.file, self.by_rule = file, defaultdict[str, list[str]](list)

    def add(self, place: str, rule: str, value: object = None) -> None:
        """Note a fault."""
        spelled = "" if value is None else f"{harmless(value)[:40]!r}, "
        self.by_rule[rule].append(f"{self.file}:{place}: {spelled}{rule}")

    def stop(self) -> None:
        """Raise what was noted, if anything."""
        lines = []
        for rule, found in self.by_rule.items():
            lines += found[:FIRST_FAULTS]
            if len(found) > FIRST_FAULTS:
                lines.append(f"{self.file}: {len(found) - FIRST_FAULTS} more: {rule}")
        if lines:
            raise ForeignFile("\n".join(lines))


def read(data: Any, columns: Mapping[str, str] | None = None) -> Data:
    """What a file, or a mapping of arrays, gives.

    Raises
    ------
    ForeignFile
        It cannot be read, or is no trajectory; every fault is listed.
    """
    chosen = expect("columns", {} if columns is None else columns, dict)
    for word in (word for pair in chosen.items() for word in pair):
        if not isinstance(word, str):
            raise wrong_type("columns", "texts alone, such as {'t': 'Zeit'}", word)
    scene = None
    if isinstance(data, str | os.PathLike):
        place = path_of("data", data)
        place = place / RUN if place.is_dir() else place
        faults = Faults(harmless(place))
        table, scene = _load(place, chosen, faults)
        masked = place.suffix.lower() in (".nc", ".h5", ".hdf5")
    elif hasattr(data, "keys"):
        faults = Faults("data")
        table = {str(k): data[k] for k in dict.fromkeys([*data, *getattr(data, "coords", ())])}
        masked = hasattr(data, "coords")
    else:
        raise wrong_type("data", "the path of a file, or arrays by their names", data)
    found = choose_columns(table, chosen, faults)
    values, declared, remarks = _quantities(table, found, faults)
    if masked:
        remarks += _drop_masked(values)
    t, values = _shaped(values, faults)
    if not faults.by_rule and not values.keys() & {*POSITIONS}:
        names = ", ".join(map(str, table))
        rule = f"a column of angles, axis, quaternion or matrix is needed; there are {names}"
        faults.add("1", rule)
    faults.stop()
    used = {name: found[name].quantity if name in found else "" for name in table}
    return _in_order(Data(faults.file, t, values, scene, used, declared, (*remarks,)), faults)


# --- columns -------------------------------------------------------------------------------------


def choose_columns(
    names: Sequence[str] | Table, chosen: Mapping[str, str], faults: Faults
) -> dict[str, Meaning]:
    """The meaning of every column that is understood; no two have the same."""
    possible: dict[str, list[Meaning]] = {}
    for key, column in chosen.items():
        plain, _, unit = (x.strip("] ") for x in column.partition("["))
        alike = [n for n in names if n == column.strip() or n.partition("[")[0].strip() == plain]
        if not (meant := meanings(key)):
            faults.add("1", "no quantity has this name (theta, phi, psi, axis_x, qw, …)", key)
        elif not alike:
            faults.add("1", f"no such column {nearest(column, names)}".rstrip(), column)
        else:
            own = next(iter(meanings(alike[0])), meant[0]).unit
            if spelled := unit or alike[0].partition("[")[2].rstrip("] "):
                own = parse_unit(spelled, key)
            possible[alike[0]] = [meant[0]._replace(unit=own)]
    possible |= {name: meanings(name) for name in names if name not in possible}
    found: dict[str, Meaning] = {}
    for quantity in ("t", *QUANTITY_SHAPES, *POSITIONS[:4], *READ_RATES):
        here = {
            meaning.component: (name, meaning)
            for name, some in reversed(possible.items())
            for meaning in some
            if meaning.quantity == quantity and name not in found
        }
        whole = quantity not in QUANTITY_SHAPES or "" in here
        components = ("",) if whole else complete_set(quantity, {*here})
        found |= dict(here[component] for component in components if component in here)
    return found


def _quantities(
    table: Table, found: dict[str, Meaning], faults: Faults
) -> tuple[dict[str, Array], dict[str, str], list[str]]:
    """The arrays by quantity in SI units, and the conventions and units that headers declare.

    Columns that hold no such quantity are taken out of those that were found.
    """
    values: dict[str, Array] = {}
    parts: dict[str, dict[str, Array]] = defaultdict(dict)
    declared: dict[str, str] = {}
    units: dict[str, list[str]] = defaultdict(list)
    for name, (quantity, component, unit) in [*found.items()]:
        spelled = getattr(table[name], "attrs", {}).get("units")
        unit = parse_unit(spelled, quantity) or unit if isinstance(spelled, str) else unit
        numbers = _numbers(table[name])
        if numbers is None or (quantity in QUANTITY_SHAPES and not component and numbers.ndim < 2):
            del found[name]  # a text, or one number a row where vectors have three
            if quantity == "t":
                faults.add(f"1: {harmless(name)}", "the times have to be numbers")
            continue
        if unit is not None and unit.factor != 1:
            numbers = numbers * unit.factor
            units[unit.text].append(name)
            if convention := DECLARED.get((unit.kind, round(unit.factor, 9))):
                declared |= [convention]
        (parts[quantity] if component else values)[component or quantity] = numbers
    for quantity, each in parts.items():
        order = complete_set(quantity, {*each})
        if order and len({each[c].shape for c in order}) == 1:
            values[quantity] = np.stack([each[c] for c in order], axis=-1)
        else:
            faults.add("1", f"{quantity} lacks components", ", ".join(sorted(each)))
    if "elevation" in values:
        declared["elevation"] = "the header says that an elevation above the horizontal is given"
    said = [f"{', '.join(names)} in {unit}" for unit, names in units.items()]
    return values, declared, [f"units of the header: {'; '.join(said)}"] * bool(said)


def _numbers(column: Any) -> Array | None:
    """A column as floats, or None where it has no numbers; dates are seconds since the first."""
    values = np.asarray(column)
    if values.dtype.kind == "M":
        values = (values - values.flat[0]).astype("timedelta64[ns]")
    if values.dtype.kind == "m":
        return np.asarray(values / np.timedelta64(1, "s"), dtype=np.float64)
    if values.dtype.kind not in "fiuO" or not values.size:
        return None
    try:
        return np.squeeze(np.asarray(values, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        return None


def _drop_masked(values: dict[str, Array]) -> list[str]:
    """Take rows without a value away, and quantities that lack a component in every row."""
    rows = values["t"].shape if "t" in values else ()
    for name, x in [*values.items()]:
        if x.shape[:1] != rows or np.isnan(x).all(axis=0).any():
            del values[name]
    if not values:
        return []
    there = np.all([np.isfinite(x).reshape(*rows, -1).all(axis=1) for x in values.values()], axis=0)
    for name, x in values.items():
        values[name] = x[there]
    gone = int((~there).sum())
    return [f"{gone} masked rows are not judged"] * bool(gone)


# --- rows ----------------------------------------------------------------------------------------


def _shaped(values: Mapping[str, Array], faults: Faults) -> tuple[Array, dict[str, Array]]:
    """The times, and the other arrays in the shapes that they need to have, of finite numbers."""
    t = values.get("t", np.empty(0))
    if t.ndim != 1 or t.size < LEAST_ROWS:
        faults.add("1", f"a column t of at least {LEAST_ROWS} times is needed ({t.size} found)")
        faults.stop()
    found = {}
    for name, x in values.items():
        shape = (t.size, *QUANTITY_SHAPES.get(name, ()))
        if x.ndim > 1 and x.shape[0] != t.size:  # as MATLAB has it
            x = np.moveaxis(x, -1, 0)
        if x.size != np.prod(shape) or x.shape[:1] != (t.size,):
            faults.add(f"1: {name}", f"has the shape {shape}", x.shape)
            continue
        found[name] = x.reshape(shape)
        flat = x.reshape(t.size, -1)
        with np.errstate(invalid="ignore"):
            bad = ~(abs(flat) < LARGEST_VALUE).all(axis=1)
        if name in ("axis", "quaternion"):
            bad |= ~flat.any(axis=1)
        for row in np.flatnonzero(bad):
            rule = f"a finite number below {LARGEST_VALUE:g}, no vector of length 0, is needed"
            faults.add(f"row {row + 1}: {name}", rule, flat[row].squeeze())
    return found.pop("t"), found


def _in_order(data: Data, faults: Faults) -> Data:
    """The data as time goes on, no time twice."""
    remarks = [*data.remarks]
    if data.t[-1] < data.t[0]:
        data = data.rows(np.s_[::-1])
        remarks.append("the times decrease: the rows are turned round")
    if same := [int(row) + 1 for row in np.flatnonzero(np.diff(data.t) == 0)]:
        rows = ", ".join(str(row + 1) for row in same[:FIRST_FAULTS])
        more = "…" * (len(same) > FIRST_FAULTS)
        remarks.append(f"rows that repeat a time are left out: {rows}{more}")
        data = data.rows(np.delete(np.arange(data.t.size), same))
    for row in np.flatnonzero(np.diff(data.t) < 0) + 1:
        faults.add(f"row {row + 1}: t", "the times must increase or decrease", data.t[row])
    faults.stop()
    return replace(data, remarks=tuple(remarks))


# --- files ---------------------------------------------------------------------------------------


def _load(path: Path, chosen: Mapping[str, str], faults: Faults) -> tuple[Table, str | None]:
    """The columns of a file by name, and the scene that it holds, if any."""
    try:
        match path.suffix.lower():
            case ".npz":
                with np.load(path, allow_pickle=False) as arrays:
                    return dict(arrays), None
            case ".mat":
                return _load_matlab(path), None
            case ".nc" | ".h5" | ".hdf5":
                return _load_netcdf(path)
            case _:
                return _load_text(path, chosen, faults), None
    except ForeignFile:
        raise
    except Exception as fault:  # of several libraries, on bytes that anybody wrote
        why = getattr(fault, "strerror", None) or fault
        raise ForeignFile(f"{harmless(path)}: not readable ({harmless(why)})") from fault


def _load_text(path: Path, chosen: Mapping[str, str], faults: Faults) -> Table:
    """The columns of a text table that are understood; the others by name alone."""
    with path.open("rb") as binary:
        start = binary.read(400)
    wide = start[:2] in (b"\xff\xfe", b"\xfe\xff") or start.count(0) > len(start) / 4
    encoding = "utf-16" if wide else "utf-8-sig"
    with path.open(encoding=encoding, errors="replace", newline="") as file:
        head = next(_headers([*islice(file, HEAD_LINES)], chosen), None)
        if head is None:
            rule = "a header with the names of the columns is needed, t among them"
            raise ForeignFile(f"{faults.file}:1: {rule}")
        first, between, names = head
        columns = {name: array("d") for name in choose_columns(names, chosen, Faults(""))}
        places = [(names.index(name), name, column) for name, column in columns.items()]
        file.seek(0)
        lines = (line.strip() for line in islice(file, first, None))
        table = csv.reader(lines, delimiter=between, skipinitialspace=True)
        for row in table:
            at = table.line_num + first
            if not row or row[0].startswith(("#", "%")):
                continue
            if len(row) != len(names) and len([*filter(None, row)]) != len(names):
                faults.add(f"{at}", f"{len(names)} values are needed", f"{len(row)} values")
                continue
            for k, name, column in places:
                try:
                    column.append(float(row[k].replace(",", ".")))
                except ValueError:
                    faults.add(f"{at}: {harmless(name)}", "no number", row[k])
    faults.stop()
    return dict.fromkeys(names, "") | {name: np.array(x) for name, x in columns.items()}


def _headers(
    lines: Sequence[str], chosen: Mapping[str, str]
) -> Iterator[tuple[int, str, list[str]]]:
    """What may be the header: where its rows begin, the delimiter, the names with their units."""
    columns = {column.partition("[")[0].strip() for column in chosen.values()}
    for at, (line, below) in enumerate(pairwise([*lines, ""])):
        text = line.strip().lstrip("#%").strip()
        for between in (x for x in "\t;, " if x in text):
            names, units = (
                [x.strip() for row in csv.reader([each], delimiter=between) for x in row if x]
                for each in (text, below.strip())
            )
            if sum(bool(meanings(n)) or n.partition("[")[0].strip() in columns for n in names) < 2:
                continue
            names = [n + "#2" * (n in names[:k]) for k, n in enumerate(names)]
            if len(units) != len(names) or any(re.match(r"[-+.]?\d", x) for x in units):
                yield at + 1, between, names
            else:  # a row of units
                spelled = (x.strip("[]() ") for x in units)
                named = zip(names, spelled, strict=True)
                yield at + 2, between, [f"{n} [{x}]" if parse_unit(x, n) else n for n, x in named]


def _load_matlab(path: Path) -> Table:
    """The arrays of a MATLAB file, also those within structures."""
    from scipy.io import loadmat

    try:
        found = loadmat(path, simplify_cells=True, appendmat=False)
    except NotImplementedError:  # since version 7.3 it is HDF5
        return _load_netcdf(path)[0]
    table: dict[str, Any] = {}
    for name, value in found.items():
        table |= value if isinstance(value, dict) else {name: value}
    return {name: value for name, value in table.items() if not name.startswith("__")}


def _load_netcdf(path: Path) -> tuple[Table, str | None]:
    """The variables of a netCDF or HDF5 file, as CF attributes say; a run of ours has its scene."""
    import xarray

    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    options: dict[str, Any] = {"engine": "scipy" if classic else "h5netcdf"}
    options |= {} if classic else {"phony_dims": "sort"}
    with xarray.open_dataset(path, decode_timedelta=False, **options) as dataset:
        table = {str(name): dataset[name].load() for name in dataset.variables}
        scene = dataset.attrs.get("scene") if "plan" in dataset.attrs else None
    return table, scene if isinstance(scene, str) else None
