"""Trajectories of others: what a file or arrays tell of a top, in the package's conventions."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import ForeignFile
from heavytop.hdf5 import dataset
from heavytop.names import nearest
from heavytop.scene.arguments import expect, path_of, wrong_type
from heavytop.spelling import harmless

Array = NDArray[np.float64]

LEAST_ROWS: Final = 5
RUN: Final = "trajectory.nc"  # in the folder of a run
MOST_FAULTS: Final = 20  # of a file, told at once
LARGEST: Final = 1e15  # of any value: beyond it an angle in doubles tells no direction
NO_NUMBERS: Final = np.array("text")  # stands for what is left unread
MATLAB_NUMBERS: Final = ("double", "single", "int", "uint")
ANGLES: Final = ("theta", "phi", "psi")
RATES: Final = ("thetadot", "phidot", "psidot")
TELLING: Final = "theta, phi, psi, axis, quaternion or matrix"

_SCALARS: Final = {
    "t": ("time", "seconds"),
    "theta": ("tilt", "nutation"),
    "phi": ("precession",),
    "psi": ("spin",),
    **{rate: (f"d{rate[:-3]}", f"{rate[:-3]}rate", f"d{rate[:-3]}dt") for rate in RATES},
}
# Of every vector: its names, and those of its components.
_NINE: Final = [f"{i}{j}" for i in "123" for j in "123"]
_VECTORS: Final[Mapping[str, tuple[tuple[str, ...], tuple[Any, ...]]]] = {
    "axis": (("axis", "e", "n"), ("xyz", "123")),
    "quaternion": (("quaternion", "quat", "q", "attitude"), ("wxyz", "0123")),
    "matrix": (("matrix", "rotation", "rot", "r"), (_NINE,)),
    "omega": (("omega", "w", "omegaspace"), ("xyz",)),
    "omega_body": (("omegabody", "bodyomega", "wbody"), ("xyz", "123")),
}
_SHAPES: Final = {"axis": (3,), "quaternion": (4,), "matrix": (3, 3)}
_GREEK: Final = str.maketrans({"θ": "theta", "φ": "phi", "ϕ": "phi", "ψ": "psi", "ω": "omega"})


def plain(name: str) -> str:
    """The letters of a name, without its unit: ``Theta_dot [rad/s]`` is ``thetadot``."""
    return re.sub(r"[\[(].*|[^a-z0-9]", "", name.lower().translate(_GREEK))


def _names() -> Iterator[tuple[str, tuple[str, int | None]]]:
    """Every usual name, with the quantity and the component that it stands for."""
    for quantity, others in _SCALARS.items():
        yield from ((name, (quantity, None)) for name in (quantity, *others))
    for quantity, (others, kinds) in _VECTORS.items():
        yield from ((name, (quantity, None)) for name in others if name not in "enrw")
        for name in others:
            yield from ((name + c, (quantity, k)) for each in kinds for k, c in enumerate(each))
    yield from ((x, ("axis", k)) for k, x in enumerate("xyz"))
    yield from ((f"omega{k + 1}", ("omega_body", k)) for k in range(3))


_USUAL: Final = dict(_names())


@dataclass(frozen=True)
class Data:
    """A trajectory: times, and what is told at each; what follows from that is computed.

    `told` has arrays by quantity; `scene` is the scene that a file of ours holds; `columns` has
    the quantity of every column that is there, empty where it tells none that is known.
    """

    name: str
    t: Array
    told: Mapping[str, Array]
    scene: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)

    def telling(self, **told: Array | None) -> Data:
        """The same, with other values; None takes one away."""
        values = {k: v for k, v in (dict(self.told) | told).items() if v is not None}
        return replace(self, told=values)

    def some(self, rows: slice) -> Data:
        """Some of the rows."""
        told = {name: values[rows] for name, values in self.told.items()}
        return replace(self, t=self.t[rows], told=told)

    @cached_property
    def matrix(self) -> Any:
        """The attitude as matrices (n, 3, 3) from body to space, or None."""
        if "quaternion" not in self.told:
            return self.told.get("matrix")
        q = self.told["quaternion"]
        w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
        rows = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        )
        return np.moveaxis(np.array(rows), -1, 0)

    @cached_property
    def axis(self) -> Any:
        """The symmetry axis (n, 3) in space, or None."""
        if "axis" in self.told:
            return self.told["axis"]
        if self.matrix is not None:
            return self.matrix[:, :, 2]
        if not {"theta", "phi"} <= self.told.keys():
            return None
        theta, phi = self.told["theta"], self.told["phi"]
        sine = np.sin(theta)
        return np.stack([sine * np.sin(phi), -sine * np.cos(phi), np.cos(theta)], axis=1)

    def angle(self, name: str) -> Any:
        """An Euler angle [rad], continuous only where it is told, or None."""
        if name in self.told or self.axis is None:
            return self.told.get(name)
        x, y, z = self.axis.T
        if name == "psi":
            m = self.matrix
            return None if m is None else np.arctan2(m[:, 2, 0], m[:, 2, 1])
        return np.arctan2(np.hypot(x, y), z) if name == "theta" else np.arctan2(x, -y)

    @cached_property
    def omega(self) -> Any:
        """The angular velocity (n, 3) in space [rad/s], or None."""
        if "omega" in self.told:
            return self.told["omega"]
        if "omega_body" in self.told and self.matrix is not None:
            return np.einsum("nij,nj->ni", self.matrix, self.told["omega_body"])
        if not {"phi", *RATES} <= self.told.keys() or self.axis is None:
            return None
        thetadot, phidot, psidot = (self.told[rate] for rate in RATES)
        node = np.stack([np.cos(self.told["phi"]), np.sin(self.told["phi"])], axis=1)
        found = psidot[:, None] * self.axis
        found[:, :2] += thetadot[:, None] * node
        found[:, 2] += phidot
        return found

    @property
    def used(self) -> dict[str, str]:
        """The columns that play a part, with their quantities."""
        idle = {""}
        if self.spinning is None:
            idle |= {"omega", "omega_body"}
        if self.spinning is None or not {*RATES} <= self.told.keys():
            idle |= {*RATES}
        if "omega" in self.told:
            idle.add("omega_body")
        if "quaternion" in self.told:
            idle.add("matrix")
        return {name: quantity for name, quantity in self.columns.items() if quantity not in idle}

    @cached_property
    def spinning(self) -> tuple[Array, Array, Array, Array] | None:
        """Return cosθ, |ė|², ω₃ and ω_z: what energy and momenta are made of."""
        if self.omega is not None and self.axis is not None:
            omega3 = (self.omega * self.axis).sum(axis=1)
            speed = np.cross(self.omega, self.axis)
            return self.axis[:, 2], (speed * speed).sum(axis=1), omega3, self.omega[:, 2]
        if {"theta", *RATES} <= self.told.keys() and "phi" not in self.told:  # which plays no part
            return self.telling(phi=np.zeros_like(self.t)).spinning
        return None


def read(data: Any, columns: Mapping[str, str] | None = None) -> Data:
    """Return what a file, or a mapping of arrays, tells.

    Everything that is wrong with it is raised at once, as `ForeignFile`.
    """
    scene = None
    if isinstance(data, str | os.PathLike):
        place = path_of("data", data)
        name = harmless(place)
        table, scene = _file(place / RUN if place.is_dir() else place)
    elif hasattr(data, "keys"):
        name, keys = "data", [*data, *getattr(data, "coords", ())]
        table = {str(key): data[key] for key in dict.fromkeys(keys)}
    else:
        raise wrong_type("data", "the path of a file, or arrays by their names", data)
    chosen = expect("columns", {} if columns is None else columns, dict)
    for word in (word for pair in chosen.items() for word in pair):
        if not isinstance(word, str):
            raise wrong_type("columns", "texts alone, such as {'t': 'Zeit'}", word)
    if scene is not None:  # an angle that a run of ours did not follow
        table = {name: x for name, x in table.items() if not (_numeric(x) and np.isnan(x).all())}
    faults: list[str] = []
    meant = _meant(table, chosen, faults)
    found = _gathered(table, meant, faults)
    told = _checked(found, faults)
    if not (told.keys() & {*ANGLES, *_SHAPES} or faults):
        names = harmless(", ".join(table)[:200])
        faults.append(f"no columns give the axis: {TELLING} (columns: {names})")
    if faults:
        raise ForeignFile("\n".join(f"{name}: {fault}" for fault in faults[:MOST_FAULTS]))
    tells = {column: meant[column][0] if column in meant else "" for column in table}
    return Data(name, told.pop("t"), told, scene, tells)


def _meant(
    table: Mapping[str, Any], columns: Mapping[str, str], faults: list[str]
) -> dict[str, tuple[str, int | None]]:
    """The quantity and the component that columns stand for; no two for the same."""
    for key, column in columns.items():
        if plain(key) not in _USUAL:
            faults.append(f"{harmless(key)}: no quantity ({TELLING}, t, rates, omega)")
        if column not in table:
            faults.append(f"{harmless(column)}: no such column {nearest(column, table)}".rstrip())
    named = [(column, _USUAL.get(plain(key))) for key, column in columns.items()]
    usual = [(name, _USUAL.get(plain(name))) for name in table if name not in columns.values()]
    found: dict[str, tuple[str, int | None]] = {}
    taken: dict[tuple[str, int | None], str] = {}
    for name, meaning in named + usual:
        if meaning is None or name not in table:
            continue
        quantity, component = meaning
        clash = (
            column
            for (also, k), column in taken.items()
            if also == quantity and (k == component or None in (k, component))
        )
        if (other := next(clash, None)) is not None:
            if other in columns.values() and name not in columns.values():
                continue  # what is named is meant
            faults.append(f"{harmless(name)}: gives {quantity}, and so does {harmless(other)}")
        elif name in found:
            faults.append(f"{harmless(name)}: one column for {found[name][0]} and for {quantity}")
        else:
            found[name], taken[meaning] = meaning, name
    return found


def _gathered(
    table: Mapping[str, Any], meant: Mapping[str, tuple[str, int | None]], faults: list[str]
) -> dict[str, Array]:
    """The arrays of a table by quantity; components are put together."""
    found: dict[str, Array] = {}
    parts: dict[str, dict[int, Array]] = {}
    for name, (quantity, component) in meant.items():
        try:
            values = np.asarray(table[name])
            if values.dtype.kind not in "fiuO":
                raise TypeError
            array = np.squeeze(np.asarray(values, dtype=np.float64))
        except (TypeError, ValueError, OverflowError):
            faults.append(f"{harmless(name)}: not numbers")
            continue
        if component is None:
            found[quantity] = array
        else:
            parts.setdefault(quantity, {})[component] = array
    for quantity, each in parts.items():
        many = len(_VECTORS[quantity][1][0])
        if len(each) < many:
            faults.append(f"{quantity}: {many} components are needed, and {len(each)} are there")
        elif len({array.shape for array in each.values()}) == 1:
            found.setdefault(quantity, np.stack([each[k] for k in range(many)], axis=-1))
        else:
            faults.append(f"{quantity}: its components are not of one length")
    return found


def _checked(found: dict[str, Array], faults: list[str]) -> dict[str, Array]:
    """The arrays, of the shapes that they need to have, in the order of time."""
    t = found.get("t")
    if t is None or t.ndim != 1 or t.size < LEAST_ROWS:
        there = "" if t is None else f", and {t.size} are there"
        faults.append(f"t: a column of at least {LEAST_ROWS} times [s] is needed{there}")
        return found
    way = 1
    if np.isfinite(t).all() and abs(t).max() < LARGEST:
        way = int(np.sign(t[-1] - t[0])) or 1
        if not (np.diff(t) * way > 0).all():
            faults.append("t: the times must increase or decrease strictly")
    checked = {}
    for name, values in found.items():
        shape = (t.size, *_SHAPES.get(name, (3,) if name.startswith("omega") else ()))
        if values.ndim > 1 and values.shape[0] != t.size:  # as MATLAB stores it in HDF5
            values = np.moveaxis(values, -1, 0)
        if values.size != np.prod(shape) or values.shape[:1] != (t.size,):
            faults.append(f"{name}: of shape {values.shape}, not {shape}")
            continue
        values = values.reshape(shape)
        finite = np.isfinite(values).reshape(t.size, -1).all(axis=1)
        if not finite.all():
            faults.append(f"{name}: not a finite number in row {int(np.argmin(finite)) + 1}")
        elif not (abs(values) < LARGEST).all():
            faults.append(f"{name}: a value is larger than {LARGEST:g}")
        elif name in ("axis", "quaternion") and not np.linalg.norm(values, axis=1).all():
            faults.append(f"{name}: of length 0")
        checked[name] = values[::way]
    return checked


# --- files ---------------------------------------------------------------------------------------


def _file(path: Path) -> tuple[dict[str, Any], str | None]:
    """The columns of a file by name, and the scene that it holds, if any."""
    try:
        match path.suffix.lower():
            case ".npz":
                with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                    return dict(arrays), None
            case ".mat":
                return _matlab(path), None
            case ".nc" | ".h5" | ".hdf5":
                return _hdf5(path)
            case _:
                return _text(path), None
    except ForeignFile:
        raise
    except Exception as fault:  # of several libraries, on bytes that anybody wrote
        why = getattr(fault, "strerror", None) or fault
        raise ForeignFile(f"{harmless(path)}: not readable ({harmless(why)})") from fault


def _text(path: Path) -> dict[str, Any]:
    """The columns of a table with a header, between commas, semicolons, tabs or blanks."""
    with path.open("rb") as file:
        lines = file.read().decode("utf-8-sig").splitlines()
    there = [(k, line) for k, line in enumerate(lines, start=1) if line.strip()]
    head = there[0][1].lstrip("#% ") if there else ""
    between = next((c for c in "\t,;" if c in head), None)

    def cells(line: str) -> list[str]:
        words = next(csv.reader([line], delimiter=between)) if between else line.split()
        return [word.strip() for word in words]

    names, rows = cells(head), []
    twice = sorted({name for name in names if plain(name) in _USUAL and names.count(name) > 1})
    faults = [f"1: {harmless(name)} is there twice" for name in twice]
    if not any(plain(name) in _USUAL for name in names):
        faults.append("1: a header with the names of the columns is needed, t among them")
    for number, line in there[1:]:
        if line.lstrip()[0] in "#%":
            continue
        words = cells(line)
        try:
            rows.append([float(word) for word in words])
        except ValueError:
            faults.append(f"{number}: not numbers alone")
            continue
        if len(words) != len(names):
            faults.append(f"{number}: {len(words)} values under {len(names)} names")
    if faults:
        raise ForeignFile("\n".join(f"{harmless(path)}:{each}" for each in faults[:MOST_FAULTS]))
    return dict(zip(names, np.array(rows).reshape(-1, len(names)).T, strict=True))


def _matlab(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat, whosmat

    try:
        with path.open("rb") as file:
            kinds = {name: kind for name, _, kind in whosmat(file)}
            numbers = [name for name, kind in kinds.items() if kind.startswith(MATLAB_NUMBERS)]
            arrays = loadmat(file, variable_names=numbers)  # damaged structures can kill scipy
    except NotImplementedError:  # since version 7.3 it is HDF5
        return _hdf5(path)[0]
    return {
        name: arrays[name] if name in numbers and _numeric(arrays[name]) else NO_NUMBERS
        for name in kinds
    }


def _hdf5(path: Path) -> tuple[dict[str, Any], str | None]:
    """The arrays of a netCDF-4 or HDF5 file; the trajectory of a run of ours has its scene."""
    import h5py

    with path.open("rb") as whole, h5py.File(whole, "r") as file:
        links = [name for name in file if isinstance(file.get(name, getlink=True), h5py.HardLink)]
        there = [name for name in links if isinstance(file[name], h5py.Dataset)]
        arrays = {
            name: dataset(file, name)[()] if _numeric(file[name]) else NO_NUMBERS for name in there
        }
        ours = {name: file.attrs[name] for name in ("plan", "scene") if name in file.attrs}
    if "plan" not in ours:
        return arrays, None
    for name, value in ours.items():
        if not isinstance(value, str):
            raise ForeignFile(f"{harmless(path)}: its attribute {name} is no text")
    # what the equations of a run do not give is nan, and what has no row for each time is the run's
    rows = np.shape(arrays.get("t", NO_NUMBERS))
    known = {n: x for n, x in arrays.items() if np.shape(x)[:1] == rows and not _void(x)}
    return known, ours.get("scene")


def _void(array: Array) -> bool:
    """Whether a component is nan throughout."""
    real = array.dtype.kind == "f"
    return bool(real and array.ndim and np.isnan(array).all(axis=0).any())


def _numeric(array: Any) -> bool:
    return array.dtype.kind in "fiu"
