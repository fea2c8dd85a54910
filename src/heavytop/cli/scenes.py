"""``heavytop scenes``."""

from __future__ import annotations

from typing import Annotated

import typer

from heavytop.cli.options import Debug, Json, blaming
from heavytop.cli.output import print_json, print_table

SCHEMA = "heavytop/scenes/1"

ShippedName = Annotated[
    str | None,
    typer.Argument(metavar="NAME", help="Print the text of this one.", show_default=False),
]


def scenes(name: ShippedName = None, json: Json = False, debug: Debug = False) -> None:
    """List the scenes that are shipped, or print the text of one."""
    if name is None:
        _list(json)
    else:
        _print(name, json)


def _list(json: bool) -> None:
    from heavytop.scene.scene import shipped_scenes

    titles = shipped_scenes()
    if json:
        print_json({"schema": SCHEMA, "scenes": dict(titles)})
        return
    from heavytop.report.terminal import two_columns

    print_table(two_columns(titles.items()))


def _print(name: str, json: bool) -> None:
    from heavytop.scene.scene import shipped_text

    with blaming(["scene"]):
        text = shipped_text(name)
    if json:
        print_json({"schema": SCHEMA, "name": name, "text": text})
        return
    typer.echo(text, nl=False)
