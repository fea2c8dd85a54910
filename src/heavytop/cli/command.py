"""The command ``heavytop``: how its verbs are called, what they print, and how they end."""

from __future__ import annotations

import errno
import os
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING, Any, Final, NamedTuple, NoReturn

import click

from heavytop import errors
from heavytop.cli.signature import Parameter, Value, read_verb
from heavytop.errors import Exit
from heavytop.text import harmless

if TYPE_CHECKING:
    from heavytop.results.base import Result

EXIT_CODES: Final = (
    "Exit codes: 0 ok; 1 a bug; 2 a bad option, or a missing optional package; 3 a bad scene, data "
    "or result file, or the folder of another study; 4 ended early, the partial result is kept; "
    "5 a check is out of its bound; 130 interrupted."
)
PROGRESS_S: Final = 30.0  # between two lines of progress
DEFAULT_SCENE: Final = "sicm-kicked"
OUTPUT: Final = ("folder", "path")
FULL: Final = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO})

Problem = tuple[Exit, str]


class Ended(NamedTuple):
    """A result, what is wrong with it, and the folder or the chart that is yet to be written."""

    result: Result
    problems: Sequence[Problem] = ()
    folder: Path | None = None
    figures: bool = True
    chart: Path | None = None


# --- verbs -----------------------------------------------------------------------------------


def read_units(text: str) -> Any:
    """Read the units that are to be shown."""
    from heavytop.scene.quantities import read_units

    return read_units(text)


UNIT_HELP: Final = "Show tables, CSV and charts in these units, such as deg,rpm,ms; JSON stays SI."
COMMON: Final = (
    click.Option(["--json"], is_flag=True, help="Print one JSON document, nothing else."),
    click.Option(["-q", "--quiet"], is_flag=True, help="Print only errors on stderr."),
    click.Option(["-v", "--verbose"], is_flag=True, help="Print what the command is doing."),
    click.Option(["--unit"], type=Value("NAME,…", read_units), help=UNIT_HELP),
    click.Option(["--debug"], is_flag=True, help="Print the traceback of an error."),
)


class Verbs(click.Group):
    """The group of all verbs; each names its function, and the one that this calls."""

    def __init__(self, verbs: Mapping[str, str], **given: Any) -> None:
        super().__init__(**given)
        self.verbs = verbs

    def main(self, args: Sequence[str] | None = None, *_: Any, **more: Any) -> NoReturn:
        """Run a command line and exit; its words are the object of the context."""
        words = sys.argv[1:] if args is None else list(args)
        more |= {"prog_name": "heavytop", "obj": words, "standalone_mode": False}
        try:
            code = super().main(words, **more) or Exit.OK
        except click.ClickException as wrong:
            code = Exit(wrong.exit_code)
            with suppress(OSError):  # of a full stderr: the exit code still says it
                wrong.show()
        except click.Abort:  # Ctrl-C, outside of a verb
            code = Exit.INTERRUPTED
        sys.exit(code)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """List the verbs in the order of the help."""
        return list(self.verbs)

    def get_command(self, ctx: click.Context, name: str) -> click.Command:
        """Return the command of a verb."""
        if name not in self.verbs:
            raise click.exceptions.NoSuchCommand(name, possibilities=self.verbs, ctx=ctx)
        takes, typed, text = read_verb(self.verbs[name])
        called = partial(invoke, self.verbs[name].split()[0], takes)
        params = [*typed, *COMMON]
        return click.Command(name, callback=called, params=params, help=text, epilog=EXIT_CODES)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the first line of what each verb says, whole."""
        helps = {name: self.get_command(ctx, name).help or "" for name in self.verbs}
        with formatter.section("Commands"):
            formatter.write_dl([(name, text.partition("\n")[0]) for name, text in helps.items()])


def invoke(place: str, takes: Mapping[str, Parameter], **typed: Any) -> None:
    """Call the function of a verb with what was typed; print and write what it returns."""
    from heavytop.results.base import command_line, typing
    from heavytop.scene.quantities import SI, showing

    given = {x: typed[x] for x in takes if typed.get(x) not in (None, ())}
    folder, path = (None if x in takes and takes[x].has_place else given.get(x) for x in OUTPUT)
    to_program = typed["json"] and folder is path is None
    words = click.get_current_context().find_root().obj
    with (
        typing(command_line(words)),
        explained(path),
        results_folder(folder),
        showing(SI if to_program else typed["unit"] or SI),
    ):
        function = find_function(place)
        with ExitStack() as stack:
            prepare(given, takes, typed, stack)
            found = function(**given)
        if isinstance(found, Path):
            document = {"schema": f"heavytop/{function.__name__}/1", "scene": given["scene"].name}
            size = f"{found.stat().st_size / 1e6:.2g} MB"
            print_result(document | {"file": str(found)}, f"{harmless(found)}: {size}")
        elif found is not None:
            ended = Ended(found, (), folder, typed.get("figures", True))
            deliver(found if isinstance(found, Ended) else ended)


def find_function(place: str) -> Any:
    """The function that is named as ``module:function``."""
    module, _, name = place.partition(":")
    return getattr(import_module(f"heavytop.{module}"), name)


def prepare(
    given: dict[str, Any], takes: Mapping[str, Parameter], typed: Any, stack: ExitStack
) -> None:
    """Put a scene, workers and progress in place of what was typed."""
    if any(each.has_place and each.kind.startswith("Scene") for each in takes.values()):
        given["scene"] = read_scene(typed["scene"], typed["changes"])
        note(f"{click.get_current_context().info_name} {given['scene'].name}")
    if address := given.get("executor"):
        from heavytop.studies.workers import executor_at

        if given.get("jobs", 1) > 1:
            rule = "cannot be combined with --scheduler, which has its own workers"
            raise click.BadParameter(rule, param_hint="--jobs")
        given["executor"] = stack.enter_context(executor_at(address))
    if "progress" in takes:
        given["progress"] = stack.enter_context(progress_bar())
    if "note" in takes:
        given["note"] = note


def read_scene(scene: str | None, changes: Sequence[str]) -> Any:
    """The scene of a name, or of the folder of a run, changed as the options ask."""
    from heavytop.scene import scene as scenes

    scene = scene or DEFAULT_SCENE
    run = Path(scene) / "trajectory.nc"
    if scene in scenes.shipped_names() or not run.exists():
        return scenes.load_scene(scene, overrides=list(changes))
    from heavytop.files import attribute, open_sealed

    with open_sealed(run) as file:
        text, name = attribute(file, "scene"), attribute(file, "name")
    return scenes.read_scene(text, where=f"{name}.toml", overrides=list(changes))


# --- what is printed -------------------------------------------------------------------------


def option(name: str) -> Any:
    """The value of an option that all verbs have."""
    return click.get_current_context().params[name]


def print_error(text: str) -> None:
    """Tell the person at the terminal something that is not a result."""
    lines = "\n".join(map(harmless, text.split("\n")))  # names of files may have escape codes
    with suppress(OSError):  # of a closed or a full stderr: the exit code still says it
        print(f"heavytop: {lines}", file=sys.stderr, flush=True)


def note(text: str) -> None:
    """Say what is being done, to those who asked."""
    if option("verbose") and not option("quiet"):
        print_error(text)


@contextmanager
def progress_bar() -> Iterator[Callable[[Any], None] | None]:
    """A progress bar on stderr; where nobody can see it move, a line now and then."""
    if option("quiet"):
        yield None
        return
    if not sys.stderr.isatty():
        yield lines_of_progress()
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)

        def update(now: Any) -> None:
            fraction, runs = done_of(now)
            bar.update(task, completed=fraction, description=runs)

        yield update


def lines_of_progress(clock: Callable[[], float] = time.monotonic) -> Callable[[Any], None]:
    """Return what says how much is done, in a line every `PROGRESS_S` seconds."""
    due = clock() + PROGRESS_S

    def update(now: Any) -> None:
        nonlocal due
        if clock() >= due:
            due = clock() + PROGRESS_S
            fraction, runs = done_of(now)
            print_error(", ".join(filter(None, (f"{100 * fraction:.0f} % done", runs))))

    return update


def done_of(now: Any) -> tuple[float, str]:
    """The fraction that is done of a run, or of a study, and how many of its runs have ended."""
    if isinstance(now, int | float):
        return now, ""
    return now.fraction, f"{now.ended} of {now.tasks} runs"


def print_result(document: Mapping[str, Any], shown: Any) -> None:
    """Print one JSON document for a program; for a person a text, or a table as wide as there is.

    The width is that of the terminal, or COLUMNS, or 100; nothing stands behind a line.
    """
    from heavytop.files import as_json

    if option("json"):
        print(as_json(document), flush=True)
    elif isinstance(shown, str):
        print(shown.removesuffix("\n"), flush=True)
    else:
        from rich.console import Console

        console = Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else 100)
        with console.capture() as printed:
            console.print(shown)
        for line in printed.get().splitlines():
            print(line.rstrip())
        sys.stdout.flush()  # it is there, whatever comes after it


def deliver(ended: Ended) -> None:
    """Write a result, print it, then draw it; leave with what is wrong with it."""
    found, ends = ended.result, [*ended.problems]
    if ended.folder is None:
        print_result(found.document(), found)
    else:
        found = write_files(found, ended.folder, ends, figures=ended.figures)
    if ended.chart is not None:
        from heavytop.plots.style import save

        with keeping_faults(ends, ended.chart):
            save(found.figure(), ended.chart)
            note(f"wrote {ended.chart}")
    exit_with([*ends, *(missing_packages(found) or found.problems())])


def write_files(found: Result, folder: Path, ends: list[Problem], *, figures: bool) -> Result:
    """Write a result, print it as a table, draw it, or print its document with all its files."""
    from heavytop.report.files import draw_study, write_study

    refused: list[Problem] = []
    with keeping_faults(refused, folder):
        found = replace(found, files=write_study(found, folder, figures=False))
    written = len(found.files)
    if not option("json"):
        print_result(found.document(), found)
    with keeping_faults(refused, folder):
        if figures and not refused:
            found = replace(found, files=draw_study(found, folder))
    if option("json"):
        print_result(found.document(), found)
    elif charts := ", ".join([*found.files.values()][written:]):
        print(f"charts  {charts}", flush=True)
    for name in found.files.values():
        note(f"wrote {folder / name}")
    ends[:0] = refused
    return found


@contextmanager
def keeping_faults(ends: list[Problem], path: Path) -> Iterator[None]:
    """Go on after what cannot be written; it is said at the end."""
    try:
        yield
    except (errors.StoppedEarly, OSError) as fault:
        ends.append(problem_of(fault, path))


def missing_packages(found: Result) -> list[Problem]:
    """What is to be installed, where no method of a study could be run without it."""
    if not (methods := found.unrun()):
        return []
    from heavytop.studies.methods import is_auto, method

    needs = [() if is_auto(name) else method(name).absent for name in methods]
    return [(Exit.USAGE, str(errors.MissingPackage(methods[0], needs[0])))] if all(needs) else []


def exit_with(problems: Iterable[Problem]) -> None:
    """Say what is wrong with a result that was printed, and exit with the gravest code."""
    worst = Exit.OK
    for code, sentence in problems:
        worst = max(worst, code)
        if sentence and (code or not option("quiet")):
            print_error(sentence)
    click.get_current_context().exit(worst)


# --- what goes wrong -------------------------------------------------------------------------


def problem_of(error: BaseException, path: Path | None = None) -> Problem:
    """The exit code of an exception, and what it says; `path` is the file of -o, if any."""
    if errors.is_interrupt(error):
        return Exit.INTERRUPTED, "interrupted"
    full = isinstance(error, OSError) and error.errno in FULL
    if isinstance(error, OSError) and (full or path is not None):
        why = "not a folder" if isinstance(error, FileExistsError) else error.strerror or error
        code = Exit.ENDED_EARLY if full else Exit.USAGE
        return code, f"cannot write {path or error.filename or ''}".rstrip() + f": {why}"
    if isinstance(error, errors.BadScene):
        return error.exit, f"the input is not valid:\n{error}"
    if isinstance(error, errors.HeavyTopError):
        early = getattr(error, "outcome", None) == errors.Outcome.INTERRUPTED
        return Exit.INTERRUPTED if early else error.exit, str(error)
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return Exit.BUG, f"a bug: {what} (--debug shows where)"


def exit_code(error: BaseException) -> Exit:
    """The exit code that an exception stands for."""
    return problem_of(error)[0]


@contextmanager
def explained(path: Path | None) -> Iterator[None]:
    """Turn what a verb raises into a sentence and an exit code, with a traceback if asked for."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore" if option("quiet") else "always", UserWarning)
            warnings.showwarning = lambda message, *_, **__: print_error(f"warning: {message}")
            yield
    except (click.exceptions.Exit, click.ClickException, BrokenPipeError):
        raise
    except (Exception, KeyboardInterrupt) as error:
        if option("debug"):
            traceback.print_exc()
        if (refused := refusal(error)) is not None:
            raise refused from error
        code, why = problem_of(error, path)
        print_error(why)
        raise click.exceptions.Exit(code) from None


def refusal(error: BaseException) -> click.BadParameter | None:
    """The refusal of options, where nothing else is wrong."""
    context = click.get_current_context()
    options = {each.name: each for each in context.command.params if each.name != "scene"}
    if isinstance(error, errors.BadScene):
        keys = ["changes" if each.file == "--set" else each.key for each in error.faults]
        why = "\n".join(str(each).removeprefix(f"{each.file}: ") for each in error.faults)
    elif isinstance(error, errors.Impossible):
        keys, why = [name for name, _ in error.broken], str(error)
    else:
        return None
    names = dict.fromkeys(name for key in keys for name in key.split(", "))
    if not names or not names.keys() <= options.keys():
        return None
    hint = " and ".join(options[name].opts[-1] for name in names)
    return click.BadParameter(why, param_hint=hint)


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
    except OSError as error:
        raise click.BadParameter(problem_of(error, folder)[1], param_hint="-o") from None
    try:
        yield
    finally:
        with suppress(OSError):  # rmdir refuses what is not empty
            for place in missing:
                place.rmdir()
