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

from heavytop.checking.headers import SHAPES, Meaning, complete_set, meanings, parse_unit
from heavytop.errors import ForeignFile
from heavytop.scene.arguments import expect, path_of, wrong_type
from heavytop.text import harmless, nearest

Array = NDArray[np.float64]

LEAST_ROWS: Final = 5
RUN: Final = "trajectory.nc"  # in the folder of a run
FIRST_FAULTS: Final = 5  # of each kind that are listed
LARGEST: Final = 1e15  # of any value: beyond it an angle in doubles has no direction
HEAD_LINES: Final = 40  # among which the header is looked for
CHUNK_ROWS: Final = 50_000  # of a table that are texts at once
POSITIONS: Final = ("theta", "phi", "psi", "elevation", "axis", "quaternion", "matrix", "vertical")
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
        return replace(
            self, t=self.t[which], values={name: x[which] for name, x in self.values.items()}
        )


class Faults:
    """Faults by kind: the first five of each, then how many more."""

    def __init__(self, file: str) -> None:
        self.file, self.kinds = file, defaultdict[str, list[str]](list)

    def add(self, place: str, rule: str, value: object = None) -> None:
        """Note a fault: its row and column, the value, and the rule that it breaks."""
        shown = "" if value is None else f"{harmless(value)[:40]!r}, "
        self.kinds[rule].append(f"{self.file}:{place}: {shown}{rule}")

    def stop(self) -> None:
        """Raise what was noted, if anything."""
        if self.kinds:
            lines = []
            for rule, found in self.kinds.items():
                lines += found[:FIRST_FAULTS]
                if more := len(found) - FIRST_FAULTS:
                    lines += [f"{self.file}: {more} more: {rule}"] * (more > 0)
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
    scene, masked = None, False
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
    ordered = _in_order(values, faults)
    if not faults.kinds and not ordered.values.keys() & {*POSITIONS}:
        names = ", ".join(map(str, table))
        faults.add(
            "1", f"a column of angles, axis, quaternion or matrix is needed; there are {names}"
        )
    faults.stop()
    used = {name: found[name].quantity if name in found else "" for name in table}
    remarks += ordered.remarks
    return Data(faults.file, ordered.t, ordered.values, scene, used, declared, tuple(remarks))


# --- columns -------------------------------------------------------------------------------------


def choose_columns(
    names: Sequence[str] | Mapping[str, Any], chosen: Mapping[str, str], faults: Faults
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
    for quantity in ("t", *SHAPES, *POSITIONS[:4], "thetadot", "phidot", "psidot", "elevationdot"):
        here = {
            meaning.component: (name, meaning)
            for name, some in reversed(possible.items())
            for meaning in some
            if meaning.quantity == quantity and name not in found
        }
        whole = quantity not in SHAPES or "" in here
        for component in ("",) if whole else complete_set(quantity, {*here}):
            if component in here:
                name, meaning = here[component]
                found[name] = meaning
    return found


def _quantities(
    table: Mapping[str, Any], found: dict[str, Meaning], faults: Faults
) -> tuple[dict[str, Array], dict[str, str], list[str]]:
    """The arrays by quantity in SI units, and the conventions and units that headers declare."""
    values: dict[str, Array] = {}
    parts: dict[str, dict[str, Array]] = defaultdict(dict)
    declared: dict[str, str] = {}
    units: dict[str, list[str]] = defaultdict(list)
    for name, meaning in [*found.items()]:
        quantity, unit = meaning.quantity, meaning.unit
        spelled = getattr(table[name], "attrs", {}).get("units")
        unit = parse_unit(spelled, quantity) or unit if isinstance(spelled, str) else unit
        array = _numbers(table[name])
        if array is None or (quantity in SHAPES and not meaning.component and array.ndim < 2):
            del found[name]  # a text, or one number a row where vectors have three
            if quantity == "t":
                faults.add(f"1: {harmless(name)}", "the times have to be numbers")
            continue
        if unit is not None and unit.factor != 1:
            array = array * unit.factor
            units[unit.text].append(name)
            if convention := DECLARED.get((unit.kind, round(unit.factor, 9))):
                declared |= [convention]
        if meaning.component:
            parts[quantity][meaning.component] = array
        else:
            values[quantity] = array
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


def _in_order(values: dict[str, Array], faults: Faults) -> Data:
    """The arrays, in the shapes that they need to have, as time goes on."""
    t = values.pop("t", np.empty(0))
    if t.ndim != 1 or t.size < LEAST_ROWS:
        faults.add("1", f"a column t of at least {LEAST_ROWS} times is needed ({t.size} found)")
        faults.stop()
    shaped = {}
    for name, x in values.items():
        shape = (t.size, *SHAPES.get(name, ()))
        if x.ndim > 1 and x.shape[0] != t.size:  # as MATLAB has it
            x = np.moveaxis(x, -1, 0)
        if x.size != np.prod(shape) or x.shape[:1] != (t.size,):
            faults.add(f"1: {name}", f"has the shape {shape}", x.shape)
            continue
        shaped[name] = x.reshape(shape)
    for name, x in {"t": t, **shaped}.items():
        flat = x.reshape(t.size, -1)
        with np.errstate(invalid="ignore"):
            bad = ~(abs(flat) < LARGEST).all(axis=1)
        if name in ("axis", "quaternion"):
            bad |= ~flat.any(axis=1)
        for row in np.flatnonzero(bad)[: 10 * FIRST_FAULTS]:
            rule = f"a finite number below {LARGEST:g}, no vector of length 0, is needed"
            faults.add(f"row {row + 1}: {name}", rule, flat[row].squeeze())
    data = Data("", t, shaped)
    if faults.kinds:
        return data
    remarks = []
    if t[-1] < t[0]:
        data, remarks = data.rows(np.s_[::-1]), ["the times decrease: the rows are turned round"]
    same = np.flatnonzero(np.diff(data.t) == 0) + 1
    if same.size:
        rows = ", ".join(str(row + 1) for row in same[:FIRST_FAULTS])
        remarks.append(f"rows that repeat a time are left out: {rows}{'…' * (same.size > 5)}")
        data = data.rows(np.setdiff1d(np.arange(t.size), same))
    for row in np.flatnonzero(np.diff(data.t) < 0)[: 10 * FIRST_FAULTS] + 1:
        faults.add(f"row {row + 1}: t", "the times must increase or decrease", data.t[row])
    return replace(data, remarks=tuple(remarks))


# --- files ---------------------------------------------------------------------------------------


def _load(
    path: Path, chosen: Mapping[str, str], faults: Faults
) -> tuple[dict[str, Any], str | None]:
    """The columns of a file by name, and the scene that it holds, if any."""
    try:
        match path.suffix.lower():
            case ".npz":
                with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                    return dict(arrays), None
            case ".mat":
                return _matlab(path), None
            case ".nc" | ".h5" | ".hdf5":
                return _netcdf(path)
            case _:
                return _text_table(path, chosen, faults), None
    except ForeignFile:
        raise
    except Exception as fault:  # of several libraries, on bytes that anybody wrote
        why = getattr(fault, "strerror", None) or fault
        raise ForeignFile(f"{harmless(path)}: not readable ({harmless(why)})") from fault


def _text_table(path: Path, chosen: Mapping[str, str], faults: Faults) -> dict[str, Any]:
    """The columns of a text table that are understood; the others by name alone."""
    with path.open("rb") as binary:
        start = binary.read(400)
    wide = start[:2] in (b"\xff\xfe", b"\xfe\xff") or start.count(0) > len(start) / 4
    encoding = "utf-16" if wide else "utf-8-sig"
    with path.open(encoding=encoding, errors="replace", newline="") as file:
        found = next(_headers([*islice(file, HEAD_LINES)], chosen), None)
        if found is None:
            faults.add("1", "a header with the names of the columns is needed, t among them")
            faults.stop()
            raise AssertionError
        first, between, names = found
        columns = {name: array("d") for name in choose_columns(names, chosen, Faults(""))}
        file.seek(0)
        lines = (line.strip() for line in islice(file, first, None))
        table = csv.reader(lines, delimiter=between, skipinitialspace=True)
        rows = ((table.line_num + first, x) for x in table if x and x[0][:1] not in ("#", "%"))
        while some := [*islice(rows, CHUNK_ROWS)]:
            for at, row in some:
                if len(row) != len(names) and len([*filter(None, row)]) != len(names):
                    faults.add(str(at), f"{len(names)} values are needed", f"{len(row)} values")
            if not faults.kinds:
                for name, column in columns.items():
                    column.extend(_floats(some, names.index(name), name, faults))
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
            known = [n for n in names if meanings(n) or n.partition("[")[0].strip() in columns]
            if len(known) < 2:
                continue
            names = [n + "#2" * (n in names[:k]) for k, n in enumerate(names)]
            if len(units) != len(names) or any(re.match(r"[-+.]?\d", x) for x in units):
                yield at + 1, between, names
            else:  # a row of units
                spelled = (x.strip("[]() ") for x in units)
                named = zip(names, spelled, strict=True)
                yield at + 2, between, [f"{n} [{x}]" if parse_unit(x, n) else n for n, x in named]


def _floats(
    rows: list[tuple[int, list[str]]], k: int, name: str, faults: Faults
) -> Iterator[float]:
    """The numbers of a column, also with decimal commas."""
    try:
        yield from [float(row[k]) for _, row in rows]
    except ValueError:
        for at, row in rows:
            try:
                yield float(row[k].replace(",", "."))
            except ValueError:
                faults.add(f"{at}: {harmless(name)}", "no number", row[k])


def _matlab(path: Path) -> dict[str, Any]:
    """The arrays of a MATLAB file, also those within structures."""
    from scipy.io import loadmat

    try:
        with path.open("rb") as file:
            found = loadmat(file, simplify_cells=True)
    except NotImplementedError:  # since version 7.3 it is HDF5
        return _netcdf(path)[0]
    table: dict[str, Any] = {}
    for name, value in found.items():
        table |= value if isinstance(value, dict) else {name: value}
    return {name: value for name, value in table.items() if not name.startswith("__")}


def _netcdf(path: Path) -> tuple[dict[str, Any], str | None]:
    """The variables of a netCDF or HDF5 file, as CF attributes say; a run of ours has its scene."""
    import xarray

    with path.open("rb") as file:
        classic = file.read(3) == b"CDF"
    options: dict[str, Any] = {"engine": "scipy" if classic else "h5netcdf"}
    options |= {} if classic else {"phony_dims": "sort"}
    with xarray.open_dataset(path, decode_timedelta=False, **options) as dataset:
        table = {str(name): dataset[name].load() for name in dataset.variables}
        scene = dataset.attrs.get("scene") if "plan" in dataset.attrs else None
    if scene is not None and not isinstance(scene, str):
        raise ForeignFile(f"{harmless(path)}: its attribute scene is no text")
    return table, scene
