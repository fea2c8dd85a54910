"""The command ``heavytop`` and its verbs."""

from __future__ import annotations

import logging
import os
import signal
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from heavytop.cli.check import check
from heavytop.cli.inspect import classify, derive, doctor, plan, reference, scenes
from heavytop.cli.messages import EXIT_CODES, Exit, say
from heavytop.cli.report import report
from heavytop.cli.run import run
from heavytop.cli.studies import NAMES, atlas, drift, resume, stress, validate, workprec
from heavytop.results.base import spelt, typing


class Verbs(TyperGroup):
    """The group of all verbs; what each finds names the command line that asked for it."""

    def main(self, args: Sequence[str] | None = None, *rest: Any, **options: Any) -> Any:
        """Run a command line."""
        words = sys.argv[1:] if args is None else list(args)
        with typing(spelt(words)):
            return super().main(words, *rest, **options)


class Verb(TyperCommand):
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
    cls=Verbs,
    help="The axisymmetric heavy top, integrated to the last digits and checked.",
    epilog=EXIT_CODES,
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help text: a third of the time
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
for each in (
    *(run, classify, plan, drift, resume, atlas, stress, workprec, validate),
    *(reference, check, report, scenes, derive, doctor),
):
    app.command(cls=Verb, epilog=EXIT_CODES)(each)


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


def stop_when_ended() -> None:
    """Let SIGTERM and SIGHUP do what Ctrl-C does, so that no process is left behind."""
    for name in {"SIGTERM", "SIGHUP"} & set(dir(signal)):  # the second is not on Windows
        number = getattr(signal, name)
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def main() -> None:
    """Run the command line."""
    _fill_closed()
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
