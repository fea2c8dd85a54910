"""``heavytop atlas``: what kind of motion every pixel of a plane of tops is."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

import typer

from heavytop.cli.ending import ending
from heavytop.cli.exits import Exit
from heavytop.cli.options import (
    Debug,
    Folder,
    Json,
    NoFigures,
    Quiet,
    Set,
    Verbose,
    blaming,
    named_folder,
    overrides,
)
from heavytop.cli.output import noted, results_folder, show
from heavytop.cli.scheduler import Scheduler, executor
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.studies.atlas import Atlas

OPTIONS = ("x", "y", "x, y", "only", "integrate", "shard", "jobs")
AXIS = "NAME=FROM:TO:COUNT"


class Put(TypedDict):
    """How what was found is put out."""

    json: bool
    figures: bool
    voice: Voice


Places = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENE", help="A scene; with --merge, folders of shards.", show_default=False
    ),
]
X = Annotated[str | None, typer.Option("--x", metavar=AXIS, help="What changes along x.")]
Y = Annotated[str | None, typer.Option("--y", metavar=AXIS, help="… along y; or …:log.")]
Only = Annotated[str | None, typer.Option("--only", metavar="kind", help="Kinds alone; faster.")]
Integrate = Annotated[
    bool, typer.Option("--integrate", help="Integrate every top too, and compare the two maps.")
]
Shard = Annotated[
    str | None, typer.Option("--shard", metavar="i/n", help="Only the tiles of one shard of n.")
]
Merge = Annotated[bool, typer.Option("--merge", help="Join the shards in DIR… in the folder -o.")]
EnergyMomentum = Annotated[
    bool,
    typer.Option("--energy-momentum", help="The diagram of E' and p_phi at the scene's p_psi."),
]
AllJobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", metavar="J", min=1, max=1024, help="Processes; all by default."),
]


def atlas(
    places: Places,
    x: X = None,
    y: Y = None,
    only: Only = None,
    integrate: Integrate = False,
    shard: Shard = None,
    merge: Merge = False,
    jobs: AllJobs = None,
    scheduler: Scheduler = None,
    energy_momentum: EnergyMomentum = False,
    json: Json = False,
    output: Folder = None,
    changes: Set = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Classify every pixel of a plane of tops, and chart the map."""
    voice = Voice(quiet, verbose)
    put: Put = {"json": json, "figures": not no_figures, "voice": voice}
    asked = {"--x": x, "--y": y, "--only": only, "--integrate": integrate or None, "--shard": shard,
             "--jobs": jobs, "--scheduler": scheduler}  # fmt: skip
    with ExitStack() as stack:
        stack.enter_context(ending())
        stack.enter_context(voice.warnings())
        if merge:
            others = {"--set": changes, "--energy-momentum": energy_momentum or None}
            _alone("--merge", asked | others)
            _join(places, output, put)
            return
        name, options = _scene(places), overrides(changes)
        if energy_momentum:
            _alone("--energy-momentum", asked)
            _diagram(name, options, output, put)
            return
        axes = _axes(x, y)
        from heavytop.scene.scene import load_scene
        from heavytop.studies.atlas import atlas as mapped

        _no_clash(options, axes)
        stack.enter_context(blaming([*options, *(f"{name}=" for name in OPTIONS)]))
        read = load_scene(name, overrides=options)
        stack.enter_context(results_folder(output))
        found = mapped(
            read,
            *axes,
            only=only,
            integrate=integrate,
            shard=shard,
            jobs=jobs,
            executor=stack.enter_context(executor(scheduler, jobs)),
            folder=output,
            progress=stack.enter_context(voice.study()),
        )
        finish(found, output, **put)


def finish(found: Atlas, folder: Path | None, *, json: bool, figures: bool, voice: Voice) -> None:
    """Write and print an atlas; leave with a code of its own where two maps disagree."""
    document = found.document(files=results(found, folder, figures=figures, voice=voice))
    show(document, json)
    if not found.whole:
        tiles = f"{len(found.tasks)} of {document['tiles']['all']} tiles"
        say(f"a part of an atlas, {tiles}: heavytop atlas --merge DIR… -o DIR joins parts")
    if document.get("unexplained"):
        say(f"{document['unexplained']} pixels differ by more than rounding")
        raise typer.Exit(Exit.OUT_OF_BOUND)


def results(found: Atlas, folder: Path | None, *, figures: bool, voice: Voice) -> dict[str, str]:
    """Write the files of an atlas, where there is a folder for them."""
    if folder is None:
        return {}
    from heavytop.report.study_files import write_atlas

    return noted(write_atlas(found, folder, figures=figures), folder, voice)


def _diagram(name: str, options: list[str], output: Path | None, put: Put) -> None:
    """Write and print the energy–momentum diagram of a scene."""
    from heavytop.results.energy_momentum import diagram_of
    from heavytop.scene.scene import load_scene

    with blaming(options), results_folder(output):
        found, files = diagram_of(load_scene(name, overrides=options)), {}
        if output is not None:
            from heavytop.report.study_files import write_energy_momentum

            files = write_energy_momentum(found, output, figures=put["figures"])
            noted(files, output, put["voice"])
        show(found.document(files=files), put["json"])


def _join(places: list[str], output: Path | None, put: Put) -> None:
    """Join shards; leave with a code of its own where some are missing."""
    from heavytop.studies.atlas import merge_atlases

    if output is None:
        raise typer.BadParameter("the folder to join the shards in", param_hint="-o")
    with results_folder(output):
        found, _ = merge_atlases([named_folder(place) for place in places], output)
    finish(found, output, **put)
    if not found.whole:
        raise typer.Exit(Exit.ENDED_EARLY)


def _alone(option: str, others: dict[str, Any]) -> None:
    """Refuse what says nothing beside an option, rather than pass it over."""
    if given := [name for name, value in others.items() if value is not None]:
        raise typer.BadParameter(f"not together with {option}", param_hint=", ".join(given))


def _no_clash(changes: list[str], axes: tuple[str, str]) -> None:
    """Refuse a change of the scene to what an axis changes pixel by pixel."""
    from heavytop.studies.atlas_plane import ROLES

    for axis in axes:
        name = axis.partition("=")[0].strip()
        for change in changes:
            table, _, key = change.partition("=")[0].strip().partition(".")
            same = table in ("top", "start") and key in ROLES and name in ROLES
            if same and ROLES[key].sets == ROLES[name].sets:
                rule = f"{change!r}: the axis {name} sets the {ROLES[name].sets} of every pixel"
                raise typer.BadParameter(rule, param_hint="--set")


def _scene(places: list[str]) -> str:
    if len(places) > 1:
        raise typer.BadParameter("one scene; folders of shards go with --merge", param_hint="SCENE")
    return places[0]


def _axes(x: str | None, y: str | None) -> tuple[str, str]:
    if x is None or y is None:
        missing = " and ".join(n for n, each in (("--x", x), ("--y", y)) if each is None)
        raise typer.BadParameter(f"an axis {AXIS}, such as phidot=-20:20:400", param_hint=missing)
    return x, y
