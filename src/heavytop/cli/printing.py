"""Printing on stdout: a document for programs, a table for people."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.console import RenderableType


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON document."""
    from heavytop.files import as_json

    typer.echo(as_json(document))


def print_table(
    table: Callable[[Mapping[str, Any]], RenderableType], document: Mapping[str, Any]
) -> None:
    """Print a document as the table that `table` makes of it; 100 columns where there is no end."""
    if sys.stdout is None:  # it was closed: nobody reads
        return
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() else 100)
    console.print(table(document))
