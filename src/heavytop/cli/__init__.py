"""The command line: reads options, calls the package, prints. It computes nothing.

Results go to stdout; progress, notes, warnings and errors to stderr. What is slow to import is
imported by the verb that needs it, so that ``heavytop --help`` answers at once.
"""

try:
    from heavytop.cli.command import EXIT_CODES, exit_code
    from heavytop.cli.entry import app, main
    from heavytop.errors import Exit
except KeyboardInterrupt:  # before there is a command that could say so
    raise SystemExit(130) from None

__all__ = ["EXIT_CODES", "Exit", "app", "exit_code", "main"]
