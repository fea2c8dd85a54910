"""``heavytop resume``: what was interrupted or killed goes on from where its folder says it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from heavytop import errors
from heavytop.cli import atlas as mapping
from heavytop.cli import drift as drifting
from heavytop.cli import stress as stressing
from heavytop.cli import workprec
from heavytop.cli.ending import ending
from heavytop.cli.exits import Exit
from heavytop.cli.options import Debug, Jobs, Json, NoFigures, Quiet, Verbose, named_folder
from heavytop.cli.output import show
from heavytop.cli.run import carry_out
from heavytop.cli.scheduler import Scheduler, executor
from heavytop.cli.voice import Voice, say
from heavytop.results.base import command_of, typed, typing

if TYPE_CHECKING:
    from heavytop.results.run import RunResult
    from heavytop.studies.runner import Progress

WITH_COMMAND: Final = ("study.json", "request.json", "run.json")
OF_A_RUN: Final = ("request.json", "run.json", "trajectory.nc")
StudyFolder = Annotated[
    Path,
    typer.Argument(
        metavar="DIR",
        help="The folder of a study (drift, atlas, stress, workprec) or of a run.",
        parser=named_folder,
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
    made = filter(None, (command_of(folder / name) for name in WITH_COMMAND))
    with typing(next(made, typed())):
        _resume(folder, jobs, scheduler, json, not no_figures, Voice(quiet, verbose))


def _resume(
    folder: Path, jobs: int, scheduler: str | None, json: bool, figures: bool, voice: Voice
) -> None:
    if not (folder / "study.json").exists() and any((folder / n).exists() for n in OF_A_RUN):
        if scheduler is not None:
            raise typer.BadParameter("for studies; this is a run", param_hint="--scheduler")
        _run(folder, voice, json=json, figures=figures)
        return
    _expect_study(folder)
    from heavytop.studies.runner import resume as go_on
    from heavytop.studies.store import Store

    kind = Store(folder).parameters["kind"]
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
    modules: dict[str, Any] = {"drift": drifting, "atlas": mapping, "stress": stressing}
    modules["work_precision"] = workprec
    modules[kind].finish(found, folder, json=json, figures=figures, voice=voice)


def _expect_study(folder: Path) -> None:
    """Refuse what is no folder, and a folder with nothing to go on with."""
    if not folder.exists():
        raise errors.ForeignFile(f"{folder}: there is no such folder")
    if not folder.is_dir():
        raise errors.ForeignFile(f"{folder}: a file; resume takes the folder of a study or a run")
    if not (folder / "study.json").exists():
        lacking = "neither study.json, of a study, nor trajectory.nc or request.json, of a run"
        raise errors.ForeignFile(f"{folder}: nothing to go on with: {lacking}")


def _run(folder: Path, voice: Voice, *, json: bool, figures: bool) -> None:
    """Go on with a run; of one that has ended, say so."""
    from heavytop.report.run_files import DOCUMENT, REQUEST, Request
    from heavytop.results.run import RunResult

    with ending(), voice.warnings():
        begun = (folder / REQUEST).exists()
        if not begun and (folder / DOCUMENT).exists():
            found = RunResult.load(folder / DOCUMENT)
            if found.outcome is not errors.Outcome.INTERRUPTED:
                _ended(folder, found, json)
                return
        asked = Request.read(folder)
        if not begun:  # the trajectory of a run is all there is
            asked.write(folder)
        asked = replace(asked, figures=asked.figures and figures)
        carry_out(asked, folder, json=json, voice=voice)


def _ended(folder: Path, found: RunResult, json: bool) -> None:
    """Print what a run that has ended gave."""
    from heavytop.report.run_files import TRAJECTORY
    from heavytop.run.trajectory_file import load_interrupted

    if (folder / TRAJECTORY).exists():
        load_interrupted(folder / TRAJECTORY)  # refuses what is damaged
    done = found.outcome is errors.Outcome.FINISHED
    ended = "is finished" if done else f"ended early: {found.outcome.sentence}"
    say(f"{folder}: this run {ended}")
    show(found.document(), json)
    if not done:
        raise typer.Exit(Exit.ENDED_EARLY)
