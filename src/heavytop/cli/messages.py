"""What the command prints: documents and tables on stdout, sentences on stderr, and exit codes."""

from __future__ import annotations

import errno
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final

import typer

from heavytop import errors
from heavytop.results.base import with_command
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.studies.runner import Progress as StudyProgress


class Exit(IntEnum):
    """What the exit code of every verb means; of several the greatest counts."""

    OK = 0
    BUG = 1
    USAGE = 2
    BAD_SCENE = 3
    ENDED_EARLY = 4
    OUT_OF_BOUND = 5
    INTERRUPTED = 130
    UNREAD = 141  # as a shell says of a command whose output is closed, as by | head


EXIT_CODES: Final = (
    "Exit codes: 0 ok; 1 a bug; 2 a bad option, or a missing optional package; 3 a bad scene, data "
    "or result file, or the folder of another study; 4 ended early, the partial result is kept; "
    "5 a check is out of its bound; 130 interrupted; 141 the output was closed."
)
CODES: Final = {  # the first that fits
    Exit.USAGE: (errors.InUse, errors.MissingPackage, errors.NoScheduler),
    Exit.ENDED_EARLY: (errors.EndedEarly, errors.StoppedEarly),
    Exit.BUG: (errors.UntranslatableExpression, errors.WrongType),
    Exit.BAD_SCENE: (errors.HeavyTopError,),
}
FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO})


def interrupted(error: BaseException) -> bool:
    """Whether it is an interrupt; one during an import comes wrapped in another error."""
    return isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt)


def exit_code(error: BaseException) -> Exit:
    """The exit code that an exception stands for."""
    if interrupted(error) or getattr(error, "outcome", None) == errors.Outcome.INTERRUPTED:
        return Exit.INTERRUPTED
    if isinstance(error, OSError) and error.errno in FULL:
        return Exit.ENDED_EARLY
    return next((code for code, kinds in CODES.items() if isinstance(error, kinds)), Exit.BUG)


def explain(error: BaseException) -> str:
    """An exception in words."""
    if exit_code(error) is Exit.BUG:
        what = " ".join(f"{type(error).__name__}: {error}".split())
        return f"a bug: {what} (--debug shows where)"
    if isinstance(error, OSError):
        return f"cannot write: {error.strerror or error}"
    if isinstance(error, errors.BadScene):
        return f"the scene cannot be run:\n{error}"
    return "interrupted" if interrupted(error) else str(error)


def say(text: str) -> None:
    """Tell the person at the terminal something that is not a result."""
    told = "\n".join(map(harmless, text.split("\n")))  # names of files may have escape codes
    with suppress(OSError):  # of a closed or a full stderr: the exit code still says it
        typer.echo(f"heavytop: {told}", err=True)


def leave(ends: Iterable[tuple[Exit, str]]) -> None:
    """Say what is wrong with a result that was printed, and leave with the gravest exit code."""
    worst = Exit.OK
    for code, sentence in ends:
        worst = max(worst, code)
        if sentence:
            say(sentence)
    if worst:
        raise typer.Exit(worst)


@contextmanager
def plain_warnings(quiet: bool) -> Iterator[None]:
    """Show the package's warnings as plain sentences, or not at all."""

    def plainly(message: Warning | str, *_: object, **__: object) -> None:
        say(f"warning: {message}")

    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if quiet else "always", UserWarning)
        warnings.showwarning = plainly
        yield


@contextmanager
def progress_bar(visible: bool) -> Iterator[Callable[[float | StudyProgress], None] | None]:
    """A progress bar on stderr, only where somebody can see it move."""
    if not visible or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def heard(now: float | StudyProgress) -> None:
            if isinstance(now, int | float):
                bar.update(task, completed=now)
            else:
                runs = f"{now.ended} of {now.tasks} runs"
                bar.update(task, completed=now.fraction, description=runs)

        yield heard


def print_json(document: Mapping[str, Any]) -> None:
    """Print one JSON document."""
    from heavytop.files import as_json

    typer.echo(as_json(document))


def show(document: Mapping[str, Any], json: bool) -> None:
    """Print a document on stdout: for a program, or for a person."""
    if json:
        print_json(with_command(document))
    else:
        from heavytop.report.studies import rendered

        print_table(rendered(document))


def print_table(table: RenderableType) -> None:
    """Print a table as wide as the terminal, or COLUMNS, or 100; nothing stands behind a line."""
    from rich.console import Console

    if sys.stdout is None:  # it was closed: nobody reads
        return
    console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 100)
    with console.capture() as printed:
        console.print(table)
    for line in printed.get().splitlines():
        print(line.rstrip())  # echo would write UTF-8 where the terminal has another alphabet
