"""``heavytop drift``: long runs, whose errors are measured as they grow."""

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
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.drifts.drift import Drift

OPTIONS = ("periods", "methods", "ensemble", "samples", "seed")

Periods = Annotated[
    float, typer.Option("--periods", metavar="N", help="Nutation periods to go.", min=1)
]
Methods = Annotated[
    str | None,
    typer.Option(
        "--methods",
        metavar="NAME,…",
        help="Methods, each NAME or NAME=SETTING (a tolerance, or steps a period).",
    ),
]
Ensemble = Annotated[
    int, typer.Option("--ensemble", metavar="K", min=1, help="Neighbouring starts.")
]
Samples = Annotated[
    int, typer.Option("--samples", metavar="M", min=2, help="Times at which errors are measured.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="S", min=0, help="Of the starts.")]
Jobs = Annotated[int, typer.Option("--jobs", "-j", metavar="J", min=1, max=1024, help="Processes.")]


def drift(
    scene: SceneName,
    periods: Periods = 10_000,
    methods: Methods = None,
    ensemble: Ensemble = 1,
    samples: Samples = 25,
    seed: Seed = 0,
    jobs: Jobs = 1,
    json: Json = False,
    output: Folder = None,
    changes: Set = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Follow a scene for long with several methods, and chart how their errors grow."""
    from heavytop.drifts.drifting import drift as follow
    from heavytop.drifts.methods import DEFAULT
    from heavytop.scene import load_scene

    voice = Voice(quiet, verbose)
    options = overrides(changes)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming([*options, *(f"{name}=" for name in OPTIONS)]))
        read = load_scene(scene, overrides=options)
        if output is not None:
            stack.enter_context(results_folder(output))
        found = follow(
            read,
            methods=DEFAULT if methods is None else [name.strip() for name in methods.split(",")],
            periods=periods,
            ensemble=ensemble,
            samples=samples,
            seed=seed,
            jobs=jobs,
            folder=output,
            progress=stack.enter_context(voice.study()),
        )
    finish(found, output, json=json, figures=not no_figures, voice=voice)


def finish(found: Drift, folder: Path | None, *, json: bool, figures: bool, voice: Voice) -> None:
    """Write and print a finished study; leave with a code of its own where nothing could run."""
    document = found.document(files=results(found, folder, figures=figures, voice=voice))
    show(document, json)
    for each in found.methods:
        for number, why in (each.ended or {}).items():
            say(f"{each.method.text}, start {number}, ended early: {why}")
    if all(each.method.absent for each in found.methods):
        raise errors.MissingPackage(found.methods[0].method.name, found.methods[0].method.absent)
    if any(each.ended for each in found.methods):
        raise typer.Exit(Exit.ENDED_EARLY)


def results(found: Drift, folder: Path | None, *, figures: bool, voice: Voice) -> dict[str, str]:
    """Write the files of a study, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.drift_results import write_drift

    files = write_drift(found, folder, figures=figures)
    for name in files.values():
        voice.note(f"wrote {folder / name}")
    return files


def show(document: dict[str, Any], json: bool) -> None:
    """Print a study's document on stdout: for a program, or for a person."""
    if json:
        print_json(document)
        return
    from heavytop.report.drift_table import drift_table

    print_table(drift_table, document)
