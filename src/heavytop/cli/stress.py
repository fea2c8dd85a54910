"""``heavytop stress``: where methods fail, each run under a limit of time."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop.cli.ending import ending
from heavytop.cli.exits import Exit
from heavytop.cli.options import (
    Debug,
    Folder,
    Jobs,
    Json,
    NoFigures,
    Quiet,
    Verbose,
    blaming,
    budgeted,
    listed,
    names,
)
from heavytop.cli.output import noted, printing_anyway, results_folder, show
from heavytop.cli.scheduler import Scheduler, executor
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.results.stress import Stress

OPTIONS = ("cases", "methods", "budget", "time_limit", "step_limit")

Cases = Annotated[str | None, listed("--cases", "Cases; all when left out.")]
Methods = Annotated[str | None, listed("--methods", "Methods; all when left out.")]
Budget = Annotated[float, budgeted(least=0)]
TimeLimit = Annotated[
    float, typer.Option("--time-limit", metavar="S", help="Seconds after which a run is killed.")
]
StepLimit = Annotated[
    int, typer.Option("--step-limit", metavar="N", help="Steps after which a run is given up.")
]
List = Annotated[
    bool, typer.Option("--list", help="List cases and methods, and why each case is hard.")
]


def stress(
    cases: Cases = None,
    methods: Methods = None,
    budget: Budget = 240.0,
    time_limit: TimeLimit = 3.0,
    step_limit: StepLimit = 2_000_000,
    listed: List = False,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    json: Json = False,
    output: Folder = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Run every method at the motions at which methods fail."""
    if listed:
        from heavytop.studies.stress import listing

        show(listing(), json)
        return
    from heavytop.studies.stress import stress as put_under_stress

    voice = Voice(quiet, verbose)
    chosen, asked = names("--cases", cases), names("--methods", methods)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming([f"{name}=" for name in OPTIONS]))
        stack.enter_context(ending())
        stack.enter_context(results_folder(output))
        found = put_under_stress(
            cases=chosen,
            methods=asked,
            budget=budget,
            time_limit=time_limit,
            step_limit=step_limit,
            jobs=jobs,
            folder=output,
            executor=stack.enter_context(executor(scheduler, jobs)),
            progress=stack.enter_context(voice.study()),
        )
        finish(found, output, json=json, figures=not no_figures, voice=voice)


def finish(found: Stress, folder: Path | None, *, json: bool, figures: bool, voice: Voice) -> None:
    """Write and print a stress test; leave with a code of its own where auto is silently wrong."""
    files: dict[str, str] = {}
    with printing_anyway() as unsaved:
        files = results(found, folder, figures=figures, voice=voice)
    show(found.document(files=files), json)
    for run in found.silently_wrong:
        say(f"auto is wrong at {run.case}, and does not say so: {run.outcome}, {run.note}")
    unsaved.leave()
    if found.silently_wrong:
        raise typer.Exit(Exit.OUT_OF_BOUND)
    if not found.cases:
        say("nothing was run")
        raise typer.Exit(Exit.ENDED_EARLY)


def results(found: Stress, folder: Path | None, *, figures: bool, voice: Voice) -> dict[str, str]:
    """Write the files of a stress test, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.report.study_files import write_stress

    return noted(write_stress(found, folder, figures=figures), folder, voice)
