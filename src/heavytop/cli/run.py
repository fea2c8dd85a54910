"""``heavytop run``, and going on with a run that was interrupted or killed."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

from typer import Option

from heavytop import errors
from heavytop.cli import options
from heavytop.cli.command import Exit, exit_code, interrupted, leave, manner, note, say, show, verb
from heavytop.cli.command import progress_bar as shown_progress

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.report.files import Request
    from heavytop.results.run import RunResult
    from heavytop.run.planning import Plan
    from heavytop.run.trajectory import Trajectory
    from heavytop.scene.scene import Scene

Early: TypeAlias = errors.EndedEarly | errors.StoppedEarly


@verb
def run(
    scene: options.SceneName,
    force: Annotated[bool, Option("--force", help="Replace another run in DIR.")] = False,
    formulation: options.Formulation = options.FormulationName.AUTO,
    digits: options.Digits = None,
    output: options.Folder = None,
    changes: options.Changes = None,
    no_figures: options.NoFigures = False,
    tolerance: options.Tolerance = None,
) -> None:
    """Integrate a scene and compare it with the closed form."""
    from heavytop.report.files import Request

    read = options.read(scene, changes, digits)
    asked = Request(read, formulation.value, not no_figures, tolerance)
    carry_out(asked, output, force=force)


def is_run(folder: Path) -> bool:
    """Whether a folder is that of a run, and not of a study."""
    files = ("request.json", "run.json", "trajectory.nc")
    return not (folder / "study.jsonl").exists() and any((folder / n).exists() for n in files)


def resume_run(folder: Path, *, figures: bool) -> None:
    """Go on with a run; of one that has ended, say so and print it."""
    from heavytop.report.files import DOCUMENT, REQUEST, TRAJECTORY, Request
    from heavytop.results.run import RunResult
    from heavytop.run.trajectory_file import load_exact, load_interrupted

    begun = (folder / REQUEST).exists()
    if not begun and (folder / DOCUMENT).exists():
        found = RunResult.load(folder / DOCUMENT)
        if (outcome := errors.Outcome(found.outcome)) is not errors.Outcome.INTERRUPTED:
            if (folder / TRAJECTORY).exists():  # what is damaged is refused
                (load_interrupted if found.plan.states else load_exact)(folder / TRAJECTORY)
            finished = outcome is errors.Outcome.FINISHED
            how = "is finished" if finished else f"ended early: {outcome.sentence}"
            show(found)
            leave([(Exit.OK if finished else Exit.ENDED_EARLY, f"{folder}: this run {how}")])
            return
    asked = Request.read(folder)
    if not begun:  # the trajectory of a run is all there is
        asked.write(folder)
    carry_out(replace(asked, figures=asked.figures and figures), folder)


def carry_out(asked: Request, folder: Path | None, *, force: bool = False) -> None:
    """Do what is asked, or what is left of it; what cannot be run touches no folder."""
    from heavytop.report.files import REQUEST
    from heavytop.run.planning import closed_form_of, planned

    motion = closed_form_of(asked.scene)
    chosen = planned(asked.scene, motion, asked.formulation, tolerance=asked.tolerance)
    early: Early | None = None
    with nullcontext() if folder is None else _holding(folder, asked, force=force):
        if chosen.formulation == "none":
            result = _exact(asked, motion, chosen, folder)
        else:
            trajectory, early = _integrated(asked, motion, chosen, folder)
            result, early = _written(trajectory, early, folder, figures=asked.figures)
        if folder is not None and not _goes_on(early):
            (folder / REQUEST).unlink(missing_ok=True)
    show(result)
    leave(_ends(asked.scene, result, early, folder))


@contextmanager
def _holding(folder: Path, asked: Request, *, force: bool) -> Iterator[None]:
    """The folder of a run; what stops it on its way says that the folder goes on with it."""
    from heavytop.report.files import begun

    with begun(folder, asked, force=force):
        try:
            yield
        except OSError as fault:
            raise errors.StoppedEarly.unwritable(fault, folder, folder) from fault
        except BaseException as fault:
            if not interrupted(fault):
                raise
            raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", folder) from None


def _exact(asked: Request, motion: Motion, chosen: Plan, folder: Path | None) -> RunResult:
    """The result of a scene that nothing is integrated of, written with its files."""
    from heavytop.report.files import write_results
    from heavytop.results.run import exact_result
    from heavytop.run.exact import SceneMotion

    found = SceneMotion(asked.scene, motion, chosen)
    if folder is None:
        return exact_result(found)
    return _noted(write_results(found, folder, figures=asked.figures), folder)


def _integrated(
    asked: Request, motion: Motion, chosen: Plan, folder: Path | None
) -> tuple[Trajectory, errors.EndedEarly | None]:
    """The trajectory of a scene, from where its folder has it, and why it is a part if it is."""
    from heavytop.report.files import TRAJECTORY, part_of
    from heavytop.run.propagation import carried_out, completed

    scene = asked.scene
    part = None if folder is None else part_of(folder, scene)
    if part is not None and part.outcome is errors.Outcome.SINGULAR:
        return part, errors.EndedEarly(part.outcome, part)
    checkpoint = None if folder is None else folder / TRAJECTORY
    notes = iter([f"integrating {scene.name}"])  # once, where there is something to keep
    try:
        with shown_progress() as bar, warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # said at the end

            def heard(done: float) -> None:
                for text in notes:
                    note(text)
                if bar is not None:
                    bar(done)

            if part is not None:
                return completed(part, progress=heard, checkpoint=checkpoint), None
            return carried_out(scene, motion, chosen, heard, checkpoint=checkpoint), None
    except errors.EndedEarly as early:
        return early.trajectory, early


def _written(
    trajectory: Trajectory, early: Early | None, folder: Path | None, *, figures: bool
) -> tuple[RunResult, Early | None]:
    """The result of a trajectory, written with its files, and why it is not whole if so."""
    from heavytop.report.files import write_results
    from heavytop.results.run import run_result

    if early is not None:
        say(f"ended early at t = {trajectory.orbit.end:.6g} s: {early}")
    if folder is None:
        return run_result(trajectory), early
    try:
        result = write_results(trajectory, folder, figures=figures and not _goes_on(early))
    except OSError as fault:
        early = errors.StoppedEarly.unwritable(fault, folder, folder)
        return run_result(trajectory), early
    return _noted(result, folder), early


def _noted(result: RunResult, folder: Path) -> RunResult:
    """A result, whose files are told."""
    for name in result.files.values():
        note(f"wrote {folder / name}")
    return result


def _goes_on(early: Early | None) -> bool:
    """Whether there is more to do in the folder of a run that ended so."""
    if isinstance(early, errors.EndedEarly):
        return early.outcome is errors.Outcome.INTERRUPTED
    return early is not None


def _ends(
    scene: Scene, result: RunResult, early: Early | None, folder: Path | None
) -> Iterator[tuple[Exit, str]]:
    """What is wrong with a run, and where the part that was done can be found."""
    from heavytop.run.events import differences
    from heavytop.run.verify import missed

    if early is not None:
        yield exit_code(early), _kept(early, folder)
    else:
        if result.missed_digits:
            yield Exit.OUT_OF_BOUND, missed(dict(result.missed_digits), scene.digits)
        if result.missed_events:  # of which a warning tells, unless it is quiet
            told = "; ".join(differences(result.missed_events, result.events))
            yield Exit.OUT_OF_BOUND, told if manner().quiet else ""


def _kept(early: Early, folder: Path | None) -> str:
    """Where the part of a run that was done can be found, and how to go on with it."""
    if isinstance(early, errors.StoppedEarly):
        return str(early)
    if folder is None:
        return "the partial result is above (-o DIR keeps it)"
    how = f"; resume with:\n{errors.resuming(folder)}" if _goes_on(early) else ""
    return f"the partial result is in {folder}{how}"
