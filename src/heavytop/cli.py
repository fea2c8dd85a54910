"""The command line: reads options, calls the package, prints. It computes nothing.

Results go to stdout; progress, notes, warnings and errors to stderr. Whatever is slow to
import is imported by the verb that needs it, so that ``heavytop --help`` answers at once.
"""

from __future__ import annotations

import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from heavytop import errors

if TYPE_CHECKING:
    from heavytop.scene import Scene
    from heavytop.trajectory import Trajectory


class Exit(IntEnum):
    """What the exit code of every verb means."""

    OK = 0
    BUG = 1
    USAGE = 2
    BAD_SCENE = 3
    ENDED_EARLY = 4
    OUT_OF_BOUND = 5
    FOREIGN_FILE = 6
    MISSING_PACKAGE = 7
    INTERRUPTED = 130


# The first that fits. What is not here is a bug of ours.
REFUSALS: tuple[tuple[type[BaseException], Exit], ...] = (
    (errors.BadScene, Exit.BAD_SCENE),
    (errors.Impossible, Exit.BAD_SCENE),
    (errors.NotANumber, Exit.BAD_SCENE),
    (errors.NoClosedForm, Exit.BAD_SCENE),
    (errors.EndedEarly, Exit.ENDED_EARLY),
    (errors.ForeignFile, Exit.FOREIGN_FILE),
    (KeyboardInterrupt, Exit.INTERRUPTED),
)

EXIT_CODES = (
    "Exit codes: 0 ok; 1 a bug; 2 a bad option; 3 a bad scene; 4 ended early, the partial result "
    "is kept; 5 a check is out of its bound; 6 a damaged or foreign file; 7 an optional package "
    "is missing; 130 interrupted."
)

DEBUG = "heavytop.debug"  # key in the context that every verb shares


def say(text: str) -> None:
    """Tell the person at the terminal something that is not a result."""
    typer.echo(f"heavytop: {text}", err=True)


def exit_code(error: BaseException) -> Exit:
    """The exit code that an exception stands for."""
    if isinstance(error, errors.EndedEarly) and error.outcome is errors.Outcome.INTERRUPTED:
        return Exit.INTERRUPTED
    return next((code for kind, code in REFUSALS if isinstance(error, kind)), Exit.BUG)


def explain(error: BaseException, code: Exit) -> str:
    """One error in words."""
    if code is Exit.BUG:
        what = " ".join(f"{type(error).__name__}: {error}".split())
        return f"a bug: {what} (--debug shows where)"
    if isinstance(error, errors.BadScene):
        return f"the scene cannot be run:\n{error}"
    return str(error) or "interrupted"


class Verbs(TyperGroup):
    """The command group, where every exception becomes a message and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Run a verb; what it raises is explained without a traceback, unless asked for one."""
        try:
            return super().invoke(ctx)
        except (Exception, KeyboardInterrupt) as error:
            if belongs_to_typer(error):
                raise
            if ctx.meta.get(DEBUG):
                traceback.print_exc()
            code = exit_code(error)
            say(explain(error, code))
            raise typer.Exit(code) from None


def belongs_to_typer(error: BaseException) -> bool:
    """Whether typer itself turns this exception into a message and an exit code."""
    return isinstance(error, BrokenPipeError) or type(error).__module__.startswith("typer.")


app = typer.Typer(
    name="heavytop",
    cls=Verbs,
    help="The axisymmetric heavy top, integrated to the last digits and checked.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help text: a third of the time
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from heavytop import __version__

        typer.echo(f"heavytop {__version__}")
        raise typer.Exit


def _note_debug(ctx: typer.Context, wanted: bool) -> None:
    ctx.meta[DEBUG] = wanted


SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="A shipped scene or the path of a TOML file.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Folder = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Write results here (else nowhere)."),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change the scene: --set start.phidot=-14."),
]
Form = Annotated[
    str, typer.Option("--formulation", metavar="NAME", help="Equations to integrate, or auto.")
]
Digits = Annotated[
    int | None,
    typer.Option("--digits", metavar="D", min=1, max=10_000, help="Digits wanted at the end."),
]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")]
Latex = Annotated[bool, typer.Option("--latex", help="Print one whole LaTeX document.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Errors only on stderr.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say what is being done.")]
Debug = Annotated[
    bool,
    typer.Option("--debug", help="Show tracebacks.", callback=_note_debug, is_eager=True),
]
Version = Annotated[
    bool,
    typer.Option("--version", help="Print it and leave.", callback=_show_version, is_eager=True),
]


@app.callback()
def heavytop(version: Version = False) -> None:
    """Options of the command itself."""


@app.command(epilog=EXIT_CODES)
def run(
    scene: SceneName,
    json: Json = False,
    output: Folder = None,
    changes: Set = None,
    formulation: Form = "auto",
    digits: Digits = None,
    no_figures: NoFigures = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Integrate a scene and compare it with the closed form."""
    from heavytop.scene import load_scene

    voice = Voice(quiet, verbose)
    options = overrides(changes, digits)
    with ExitStack() as stack:
        stack.enter_context(voice.warnings())
        stack.enter_context(blaming(options))
        read = load_scene(scene, overrides=options)
        folder = stack.enter_context(results_folder(output)) if output else None
        trajectory, early = integrated(read, formulation, voice)
        if early is not None:
            say(f"ended early at t = {trajectory.orbit.end:.6g} s: {early}")
        document = results(trajectory, folder, figures=not no_figures, voice=voice)
        show(document, json)
        if early is not None:
            say(kept(output))
            raise typer.Exit(exit_code(early))
        if document["missed_digits"]:
            say(missed(document["missed_digits"], read.digits))
            raise typer.Exit(Exit.OUT_OF_BOUND)


@app.command()
def scenes(json: Json = False, debug: Debug = False) -> None:
    """List the scenes that come with the package."""
    from heavytop.scene import shipped_scenes

    titles = shipped_scenes()
    if json:
        from heavytop.files import as_json

        typer.echo(as_json({"schema": "heavytop/scenes/1", "scenes": dict(titles)}))
        return
    width = max(map(len, titles), default=0)
    for name, title in titles.items():
        typer.echo(f"{name:{width}}  {title}")


@app.command()
def derive(latex: Latex = False, json: Json = False, debug: Debug = False) -> None:
    """Show the derivation: from the rotation matrix to the equations that are integrated."""
    from heavytop.derivation import as_latex, as_text, derivation, derive_document

    if latex and json:
        raise typer.BadParameter("--json holds the LaTeX too", param_hint="--latex")
    if json:
        from heavytop.files import as_json

        typer.echo(as_json(derive_document(derivation())))
    else:
        typer.echo((as_latex if latex else as_text)(derivation()))


@app.command()
def doctor(json: Json = False, debug: Debug = False) -> None:
    """Say what is installed here: versions, processor, the integrator's wheel and cache."""
    from heavytop.doctor import diagnosis, in_words

    found = diagnosis()
    if json:
        from heavytop.files import as_json

        typer.echo(as_json(found))
    else:
        typer.echo(in_words(found))
    if found["missing"]:
        say("missing: " + ", ".join(found["missing"]))
        raise typer.Exit(Exit.OUT_OF_BOUND)


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


def overrides(changes: list[str] | None, digits: int | None) -> list[str]:
    """The changes to the scene that the options ask for."""
    changes = changes or []
    for change in changes:
        key, equals, _ = change.partition("=")
        if not (key.strip() and equals):
            raise typer.BadParameter(f"{change!r} is not KEY=VALUE", param_hint="--set")
    return [*changes, *([f"want.digits={digits}"] if digits is not None else [])]


@contextmanager
def blaming(options: list[str]) -> Iterator[None]:
    """Blame the options, not the scene, when everything wrong stands in an option."""
    keys = {"formulation", *(option.partition("=")[0].strip() for option in options)}
    try:
        yield
    except errors.BadScene as bad:
        if all(fault.key in keys for fault in bad.faults):
            raise typer.BadParameter(f"\n{bad}") from bad
        raise


@contextmanager
def results_folder(folder: Path) -> Iterator[Path]:
    """The folder named by -o; what cannot be written there is the fault of that option."""
    from heavytop.files import writable

    with ExitStack() as stack:
        try:
            stack.enter_context(writable(folder))
        except (OSError, ValueError) as error:
            raise _unwritable(folder, error) from None
        yield folder


def _unwritable(folder: Path, error: Exception) -> typer.BadParameter:
    why = getattr(error, "strerror", None) or str(error)
    return typer.BadParameter(f"cannot write to {str(folder)!r}: {why}", param_hint="-o")


def integrated(
    scene: Scene, formulation: str, voice: Voice
) -> tuple[Trajectory, errors.EndedEarly | None]:
    """The trajectory of a scene, and why it is only a part when it is."""
    from heavytop.propagation import propagate

    try:
        with voice.progress() as progress:
            return propagate(scene, formulation=formulation, progress=progress), None
    except errors.EndedEarly as early:
        return early.trajectory, early


def missed(found: dict[str, float], digits: int) -> str:
    """What is farther off the closed form than the digits asked for allow."""
    off = ", ".join(f"{name} {error:.1e}" for name, error in found.items())
    return f"{digits} digits were asked for, and are not met: off the closed form by {off}"


def kept(output: Path | None) -> str:
    """Where the part of a run that was done can be found."""
    return f"what was done is in {output}" if output else "what was done is above (-o DIR keeps it)"


def results(
    trajectory: Trajectory, folder: Path | None, *, figures: bool, voice: Voice
) -> dict[str, Any]:
    """The document of a run, and its files when there is a folder for them."""
    from heavytop.document import run_document

    if folder is None:
        return run_document(trajectory, files={})
    try:
        return write_results(trajectory, folder, figures=figures, voice=voice)
    except OSError as error:  # the disk is full, the folder has gone
        raise _unwritable(folder, error) from error


def write_results(
    trajectory: Trajectory, folder: Path, *, figures: bool, voice: Voice
) -> dict[str, Any]:
    """Write a run; the document comes last, so that where it stands the rest is whole."""
    from heavytop.document import run_document
    from heavytop.files import write_document

    files = {"document": "run.json", "trajectory": "trajectory.nc"}
    (folder / files["document"]).unlink(missing_ok=True)  # of an earlier run in this folder
    trajectory.save(folder / files["trajectory"])
    if figures:
        files |= write_figures(trajectory, folder)
    document = run_document(trajectory, files=files)
    write_document(folder / files["document"], document)
    for name in files.values():
        voice.note(f"wrote {folder / name}")
    return document


def write_figures(trajectory: Trajectory, folder: Path) -> dict[str, str]:
    """Write every figure of a run; return their names by what they are."""
    from heavytop.report.figures import FIGURES, save

    files = {}
    for name, draw in FIGURES.items():
        figure = draw(trajectory)
        for form in ("svg", "png"):
            files[f"{name}_{form}"] = f"{name}.{form}"
            save(figure, folder / f"{name}.{form}")
    return files


def show(document: dict[str, Any], json: bool) -> None:
    """Print a run's document on stdout: for a program, or for a person."""
    if json:
        from heavytop.files import as_json

        typer.echo(as_json(document))
        return
    from rich.console import Console

    from heavytop.report.table import run_table

    console = Console(width=None if sys.stdout.isatty() else 100)
    console.print(run_table(document))


def main() -> None:
    """Run the command line."""
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a terminal without θ shows ?, and does not fail
            stream.reconfigure(errors="replace")
    app()
