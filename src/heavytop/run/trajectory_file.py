"""Trajectories as datasets, data frames and netCDF files, and read back from such a file.

A file holds the scene, samples, events, and the starts of the blocks, from which the motion at any
other time, or the continuation, is computed bit for bit. Nothing in it can execute. Its digest
stands behind its end.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from io import BytesIO
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop import __version__
from heavytop.doctor import versions
from heavytop.errors import Outcome
from heavytop.exact.decimals import DOUBLE, bits_of
from heavytop.files import array, attribute, open_sealed, write_sealed
from heavytop.integration.engine import TimedStates, reals, text
from heavytop.integration.orbit import Checkpoint, Orbit
from heavytop.run.binary_motion import integrator_of
from heavytop.run.events import STORED
from heavytop.run.exact import Run, SceneMotion
from heavytop.run.plan import Plan, Statistics, closed_form_of
from heavytop.run.trajectory import Trajectory
from heavytop.scene.arguments import path_of
from heavytop.scene.quantities import ANGLES, RATES, derived, quantity_of, values_of
from heavytop.scene.scene import read_scene

if TYPE_CHECKING:
    import pandas
    import xarray


TRAJECTORY_SCHEMA: Final = "heavytop/trajectory/2"
# of variables that are no quantities: name, unit, and a second dimension
VARIABLES: Final[Mapping[str, tuple[str, ...]]] = {
    "t_low": ("what the time has beyond a double", "s"),
    "time": ("time since the start, as words that add up", "s", "word"),
    "states": ("states of the formulation, each in its own unit", "various", "state"),
    "state": ("name of a state", "1"),
    "space": ("direction in space, z upwards", "1"),
    "kind": ("what happens: a turning point, a reversal or a cusp", "1"),
    "steps": ("natural steps taken", "1"),
}
CHECKPOINT_COLUMNS: Final = ("time", "states", "steps")  # the columns of checkpoints
OWN_COLUMNS: Final = ("t", "states")  # of samples in more digits than doubles, as decimal texts

Variables = dict[str, Any]
SPACE: Final = {"space": np.array(list("xyz"))}


# --- writing -------------------------------------------------------------------------------------


def dataset(run: Run) -> xarray.Dataset:
    """Return samples and events as an xarray Dataset.

    Variables over ``t`` have time as their first dimension: theta, phi, psi and rates
    [rad, rad/s], axis and omega with dimension ``space``, and the states of the formulation. Of a
    run in more digits there are decimal texts too, ``theta_text`` and so on, empty where there is
    no value.
    """
    import xarray

    return xarray.Dataset(_contents(run), attrs=_attributes(run))


def frame(data: xarray.Dataset, dimension: str) -> pandas.DataFrame:
    """Return the variables of a dataset over ``t``, or over ``event``, as a pandas DataFrame.

    Vectors are columns for each component; `attrs` has units and names.
    """
    import pandas

    over = {n: x for n, x in data.data_vars.items() if x.dims[:1] == (dimension,)}
    parts, attributes = [], dict(data.attrs)
    attributes |= {key: {"t": data["t"].attrs[key]} for key in ("units", "long_name")}
    for full, x in over.items():
        name = f"{full}".removeprefix("event_") if dimension == "event" else f"{full}"
        part = x.to_pandas()
        part = part.rename(name).to_frame() if x.ndim == 1 else part.add_prefix(f"{name}_")
        parts.append(part)
        for key in ("units", "long_name"):
            attributes[key] |= dict.fromkeys(part.columns, x.attrs[key])
    table = pandas.concat(parts, axis="columns")
    table = table.set_index("t") if dimension == "event" else table
    table.attrs = attributes
    return table


def write(run: Run, path: str | os.PathLike[str]) -> None:
    """Write a netCDF file, whole or not at all; xarray, which takes long to import, is not used."""
    import h5netcdf
    import h5py

    restart = _restart_data(run) if isinstance(run, Trajectory) else {}
    target, memory = Path(path), BytesIO()  # HDF5 does not survive a full disk
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{target.parent}: no such folder")
    with h5netcdf.File(memory, "w") as file:
        file.attrs.update(_attributes(run))
        for name, (dimensions, values, attributes) in (_contents(run) | restart).items():
            column = np.asarray(values)
            if column.dtype.kind == "U" and not (name in dimensions or name.endswith("_text")):
                encoded = np.char.encode(column, "utf-8")  # single bytes are read back faster
                column = encoded.view("S1").reshape(*column.shape, encoded.itemsize)
                dimensions += (f"letters_{encoded.itemsize}",)
                attributes = attributes | {"_Encoding": "utf-8"}
            for dimension, size in zip(dimensions, column.shape, strict=True):
                if dimension not in file.dimensions:
                    file.dimensions[dimension] = size
            kind = column.dtype
            if kind.kind == "U":
                column, kind = column.astype(object), h5py.string_dtype()
            file.create_variable(name, dimensions, kind, data=column).attrs.update(attributes)
    write_sealed(target, lambda part: part.write_bytes(memory.getvalue()))


def _contents(run: Run) -> Variables:
    """Return samples and events as variables; of a scene that is not integrated samples alone."""
    names = ("t", *ANGLES, *RATES, "axis", "omega", *derived(run.scene.top))
    samples = {name: values_of(run.samples, name, run.motion) for name in names}
    if not isinstance(run, Trajectory):
        return _over("t", samples) | _over("space", SPACE)
    samples["states"], events = run.samples.states, run.events
    at_events = {name: getattr(events, name) for name in STORED}
    at_events["kind"] = np.array(events.kind, dtype="U10")
    if not run.in_doubles:
        samples |= _texts(run, run.raw_samples)
    if events.own is not None:
        at_events |= _texts(run, SimpleNamespace(**events.own))
    states = {"state": np.array([s.name for s in run.plan.equations.states])}
    variables = _over("t", samples) | _over("event", at_events, "event_", "at an event")
    return variables | _over("space", SPACE) | _over("state", states)


def _over(along: str, columns: Mapping[str, Any], prefix: str = "", where: str = "") -> Variables:
    """Return columns over a dimension as variables with names and units as their attributes."""
    found = {}
    for name, values in columns.items():
        quantity = name.removesuffix("_text")
        of = quantity_of(quantity)
        space = ["space"] if of.parts else []
        what, unit, *second = VARIABLES.get(quantity) or (of.name, of.cf_unit, *space)
        words = what, where, "as a decimal text" if quantity != name else ""
        attributes = {"long_name": ", ".join(filter(None, words)), "units": unit}
        found[prefix + name] = (along, *second)[: np.ndim(values)], values, attributes
    return found


def _texts(trajectory: Trajectory, record: Any) -> Variables:
    """Return times, angles and rates of a record in more digits as texts of the wanted digits."""
    to_text = np.frompyfunc(lambda x: trajectory.text(x) or "", 1, 1)
    columns = {name: getattr(record, name) for name in ("t", *ANGLES, *RATES)}
    with np.errstate(invalid="ignore"):  # nan
        return {f"{name}_text": to_text(x).astype(str) for name, x in columns.items()}


def _restart_data(trajectory: Trajectory) -> Variables:
    """Return what continuing, or running a block again, takes: block starts and all zeros."""
    orbit = trajectory.orbit
    rows = zip(*((c.time, c.state, c.steps) for c in orbit.checkpoints), strict=True)
    points = dict(zip(CHECKPOINT_COLUMNS, map(np.array, rows), strict=True))
    kept = _over("t", {"t_low": orbit.samples.t_low.astype(float)})
    for i, zeros in enumerate(orbit.hits):
        kept |= _over(f"zero_{i}", zeros._asdict(), f"zeros_{i}_", "at a zero of an event function")
    if not trajectory.in_doubles:
        more = "of the run in more than doubles"
        points |= {name: _exact_texts(points[name]) for name in ("time", "states")}
        own = {name: _exact_texts(getattr(orbit.samples, name)) for name in OWN_COLUMNS}
        kept |= _over("t", own, "own_", more)
    return kept | _over("checkpoint", points, "checkpoint_", "at the start of a block")


def _exact_texts(column: Any) -> Any:
    """Return reals as texts by which every bit comes back."""
    return np.frompyfunc(text, 1, 1)(column).astype(str)


def _attributes(run: Run) -> dict[str, Any]:
    """Return what the file says of a run: scene, plan, versions, and how it was integrated."""
    found: dict[str, Any] = {
        "schema": TRAJECTORY_SCHEMA,
        "name": run.scene.name,
        "title": run.scene.title,
        "references": run.scene.source,
        "source": run.source,
        "scene": run.scene.to_toml(),
        "plan": json.dumps(asdict(run.plan)),
        "heavytop": __version__,
        "versions": json.dumps(versions()),
    }
    if isinstance(run, Trajectory):
        constants = run.orbit.parameters
        if not run.in_doubles:
            constants = {name: text(x) for name, x in constants.items()}
        found |= {"parameters": json.dumps(constants), "outcome": str(run.outcome)}
        found |= {"steps": run.orbit.steps, "end": run.orbit.end}
    return found


# --- reading -------------------------------------------------------------------------------------


def load_trajectory(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory from a netCDF file that `Trajectory.save` wrote.

    Parameters
    ----------
    path : path
        The file, ``trajectory.nc`` in the folder of a run.

    Returns
    -------
    Trajectory
        The same bits; it can be asked for any time, and continued by `extend`.

    Raises
    ------
    ForeignFile
        The file is missing, damaged, or was not written by this package.
    WrongType
        It is no path.

    Notes
    -----
    Accuracy: ``tests/run/test_propagation.py`` holds a run that was stored to the run itself,
    bit for bit.

    Examples
    --------
    >>> import heavytop as ht
    >>> from tempfile import TemporaryDirectory
    >>> ran = ht.propagate(ht.load_scene("sicm-kicked"))
    >>> with TemporaryDirectory() as folder:
    ...     ran.save(f"{folder}/kicked.nc")
    ...     read = load_trajectory(f"{folder}/kicked.nc")
    >>> bool((read.phi == ran.phi).all())
    True
    """
    with open_sealed(path_of("path", path)) as file:
        if (schema := attribute(file, "schema")) != TRAJECTORY_SCHEMA:
            raise ValueError(f"schema = {schema!r:.60}: expected {TRAJECTORY_SCHEMA}")
        if attribute(file, "source") == SceneMotion.source:
            instead = "xarray reads the samples, heavytop.Motion has the motion at any time"
            raise ValueError(f"of the closed form, nothing was integrated: {instead}")
        scene = read_scene(attribute(file, "scene"), where="scene in file")
        if "name" in file.attrs:
            scene = replace(scene, name=attribute(file, "name"))
        fields = json.loads(attribute(file, "plan"))
        chosen = Plan(**{name: _tuples(x) for name, x in fields.items()})
        orbit = _read_orbit(file, chosen, Outcome(attribute(file, "outcome")))
        cost = Statistics(orbit.steps, 0, 0.0, 0.0, 0.0, whole=False)
        return Trajectory(scene, closed_form_of(scene), chosen, orbit, cost)


def _tuples(value: Any) -> Any:
    """Return a value of JSON with tuples in place of its lists."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _read_orbit(file: Any, chosen: Plan, outcome: Outcome) -> Orbit:
    """Return the orbit that a file holds, with an integrator that can continue it."""
    bits = bits_of(chosen.precision)

    def numbers(name: str) -> Any:
        stored = array(file, name)
        return stored if bits == DOUBLE else reals(stored, bits)

    times, states = (numbers(f"checkpoint_{name}") for name in ("time", "states"))
    rows = zip(times, states, array(file, "checkpoint_steps").tolist(), strict=True)
    points = tuple(Checkpoint(tuple(t.tolist()), state.copy(), done) for t, state, done in rows)

    def timed(prefix: str = "") -> TimedStates:
        return TimedStates(*(array(file, f"{prefix}{name}") for name in TimedStates._fields))

    constants = json.loads(attribute(file, "parameters"))
    samples = timed()
    if bits > DOUBLE:
        constants = {name: reals(np.array(x), bits)[()] for name, x in constants.items()}
        t, own = (numbers(f"own_{name}") for name in OWN_COLUMNS)
        samples = TimedStates(t, 0 * t, own)
    integrator = integrator_of(chosen, constants, points[0])
    return Orbit(
        integrator=integrator,
        checkpoints=points,
        samples=samples,
        hits=tuple(timed(f"zeros_{i}_") for i, _ in enumerate(integrator.engine.events)),
        end=float(attribute(file, "end")),
        steps=int(attribute(file, "steps")),
        outcome=outcome,
        between=samples.where(slice(0)),
    )


# --- saved on the way, so that a kill loses little ----------------------------------------------


SAVE_S = 10.0  # the least time between two saves of a trajectory on its way
SAVE_SHARE = 20.0  # the same, in units of the time that a save takes
UNSAVED_S = 1.0  # unsaved work at the end of the steps that is worth a file
WHOLE = (Outcome.FINISHED, Outcome.SINGULAR)


@dataclass
class Checkpoints:
    """Saves a trajectory on its way into a file.

    `begun` is what it began with, `saved` when it was saved last, `due` when it is saved next,
    monotonic times [s].
    """

    path: str | os.PathLike[str]
    begun: Trajectory
    saved: float = field(default_factory=time.monotonic)
    due: float = field(default_factory=lambda: time.monotonic() + SAVE_S)

    def __call__(self, so_far: Callable[[], Orbit]) -> None:
        """Save the orbit so far, if that is due."""
        if time.monotonic() >= self.due:
            self._save(so_far())

    def save_end(self, orbit: Orbit) -> None:
        """Save the orbit at the end of its steps, before the comparison with the exact motion."""
        long = time.monotonic() - self.saved >= UNSAVED_S
        if orbit.outcome is Outcome.INTERRUPTED or (long and orbit.outcome in WHOLE):
            self._save(orbit)

    def _save(self, orbit: Orbit) -> None:
        began, so_far = time.monotonic(), replace(orbit, outcome=Outcome.INTERRUPTED)
        replace(self.begun, orbit=so_far, with_events=False).save(self.path)
        self.saved = time.monotonic()
        self.due = self.saved + max(SAVE_S, SAVE_SHARE * (self.saved - began))
