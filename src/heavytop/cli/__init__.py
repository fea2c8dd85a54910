"""The command line: it reads options, calls the package and prints; it computes nothing.

Results go to stdout; progress, notes, warnings and errors to stderr. Modules that are slow to
import are imported by the verbs that need them, so that ``heavytop --help`` is fast.
"""

import codecs
import gc
import os
import signal
import sys
import threading
from io import TextIOWrapper
from typing import Any, Final

try:
    import click

    from heavytop import __version__
    from heavytop.cli.command import EXIT_CODES, Verbs, print_error
    from heavytop.errors import Exit
    from heavytop.results.registry import RESULTS
except KeyboardInterrupt:  # before there is a command that handles it
    raise SystemExit(130) from None

__all__ = ["EXIT_CODES", "Exit", "app", "main"]

VERBS: Final = {
    "run": "cli.run:run",
    "classify": "results.classification:classify_scene",
    "plan": "results.classification:plan_scene",
    **{file.removesuffix(".json"): each.command for file, each in RESULTS.items() if each.study},
    "resume": "cli.run:resume studies.study:resume",
    "reference": "cli.verbs:reference analytic.reference:reference",
    "find": "studies.find:find",
    "sweep": "cli.verbs:sweep studies.sweep:sweep",
    "check": "cli.verbs:check checking.judge:check",
    "report": "cli.verbs:report",
    "film": "plots.film:film",
    "explore": "report.explorer:explore",
    **{name: f"cli.verbs:{name}" for name in ("scenes", "derive", "doctor")},
}
"""The function of each verb, and after it the one that it calls, whose parameters it has too."""

app = Verbs(
    VERBS,
    name="heavytop",
    help="The axisymmetric heavy top, integrated to the last digits and checked.",
    epilog=EXIT_CODES,
    context_settings={"help_option_names": ["-h", "--help"]},
)
click.version_option(__version__, message="%(prog)s %(version)s")(app)


def _plain(error: Any) -> tuple[str, int]:
    """The replacement of a letter that a terminal does not have: "-" for a minus, else "?"."""
    return "-" if error.object[error.start] == "−" else "?", error.start + 1


def main() -> None:
    """Run the command line."""
    gc.set_threshold(100_000)  # imports create many objects, and no garbage
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) is signal.SIG_DFL:  # as Ctrl-C: child processes end too
            signal.signal(number, signal.default_int_handler)
    os.environ["MPLBACKEND"] = "agg"  # figures are files; an unknown name would stop matplotlib
    for name in ("stdout", "stderr"):  # None where it is closed
        setattr(sys, name, getattr(sys, name) or os.fdopen(os.open(os.devnull, os.O_WRONLY), "w"))
    codecs.register_error("plain", _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a terminal without θ shows ? instead of an error
            stream.reconfigure(errors="plain")
    try:
        app()
    except OSError as fault:  # when the help is printed
        print_error(f"cannot write: {fault.strerror}")
        raise SystemExit(Exit.ENDED_EARLY) from None
    except SystemExit as end:
        in_heyoka = any(thread.name == "in heyoka" for thread in threading.enumerate())
        if end.code == Exit.INTERRUPTED and in_heyoka:  # that thread would crash a normal exit
            os._exit(Exit.INTERRUPTED)
        raise
    finally:
        gc.freeze()  # so that the last collection does not search all modules
