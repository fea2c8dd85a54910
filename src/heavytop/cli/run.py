"""``heavytop run``."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop import errors
from heavytop.cli.ending import ending
from heavytop.cli.exits import Exit, exit_code, interrupted
from heavytop.cli.options import (
    Debug,
    Digits,
    Folder,
    Form,
    Json,
    NoFigures,
    Quiet,
    SceneName,
    Set,
    Verbose,
    blaming,
    overrides,
)
from heavytop.cli.output import noted, results_folder, show
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.report.run_files import Request
    from heavytop.results.run import RunResult
    from heavytop.run.planning import Plan
    from heavytop.run.trajectory import Trajectory
    from heavytop.scene.scene import Scene


Early = errors.EndedEarly | errors.StoppedEarly
Force = Annotated[bool, typer.Option("--force", help="Replace another run that DIR holds.")]


def run(
    scene: SceneName,
    json: Json = False,
    output: Folder = None,
    force: Force = False,
    changes: Set = None,
    formulation: Form = "auto",
    digits: Digits = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Integrate a scene and compare it with the closed form."""
    from heavytop.scene.scene import load_scene

    voice = Voice(quiet, verbose)
    options = overrides(changes, digits)
    with ExitStack() as stack:
        stack.enter_context(ending())
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming(options))
        read = load_scene(scene, overrides=options)
        from heavytop.report.run_files import Request

        asked = Request(read, formulation, figures=not no_figures)
        carry_out(asked, output, json=json, voice=voice, force=force)


def carry_out(
    asked: Request, folder: Path | None, *, json: bool, voice: Voice, force: bool = False
) -> None:
    """Do what is asked, or what is left of it; leave with a code of its own where it is not whole.

    What cannot be run touches no folder.
    """
    from heavytop.report.run_files import REQUEST, begun
    from heavytop.run.planning import closed_form_of, planned

    motion = closed_form_of(asked.scene)
    chosen = planned(asked.scene, motion, asked.formulation)
    if folder is None:
        result, early = answered(asked, motion, chosen, None, voice)
    else:
        with results_folder(folder), begun(folder, asked, force=force), stopping(folder):
            result, early = answered(asked, motion, chosen, folder, voice)
            if not goes_on(early):
                (folder / REQUEST).unlink(missing_ok=True)
    document = result.document()
    show(document, json)
    if early is not None:
        say(kept(folder, early))
        raise typer.Exit(exit_code(early))
    if document["missed_digits"]:
        from heavytop.run.verify import missed

        say(missed(document["missed_digits"], asked.scene.digits))
    if document["missed_events"] and voice.quiet:  # else it has been warned of
        from heavytop.run.events import differences

        say("; ".join(differences(document["missed_events"], document["events"])))
    if document["missed_digits"] or document["missed_events"]:
        raise typer.Exit(Exit.OUT_OF_BOUND)


@contextmanager
def stopping(folder: Path) -> Iterator[None]:
    """Let what stops a run on its way say that its folder goes on with it."""
    try:
        yield
    except OSError as fault:
        raise unwritten(folder, fault) from fault
    except BaseException as fault:
        if not interrupted(fault):
            raise
        raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", folder) from None


def unwritten(folder: Path, fault: OSError) -> errors.StoppedEarly:
    """The end of a run that cannot write a file: the disk is full, the folder has gone."""
    unwritable = errors.Stop.UNWRITABLE
    if not folder.is_dir():
        return errors.StoppedEarly(unwritable, f"ended early: {folder}: the folder has gone", None)
    why = errors.StoppedEarly.unwritable(fault, folder, folder).why
    return errors.StoppedEarly(unwritable, f"ended early: {why}", folder)


def goes_on(early: Early | None) -> bool:
    """Whether there is more to do in the folder of a run that ended so."""
    if isinstance(early, errors.EndedEarly):
        return early.outcome is errors.Outcome.INTERRUPTED
    return early is not None


def answered(
    asked: Request, motion: Motion, chosen: Plan, folder: Path | None, voice: Voice
) -> tuple[RunResult, Early | None]:
    """The result of what is asked, written with its files, and why it is not whole if so."""
    from heavytop.report.run_files import DOCUMENT, write_results
    from heavytop.results.run import run_result

    early: Early | None = None
    if chosen.formulation == "none" or chosen.folded:
        result = at_once(asked.scene, chosen)
        if folder is not None:
            result = replace(result, files={"document": DOCUMENT})
            try:
                result.save(folder / DOCUMENT)
            except OSError as fault:
                early = unwritten(folder, fault)
        return result, early
    trajectory, early = integrated(asked, motion, chosen, folder, voice)
    if early is not None:
        say(f"ended early at t = {trajectory.orbit.end:.6g} s: {early}")
    if folder is None:
        return run_result(trajectory), early
    try:
        figures = asked.figures and not goes_on(early)
        result = write_results(trajectory, folder, figures=figures)
    except OSError as fault:
        return run_result(trajectory), unwritten(folder, fault)
    noted(result.files, folder, voice)
    return result, early


def at_once(scene: Scene, chosen: Plan) -> RunResult:
    """The result of a scene that is known at once, or from one nutation."""
    from heavytop.results.run import folded_result, known_result

    if not chosen.folded:
        return known_result(scene, chosen)
    from heavytop.run.periodic import fold

    return folded_result(fold(scene), chosen)


def integrated(
    asked: Request, motion: Motion, chosen: Plan, folder: Path | None, voice: Voice
) -> tuple[Trajectory, errors.EndedEarly | None]:
    """The trajectory of a scene, from where its folder has it, and why it is a part if it is."""
    from heavytop.report.run_files import TRAJECTORY, part_of
    from heavytop.run.propagation import carried_out, completed

    scene = asked.scene
    part = None if folder is None else part_of(folder, scene, chosen)
    if part is not None and part.outcome is errors.Outcome.SINGULAR:
        return part, errors.EndedEarly(part.outcome, part)
    checkpoint = None if folder is None else folder / TRAJECTORY
    try:
        with voice.progress() as progress, warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # said at the end
            heard = announced(progress, voice, scene.name)
            if part is not None:
                return completed(part, progress=heard, checkpoint=checkpoint), None
            found = carried_out(scene, motion, chosen, heard, checkpoint=checkpoint)
            return found, None
    except errors.EndedEarly as early:
        return early.trajectory, early


def announced(
    progress: Callable[[float], None] | None, voice: Voice, name: str
) -> Callable[[float], None] | None:
    """What hears of each block: the progress bar, after a word that there is something to see."""
    if not voice.verbose:
        return progress
    said = False

    def heard(done: float) -> None:
        nonlocal said
        if not said:
            voice.note(f"integrating {name}")
            said = True
        if progress is not None:
            progress(done)

    return heard


def kept(folder: Path | None, early: Early) -> str:
    """Where the part of a run that was done can be found, and how to go on with it."""
    if isinstance(early, errors.StoppedEarly):
        return str(early)
    if folder is None:
        return "what was done is above (-o DIR keeps it)"
    if not goes_on(early):
        return f"what was done is in {folder}"
    return f"what was done is in {folder}, and this goes on:\n{errors.resuming(folder)}"
