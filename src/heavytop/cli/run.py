"""``heavytop run``."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from heavytop import errors
from heavytop.cli.exits import Exit, exit_code
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
from heavytop.cli.output import noted, results_folder, show, unwritable
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.planning import Plan
    from heavytop.scene import Scene
    from heavytop.trajectory import Trajectory


def run(
    scene: SceneName,
    json: Json = False,
    output: Folder = None,
    changes: Set = None,
    formulation: Form = "auto",
    digits: Digits = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Integrate a scene and compare it with the closed form."""
    from heavytop.scene import load_scene

    voice = Voice(quiet, verbose)
    options = overrides(changes, digits)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming(options))
        read = load_scene(scene, overrides=options)
        folder = stack.enter_context(results_folder(output))
        if (known := known_already(read, formulation, folder)) is not None:
            finish(known, read.digits, json)
            return
        trajectory, early = integrated(read, formulation, voice)
        conclude(trajectory, early, folder, json=json, figures=not no_figures, voice=voice)


def conclude(
    trajectory: Trajectory,
    early: errors.EndedEarly | None,
    folder: Path | None,
    *,
    json: bool,
    figures: bool,
    voice: Voice,
) -> None:
    """Write and print a run; leave with a code where it ended early or missed a check."""
    if early is not None:
        say(f"ended early at t = {trajectory.orbit.end:.6g} s: {early}")
    document = results(trajectory, folder, figures=figures, voice=voice)
    if early is None:
        finish(document, trajectory.scene.digits, json)
        return
    show(document, json, "run")
    say(kept(folder, early))
    raise typer.Exit(exit_code(early))


def finish(document: dict[str, Any], digits: int, json: bool) -> None:
    """Print a whole run; leave with a code of its own where digits or events are missed."""
    show(document, json, "run")
    if document["missed_digits"]:
        from heavytop.doubts import missed

        say(missed(document["missed_digits"], digits))
    if document["missed_digits"] or document["missed_events"]:
        raise typer.Exit(Exit.OUT_OF_BOUND)


def known_already(scene: Scene, formulation: str, folder: Path | None) -> dict[str, Any] | None:
    """The document of a scene that needs no integration over its span; None of another."""
    from heavytop.planning import plan

    chosen = plan(scene, formulation)
    if chosen.formulation != "none" and not chosen.folded:
        return None
    from heavytop.files import write_document

    document = at_once(scene, chosen)
    if folder is not None:
        from heavytop.results import clear

        clear(folder)
        document["files"] = {"document": "run.json"}
        write_document(folder / "run.json", document)
    return document


def at_once(scene: Scene, chosen: Plan) -> dict[str, Any]:
    """The document of a scene that is known at once, or from one nutation."""
    if not chosen.folded:
        from heavytop.document import known_document

        return known_document(scene, chosen)
    from heavytop.folded import fold
    from heavytop.folded_document import folded_document

    return folded_document(fold(scene), chosen)


def integrated(
    scene: Scene, formulation: str, voice: Voice
) -> tuple[Trajectory, errors.EndedEarly | None]:
    """The trajectory of a scene, and why it is only a part when it is."""
    from heavytop.propagation import propagate

    try:
        with voice.progress() as progress, warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # said at the end
            heard = announced(progress, voice, scene.name)
            return propagate(scene, formulation=formulation, progress=heard), None
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


def results(
    trajectory: Trajectory, folder: Path | None, *, figures: bool, voice: Voice
) -> dict[str, Any]:
    """The document of a run, and its files when there is a folder for them."""
    if folder is None:
        from heavytop.document import run_document

        return run_document(trajectory, files={})
    from heavytop.results import write_results

    try:
        document = write_results(trajectory, folder, figures=figures)
    except OSError as error:  # the disk is full, the folder has gone
        raise unwritable(folder, error) from error
    noted(document["files"], folder, voice)
    return document


def kept(output: Path | None, early: errors.EndedEarly) -> str:
    """Where the part of a run that was done can be found, and how to go on with it."""
    if output is None:
        return "what was done is above (-o DIR keeps it)"
    if early.outcome is not errors.Outcome.INTERRUPTED:
        return f"what was done is in {output}"
    return f"what was done is in {output}, and this goes on:\n{errors.resuming(output)}"
