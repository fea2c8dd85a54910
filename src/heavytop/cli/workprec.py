"""``heavytop workprec``: what every method costs for what it attains."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop import errors
from heavytop.cli.ending import ending
from heavytop.cli.exits import Exit
from heavytop.cli.options import (
    Debug,
    Folder,
    Json,
    NoFigures,
    Periods,
    Quiet,
    SceneName,
    Set,
    Verbose,
    blaming,
    budgeted,
    listed,
    names,
    overrides,
)
from heavytop.cli.output import noted, printing_anyway, results_folder, show
from heavytop.cli.voice import Voice

if TYPE_CHECKING:
    from heavytop.results.work_precision import WorkPrecision

OPTIONS = ("periods", "methods", "budget")

Methods = Annotated[
    str | None,
    listed(
        "--methods",
        "Methods, each NAME (all its settings), NAME=SETTING, auto or auto=DIGITS; a wrong NAME "
        "is answered with all names, and so does docs/rivals.md.",
    ),
]
Budget = Annotated[float, budgeted(least=1)]


def workprec(
    scene: SceneName,
    periods: Periods = 100,
    methods: Methods = None,
    budget: Budget = 240,
    json: Json = False,
    output: Folder = None,
    changes: Set = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Time every method at every setting; chart times by errors."""
    from heavytop.scene.scene import load_scene
    from heavytop.studies.work_precision import DEFAULT, work_precision

    voice = Voice(quiet, verbose)
    options, asked = overrides(changes), names("--methods", methods)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming([*options, *(f"{name}=" for name in OPTIONS)]))
        read = load_scene(scene, overrides=options)
        stack.enter_context(ending())
        stack.enter_context(results_folder(output))
        found = work_precision(
            read,
            methods=asked or DEFAULT,
            periods=periods,
            budget=budget,
            folder=output,
            progress=stack.enter_context(voice.progress()),
        )
        finish(found, output, json=json, figures=not no_figures, voice=voice)


def finish(
    found: WorkPrecision, folder: Path | None, *, json: bool, figures: bool, voice: Voice
) -> None:
    """Write and print a diagram; leave with a code of its own where nothing could be run."""
    files: dict[str, str] = {}
    with printing_anyway() as unsaved:
        files = _results(found, folder, figures=figures, voice=voice)
    show(found.document(files=files), json)
    unsaved.leave()
    _leave(found)


def _results(
    found: WorkPrecision, folder: Path | None, *, figures: bool, voice: Voice
) -> dict[str, str]:
    """Write the files of a diagram, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.report.study_files import write_work_precision

    return noted(write_work_precision(found, folder, figures=figures), folder, voice)


def _leave(found: WorkPrecision) -> None:
    """Leave with a code of its own where nothing could be run."""
    from heavytop.studies.methods import AUTO, method

    if found.points:
        return
    names = [each.method for each in found.skipped]
    needs = [() if name == AUTO else method(name).absent for name in names]
    if all(needs):
        raise errors.MissingPackage(names[0], needs[0])
    raise typer.Exit(Exit.ENDED_EARLY)
