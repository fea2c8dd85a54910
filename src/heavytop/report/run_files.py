"""The files of a run, in one folder: first what is asked, at last document, trajectory, figures.

The request goes when all else is there. So a folder with a request holds a run that is not whole,
and its trajectory, if there is one, is as far as it went.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from heavytop.errors import ForeignFile, ForeignRun, StoppedEarly
from heavytop.files import as_json, locked, regular, write_text
from heavytop.results.base import typed
from heavytop.results.classification import PlanSummary
from heavytop.results.run import RunResult, run_result
from heavytop.run.planning import Plan
from heavytop.run.trajectory import Trajectory
from heavytop.scene.scene import Scene, read_scene

REQUEST, DOCUMENT, TRAJECTORY = "request.json", "run.json", "trajectory.nc"
REQUEST_SCHEMA: Final = "heavytop/request/1"
FORMS: Final = ("svg", "png")
OWN_FIGURES: Final = frozenset(
    f"{name}.{form}"
    for name in ("overview", "angles", "potential", "phase", "errors")
    for form in FORMS
)
OWN: Final = OWN_FIGURES | {REQUEST, DOCUMENT, TRAJECTORY, "probe"}


@dataclass(frozen=True, slots=True)
class Request:
    """What a run is asked: a scene, its equations or auto, and whether figures are drawn."""

    scene: Scene
    formulation: str = "auto"
    figures: bool = True

    @property
    def question(self) -> dict[str, Any]:
        """What makes it another run."""
        return _question(self.scene.document(), self.formulation)

    def write(self, folder: Path) -> None:
        """Write it down."""
        told = {
            "schema": REQUEST_SCHEMA,
            "command": typed(),
            "name": self.scene.name,
            "scene": self.scene.to_toml(),
            "formulation": self.formulation,
            "figures": self.figures,
        }
        write_text(folder / REQUEST, as_json(told) + "\n")

    @classmethod
    def read(cls, folder: Path) -> Request:
        """What a folder says; without a request, what its trajectory is of.

        Raises
        ------
        ForeignFile
            It is missing or damaged.
        """
        from heavytop.run.trajectory_file import load_interrupted

        if not (folder / REQUEST).exists():
            found = load_interrupted(folder / TRAJECTORY)
            return cls(found.scene, PlanSummary.of(found.plan).asked)
        told = _read(folder / REQUEST, REQUEST_SCHEMA)
        scene = read_scene(told["scene"], where=f"{told['name']}.toml")
        return cls(scene, told["formulation"], told["figures"])


def _question(scene: Mapping[str, Any], formulation: str) -> dict[str, Any]:
    """A run as it is compared with others: whatever its scene is called."""
    told = {key: scene[key] for key in ("top", "start", "span", "want")}
    return {"scene": json.loads(as_json(told)), "formulation": formulation}


@contextmanager
def begun(folder: Path, asked: Request, *, force: bool = False) -> Iterator[None]:
    """Hold a folder for one run, whose request stands there from now on until it is whole.

    What is left of the same run stays, to go on with; a whole one is taken away.

    Raises
    ------
    ForeignRun
        It holds another run, or a study, and `force` does not replace it.
    ForeignFile
        It holds what cannot be read.
    InUse
        Another process is writing it.
    OSError
        The request cannot be written.
    """
    from heavytop.studies.store import LOCK, STUDY

    if (folder / STUDY).exists():
        raise ForeignRun(folder, ())
    mine = False
    with locked(folder / LOCK):
        try:
            if not force:
                _expect_same(folder, asked)
            for path in folder.glob(".*"):  # of a writer that was killed
                if (name := re.fullmatch(r"\.\d+\.(.+)", path.name)) and name[1] in OWN:
                    path.unlink(missing_ok=True)
            unfinished = (folder / REQUEST).exists()
            if force or not unfinished:
                _replace(folder, unfinished=unfinished)
                asked.write(folder)
            mine = True
            yield
        except (KeyboardInterrupt, OSError, StoppedEarly):
            raise
        except BaseException:
            if mine and not (folder / TRAJECTORY).exists():  # nothing is done: it would fail again
                (folder / REQUEST).unlink(missing_ok=True)
            raise
        finally:
            if not (folder / REQUEST).exists():
                (folder / LOCK).unlink(missing_ok=True)


def _replace(folder: Path, *, unfinished: bool) -> None:
    """Take away the files of another run.

    Raises
    ------
    ForeignFile
        One of them is a folder, or cannot be removed.
    """
    names = (REQUEST, DOCUMENT, TRAJECTORY, *(OWN_FIGURES if unfinished else ()))
    for name in names:
        if (folder / name).is_dir():
            raise ForeignFile(f"{folder / name}: a folder, where a run has a file")
    clear(folder)
    for name in names[2:]:
        (folder / name).unlink(missing_ok=True)


def _expect_same(folder: Path, asked: Request) -> None:
    """Refuse a folder that holds another run than the one that is asked."""
    from heavytop.studies.store import differences

    try:
        if (folder / REQUEST).exists():
            there = Request.read(folder).question
        elif (folder / DOCUMENT).exists():
            found = RunResult.load(folder / DOCUMENT)
            there = _question(found.scene.document(), found.plan.asked)
        elif (folder / TRAJECTORY).exists():
            there = Request.read(folder).question
        else:
            if theirs := sorted(name for name in OWN_FIGURES if os.path.lexists(folder / name)):
                raise ForeignFile(f"{folder / theirs[0]}: not of a run of this package")
            return
    except ForeignFile as fault:
        raise ForeignFile(f"{fault} (--force replaces it)") from None
    if others := differences(there, asked.question):
        raise ForeignRun(folder, others)


def part_of(folder: Path, scene: Scene, chosen: Plan) -> Trajectory | None:
    """What a folder has of the trajectory of a scene, by its plan; None where there is nothing.

    Raises
    ------
    ForeignFile
        It is damaged, of another scene, or was begun with other versions.
    """
    from heavytop.run.trajectory_file import load_interrupted

    path = folder / TRAJECTORY
    if not path.exists():
        return None
    part = load_interrupted(path)
    if Request(part.scene).question != Request(scene).question:
        raise ForeignFile(f"{path}: of another scene than {REQUEST}")
    # a file has neither the name of its scene nor what was expected of the plan
    return replace(part, scene=scene, plan=replace(part.plan, estimate=chosen.estimate))


def _read(path: Path, schema: str) -> dict[str, Any]:
    """The document of a schema in a file."""
    try:
        with regular(path) as file:
            found = json.loads(file.read())
    except (OSError, ValueError, RecursionError) as fault:
        raise ForeignFile(f"{path}: not readable ({fault})") from None
    if not isinstance(found, dict) or found.get("schema") != schema:
        raise ForeignFile(f"{path}: not a document {schema}")
    return found


def write_results(trajectory: Trajectory, folder: Path, *, figures: bool = True) -> RunResult:
    """Write a run; the document comes last, so that where it stands the rest is whole.

    Parameters
    ----------
    trajectory : Trajectory
    folder : Path
        It exists; files of an earlier run in it are replaced.
    figures : bool
        Whether figures are drawn.

    Returns
    -------
    RunResult
        Its ``files`` are the names of what was written.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    files = {"document": DOCUMENT, "trajectory": TRAJECTORY}
    clear(folder)
    trajectory.save(folder / TRAJECTORY)
    if figures:
        from heavytop.plots.figures import FIGURES, save

        for name, draw in FIGURES.items():
            figure = draw(trajectory)
            for form in FORMS:
                files[f"{name}_{form}"] = f"{name}.{form}"
                save(figure, folder / f"{name}.{form}")
    result = run_result(trajectory, files=files)
    result.save(folder / DOCUMENT)
    return result


def clear(folder: Path) -> None:
    """Remove the document of an earlier run in a folder, and the figures of which it tells.

    They would stand beside another top's document. Other files are left alone.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OSError
        A file cannot be removed.
    """
    for name in OWN_FIGURES & _told(folder / DOCUMENT):
        (folder / name).unlink(missing_ok=True)
    (folder / DOCUMENT).unlink(missing_ok=True)


def _told(document: Path) -> set[str]:
    """The files of which a document tells, which need not be whole."""
    try:
        with regular(document) as file:
            return {name for name in json.loads(file.read())["files"].values() if name == str(name)}
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return set()  # there is no document, or it is no run's
