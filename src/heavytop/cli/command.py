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
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer import BadParameter, Option
from typer.core import TyperGroup

from heavytop import errors
from heavytop.errors import Exit as Exit
from heavytop.results.base import command_line, typing
from heavytop.scene.arguments import Refused
from heavytop.scene.quantities import SHOWN, SI, Units, read_units
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from rich.console import RenderableType

    from heavytop.results.base import Result
    from heavytop.studies.study import Progress

Verb = Callable[..., None]


UNIT: Final = "Show tables, CSV and charts in these units, such as deg,rpm,ms; JSON stays SI."


@dataclass(frozen=True, kw_only=True)
class Manner:
    """How a verb answers: the options that all of them have."""

    json: Annotated[bool, Option("--json", help="Print one JSON document, nothing else.")] = False
    quiet: Annotated[bool, Option("-q", "--quiet", help="Print only errors on stderr.")] = False
    verbose: Annotated[bool, Option("-v", "--verbose", help="Print what the command is doing.")] = (
        False
    )
    unit: Annotated[str, Option("--unit", metavar="NAME,…", help=UNIT)] = ""
    debug: Annotated[bool, Option("--debug", help="Print the traceback of an error.")] = False

    @property
    def units(self) -> Units:
        """The units that are to be shown in place of those of SI."""
        try:
            return read_units(self.unit) if self.unit else SI
        except Refused as wrong:
            raise BadParameter(str(wrong), param_hint="--unit") from None


_MANNER: ContextVar[Manner] = ContextVar("manner", default=Manner())  # noqa: B039 (it is frozen)
manner = _MANNER.get

# --- exit codes ------------------------------------------------------------------------------


EXIT_CODES: Final = (
    "Exit codes: 0 ok; 1 a bug; 2 a bad option, or a missing optional package; 3 a bad scene, data "
    "or result file, or the folder of another study; 4 ended early, the partial result is kept; "
    "5 a check is out of its bound; 130 interrupted."
)
CODES: Final = {  # the first that fits
    Exit.USAGE: (errors.InUse, errors.MissingPackage, errors.NoScheduler),
    Exit.ENDED_EARLY: (errors.EndedEarly, errors.StoppedEarly),
    Exit.BUG: (errors.WrongType,),
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
        if sentence and (code or not manner().quiet):
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
    if manner().quiet or not sys.stderr.isatty():
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


def show(found: Result) -> None:
    """Print the document of a result, or its facts and tables in the units asked for."""

    def tables() -> None:
        token = SHOWN.set(manner().units)
        print_table(found)
        SHOWN.reset(token)

    answer(found.document(), tables)


def print_table(table: RenderableType) -> None:
    """Print a table as wide as the terminal, or COLUMNS, or 100; nothing stands behind a line."""
    from rich.console import Console

    console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 100)
    with console.capture() as printed:
        console.print(table)
    for line in printed.get().splitlines():
        print(line.rstrip())  # echo would write UTF-8 where the terminal has another alphabet
    sys.stdout.flush()  # it is there, whatever comes after it


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
                raise _of_options(bad, given) from bad
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


def _of_options(bad: errors.BadScene, given: Mapping[str, Any]) -> Exception:
    """What is wrong with a scene; or with options, where nothing else is wrong."""

    def option(fault: errors.Fault) -> str:
        keys = fault.key.split(", ")
        if fault.file == "--set":
            return fault.file
        if "scene" in keys or not {*keys} <= given.keys():
            return ""
        return " and ".join(f"--{key.replace('_', '-')}" for key in keys)

    hints = dict.fromkeys(option(fault) for fault in bad.faults)
    if "" in hints:
        return bad
    told = (str(fault).removeprefix(f"{fault.file}: ") for fault in bad.faults)
    return BadParameter("\n".join(told), param_hint=" and ".join(hints))


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
        with typing(command_line(words)):
            return super().main(words, **options | {"prog_name": "heavytop"})


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
        app.command(epilog=EXIT_CODES)(each)


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


COLLECTED: Final = 100_000  # objects, until garbage is looked for: imports make many and none


def stop_when_ended() -> None:
    """Let SIGTERM and SIGHUP do what Ctrl-C does, so that no process is left behind."""
    for name in {"SIGTERM", "SIGHUP"} & set(dir(signal)):  # the second is not on Windows
        number = getattr(signal, name)
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def main() -> None:
    """Run the command line."""
    gc.set_threshold(COLLECTED)
    stop_when_ended()
    os.environ["MPLBACKEND"] = "agg"  # figures are files; a name it does not know stops matplotlib
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # it tells of caches it cannot make
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a terminal without θ shows ?, and does not fail
            stream.reconfigure(errors="replace")
    try:
        app()
    except KeyboardInterrupt:  # before a verb has been read, or while it is explained
        raise SystemExit(Exit.INTERRUPTED) from None
    except OSError as fault:  # of the help, or of what is wrong with an option
        say(f"cannot write: {fault.strerror}")
        raise SystemExit(getattr(fault.__context__, "exit_code", Exit.ENDED_EARLY)) from None
    finally:
        gc.freeze()  # the interpreter would look through all modules once more before it ends
