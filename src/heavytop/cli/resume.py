"""``heavytop resume``: what was interrupted or killed goes on from where its folder says it was."""

from __future__ import annotations

import warnings
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heavytop import errors
from heavytop.cli import atlas as mapping
from heavytop.cli import drift as drifting
from heavytop.cli import run as running
from heavytop.cli.options import Debug, Jobs, Json, NoFigures, Quiet, Verbose, named_folder
from heavytop.cli.output import show
from heavytop.cli.scheduler import Scheduler, executor
from heavytop.cli.voice import Voice, say
from heavytop.files import regular

if TYPE_CHECKING:
    from heavytop.ledger import Progress

StudyFolder = Annotated[
    Path,
    typer.Argument(
        metavar="DIR", help="The folder of a drift study, an atlas, or a run.", parser=named_folder
    ),
]


def resume(
    folder: StudyFolder,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    json: Json = False,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Go on with a study or a run that was interrupted or killed."""
    voice = Voice(quiet, verbose)
    if not (folder / "study.json").exists() and (folder / "trajectory.nc").exists():
        if scheduler is not None:
            raise typer.BadParameter("for studies; this is a run", param_hint="--scheduler")
        _run(folder, voice, json=json, figures=not no_figures)
        return
    _expect_study(folder)
    from heavytop.resuming import kind_of
    from heavytop.resuming import resume as go_on

    kind = kind_of(folder)
    begun: list[Progress] = []

    def heard(now: Progress) -> None:
        if not begun:
            begun.append(now)
        if progress is not None:
            progress(now)

    with voice.warnings(), executor(scheduler, jobs) as workers, voice.study() as progress:
        found = go_on(folder, jobs=jobs, executor=workers, progress=heard)
    if 0 < begun[0].tasks == begun[0].ended:
        say(f"{folder}: this study is finished")
    finish: Any = {"drift": drifting.finish, "atlas": mapping.finish}[kind]
    finish(found, folder, json=json, figures=not no_figures, voice=voice)


def _expect_study(folder: Path) -> None:
    """Refuse what is no folder, and a folder with nothing to go on with."""
    if not folder.exists():
        raise errors.ForeignFile(f"{folder}: there is no such folder")
    if not folder.is_dir():
        raise errors.ForeignFile(f"{folder}: a file; resume takes the folder of a study or a run")
    if not (folder / "study.json").exists():
        lacking = "neither study.json, of a study, nor trajectory.nc, of a run"
        raise errors.ForeignFile(f"{folder}: nothing to go on with: {lacking}")


def _run(folder: Path, voice: Voice, *, json: bool, figures: bool) -> None:
    from heavytop.archive import load_interrupted
    from heavytop.continuation import completed

    with voice.warnings():
        part = load_interrupted(folder / "trajectory.nc")
        if part.outcome is errors.Outcome.FINISHED:
            say(f"{folder}: this run is finished")
            show(document(folder / "run.json"), json, "run")
            return
        try:
            with voice.progress() as progress, warnings.catch_warnings():
                warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # said at the end
                trajectory, early = completed(part, progress=progress), None
        except errors.EndedEarly as stopped:
            trajectory, early = stopped.trajectory, stopped
        running.conclude(trajectory, early, folder, json=json, figures=figures, voice=voice)


def document(path: Path) -> dict[str, Any]:
    """The document of a finished run, as it was written."""
    try:
        with regular(path) as file:
            found = loads(file.read())
    except (OSError, ValueError) as fault:
        raise errors.ForeignFile(f"{path}: not readable ({fault})") from None
    if not isinstance(found, dict) or found.get("schema") != "heavytop/run/1":
        raise errors.ForeignFile(f"{path}: not the document of a run")
    return found
