"""``heavytop stress``: where methods fail, each run under a limit of time."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heavytop.cli.exits import Exit
from heavytop.cli.options import Debug, Folder, Json, NoFigures, Quiet, Verbose, blaming
from heavytop.cli.printing import print_json, print_table
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.stresses.stress import Stress

OPTIONS = ("cases", "methods", "budget", "time_limit", "step_limit")

Cases = Annotated[
    str | None, typer.Option("--cases", metavar="NAME,…", help="Cases; all when left out.")
]
Methods = Annotated[
    str | None, typer.Option("--methods", metavar="NAME,…", help="Methods; all when left out.")
]
Budget = Annotated[
    float, typer.Option("--budget", metavar="S", min=0, help="Seconds for all of it.")
]
TimeLimit = Annotated[
    float, typer.Option("--time-limit", metavar="S", help="Seconds after which a run is killed.")
]
StepLimit = Annotated[
    int, typer.Option("--step-limit", metavar="N", help="Steps after which a run is given up.")
]


def stress(
    cases: Cases = None,
    methods: Methods = None,
    budget: Budget = 240.0,
    time_limit: TimeLimit = 3.0,
    step_limit: StepLimit = 2_000_000,
    json: Json = False,
    output: Folder = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Run every method at the motions at which methods fail, and say how each of them does."""
    from heavytop.stresses.stressing import stress as put_under_stress

    voice = Voice(quiet, verbose)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming([f"{name}=" for name in OPTIONS]))
        if output is not None:
            from heavytop.cli.run import results_folder

            stack.enter_context(results_folder(output))
        found = put_under_stress(
            cases=_named(cases),
            methods=_named(methods),
            budget=budget,
            time_limit=time_limit,
            step_limit=step_limit,
            progress=stack.enter_context(voice.progress()),
        )
        finish(found, output, json=json, figures=not no_figures, voice=voice)


def finish(found: Stress, folder: Path | None, *, json: bool, figures: bool, voice: Voice) -> None:
    """Write and print a stress test; leave with a code of its own where auto is silently wrong."""
    document = found.document(files=results(found, folder, figures=figures, voice=voice))
    show(document, json)
    for run in found.silently_wrong:
        say(f"auto is wrong at {run.case}, and does not say so: {run.outcome}, {run.note}")
    if found.silently_wrong:
        raise typer.Exit(Exit.OUT_OF_BOUND)


def results(found: Stress, folder: Path | None, *, figures: bool, voice: Voice) -> dict[str, str]:
    """Write the files of a stress test, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.stress_results import write_stress

    files = write_stress(found, folder, figures=figures)
    for name in files.values():
        voice.note(f"wrote {folder / name}")
    return files


def show(document: dict[str, Any], json: bool) -> None:
    """Print the document on stdout: for a program, or for a person."""
    if json:
        print_json(document)
        return
    from heavytop.report.stress_table import stress_table

    print_table(stress_table, document)


def _named(texts: str | None) -> tuple[str, ...] | None:
    return None if texts is None else tuple(texts.split(","))
