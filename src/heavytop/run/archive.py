"""Reading a trajectory back from the netCDF file that holds it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

from heavytop.errors import ForeignFile, Outcome
from heavytop.hdf5 import array, attribute, opened
from heavytop.integration.integrator import Checkpoint, Seen
from heavytop.integration.orbit import Ending, Orbit
from heavytop.machine import versions
from heavytop.run.events import STORED, Events
from heavytop.run.netcdf import SCHEMA, SEEN_COLUMNS
from heavytop.run.planning import Plan, closed_form_of
from heavytop.run.propagation import compiled_for, integrator_of
from heavytop.run.trajectory import Statistics, Trajectory
from heavytop.scene.arguments import path_of
from heavytop.scene.scene import read_scene

_ENDINGS: dict[Outcome, Ending] = {
    Outcome.FINISHED: "reached",
    Outcome.SINGULAR: "singular",
    Outcome.INTERRUPTED: "interrupted",
    Outcome.STEP_LIMIT: "step-limit",
}


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
    Accuracy: ``tests/property/test_determinism.py`` holds a run that was stored to the run itself,
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
    place = path_of("path", path)
    with opened(place) as file:
        return _checked(_trajectory(file))


def load_interrupted(path: str | os.PathLike[str]) -> Trajectory:
    """Read a trajectory to go on with it, which takes what it was begun with.

    Raises
    ------
    ForeignFile
        As for `load_trajectory`; or it was begun with other versions, or on another processor.
    """
    with opened(Path(path)) as file:
        there = json.loads(attribute(file, "versions"))
        found = _checked(_trajectory(file))
    here = versions()
    other = [
        f"{name}: {there.get(name)} there, {here[name]} here"
        for name in here
        if there.get(name) != here[name]
    ]
    if other:
        raise ForeignFile(f"{path}: begun with other versions ({'; '.join(other)})")
    return found


def _checked(trajectory: Trajectory) -> Trajectory:
    """Return it if its parts belong together."""
    orbit, form = trajectory.orbit, trajectory.orbit.integrator.formulation
    width = len(form.states)
    named = {p.name for p in (*form.parameters, *form.given)}
    rows = [orbit.samples.rows, *(seen.rows for seen in orbit.hits)]
    fits = all(array.shape[1:] == (width,) for array in rows)
    fits &= all(c.state.shape == (width,) for c in orbit.checkpoints)
    own = len((form.integrated or form).states)
    if not fits or set(orbit.parameters) != named or trajectory.plan.states != own:
        raise ForeignFile("states, parameters and plan do not belong together")
    if not abs(orbit.end) >= float(np.max(np.abs(orbit.samples.t), initial=0.0)):
        raise ForeignFile("end: before the last sample")
    return trajectory


def _trajectory(file: Any) -> Trajectory:
    if (schema := attribute(file, "schema")) != SCHEMA:
        raise ForeignFile(f"schema = {schema!r:.60}: expected {SCHEMA}")
    scene = read_scene(attribute(file, "scene"), where="scene in file")
    chosen = _plan(json.loads(attribute(file, "plan")))
    parameters = json.loads(attribute(file, "parameters"))
    values = {name: float.fromhex(text) for name, text in parameters.items()}
    outcome = Outcome(attribute(file, "outcome"))
    orbit, events = _orbit(file, chosen, values, outcome), _events(file, scene.events)
    decimals, motion = None, closed_form_of(scene)
    if "decimal_t_time" in file:
        from heavytop.run.high_precision import restored

        decimals = restored(file, scene, motion, chosen, orbit, events)
    steps = orbit.steps if decimals is None else decimals.steps
    return Trajectory(
        scene=scene,
        motion=motion,
        plan=chosen,
        orbit=orbit,
        events=events,
        outcome=outcome,
        statistics=Statistics(steps, 0, 0.0, 0.0, 0.0, whole=False),
        decimals=decimals,
    )


def _plan(fields: dict[str, Any]) -> Plan:
    return Plan(
        formulation=str(fields["formulation"]),
        variant=None if fields["variant"] is None else str(fields["variant"]),
        follows_phi=bool(fields["follows_phi"]),
        frame=tuple((str(name), float.fromhex(rate)) for name, rate in fields["frame"]),
        watched=tuple(map(str, fields["watched"])),
        states=int(fields["states"]),
        precision=str(fields["precision"]),
        tolerance=float(fields["tolerance"]),
        projected=bool(fields["projected"]),
        folded=bool(fields["folded"]),
        reasons=tuple(map(str, fields["reasons"])),
        warnings=tuple(map(str, fields["warnings"])),
    )


def _orbit(file: Any, chosen: Plan, parameters: dict[str, float], outcome: Outcome) -> Orbit:
    columns = (f"checkpoint_{n}" for n in ("time", "states", "phi", "steps"))
    rows = zip(*(array(file, c) for c in columns), strict=True)
    points = tuple(
        Checkpoint((float(t[0]), float(t[1])), np.array(s), float(phi), int(n))
        for t, s, phi, n in rows
    )
    t, t_low, states = (array(file, n) for n in ("t", "t_low", "states"))
    phi = array(file, "phi") if chosen.follows_phi else np.full(t.size, np.nan)
    hits = tuple(_seen(file, f"zeros_{i}") for i in range(len(chosen.watched)))
    return Orbit(
        integrator=integrator_of(chosen, compiled_for(chosen), parameters, points[0]),
        checkpoints=points,
        samples=Seen(t, t_low, states, phi),
        hits=hits,
        end=float(attribute(file, "end")),
        steps=int(attribute(file, "steps")),
        ending=_ENDINGS[outcome],
    )


def _seen(file: Any, name: str) -> Seen:
    return Seen(*(array(file, f"{name}_{part}") for part in SEEN_COLUMNS))


def _events(file: Any, asked: tuple[str, ...]) -> Events:
    columns = {n: array(file, f"event_{n}") for n in STORED}
    kind = tuple(map(str, array(file, "event_kind")))
    return Events(kind=kind, asked=tuple(asked), **columns)
