"""The command ``heavytop``: how its verbs are called, what they print, and how they end."""

from __future__ import annotations

import errno
import gc
import inspect
import logging
import os
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import wraps
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer import BadParameter, Option
from typer.core import TyperCommand, TyperGroup

from heavytop import errors
from heavytop.cli.options import NAMES
from heavytop.results.base import spelt, typing, with_command
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.studies.runner import Progress

Verb = Callable[..., None]


@dataclass(frozen=True, kw_only=True)
class Manner:
    """How a verb answers: the options that all of them have."""

    json: Annotated[bool, Option("--json", help="Print one JSON document, nothing else.")] = False
    quiet: Annotated[bool, Option("-q", "--quiet", help="Print only errors on stderr.")] = False
    verbose: Annotated[bool, Option("-v", "--verbose", help="Print what the command is doing.")] = (
        False
    )
    debug: Annotated[bool, Option("--debug", help="Print the traceback of an error.")] = False


_MANNER: ContextVar[Manner] = ContextVar("manner", default=Manner())  # noqa: B039 (it is frozen)
manner = _MANNER.get

COLLECTED: Final = 100_000  # objects: imports make many and no rubbish, a tenth of their time

# --- exit codes ------------------------------------------------------------------------------


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
        return f"the input is not valid:\n{error}"
    return "interrupted" if interrupted(error) else str(error)


def leave(ends: Iterable[tuple[Exit, str]]) -> None:
    """Say what is wrong with a result that was printed, and leave with the gravest exit code."""
    worst = Exit.OK
    for code, sentence in ends:
        worst = max(worst, code)
        if sentence:
            say(sentence)
    if worst:
        raise typer.Exit(worst)


# --- what is printed -------------------------------------------------------------------------


def say(text: str) -> None:
    """Tell the person at the terminal something that is not a result."""
    told = "\n".join(map(harmless, text.split("\n")))  # names of files may have escape codes
    with suppress(OSError):  # of a closed or a full stderr: the exit code still says it
        typer.echo(f"heavytop: {told}", err=True)


def note(text: str) -> None:
    """Say what is being done, to those who asked."""
    if manner().verbose and not manner().quiet:
        say(text)


@contextmanager
def progress_bar() -> Iterator[Callable[[float | Progress], None] | None]:
    """A progress bar on stderr, only where somebody can see it move."""
    if manner().quiet or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def heard(now: float | Progress) -> None:
            if isinstance(now, int | float):
                bar.update(task, completed=now)
            else:
                runs = f"{now.ended} of {now.tasks} runs"
                bar.update(task, completed=now.fraction, description=runs)

        yield heard


def answer(document: Mapping[str, Any], in_words: Callable[[], None]) -> None:
    """Print one JSON document for a program, or for a person what says the same in words."""
    if manner().json:
        from heavytop.files import as_json

        typer.echo(as_json(document))
    else:
        in_words()


def show(document: Mapping[str, Any]) -> None:
    """Print the document of a result, or its tables."""

    def tables() -> None:
        from heavytop.report.studies import rendered

        print_table(rendered(document))

    answer(with_command(document), tables)


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


# --- verbs -----------------------------------------------------------------------------------


def verb(function: Verb) -> Verb:
    """Give a function the options of `Manner`, and what all verbs do with exceptions."""
    own = inspect.signature(function, eval_str=True)
    every = inspect.signature(Manner, eval_str=True).parameters

    @wraps(function)
    def run(**given: Any) -> None:
        token = _MANNER.set(Manner(**{name: given.pop(name) for name in every}))
        try:
            with _answering(given):
                function(**given)
        finally:
            _MANNER.reset(token)

    parameters = [*own.parameters.values(), *every.values()]
    run.__signature__ = own.replace(  # type: ignore[attr-defined]
        parameters=[each.replace(kind=each.KEYWORD_ONLY) for each in parameters]
    )
    return run


@contextmanager
def _answering(given: Mapping[str, Any]) -> Iterator[None]:
    """Turn what a verb raises into a sentence and an exit code, with a traceback if asked for."""
    try:
        with warnings.catch_warnings(), results_folder(given.get("output")):
            warnings.simplefilter("ignore" if manner().quiet else "always", UserWarning)
            warnings.showwarning = lambda message, *_, **__: say(f"warning: {message}")
            try:
                yield
            except errors.BadScene as bad:
                raise _blamed(bad, given) from bad
            except BrokenPipeError:  # of stdout, and not of a file
                raise
            except OSError as error:  # of a verb that writes one file
                if error.errno in FULL or "file" not in given:
                    raise
                raise unwritable(given["file"] or Path(), error) from None
    except (typer.Exit, BadParameter, BrokenPipeError):
        raise
    except (Exception, KeyboardInterrupt) as error:
        if manner().debug:
            traceback.print_exc()
        say(explain(error))
        raise typer.Exit(exit_code(error)) from None


def _blamed(bad: errors.BadScene, given: Mapping[str, Any]) -> Exception:
    """What is wrong with a scene; or with options, where nothing else is wrong."""
    keys = {change.partition("=")[0].strip() for change in given.get("changes") or ()}
    changed = keys | {key.partition(".")[0] for key in keys}
    if changed & {"top", "start"}:  # what a start with this top cannot be, the change has made
        changed |= {"top", "start"}

    def option(fault: errors.Fault) -> str:
        if fault.key == "want.digits" and given.get("digits") is not None:
            return "--digits"
        if fault.file == "--set" or fault.key in changed:
            return "--set"
        if fault.key == "scene" or not {*fault.key.split(", ")} <= given.keys():
            return ""
        return f"--{fault.key.replace('_', '-').replace(', ', ' and --')}"

    found = [(option(fault), fault) for fault in bad.faults]
    told = [replace(fault, file=name, line=None) if name else fault for name, fault in found]
    if not all(name for name, _ in found):
        return errors.BadScene(tuple(told))
    if len(told) == 1:
        [fault] = told
        return BadParameter(str(fault).removeprefix(f"{fault.file}: "), param_hint=fault.file)
    hint = " and ".join(dict.fromkeys(name for name, _ in found))
    return BadParameter("\n".join([f"{len(told)} faults", *map(str, told)]), param_hint=hint)


@contextmanager
def results_folder(folder: Path | None) -> Iterator[None]:
    """The folder of -o, if any, made and proved writable before time is spent on what it is for.

    Where it was made and is left empty it is taken away again.
    """
    if folder is None:
        yield
        return
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()
    except (OSError, ValueError) as error:
        raise unwritable(folder, error) from None
    try:
        yield
    finally:
        with suppress(OSError):  # rmdir refuses what is not empty
            for place in missing:
                place.rmdir()


def unwritable(path: Path, error: Exception) -> BadParameter:
    """What is wrong with the folder or the file named by -o."""
    why = getattr(error, "strerror", None) or str(error)
    if isinstance(error, FileExistsError):
        why = "not a folder"
    return BadParameter(f"cannot write to {str(path)!r}: {why}", param_hint="-o")


# --- the command -----------------------------------------------------------------------------


class _Verbs(TyperGroup):
    """The group of all verbs; what each finds names the command line that asked for it."""

    def main(self, args: Sequence[str] | None = None, *_: Any, **options: Any) -> Any:
        """Run a command line; completion is that of this name, also under ``python -m``."""
        words = sys.argv[1:] if args is None else list(args)
        with typing(spelt(words)):
            return super().main(words, **options | {"prog_name": "heavytop"})


class _Verb(TyperCommand):
    """A verb, whose help lists names that are too slow to import for any other."""

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the names, then the exit codes."""
        for option, known in NAMES.get(self.name or "", {}).items():
            formatter.write_paragraph()
            with formatter.indentation():
                formatter.write_text(f"Names for {option}: {', '.join(known())}.")
        super().format_epilog(ctx, formatter)


app = typer.Typer(
    name="heavytop",
    cls=_Verbs,
    help="The axisymmetric heavy top, integrated to the last digits and checked.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help text: a third of the time
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def register(*verbs: Verb) -> None:
    """Give the command its verbs, in the order of its help."""
    for each in verbs:
        app.command(cls=_Verb, epilog=EXIT_CODES)(each)


def _show_version(wanted: bool) -> None:
    if wanted:
        from heavytop import __version__

        typer.echo(f"heavytop {__version__}")
        raise typer.Exit


Version = Annotated[
    bool,
    Option("--version", help="Print the version and exit.", callback=_show_version, is_eager=True),
]


@app.callback()
def heavytop(version: Version = False) -> None:
    """Options of the command itself."""


def stop_when_ended() -> None:
    """Let SIGTERM and SIGHUP do what Ctrl-C does, so that no process is left behind."""
    for name in {"SIGTERM", "SIGHUP"} & set(dir(signal)):  # the second is not on Windows
        number = getattr(signal, name)
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def main() -> None:
    """Run the command line."""
    gc.set_threshold(COLLECTED)
    for number in range(3):  # a stream that is closed would give its number to a file of results
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    stop_when_ended()
    os.environ["MPLBACKEND"] = "agg"  # figures are files; a name it does not know stops matplotlib
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it tells of caches it cannot make
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a terminal without θ shows ?, and does not fail
            stream.reconfigure(errors="replace")
    try:
        app()
    except SystemExit as leaving:
        if isinstance(leaving.__context__, BrokenPipeError):
            raise SystemExit(Exit.UNREAD) from None
        raise
    except KeyboardInterrupt:  # before a verb has been read, or while it is explained
        raise SystemExit(Exit.INTERRUPTED) from None
    except OSError as fault:  # of the help, or of what is wrong with an option
        say(f"cannot write: {fault.strerror}")
        raise SystemExit(getattr(fault.__context__, "exit_code", Exit.ENDED_EARLY)) from None
    finally:
        gc.freeze()  # the interpreter would look through all modules once more before it ends
