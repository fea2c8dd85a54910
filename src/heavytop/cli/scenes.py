"""``heavytop scenes``."""

from __future__ import annotations

import typer

from heavytop.cli.options import Debug, Json
from heavytop.cli.printing import print_json


def scenes(json: Json = False, debug: Debug = False) -> None:
    """List the scenes that come with the package."""
    from heavytop.scene import shipped_scenes

    titles = shipped_scenes()
    if json:
        print_json({"schema": "heavytop/scenes/1", "scenes": dict(titles)})
        return
    width = max(map(len, titles), default=0)
    for name, title in titles.items():
        typer.echo(f"{name:{width}}  {title}")
