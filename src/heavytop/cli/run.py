"""``heavytop run``, and going on with a run that was interrupted or killed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from typer import Option

from heavytop import errors
from heavytop.cli.messages import Exit, exit_code, interrupted, leave, progress_bar, say, show
from heavytop.cli.options import Common, SceneName, results_folder, verb

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.report.files import Request
    from heavytop.results.run import RunResult
    from heavytop.run.planning import Plan
    from heavytop.run.trajectory import Trajectory
    from heavytop.scene.scene import Scene

Early: TypeAlias = errors.EndedEarly | errors.StoppedEarly


@verb("formulation", "digits", "output", "changes", "no_figures")
def run(
    scene: SceneName,
    force: Annotated[bool, Option("--force", help="Replace another run in DIR.")] = False,
    *,
    common: Common,
) -> None:
    """Integrate a scene and compare it with the closed form."""
    from heavytop.report.files import Request

    asked = Request(common.scene(scene), common.formulation.value, figures=not common.no_figures)
    carry_out(asked, common.output, common, force=force)


def is_run(folder: Path) -> bool:
    """Whether a folder is that of a run, and not of a study."""
    files = ("request.json", "run.json", "trajectory.nc")
    return not (folder / "study.json").exists() and any((folder / n).exists() for n in files)


def resume_run(folder: Path, common: Common) -> None:
    """Go on with a run; of one that has ended, say so and print it."""
    from heavytop.report.files import DOCUMENT, REQUEST, TRAJECTORY, Request
    from heavytop.results.run import RunResult
    from heavytop.run.trajectory_file import load_interrupted

    begun = (folder / REQUEST).exists()
    if not begun and (folder / DOCUMENT).exists():
        found = RunResult.load(folder / DOCUMENT)
        outcome = found.outcome
        if outcome is not errors.Outcome.INTERRUPTED:
            if (folder / TRAJECTORY).exists():
                load_interrupted(folder / TRAJECTORY)  # refuses what is damaged
            finished = outcome is errors.Outcome.FINISHED
            how = "is finished" if finished else f"ended early: {outcome.sentence}"
            show(found.document(), common.json)
            leave([(Exit.OK if finished else Exit.ENDED_EARLY, f"{folder}: this run {how}")])
            return
    asked = Request.read(folder)
    if not begun:  # the trajectory of a run is all there is
        asked.write(folder)
    carry_out(replace(asked, figures=asked.figures and not common.no_figures), folder, common)


def carry_out(asked: Request, folder: Path | None, common: Common, *, force: bool = False) -> None:
    """Do what is asked, or what is left of it; what cannot be run touches no folder."""
    from heavytop.report.files import REQUEST, begun
    from heavytop.run.planning import closed_form_of, planned

    motion = closed_form_of(asked.scene)
    chosen = planned(asked.scene, motion, asked.formulation)
    with ExitStack() as stack:
        if folder is not None:
            stack.enter_context(results_folder(folder))
            stack.enter_context(begun(folder, asked, force=force))
            stack.enter_context(_stopping(folder))
        result, early = _result(asked, motion, chosen, folder, common)
        if folder is not None and not _goes_on(early):
            (folder / REQUEST).unlink(missing_ok=True)
    document = result.document()
    show(document, common.json)
    leave(_ends(asked, document, early, folder, common.quiet))


@contextmanager
def _stopping(folder: Path) -> Iterator[None]:
    """Let what stops a run on its way say that its folder goes on with it."""
    try:
        yield
    except OSError as fault:
        raise _unwritten(folder, fault) from fault
    except BaseException as fault:
        if not interrupted(fault):
            raise
        raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", folder) from None


def _unwritten(folder: Path, fault: OSError) -> errors.StoppedEarly:
    """The end of a run that cannot write a file: the disk is full, the folder has gone."""
    there = folder.is_dir()
    why = f"cannot write {fault.filename or folder}: {fault.strerror or fault}"
    why = f"ended early: {why if there else f'{folder}: the folder has gone'}"
    return errors.StoppedEarly(errors.Stop.UNWRITABLE, why, folder if there else None)


def _goes_on(early: Early | None) -> bool:
    """Whether there is more to do in the folder of a run that ended so."""
    if isinstance(early, errors.EndedEarly):
        return early.outcome is errors.Outcome.INTERRUPTED
    return early is not None


def _result(
    asked: Request, motion: Motion, chosen: Plan, folder: Path | None, common: Common
) -> tuple[RunResult, Early | None]:
    """The result of what is asked, written with its files, and why it is not whole if so."""
    from heavytop.report.files import write_results
    from heavytop.results.run import run_result

    if chosen.folded or chosen.formulation == "none":
        return _known(asked.scene, chosen, folder), None
    trajectory, early = _integrated(asked, motion, chosen, folder, common)
    if early is not None:
        say(f"ended early at t = {trajectory.orbit.end:.6g} s: {early}")
    if folder is None:
        return run_result(trajectory), early
    try:
        figures = asked.figures and not _goes_on(early)
        result = write_results(trajectory, folder, figures=figures)
    except OSError as fault:
        return run_result(trajectory), _unwritten(folder, fault)
    for name in result.files.values():
        common.note(f"wrote {folder / name}")
    return result, early


def _known(scene: Scene, chosen: Plan, folder: Path | None) -> RunResult:
    """The result of a scene that is known at once, or from one nutation."""
    from heavytop.report.files import DOCUMENT
    from heavytop.results.run import folded_result, known_result
    from heavytop.run.periodic import fold

    result = folded_result(fold(scene), chosen) if chosen.folded else known_result(scene, chosen)
    if folder is not None:
        result = replace(result, files={"document": DOCUMENT})
        result.save(folder / DOCUMENT)
    return result


def _integrated(
    asked: Request, motion: Motion, chosen: Plan, folder: Path | None, common: Common
) -> tuple[Trajectory, errors.EndedEarly | None]:
    """The trajectory of a scene, from where its folder has it, and why it is a part if it is."""
    from heavytop.report.files import TRAJECTORY, part_of
    from heavytop.run.propagation import carried_out, completed

    scene = asked.scene
    part = None if folder is None else part_of(folder, scene, chosen)
    if part is not None and part.outcome is errors.Outcome.SINGULAR:
        return part, errors.EndedEarly(part.outcome, part)
    checkpoint = None if folder is None else folder / TRAJECTORY
    try:
        with progress_bar(not common.quiet) as bar, warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # said at the end
            heard = _noting(bar, common, f"integrating {scene.name}")
            if part is not None:
                return completed(part, progress=heard, checkpoint=checkpoint), None
            return carried_out(scene, motion, chosen, heard, checkpoint=checkpoint), None
    except errors.EndedEarly as early:
        return early.trajectory, early


def _noting(
    bar: Callable[[float], None] | None, common: Common, text: str
) -> Callable[[float], None]:
    """What hears of each block: the bar, after a word, once, that there is something to keep."""
    notes = iter([text])

    def heard(done: float) -> None:
        for note in notes:
            common.note(note)
        if bar is not None:
            bar(done)

    return heard


def _ends(
    asked: Request,
    document: dict[str, Any],
    early: Early | None,
    folder: Path | None,
    quiet: bool,
) -> Iterator[tuple[Exit, str]]:
    """What is wrong with a run, and where the part that was done can be found."""
    from heavytop.run.events import differences
    from heavytop.run.verify import missed

    if early is not None:
        yield exit_code(early), _kept(folder, early)
        return
    if document["missed_digits"]:
        yield Exit.OUT_OF_BOUND, missed(document["missed_digits"], asked.scene.digits)
    if document["missed_events"]:  # of which a warning tells, unless it is quiet
        told = "; ".join(differences(document["missed_events"], document["events"]))
        yield Exit.OUT_OF_BOUND, told if quiet else ""


def _kept(folder: Path | None, early: Early) -> str:
    """Where the part of a run that was done can be found, and how to go on with it."""
    if isinstance(early, errors.StoppedEarly):
        return str(early)
    if folder is None:
        return "what was done is above (-o DIR keeps it)"
    if not _goes_on(early):
        return f"what was done is in {folder}"
    return f"what was done is in {folder}, and this goes on:\n{errors.resuming(folder)}"
