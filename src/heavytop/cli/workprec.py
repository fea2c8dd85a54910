"""``heavytop workprec``: what every method costs for what it attains."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heavytop import errors
from heavytop.cli.exits import Exit
from heavytop.cli.options import (
    Debug,
    Folder,
    Json,
    NoFigures,
    Quiet,
    SceneName,
    Set,
    Verbose,
    blaming,
    overrides,
)
from heavytop.cli.printing import print_json, print_table
from heavytop.cli.run import results_folder
from heavytop.cli.voice import Voice

if TYPE_CHECKING:
    from heavytop.workprecs.work_precision import WorkPrecision

OPTIONS = ("periods", "methods", "budget")

Periods = Annotated[
    float, typer.Option("--periods", metavar="N", help="Nutation periods to go.", min=1)
]
Methods = Annotated[
    str | None,
    typer.Option(
        "--methods",
        metavar="NAME,…",
        help="Methods, each NAME (all its settings), NAME=SETTING or auto.",
    ),
]
Budget = Annotated[
    float, typer.Option("--budget", metavar="S", help="Time to take in all [s].", min=1)
]


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
    """Time every method at every setting, and chart the times against the errors."""
    from heavytop.scene import load_scene
    from heavytop.workprecs.ladder import DEFAULT
    from heavytop.workprecs.measuring import work_precision

    voice = Voice(quiet, verbose)
    options = overrides(changes)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming([*options, *(f"{name}=" for name in OPTIONS)]))
        read = load_scene(scene, overrides=options)
        if output is not None:
            stack.enter_context(results_folder(output))  # before minutes are spent
        found = work_precision(
            read,
            methods=DEFAULT if methods is None else tuple(methods.split(",")),
            periods=periods,
            budget=budget,
            progress=stack.enter_context(voice.progress()),
        )
        files = _results(found, output, figures=not no_figures, voice=voice)
    _show(found.document(files=files), json)
    _leave(found)


def _results(
    found: WorkPrecision, folder: Path | None, *, figures: bool, voice: Voice
) -> dict[str, str]:
    """Write the files of a diagram, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.workprec_results import write_work_precision

    try:
        files = write_work_precision(found, folder, figures=figures)
    except OSError as error:
        why = f"cannot write {error.filename or folder}: {error.strerror or error}"
        raise typer.BadParameter(why, param_hint="-o") from error
    for name in files.values():
        voice.note(f"wrote {folder / name}")
    return files


def _show(document: dict[str, Any], json: bool) -> None:
    if json:
        print_json(document)
        return
    from heavytop.report.workprec_table import workprec_table

    print_table(workprec_table, document)


def _leave(found: WorkPrecision) -> None:
    """Leave with a code of its own where nothing could be run."""
    if found.points:
        return
    methods = [each.trial.method for each in found.skipped]
    if all(method.absent for method in methods):
        raise errors.MissingPackage(methods[0].name, methods[0].absent)
    raise typer.Exit(Exit.ENDED_EARLY)
