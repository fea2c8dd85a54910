"""The files of results in their folders.

Of a run the journal, one line, is written first, and the document last: a folder without it resumes
from its trajectory, if there is one. A study has its document, its data and its charts.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from heavytop import errors
from heavytop.doctor import versions
from heavytop.errors import ForeignFile, NoClosedForm, StoppedEarly
from heavytop.files import lock, remove_parts
from heavytop.results.base import Result, kind_of
from heavytop.results.run import DOCUMENT, FIGURES, TRAJECTORY, RunResult
from heavytop.scene.scene import Scene, read_scene
from heavytop.scene.scene_file import toml_text
from heavytop.studies.journal import LOCK, RUN, STUDY, Journal, Parameters, first_line

PICTURE_FORMATS: Final = ("svg", "png")
UNDRAWABLE: Final = (
    NoClosedForm, ArithmeticError, LookupError, RuntimeError, TypeError, ValueError
)  # fmt: skip
"""The errors that drawing raises for numbers that no picture can show."""

# --- a run -----------------------------------------------------------------------------------


def scene_text(document: Mapping[str, Any]) -> str:
    """The scene of a document as TOML."""
    return toml_text({name: x for name, x in document.items() if name != "name" and x != ""})


def tables_of(scene: Scene) -> dict[str, Any]:
    """The tables by which scenes are compared: all but name, title and source."""
    document = scene.document()
    return {name: document[name] for name in ("top", "start", "span", "want")}


def finished_run(folder: Path) -> RunResult | None:
    """The result of the run in a folder; None where the run is not finished.

    Raises
    ------
    ForeignFile
        It is damaged.
    """
    path = folder / DOCUMENT
    return RunResult.load(path) if path.exists() else None


@contextmanager
def open_run(
    folder: Path, scene: Scene, asked: Mapping[str, Any], *, force: bool = False
) -> Iterator[None]:
    """Lock a folder for one run, which is identified by its scene and the options `asked`.

    A part of the same run stays, to be continued; a finished one is removed. The journal of a run
    that fails before a trajectory is stored is removed too.

    Raises
    ------
    ForeignFile
        It holds another run, and `force` is not set; or a study; or files that cannot be read.
    InUse
        Another process is writing it.
    StoppedEarly
        Ctrl-C, or a file that cannot be written: the run can be resumed from the folder.
    """
    parameters = {"kind": RUN, "scene": tables_of(scene), **asked, "versions": versions()}
    about = {"name": scene.name, "text": scene.to_toml()}
    files = files_of(RunResult)
    try:
        kind = first_line(folder).get("parameters", parameters)["kind"]
    except ForeignFile:
        if not (force and (folder / DOCUMENT).exists()):
            raise
        kind = RUN  # of a damaged journal
    if kind != RUN:
        raise ForeignFile(f"{folder}: holds a study; a run needs a folder of its own")
    folder.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        try:
            with lock(folder / LOCK):
                if force or _is_complete(folder, parameters):
                    _remove(folder, (*files, STUDY))
            stack.enter_context(Journal.open(folder, parameters, files, run=about))
        except ForeignFile as fault:
            raise ForeignFile(f"{fault} (run --force replaces it)") from None
        remove_parts(folder, files)
        try:
            yield
        except OSError as fault:
            raise StoppedEarly.unwritable(fault, folder, folder) from fault
        except Exception as fault:
            stopped = isinstance(fault, StoppedEarly) or errors.is_interrupt(fault)
            if not stopped and not (folder / TRAJECTORY).exists():  # resumed, it would fail again
                (folder / STUDY).unlink(missing_ok=True)
            raise


def _is_complete(folder: Path, parameters: Parameters) -> bool:
    """Whether a folder has a finished run with these parameters, of any versions."""
    if not first_line(folder) or finished_run(folder) is None:
        return False
    journal = Journal.read(folder)
    journal.expect(parameters | {"versions": journal.parameters["versions"]})
    return True


def _remove(folder: Path, names: Sequence[str]) -> None:
    """Remove files of an earlier result."""
    for name in names:
        (folder / name).unlink(missing_ok=True)


def load_run(result: RunResult, path: Path) -> Any:
    """The trajectory, or the exact motion, of a run by its document; None without its file.

    Without heyoka it is the exact motion of a finished run, which has the same pictures.

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
        except errors.MissingPackage:
            if result.outcome != errors.Outcome.FINISHED:
                raise
    from heavytop.run.exact import SceneMotion
    from heavytop.run.plan import closed_form_of
    from heavytop.run.planning import plan

    scene = read_scene(scene_text(result.scene), where=f"{result.scene.name}.toml")
    return SceneMotion(scene, closed_form_of(scene), plan(scene))


# --- a result --------------------------------------------------------------------------------


def files_of(kind: type[Result]) -> list[str]:
    """The names of all files of a kind of result, its document first."""
    figures = FIGURES if kind is RunResult else [kind_of(kind)]
    drawn = (f"{name}.{form}" for name in figures for form in PICTURE_FORMATS)
    return [f"{kind_of(kind)}.json", *filter(None, [kind.data_file]), *drawn]


def write_result(
    found: Result,
    folder: str | os.PathLike[str],
    *,
    figures: bool = True,
    show: Callable[[], object] | None = None,
) -> dict[str, str]:
    """Write a result: its data, its figures, and last its document.

    So a document is there only if the data are complete. Of a result that cannot be resumed the
    document is also written before anything is drawn.

    Parameters
    ----------
    found : Result
    folder : path
        The folder, which is made where there is none.
    figures : bool
        Whether figures are drawn, if the result has any.
    show : callable, optional
        Called before figures are drawn, which takes longer than the rest.

    Returns
    -------
    dict from str to str
        Names of the files, by their contents.

    Raises
    ------
    StoppedEarly
        A file cannot be written, or Ctrl-C.

    Warns
    -----
    NotDrawnWarning
        A figure cannot be drawn; all else is written.
    """
    place, names = Path(folder), files_of(type(found))
    goes_on, files = (place / STUDY).exists(), {"document": names[0]}
    try:
        place.mkdir(parents=True, exist_ok=True)
        remove_parts(place, names)
        _remove(place, [name for name in names if name != found.data_file])
        files |= found.save_data(place)
        found = replace(found, files=files, **found.without_times())
        if not goes_on:
            found.save(place / names[0])
        if show is not None:
            show()
        with warn_not_drawn("figures"):
            for name, _, draw in found.figures() if figures else ():
                key = "chart" if name == kind_of(found) else name
                files |= _save_figure(place, name, draw, key)
        replace(found, files=files).save(place / names[0])
    except (OSError, KeyboardInterrupt) as fault:
        kept = place if goes_on or (place / names[0]).is_file() else None
        if isinstance(fault, OSError):
            raise StoppedEarly.unwritable(fault, place, kept, goes_on) from fault
        raise StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", kept, goes_on) from None
    return files


def _save_figure(place: Path, name: str, draw: Callable[[], Any], key: str) -> dict[str, str]:
    """Draw a figure and save it in every format; return its files, none where it fails."""
    from heavytop.plots.style import save

    files = dict[str, str]()
    with warn_not_drawn(name):
        if (figure := draw()) is not None:
            for form in PICTURE_FORMATS:
                save(figure, place / f"{name}.{form}")
                figure.set_layout_engine("none")  # the layout is done, for the other formats too
                files[f"{key}_{form}"] = f"{name}.{form}"
    return files


@contextmanager
def warn_not_drawn(name: str) -> Iterator[None]:
    """Warn of a picture that cannot be drawn, with the reason, and continue without it."""
    try:
        yield
    except ForeignFile:  # the file of what is drawn is damaged
        raise
    except UNDRAWABLE as fault:
        why = f"{name}: not drawn ({type(fault).__name__}: {fault})"
        warnings.warn(why, errors.NotDrawnWarning, stacklevel=3)
