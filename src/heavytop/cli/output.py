"""What verbs put out: a document or its table on stdout, and files in the folder of -o."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from heavytop.cli.exits import Exit
from heavytop.cli.voice import say
from heavytop.errors import StoppedEarly
from heavytop.results.base import with_command

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.cli.voice import Voice


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON document."""
    from heavytop.files import as_json

    typer.echo(as_json(document))


def show(document: Mapping[str, Any], json: bool) -> None:
    """Print a document on stdout: for a program, or for a person."""
    if json:
        print_json(with_command(document))
    elif sys.stdout is not None:  # it was closed: nobody reads
        from heavytop.report.terminal import rendered

        print_table(rendered(document))


def print_table(table: RenderableType) -> None:
    """Print a table as wide as the terminal, or COLUMNS, or 100; nothing stands behind a line."""
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 100)
    with console.capture() as printed:
        console.print(table)
    for line in printed.get().splitlines():
        print(line.rstrip())  # echo would write UTF-8 where the terminal has another alphabet


@contextmanager
def results_folder(folder: Path | None) -> Iterator[Path | None]:
    """The folder named by -o, if any, proved writable before time is spent on what it is for.

    What cannot be written there is the fault of that option.
    """
    if folder is None:
        yield None
        return
    from heavytop.files import writable

    with ExitStack() as stack:
        try:
            stack.enter_context(writable(folder))
        except (OSError, ValueError) as error:
            raise unwritable(folder, error) from None
        yield folder


def unwritable(folder: Path, error: Exception) -> typer.BadParameter:
    """What is wrong with the folder named by -o."""
    why = getattr(error, "strerror", None) or str(error)
    if isinstance(error, FileExistsError):
        why = "not a folder"
    return typer.BadParameter(f"cannot write to {str(folder)!r}: {why}", param_hint="-o")


@contextmanager
def printing_anyway() -> Iterator[Unsaved]:
    """Let files be written; where one cannot, print what was found, and then leave with 4."""
    unsaved = Unsaved()
    try:
        yield unsaved
    except StoppedEarly as lost:
        unsaved.why = lost.why


@dataclass(slots=True)
class Unsaved:
    """Why files are not there, if so."""

    why: str = ""

    def leave(self) -> None:
        """Say why, and leave, once what was found is on stdout; where all is there, do nothing."""
        if self.why:
            say(self.why)
            raise typer.Exit(Exit.ENDED_EARLY)


def noted(files: Mapping[str, str], folder: Path, voice: Voice) -> dict[str, str]:
    """The names of files that were just written, after a word about each to those who asked."""
    for name in files.values():
        voice.note(f"wrote {folder / name}")
    return dict(files)
