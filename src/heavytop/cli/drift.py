"""``heavytop drift``: long runs, whose errors are measured as they grow."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop import errors
from heavytop.cli.exits import Exit
from heavytop.cli.options import (
    Debug,
    Folder,
    Jobs,
    Json,
    NoFigures,
    Periods,
    Quiet,
    SceneName,
    Set,
    Verbose,
    blaming,
    listed,
    names,
    overrides,
)
from heavytop.cli.output import noted, results_folder, show
from heavytop.cli.scheduler import Scheduler, executor
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.results.drift import Drift

OPTIONS = ("periods", "methods", "ensemble", "samples", "seed")

Methods = Annotated[
    str | None,
    listed("--methods", "Methods, each NAME or NAME=SETTING (a tolerance, or steps a period)."),
]
Ensemble = Annotated[
    int, typer.Option("--ensemble", metavar="K", min=1, help="Neighbouring starts.")
]
Samples = Annotated[
    int, typer.Option("--samples", metavar="M", min=2, help="Times at which errors are measured.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="S", min=0, help="Of the starts.")]


def drift(
    scene: SceneName,
    periods: Periods = 10_000,
    methods: Methods = None,
    ensemble: Ensemble = 1,
    samples: Samples = 25,
    seed: Seed = 0,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    json: Json = False,
    output: Folder = None,
    changes: Set = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Follow a scene for long by many methods; chart their errors."""
    from heavytop.scene.scene import load_scene
    from heavytop.studies.drift import drift as follow
    from heavytop.studies.methods import DEFAULT

    voice = Voice(quiet, verbose)
    options, asked = overrides(changes), names("--methods", methods)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming([*options, *(f"{name}=" for name in OPTIONS)]))
        read = load_scene(scene, overrides=options)
        stack.enter_context(results_folder(output))
        found = follow(
            read,
            methods=asked or DEFAULT,
            periods=periods,
            ensemble=ensemble,
            samples=samples,
            seed=seed,
            jobs=jobs,
            folder=output,
            executor=stack.enter_context(executor(scheduler, jobs)),
            progress=stack.enter_context(voice.study()),
        )
    finish(found, output, json=json, figures=not no_figures, voice=voice)


def finish(found: Drift, folder: Path | None, *, json: bool, figures: bool, voice: Voice) -> None:
    """Write and print a finished study; leave with a code of its own where nothing could run."""
    from heavytop.studies.methods import method

    document = found.document(files=results(found, folder, figures=figures, voice=voice))
    show(document, json)
    for each in found.methods:
        for number, why in each.ended.items():
            say(f"{each.name}, start {number}, ended early: {why}")
    methods = [method(each.name) for each in found.methods]
    if all(each.absent for each in methods):
        raise errors.MissingPackage(methods[0].name, methods[0].absent)
    if any(each.ended for each in found.methods):
        raise typer.Exit(Exit.ENDED_EARLY)


def results(found: Drift, folder: Path | None, *, figures: bool, voice: Voice) -> dict[str, str]:
    """Write the files of a study, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.report.study_files import write_drift

    return noted(write_drift(found, folder, figures=figures), folder, voice)
