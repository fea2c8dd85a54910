"""The command and its verbs; every exception becomes a message and an exit code here."""

from __future__ import annotations

import logging
import os
import sys
import traceback
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from heavytop.cli.atlas import atlas
from heavytop.cli.check import check
from heavytop.cli.classify import classify
from heavytop.cli.derive import derive
from heavytop.cli.doctor import doctor
from heavytop.cli.drift import drift
from heavytop.cli.exits import EXIT_CODES, Exit, exit_code, explain
from heavytop.cli.hints import Usage, hinted
from heavytop.cli.options import DEBUG
from heavytop.cli.plan import plan
from heavytop.cli.reference import reference
from heavytop.cli.report import report
from heavytop.cli.resume import resume
from heavytop.cli.run import run
from heavytop.cli.scenes import scenes
from heavytop.cli.stress import stress
from heavytop.cli.validate import validate
from heavytop.cli.voice import say
from heavytop.cli.workprec import workprec
from heavytop.results.command import spelt, typing

WORDS = "heavytop.words"  # key in the context: all that stands behind the name of the command


class Verbs(TyperGroup):
    """The command group, where every exception becomes a message and an exit code."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read what stands before the verb, and remember all that was said."""
        ctx.meta[WORDS] = tuple(args)
        try:
            return super().parse_args(ctx, args)
        except Usage as error:
            hinted(error, ctx.meta[WORDS])
            raise

    def invoke(self, ctx: Any) -> Any:
        """Run a verb; what it raises is explained without a traceback, unless asked for one."""
        try:
            with typing(spelt(ctx.meta[WORDS])):
                return super().invoke(ctx)
        except Usage as error:
            hinted(error, ctx.meta[WORDS])
            raise
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
    home = type(error).__module__.partition(".")[0]
    return isinstance(error, BrokenPipeError) or home in ("typer", "click")


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
app.command(epilog=EXIT_CODES)(run)
app.command(epilog=EXIT_CODES)(classify)
app.command(epilog=EXIT_CODES)(plan)
app.command(epilog=EXIT_CODES)(drift)
app.command(epilog=EXIT_CODES)(resume)
app.command(epilog=EXIT_CODES)(atlas)
app.command(epilog=EXIT_CODES)(stress)
app.command(epilog=EXIT_CODES)(workprec)
app.command(epilog=EXIT_CODES)(validate)
app.command(epilog=EXIT_CODES)(reference)
app.command(epilog=EXIT_CODES)(check)
app.command(epilog=EXIT_CODES)(report)
app.command()(scenes)
app.command()(derive)
app.command()(doctor)


def _show_version(wanted: bool) -> None:
    if wanted:
        from heavytop import __version__

        typer.echo(f"heavytop {__version__}")
        raise typer.Exit


Version = Annotated[
    bool,
    typer.Option("--version", help="Print it and leave.", callback=_show_version, is_eager=True),
]


@app.callback()
def heavytop(version: Version = False) -> None:
    """Options of the command itself."""


def _fill_closed() -> None:
    """Put nothing where a standard stream is closed, or a file of results would get its number."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)


def main() -> None:
    """Run the command line."""
    _fill_closed()
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
