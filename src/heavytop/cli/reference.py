"""``heavytop reference``: exact values of a motion, every digit proved."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heavytop.cli.options import Debug, Json, Quiet, Set, Verbose, blaming, names, overrides
from heavytop.cli.output import print_json, unwritable
from heavytop.cli.voice import Voice

OptionalScene = Annotated[
    str | None, typer.Argument(metavar="SCENE", help="A shipped scene or the path of a TOML file.")
]
Times = Annotated[
    str | None,
    typer.Option(
        "--times", metavar="A:B:STEP|FILE", help="Times [s]: 0:10:0.01, or a file with a column t."
    ),
]
Quantities = Annotated[
    str,
    typer.Option(
        "--quantities", metavar="NAME,…", help="theta, phi, psi, rates, axis, attitude, omega."
    ),
]
Events = Annotated[
    str | None,
    typer.Option("--events", metavar="NAME,…", help="turning, reversal, cusp; in --json alone."),
]
Digits = Annotated[
    int, typer.Option("--digits", metavar="D", min=2, max=4000, help="Digits of every number.")
]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o", "--output", metavar="FILE", help="Write x.csv, x.json or x.nc (else stdout)."
    ),
]
Pack = Annotated[
    Path | None,
    typer.Option("--pack", metavar="DIR", help="Write values of all shipped scenes, and score.py."),
]


def reference(
    scene: OptionalScene = None,
    times: Times = None,
    quantities: Quantities = "theta,phi,psi",
    events: Events = None,
    digits: Digits = 20,
    output: Output = None,
    pack: Pack = None,
    json: Json = False,
    changes: Set = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Print exact values of a motion, every digit proved."""
    from heavytop.analytic import reference as exact
    from heavytop.scene.scene import load_scene

    voice = Voice(quiet, verbose)
    if pack is not None:
        _pack(pack, voice, SCENE=scene, times=times, events=events, output=output, set=changes)
        return
    if scene is None or times is None:
        missing = "SCENE" if scene is None else "--times"
        raise typer.BadParameter("is missing", param_hint=missing)
    if output is not None and output.suffix not in (".csv", ".json", ".nc"):
        raise typer.BadParameter(f"{output}: .csv, .json or .nc", param_hint="-o")
    if events and not (json or (output is not None and output.suffix == ".json")):
        raise typer.BadParameter("with --json or -o x.json: no table", param_hint="--events")
    options = overrides(changes)
    wanted, happening = names("--quantities", quantities), names("--events", events)
    asked_for = ("times", "quantities", "events", "digits")
    with voice.warnings(), blaming([*options, *(f"{name}=" for name in asked_for)]):
        asked = exact.read_times(times)
        chosen = load_scene(scene, overrides=options)
        found = exact.reference(chosen, asked, wanted or (), digits, happening or ())
    if output is not None:
        try:
            found.save(output)
        except OSError as fault:
            raise unwritable(output, fault) from None
        voice.note(f"wrote {output}")
    if json:
        print_json(found.document())
    elif output is None:
        typer.echo(found.to_csv(), nl=False)


def _pack(folder: Path, voice: Voice, **others: object) -> None:
    """Write the values of all shipped scenes; what else was asked for has no say in them."""
    from heavytop.results.reference_pack import write_pack

    for name, value in others.items():
        if value:
            hint = name if name.isupper() else f"--{name}"
            raise typer.BadParameter("nothing else goes with --pack", param_hint=hint)
    try:
        files = write_pack(folder)
    except OSError as fault:
        raise unwritable(folder, fault) from None
    voice.note(f"wrote {len(files)} files into {folder}")
