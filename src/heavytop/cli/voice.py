"""The voice: what is said on stderr. Results are printed on stdout."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import typer


def say(text: str) -> None:
    """Tell the person at the terminal something that is not a result."""
    typer.echo(f"heavytop: {text}", err=True)


@dataclass(frozen=True, slots=True)
class Voice:
    """How much is said on stderr while working."""

    quiet: bool = False
    verbose: bool = False

    def note(self, text: str) -> None:
        """Say what is being done, to those who asked."""
        if self.verbose and not self.quiet:
            say(text)

    @contextmanager
    def warnings(self) -> Iterator[None]:
        """Show the package's warnings as plain sentences, or not at all."""

        def plainly(message: Warning | str, *_: object, **__: object) -> None:
            say(f"warning: {message}")

        with warnings.catch_warnings():
            warnings.simplefilter("ignore" if self.quiet else "always", UserWarning)
            warnings.showwarning = plainly
            yield

    @contextmanager
    def progress(self) -> Iterator[Callable[[float], None] | None]:
        """A progress bar on stderr, only where somebody can see it move."""
        if self.quiet or not sys.stderr.isatty():
            yield None
            return
        from rich.console import Console
        from rich.progress import Progress

        with Progress(console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("integrating", total=1.0)
            yield lambda done: bar.update(task, completed=done)
