"""``heavytop doctor``."""

from __future__ import annotations

import typer

from heavytop.cli.exits import Exit
from heavytop.cli.options import Debug, Json
from heavytop.cli.output import print_json
from heavytop.cli.voice import say


def doctor(json: Json = False, debug: Debug = False) -> None:
    """Say what is installed here: versions, processor, wheel, cache."""
    from heavytop.doctor import diagnosis, in_words

    found = diagnosis()
    if json:
        print_json(found)
    else:
        typer.echo(in_words(found))
    if found["missing"]:
        say("missing: " + ", ".join(found["missing"]))
        raise typer.Exit(Exit.OUT_OF_BOUND)
