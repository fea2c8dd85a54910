"""The files of results in their folders.

Of a run first its journal, of one line, and at last its document: a folder without it goes on from
its trajectory, if there is one. Of a study its document, its data and its charts.
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
"""What drawing raises of numbers that no picture can show."""

# --- a run -----------------------------------------------------------------------------------


def scene_text(document: Mapping[str, Any]) -> str:
    """The scene of a document as TOML."""
    return toml_text({name: x for name, x in document.items() if name != "name" and x != ""})


def tables_of(scene: Scene) -> dict[str, Any]:
    """What makes a scene another one: its tables, not its name and title."""
    document = scene.document()
    return {name: document[name] for name in ("top", "start", "span", "want")}


def finished_run(folder: Path) -> RunResult | None:
    """The result that a folder has of its run; None where it is not at its end.

    Raises
    ------
    ForeignFile
        It is damaged.
    """
    path = folder / DOCUMENT
    return RunResult.load(path) if path.exists() else None


@contextmanager
def open_run(
    folder: Path,
    scene: Scene,
    asked: Mapping[str, Any],
    *,
    figures: bool = True,
    force: bool = False,
) -> Iterator[None]:
    """Hold a folder for one run, which is another one if its scene is, or what is `asked` of it.

    What is left of the same run stays, to go on with; a whole one is taken away, and one that fails
    before anything is stored does not stay.

    Raises
    ------
    ForeignFile
        It holds another run, or a study, and `force` does not replace it; or what cannot be read.
    InUse
        Another process is writing it.
    StoppedEarly
        Ctrl-C, or a file that cannot be written: the folder goes on with the run.
    """
    parameters = {"kind": RUN, "scene": tables_of(scene), **asked, "versions": versions()}
    about = {"name": scene.name, "text": scene.to_toml(), "figures": figures}
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
            if not stopped and not (folder / TRAJECTORY).exists():  # it would fail again
                (folder / STUDY).unlink(missing_ok=True)
            raise


def _is_complete(folder: Path, parameters: Parameters) -> bool:
    """Whether a folder has all of a run, with whatever versions it was made."""
    if not first_line(folder) or finished_run(folder) is None:
        return False
    journal = Journal.read(folder)
    journal.expect(parameters | {"versions": journal.parameters["versions"]})
    return True


def _remove(folder: Path, names: Sequence[str]) -> None:
    """Take away the files of an earlier run."""
    for name in names:
        (folder / name).unlink(missing_ok=True)


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
    """The names of all that a kind of result may leave in its folder, first its document."""
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
    """Write a result: its numbers, its figures, and at last its document.

    Where a document stands the rest is whole. That of a result whose folder does not go on is there
    before anything is drawn too.

    Parameters
    ----------
    found : Result
    folder : path
        It is made where there is none.
    figures : bool
        Whether figures are drawn, where there are numbers for them.
    show : callable, optional
        Called before anything is drawn, which takes longer than all else.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

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
    except ForeignFile:  # of what is drawn: a damaged record
        raise
    except UNDRAWABLE as fault:
        why = f"{name}: not drawn ({type(fault).__name__}: {fault})"
        warnings.warn(why, errors.NotDrawnWarning, stacklevel=3)
