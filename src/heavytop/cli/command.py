"""The command ``heavytop``: calls its verbs, prints their results, and exits with their codes."""

from __future__ import annotations

import errno
import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import (
    AbstractContextManager,
    ExitStack,
    contextmanager,
    nullcontext,
    redirect_stdout,
    suppress,
)
from dataclasses import replace
from functools import partial
from importlib import import_module
from inspect import Parameter
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Final, NamedTuple, NoReturn

import click
from click.shell_completion import shell_complete

from heavytop import errors
from heavytop.cli.signature import positional, read_verb
from heavytop.errors import Exit
from heavytop.results.registry import RESULTS
from heavytop.text import in_a_line, printable

EXIT_CODES: Final = (
    "Exit codes: 0 ok; 1 a bug; 2 a bad option, or a missing optional package; 3 a bad scene, data "
    "or result file, or the folder of another study; 4 ended early, the partial result is kept; "
    "5 a check is out of its bound; 130 interrupted; 141 nobody reads the output on."
)
DEFAULT_SCENE: Final = "sicm-kicked"
COMPLETION: Final = "_HEAVYTOP_COMPLETE"  # the variable by which a shell asks for words
PROGRESS_S: Final = 30.0  # between two lines of progress
FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO})

Problem = tuple[Exit, str]


class CommandResult(NamedTuple):
    """The result of a verb, and its problems.

    Attributes
    ----------
    found : Any
        A result, a table, or anything with a text.
    problems : sequence of (Exit, str)
    document : mapping, optional
        The JSON document, where `found` does not give it.
    figures : bool
        Whether its figures are to be drawn.
    held : context manager
        The lock of the folder that it is to be written in.
    """

    found: Any
    problems: Iterable[Problem] = ()
    document: Mapping[str, Any] | None = None
    figures: bool = True
    held: AbstractContextManager[object] = nullcontext()


# --- verbs -----------------------------------------------------------------------------------


UNIT_HELP: Final = "Show tables, CSV and charts in these units, such as deg,rpm,ms; JSON stays SI."
COMMON: Final = (
    click.Option(["--json"], is_flag=True, help="Print one JSON document, nothing else."),
    click.Option(["-q", "--quiet"], is_flag=True, help="On stderr, print errors only."),
    click.Option(["-v", "--verbose"], is_flag=True, help="Print what the command is doing."),
    click.Option(["--unit"], metavar="NAME,…", help=UNIT_HELP),
    click.Option(["--debug"], is_flag=True, help="Print the traceback of an error."),
)


class Verb(click.Command):
    """A command that reports all of its wrong options at once."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the options; raise one error for all that are wrong."""
        typed = list(args)
        try:
            return super().parse_args(ctx, args)
        except click.BadParameter:
            options, _, order = self.make_parser(ctx).parse_args(typed)
            wrong = []
            for each in click.core.iter_params_for_processing(order, self.get_params(ctx)):
                try:
                    each.handle_parse_result(ctx, options, [])
                except click.BadParameter as refusal:
                    wrong.append(refusal.format_message())
            raise click.UsageError("\n".join(wrong), ctx) from None


class Verbs(click.Group):
    """The group of all verbs, with the function of each, and the one that this calls."""

    def __init__(self, verbs: Mapping[str, str], **given: Any) -> None:
        super().__init__(**given)
        self.verbs = verbs

    def main(self, args: Any = None, prog_name: Any = None, *_: Any, **more: Any) -> NoReturn:
        """Run a command line and exit; its words are `obj` of the context."""
        words = sys.argv[1:] if args is None else list(args)
        if completion := os.environ.get(COMPLETION):
            sys.exit(shell_complete(self, {}, "heavytop", COMPLETION, completion))
        try:
            with self.make_context("heavytop", [*words], obj=words, **more) as ctx:
                self.invoke(ctx)
            sys.exit(Exit.OK)
        except click.exceptions.Exit as end:
            sys.exit(end.exit_code)
        except click.ClickException as wrong:
            wrong.show()
            sys.exit(wrong.exit_code)
        except KeyboardInterrupt:  # outside of a verb
            sys.exit(Exit.INTERRUPTED)
        except BrokenPipeError:  # the reader has ended, such as `head`: the rest is not printed
            with suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(Exit.CLOSED)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the verbs in the order of the help."""
        return [*self.verbs]

    def get_command(self, ctx: click.Context, name: str) -> click.Command:
        """Return the command of a verb."""
        if name not in self.verbs:
            raise click.exceptions.NoSuchCommand(name, possibilities=self.verbs, ctx=ctx)
        takes, typed, text = read_verb(self.verbs[name], stored=f"{name}.json" in RESULTS)
        texts: Any = {"help": text, "short_help": text.partition("\n")[0], "epilog": EXIT_CODES}
        callback = partial(invoke, self.verbs[name].split()[0], takes)
        return Verb(name, callback=callback, params=[*typed, *COMMON], **texts)


def invoke(place: str, takes: Mapping[str, Parameter], **typed: Any) -> None:
    """Call the function of a verb with its options, print its result, and exit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore" if typed["quiet"] else "default", UserWarning)
        warnings.showwarning = lambda message, *_, **__: print_error(f"warning: {message}")
        try:
            call(place, takes, typed)
        except (click.exceptions.Exit, click.ClickException, BrokenPipeError):
            raise
        except (Exception, KeyboardInterrupt) as error:
            if typed["debug"]:
                traceback.print_exc()
            refuse_options(error)
            exit_with([problem_of(error)])


def call(place: str, takes: Mapping[str, Parameter], typed: Mapping[str, Any]) -> None:
    """Call the function ``module:function`` with its options; write and print its result."""
    from heavytop.results.base import command_line, typing
    from heavytop.scene.arguments import gather
    from heavytop.scene.quantities import SI, read_units, show_units

    module, _, name = place.partition(":")
    given = {x: typed[x] for x in takes if typed.get(x) not in (None, ())}
    folder, path = typed.get("folder"), typed.get("path")
    if path is not None and not path.suffix:
        folder, path = path, None
    with gather() as attempt:
        output = "path" if "path" in takes else "folder"  # what -o stands for
        if positional(takes) != output:  # the folder of `resume` is data
            attempt(expect_writable, output, folder or (path and path.parent))
        units = SI if typed["unit"] is None else attempt(read_units, typed["unit"])
        if of_scene := positional(takes) == "scene":
            given["scene"] = attempt(read_scene, typed["scene"], typed["changes"])
    context, printed = click.get_current_context(), typed["json"] and folder is path is None
    with typing(command_line(context.obj)), show_units(SI if printed else units):
        if of_scene:
            note(f"{context.info_name} {given['scene'].name}")
        with ExitStack() as working:  # it ends before printing: a progress bar uses stdout
            working.enter_context(redirect_stdout(sys.stderr))  # for prints of users' methods
            if address := given.get("executor"):
                from heavytop.studies.workers import executor_at

                given["executor"] = working.enter_context(executor_at(address))
            if "progress" in takes:
                given["progress"] = working.enter_context(progress_bar())
            found = getattr(import_module(f"heavytop.{module}"), name)(**given)
        if isinstance(found, Path):
            document = {"schema": f"heavytop/{name}/1", "scene": given["scene"].name}
            size = f"{printable(found)}: {found.stat().st_size / 1e6:.2g} MB"
            found = CommandResult(size, document=document | {"file": str(found)})
        answer = found if isinstance(found, CommandResult) else CommandResult(found)
        deliver(answer, folder, path, typed.get("figures", True))


def read_scene(scene: str | None, changes: Sequence[str]) -> Any:
    """The scene of a name, or of the folder of a run, with changes."""
    from heavytop.scene import scene as scenes
    from heavytop.scene.scene_file import shipped_names

    scene = scene or DEFAULT_SCENE
    if scene in shipped_names() or not Path(scene).is_dir():
        return scenes.load_scene(scene, overrides=list(changes))
    from heavytop.studies.journal import first_line

    if not (run := first_line(Path(scene)).get("run")):
        raise errors.ForeignFile(f"{scene}: neither a scene nor the folder of a run")
    return scenes.read_scene(run["text"], f"{run['name']}.toml", list(changes))


# --- printing and writing --------------------------------------------------------------------


def option(name: str) -> Any:
    """The value of an option of the running verb."""
    return click.get_current_context().params[name]


def print_error(text: str) -> None:
    """Print a text to stderr."""
    lines = "\n".join(map(printable, text.split("\n")))  # names of files may have escape codes
    with suppress(OSError):  # stderr is closed or full: the exit code still tells the outcome
        print(f"heavytop: {lines}", file=sys.stderr, flush=True)


def note(text: str) -> None:
    """Print what is being done, with --verbose."""
    if option("verbose") and not option("quiet"):
        print_error(text)


@contextmanager
def progress_bar() -> Iterator[Callable[[Any], None] | None]:
    """Yield a function that shows progress: by a bar on a terminal, else by lines now and then."""
    if option("quiet") or not sys.stderr.isatty():
        yield None if option("quiet") else lines_of_progress()
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda now: bar.update(task, completed=done_of(now)[0], description=done_of(now)[1])


def done_of(now: Any) -> tuple[float, str]:
    """The fraction of a run or a study that is done, and words for the ended runs of a study."""
    if isinstance(now, int | float):
        return now, ""
    return now.fraction, f"{now.ended} of {now.tasks} runs"


def lines_of_progress(clock: Callable[[], float] = time.monotonic) -> Callable[[Any], None]:
    """Return a function that prints the progress in a line every `PROGRESS_S` seconds."""
    due = clock() + PROGRESS_S

    def update(now: Any) -> None:
        nonlocal due
        if clock() >= due:
            due = clock() + PROGRESS_S
            fraction, runs = done_of(now)
            print_error(", ".join(filter(None, (f"{100 * fraction:.0f} % done", runs))))

    return update


def deliver(answer: CommandResult, folder: Path | None, path: Path | None, figures: bool) -> None:
    """Write a result, print it before figures are drawn, and exit with its problems."""
    from heavytop.report.files import write_result
    from heavytop.results.base import Result

    found, problems, shown, written = answer.found, [*answer.problems], False, ""

    def show() -> None:
        nonlocal shown
        shown = True
        with suppress(OSError):  # the reader has ended: the last print fails again
            print_found(found, None)

    try:
        with answer.held:
            if isinstance(found, Result) and folder is not None and not found.files:
                first, drawn = None if option("json") else show, figures and answer.figures
                found = replace(found, files=write_result(found, folder, figures=drawn, show=first))
        if path is not None and not isinstance(found, str):
            found.save(path)
            written = f"wrote {printable(path)}"
    except (errors.StoppedEarly, OSError) as fault:
        problems.append(problem_of(fault))
    if isinstance(found, Result):
        problems += found.problems()
        for name in found.files.values():
            note(f"wrote {folder}/{name}")
    if shown:
        print("\n" * bool(found.files), end="")
        print_found(found.files_table, None)
    elif path is None or isinstance(found, str) or option("json"):
        print_found(found, answer.document)
    elif written:
        print(written, flush=True)
    exit_with(problems)


def print_found(found: Any, document: Mapping[str, Any] | None) -> None:
    """Print a result: with --json one document, else a text or a table.

    The width is that of the terminal, or COLUMNS, or 100; lines have no blanks at their ends.
    """
    from heavytop.files import as_json

    if option("json"):
        print(as_json(document or found.document()), flush=True)
    elif not hasattr(found, "__rich_console__"):
        print(str(found).removesuffix("\n"), flush=True)
    else:
        from rich.console import Console

        wide = sys.stdout.isatty() or os.environ.get("COLUMNS", "0").strip("0") != ""
        console = Console(width=None if wide else 100)
        with console.capture() as printed:
            console.print(found)
        for line in printed.get().splitlines():
            print(line.rstrip())
        sys.stdout.flush()  # before figures are drawn


def exit_with(problems: Iterable[Problem]) -> NoReturn:
    """Print problems, and exit with the largest code."""
    worst = Exit.OK
    for code, sentence in problems:
        worst = max(worst, code)
        if sentence and (code or not option("quiet")):
            print_error(sentence)
    click.get_current_context().exit(worst)


def expect_writable(name: str, folder: Path | None) -> None:
    """Raise `Impossible` for a folder of -o in which nothing can be written."""
    if folder is None:
        return
    existing = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    try:
        TemporaryFile(dir=existing).close()
    except OSError as error:
        raise errors.Impossible([(name, f"cannot write {folder}: {error.strerror}")]) from None


# --- errors ----------------------------------------------------------------------------------


def problem_of(error: BaseException) -> Problem:
    """The exit code and the sentence of an exception."""
    if errors.is_interrupt(error):
        return Exit.INTERRUPTED, "interrupted"
    if isinstance(error, errors.HeavyTopError):
        head = "the input is not valid:\n" if isinstance(error, errors.BadScene) else ""
        return error.exit, f"{head}{error}"
    if isinstance(error, OSError) and (error.filename or error.errno in FULL):
        code = Exit.ENDED_EARLY if error.errno in FULL else Exit.USAGE
        return code, f"cannot write {error.filename or ''}".rstrip() + f": {error.strerror}"
    return Exit.BUG, f"a bug: {in_a_line(error)} (--debug shows where)"


def refuse_options(error: BaseException) -> None:
    """Raise an error about options for one about arguments, if all of these are options."""
    if not isinstance(error, errors.Impossible):
        return
    keys = ["changes" if each.file == "--set" else each.key for each in error.faults]
    why = "\n".join(str(each).removeprefix(f"{each.file}: ") for each in error.faults)
    context = click.get_current_context()
    options = {each.name: each.opts[-1] for each in context.command.params if each.name != "scene"}
    names = dict.fromkeys(name for key in keys for name in key.split(", "))
    if names and names.keys() <= options.keys():
        hint = " and ".join(options[name] for name in names)
        raise click.BadParameter(why, param_hint=hint) from error
