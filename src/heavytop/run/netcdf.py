"""A trajectory as a netCDF file that holds the scene itself.

The file holds samples and events for everybody, and the starts of the blocks, with which the
trajectory can be asked for any other time, or continued, bit for bit. Nothing in it can execute.
Behind its end stands its digest.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from heavytop import __version__
from heavytop.hdf5 import write_sealed
from heavytop.integration.orbit import Orbit
from heavytop.integration.outputs import ANGLES, RATES
from heavytop.machine import versions
from heavytop.run.events import STORED, Events
from heavytop.run.planning import Plan

if TYPE_CHECKING:
    import xarray

    from heavytop.run.trajectory import Trajectory

SCHEMA = "heavytop/trajectory/1"
SEEN_COLUMNS = ("t", "t_low", "states", "phi")
TEXTS = ("event_kind", *(f"decimal_{x}_{y}" for x in ("t", "event") for y in ("time", "states")))
"""Variables that are read back as texts."""


def dataset(trajectory: Trajectory) -> xarray.Dataset:
    """Return samples and events as an xarray Dataset.

    Variables over ``t`` have time as their first dimension: theta, phi, psi and rates
    [rad, rad/s], axis and omega with dimension ``space``, and the states of the formulation.
    """
    import xarray

    run, events, orbit = trajectory.samples, trajectory.events, trajectory.orbit
    over_time: dict[str, Any] = {name: ("t", getattr(run, name)) for name in (*ANGLES, *RATES)}
    over_time |= {name: (("t", "space"), getattr(run, name)) for name in ("axis", "omega")}
    over_time["states"] = (("t", "state"), run.states)
    if trajectory.decimals is not None:
        from heavytop.run.high_precision import text_variables

        over_time |= text_variables(trajectory.decimals)
    whole = xarray.Dataset(
        over_time | _event_variables(events),
        coords={
            "t": ("t", run.t),
            "space": list("xyz"),
            "state": [s.name for s in orbit.integrator.formulation.states],
        },
        attrs=_attributes(trajectory),
    )
    return _described(whole)


_QUANTITIES = {
    "t": ("time since the start", "s"),
    "t_low": ("what the time has beyond a double", "s"),
    "time": ("time since the start, as words that add up", "s"),
    "theta": ("tilt of the axis from the upward vertical", "rad"),
    "phi": ("precession angle, continuous from the start", "rad"),
    "psi": ("spin angle, continuous from the start", "rad"),
    "thetadot": ("rate of the tilt", "rad s-1"),
    "phidot": ("rate of precession", "rad s-1"),
    "psidot": ("rate of the spin angle", "rad s-1"),
    "axis": ("unit vector along the symmetry axis, in space", "1"),
    "omega": ("angular velocity, in space", "rad s-1"),
    "states": ("states of the formulation, each in its own unit", "various"),
    "state": ("name of a state", "1"),
    "space": ("direction in space, z upwards", "1"),
    "kind": ("what happens: a turning point, a reversal or a cusp", "1"),
    "residual": ("value of the event function where it was found", "s-1"),
    "steps": ("natural steps taken", "1"),
    "turned": ("phi and psi as they were followed", "rad"),
}
_PREFIXES = {
    "event": "at an event",
    "checkpoint": "at the start of a block",
    "zeros": "at a zero of an event function",
    "decimal": "of the run in more than doubles",
}


def _described(contents: xarray.Dataset) -> xarray.Dataset:
    """Give every variable a long_name and units, by the words of which its name is made."""
    for name, variable in contents.variables.items():
        words = str(name).removesuffix("_text")
        told = [more for prefix, more in _PREFIXES.items() if words.startswith(f"{prefix}_")]
        if words != name:
            told.append("as a decimal text")
        known = next(q for q in sorted(_QUANTITIES, key=len, reverse=True)
                     if words == q or words.endswith(f"_{q}"))  # fmt: skip
        what, unit = _QUANTITIES[known]
        variable.attrs = {"long_name": ", ".join([what, *told]), "units": unit} | variable.attrs
    return contents


def _event_variables(events: Events) -> dict[str, Any]:
    columns = {name: getattr(events, name) for name in STORED}
    columns["kind"] = np.array(events.kind, dtype="U10")
    over = {"axis": ("event", "space"), "states": ("event", "state")}
    return {f"event_{name}": (over.get(name, "event"), x) for name, x in columns.items()}


def _restart_variables(orbit: Orbit) -> dict[str, Any]:
    """Return what it takes to run any block again, and to go on: block starts and all zeros."""
    points = orbit.checkpoints
    kept: dict[str, Any] = {
        "t_low": ("t", orbit.samples.t_low),
        "checkpoint_time": (("checkpoint", "word"), np.array([c.time for c in points])),
        "checkpoint_states": (("checkpoint", "state"), np.array([c.state for c in points])),
        "checkpoint_phi": ("checkpoint", np.array([c.phi for c in points])),
        "checkpoint_steps": ("checkpoint", np.array([c.steps for c in points])),
    }
    for i, seen in enumerate(orbit.hits):
        for name, values in zip(
            SEEN_COLUMNS, (seen.t, seen.t_low, seen.rows, seen.phi), strict=True
        ):
            kept[f"zeros_{i}_{name}"] = ((f"zero_{i}", "state")[: values.ndim], values)
    return kept


def _attributes(trajectory: Trajectory) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "title": trajectory.scene.title,
        "source": trajectory.scene.source,
        "scene": trajectory.scene.to_toml(),
        "plan": json.dumps(_plan(trajectory.plan)),
        "parameters": json.dumps({k: v.hex() for k, v in trajectory.orbit.parameters.items()}),
        "outcome": str(trajectory.outcome),
        "steps": trajectory.orbit.steps,
        "end": trajectory.orbit.end,
        "heavytop": __version__,
        "versions": json.dumps(versions()),
    }


def _plan(plan: Plan) -> dict[str, Any]:
    return asdict(plan) | {"frame": [(name, rate.hex()) for name, rate in plan.frame]}


def write(trajectory: Trajectory, path: str | os.PathLike[str]) -> None:
    """Write a trajectory to a netCDF file, whole or not at all."""
    target = Path(path)
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{target.parent}: no such folder")
    contents = dataset(trajectory).assign(_restart_variables(trajectory.orbit))
    if trajectory.decimals is not None:
        from heavytop.run.high_precision import kept_variables

        contents = contents.assign(kept_variables(trajectory.decimals))
    letters = {name: {"dtype": "S1"} for name in contents if name in TEXTS}  # of a known size
    # HDF5 does not survive a full disk
    data = bytes(_described(contents).to_netcdf(engine="h5netcdf", encoding=letters))
    write_sealed(target, lambda part: part.write_bytes(data))
