"""``heavytop check``: a trajectory that somebody else computed, judged by the exact motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from heavytop.cli.exits import Exit
from heavytop.cli.options import Debug, Json, Quiet, Verbose, names
from heavytop.cli.output import print_json, unwritable
from heavytop.cli.voice import Voice, say

Data = Annotated[
    Path, typer.Argument(metavar="DATA", help="A CSV or TSV table, .npz, .mat, .nc or .h5.")
]
OptionalScene = Annotated[
    str | None,
    typer.Option("--scene", metavar="SCENE", help="What the data are of: a scene, or its top."),
]
Columns = Annotated[
    str | None,
    typer.Option("--columns", metavar="NAME=COLUMN,…", help="Names of unusual columns: t=Zeit."),
]
Digits = Annotated[
    float | None, typer.Option("--digits", metavar="D", help="Leave with 5 if there are fewer.")
]
Chart = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="Draw the errors: x.svg, .png or .pdf."),
]


def check(
    data: Data,
    scene: OptionalScene = None,
    columns: Columns = None,
    digits: Digits = None,
    output: Chart = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Judge a trajectory of your own, and name the usual slips."""
    from heavytop.checking.judge import check as judge

    pairs = [pair.partition("=") for pair in names("--columns", columns) or ()]
    if not all(equals for _, equals, _ in pairs):
        raise typer.BadParameter(f"{columns!r} is not NAME=COLUMN,…", param_hint="--columns")
    if output is not None and output.suffix not in (".svg", ".png", ".pdf"):
        raise typer.BadParameter(f"{output}: .svg, .png or .pdf", param_hint="-o")
    voice = Voice(quiet, verbose)
    found = judge(data, scene, {name: column for name, _, column in pairs})
    document = found.document()
    if output is not None:
        from heavytop.plots.check import check_figure
        from heavytop.plots.style import save

        try:
            save(check_figure(document), output)
        except OSError as fault:
            raise unwritable(output, fault) from None
        voice.note(f"wrote {output}")
    if json:
        print_json(document)
    else:
        print(found, flush=True)  # in the alphabet of the terminal
    if digits is not None and found.digits < digits:
        say(f"{digits:g} digits were asked for, and there are {found.digits:.1f}")
        raise typer.Exit(Exit.OUT_OF_BOUND)
