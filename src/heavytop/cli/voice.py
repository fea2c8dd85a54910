"""The voice: what is said on stderr. Results are printed on stdout."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.studies.runner import Progress as StudyProgress


def say(text: str) -> None:
    """Tell the person at the terminal something that is not a result, if it can be told."""
    told = "\n".join(map(harmless, text.split("\n")))  # names of files may have escape codes
    with suppress(OSError):  # of a closed or a full stderr: the exit code still says it
        typer.echo(f"heavytop: {told}", err=True)


def _watched() -> bool:
    """Whether stderr is a terminal; it may be closed."""
    return sys.stderr is not None and sys.stderr.isatty()


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
        if self.quiet or not _watched():
            yield None
            return
        from rich.console import Console
        from rich.progress import Progress

        with Progress(console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("integrating", total=1.0)
            yield lambda done: bar.update(task, completed=done)

    @contextmanager
    def study(self) -> Iterator[Callable[[StudyProgress], None] | None]:
        """A progress bar for many runs, with their number, the rate and the time left."""
        if self.quiet or not _watched():
            yield None
            return
        from rich import progress
        from rich.console import Console

        columns = (
            progress.BarColumn(),
            progress.TaskProgressColumn(show_speed=False),
            progress.TextColumn("{task.fields[runs]} runs, {task.fields[rate]}"),
            progress.TimeRemainingColumn(),
        )
        with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            task = bar.add_task("", total=1.0, runs="0", rate="")

            def show(now: StudyProgress) -> None:
                runs, rate = f"{now.ended} of {now.tasks}", f"{100 * now.per_s:.2g} %/s"
                bar.update(task, completed=now.fraction, runs=runs, rate=rate)

            yield show
