"""The files of results in their folders.

Of a run first what is asked, at last its document. The request goes when all else is there: a
folder with a request holds a run that is not whole, and its trajectory, if there is one, is as far
as it went. Of a study its document, its data and its charts.
"""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from heavytop.errors import (
    ForeignFile,
    HeavyTopError,
    MissingPackage,
    NotDrawnWarning,
    Outcome,
    Stop,
    StoppedEarly,
    is_interrupt,
)
from heavytop.files import as_json, locked, not_as_written, remove_parts, write_document
from heavytop.results.base import Result, typed
from heavytop.results.classification import plan_summary
from heavytop.results.run import PICTURES, RunResult, run_result
from heavytop.results.table import Row
from heavytop.scene.scene import Scene, read_scene
from heavytop.scene.scene_file import written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.run.trajectory import Trajectory

REQUEST, DOCUMENT, TRAJECTORY = "request.json", "run.json", "trajectory.nc"
PICTURE_FORMATS: Final = ("svg", "png")
FIGURE_FILES: Final = tuple(f"{name}.{form}" for name in PICTURES for form in PICTURE_FORMATS)
UNDRAWABLE: Final = (ArithmeticError, LookupError, RuntimeError, TypeError, ValueError)
"""What drawing raises of numbers that no picture can show."""
RUN_FILES: Final = (REQUEST, DOCUMENT, TRAJECTORY, *FIGURE_FILES)

# --- a run -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Request:
    """What a run is asked: a scene, its equations or auto, and whether figures are drawn."""

    scene: Scene
    formulation: str = "auto"
    figures: bool = True
    tolerance: float | None = None

    @property
    def question(self) -> dict[str, Any]:
        """What makes it another run, whatever its scene is called."""
        scene = json.loads(as_json(self.scene.document()))
        parts = {name: scene[name] for name in ("top", "start", "span", "want")}
        return {"scene": parts, "formulation": self.formulation, "tolerance": self.tolerance}

    def write(self, folder: Path) -> None:
        """Write it down."""
        document = {
            "schema": "heavytop/request/1",
            "command": typed(),
            "name": self.scene.name,
            "scene": self.scene.to_toml(),
            "formulation": self.formulation,
            "figures": self.figures,
            "tolerance": self.tolerance,
        }
        write_document(folder / REQUEST, document)

    @classmethod
    def read(cls, folder: Path) -> Request:
        """What a folder says of its run: its request, or its document, or its trajectory.

        Raises
        ------
        ForeignFile
            It is missing or damaged.
        """
        if (folder / REQUEST).exists():
            with not_as_written(folder / REQUEST):
                found = Row(json.loads((folder / REQUEST).read_bytes()))
                scene = read_scene(found.scene, where=f"{found.name}.toml")
                return cls(scene, found.formulation, bool(found.figures), found.tolerance)
        if (folder / DOCUMENT).exists():
            result = RunResult.load(folder / DOCUMENT)
            with not_as_written(folder / DOCUMENT):
                scene = read_scene(scene_text(result.scene), f"{result.scene.name}.toml")
                return cls.of_plan(scene, result.plan)
        from heavytop.run.trajectory_file import load_interrupted

        part = load_interrupted(folder / TRAJECTORY)
        return cls.of_plan(part.scene, plan_summary(part.plan))

    @classmethod
    def of_plan(cls, scene: Scene, plan: Mapping[str, Any]) -> Request:
        """What was asked of a scene, by the reasons of its plan."""
        form, reasons = plan["formulation"], plan["reasons"]
        chosen = form if f"{form}: asked for by name" in reasons else "auto"
        given = any(reason.endswith(": asked for") for reason in reasons)
        return cls(scene, chosen, tolerance=plan["tolerance"] if given else None)


def scene_text(document: Mapping[str, Any]) -> str:
    """The scene of a document as TOML."""
    return written({name: x for name, x in document.items() if name != "name" and x != ""})


@contextmanager
def open_run(folder: Path, request: Request, *, force: bool = False) -> Iterator[None]:
    """Hold a folder for one run, whose request stands there from now on until it is whole.

    What is left of the same run stays, to go on with; a whole one is taken away.

    Raises
    ------
    ForeignFile
        It holds another run, or a study, and `force` does not replace it; or what cannot be read.
    InUse
        Another process is writing it.
    StoppedEarly
        Ctrl-C, or a file that cannot be written: the folder goes on with the run.
    """
    from heavytop.studies.journal import LOCK, STUDY

    if (folder / STUDY).exists():
        raise ForeignFile(f"{folder}: holds a study; a run needs a folder of its own")
    with locked(folder / LOCK):
        try:
            if not force:
                _expect_same(folder, request)
            remove_parts(folder, RUN_FILES)
            if force or not (folder / REQUEST).exists():
                _remove(folder, RUN_FILES)
                request.write(folder)
            with _resumable(folder):
                yield
        finally:
            if not (folder / REQUEST).exists():
                (folder / LOCK).unlink(missing_ok=True)


@contextmanager
def _resumable(folder: Path) -> Iterator[None]:
    """Keep the request of a run that is stopped on its way; of one that fails, if steps are done.

    Raises
    ------
    StoppedEarly
    """
    try:
        yield
    except OSError as fault:
        raise StoppedEarly.unwritable(fault, folder, folder) from fault
    except BaseException as fault:
        if is_interrupt(fault):
            raise StoppedEarly(Stop.INTERRUPTED, "interrupted", folder) from None
        if not (folder / TRAJECTORY).exists():  # it would fail again
            (folder / REQUEST).unlink(missing_ok=True)
        raise


def _remove(folder: Path, names: Sequence[str]) -> None:
    """Take away the files of an earlier run."""
    for name in names:
        (folder / name).unlink(missing_ok=True)


def _expect_same(folder: Path, request: Request) -> None:
    """Refuse a folder that holds another run than the one that is asked."""
    from heavytop.studies.journal import differences

    there = [name for name in RUN_FILES if os.path.lexists(folder / name)]
    if not there:
        return
    try:
        if there[0] in FIGURE_FILES:
            raise ForeignFile(f"{folder / there[0]}: not of a run of this package")
        found = differences(Request.read(folder).question, request.question)
    except ForeignFile as fault:
        raise ForeignFile(f"{fault} (--force replaces it)") from None
    if found:
        raise ForeignFile(f"{folder}: holds another run: {'; '.join(found)} (--force replaces it)")


def load_part(folder: Path, scene: Scene) -> Trajectory | None:
    """What a folder has of the trajectory of a scene, by its plan; None where there is nothing.

    Raises
    ------
    ForeignFile
        It is damaged, or was begun with other versions.
    """
    from heavytop.run.trajectory_file import load_interrupted

    if not (folder / TRAJECTORY).exists():
        return None
    part = load_interrupted(folder / TRAJECTORY)
    return replace(part, scene=scene)  # a file does not have the name of its scene


def load_run(result: RunResult, path: Path) -> Any:
    """The trajectory, or the exact motion, of a run whose document is there; None without a file.

    Without heyoka a finished run has its exact motion, which no picture tells from it.

    Raises
    ------
    ForeignFile
        It is damaged.
    """
    place = path.with_name(TRAJECTORY)
    if "trajectory" not in result.files or not place.exists():
        return None
    if result.source == "integrated":
        try:
            from heavytop.run.trajectory_file import load_trajectory

            return load_trajectory(place)
        except MissingPackage:
            if result.outcome != Outcome.FINISHED:
                raise
    from heavytop.run.exact import SceneMotion
    from heavytop.run.planning import plan
    from heavytop.run.span import closed_form_of

    scene = read_scene(scene_text(result.scene), where=f"{result.scene.name}.toml")
    return SceneMotion(scene, closed_form_of(scene), plan(scene))


def write_results(run: Any, folder: Path, *, figures: bool = True) -> RunResult:
    """Write a run; the document comes last, so that where it stands the rest is whole.

    Parameters
    ----------
    run : Trajectory or SceneMotion
        A trajectory, or what the closed form says of a scene.
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
    from heavytop.plots.figures import run_figures
    from heavytop.run.exact import SceneMotion

    files = {"document": DOCUMENT}
    _remove(folder, (DOCUMENT, *FIGURE_FILES))
    if isinstance(run, SceneMotion) and not run.moves:
        _remove(folder, [TRAJECTORY])
    else:
        files["trajectory"] = TRAJECTORY
        run.save(folder / TRAJECTORY)
        for name, draw in run_figures(run) if figures else ():
            files |= _save_figure(folder, name, draw, name)
    result = run_result(run, files=files)
    result.save(folder / DOCUMENT)
    return result


# --- a study ---------------------------------------------------------------------------------


def write_study(
    found: Result, folder: str | os.PathLike[str], *, figures: bool = True
) -> dict[str, str]:
    """Write what a study found: its document, its data and its chart.

    The document is written before anything is drawn, and again when the chart is there.

    Parameters
    ----------
    found : Result
    folder : path
        It is made where there is none.
    figures : bool
        Whether the chart is drawn, where there are numbers for it.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    StoppedEarly
        A file cannot be written.

    Warns
    -----
    NotDrawnWarning
        The chart cannot be drawn; all else is written.
    """
    place, kind = Path(folder), kind_of(found)
    with _writing(found, place):
        place.mkdir(parents=True, exist_ok=True)
        remove_parts(place, [f"{kind}.{form}" for form in ("json", "nc", *PICTURE_FORMATS)])
        files = {"document": f"{kind}.json", **found.save_data(place)}
        found = replace(found, files=files)
        found.save(place / files["document"])
        for form in PICTURE_FORMATS:
            (place / f"{kind}.{form}").unlink(missing_ok=True)
    return draw_study(found, place) if figures else files


def draw_study(found: Result, folder: Path) -> dict[str, str]:
    """Draw the chart of a study that was written, and name it in its document.

    Parameters, warnings and errors are those of `write_study`, of which `found` has the files.
    """
    with _writing(found, folder):
        files = {**found.files, **_save_figure(folder, kind_of(found), found.figure, "chart")}
        replace(found, files=files).save(folder / files["document"])
    return files


def kind_of(found: Result) -> str:
    """The kind of a result: the name of its document."""
    return found.schema.split("/")[1]


@contextmanager
def _writing(found: Result, place: Path) -> Iterator[None]:
    """Say of a file that cannot be written how the study goes on, if it does."""
    try:
        yield
    except OSError as fault:
        raise StoppedEarly.unwritable(fault, place, place if found.goes_on else None) from fault


def _save_figure(
    place: Path, name: str, draw: Callable[[], Figure | None], key: str
) -> dict[str, str]:
    """Draw a figure and save it in every form; the names of its files, none where it fails."""
    from heavytop.plots.style import save

    files = dict[str, str]()
    with warn_not_drawn(name):
        if (figure := draw()) is not None:
            for form in PICTURE_FORMATS:
                save(figure, place / f"{name}.{form}")
                figure.set_layout_engine("none")  # it is laid out, for all its files
                files[f"{key}_{form}"] = f"{name}.{form}"
    return files


@contextmanager
def warn_not_drawn(name: str) -> Iterator[None]:
    """Warn of a picture that cannot be drawn, say why, and go on without it."""
    try:
        yield
    except HeavyTopError:  # of what is drawn: a damaged record
        raise
    except UNDRAWABLE as fault:
        why = f"{name}: not drawn ({type(fault).__name__}: {fault})"
        warnings.warn(why, NotDrawnWarning, stacklevel=3)
