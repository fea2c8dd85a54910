"""A run on the page: what it says, its pictures with their numbers, and frames for the player."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from heavytop.errors import ForeignFile
from heavytop.report.pages.figure_data import TITLES, figure_data
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.parts import FactRows, Table, called, given
from heavytop.report.run import run_parts
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.report.pages.load import Result
    from heavytop.run.trajectory import Trajectory

SAME: Final = ("top", "start", "title", "span")
UNSEEN: Final = 1e-6  # of a picture
COMPARED: Final = 400  # samples


def run_section(result: Result, ident: str) -> Section:
    """Return the section of a run: with pictures and frames where its trajectory is there.

    Raises
    ------
    ForeignFile
        The trajectory is damaged, or that of another scene.
    """
    document, heading = result.document, f"Run: {called(result.document)}"
    about = FactRows.of((name, given(document["scene"][name])) for name in ("top", "start"))
    parts = (about, *run_parts(document))
    trajectory = _trajectory(result)
    if trajectory is None:
        note = "trajectory.nc is not beside run.json: no pictures."
        return Section(result, ident, heading, (note, *parts))
    from heavytop.report.pages.player import played

    top = {"id": ident, "title": heading, **played(_in_doubles(trajectory))}
    return Section(result, ident, heading, parts, tuple(_pictures(trajectory)), top)


def _trajectory(result: Result) -> Trajectory | None:
    path, scene = result.path.with_name("trajectory.nc"), result.document["scene"]
    if "trajectory" not in result.document.get("files", {}) or not path.exists():
        return None
    from heavytop.run.trajectory_file import load_trajectory

    found = load_trajectory(path)
    own = found.scene.document()
    if any(own[key] != scene.get(key) for key in SAME):
        raise ForeignFile(
            f"{harmless(path)}: the trajectory of another scene than run.json is about"
        )
    return found


def _in_doubles(trajectory: Trajectory) -> Trajectory:
    """The run in double precision where pictures show no more: many digits take long to draw."""
    if trajectory.decimals is None:
        return trajectory
    seen = replace(trajectory, decimals=None)
    some = trajectory.samples.at(slice(None, None, -(-trajectory.t.size // COMPARED)))
    there = seen(some.t)
    same = (
        np.allclose(getattr(some, name), getattr(there, name), UNSEEN, UNSEEN, equal_nan=True)
        for name in ("theta", "phi", "psi")
    )
    return seen if all(same) else trajectory


def _pictures(trajectory: Trajectory) -> Iterator[Picture]:
    from heavytop.plots.figures import FIGURES

    quick = _in_doubles(trajectory)
    for name, draw in FIGURES.items():
        run = trajectory if name == "errors" else quick
        found = figure_data(name, run)
        yield Picture(name, TITLES[name], drawn(draw(run)), Table.of_columns(found), found)
