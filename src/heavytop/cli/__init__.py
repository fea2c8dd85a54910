"""The command line: reads options, calls the package, prints. It computes nothing.

Results go to stdout; progress, notes, warnings and errors to stderr. What is slow to import is
imported by the verb that needs it, so that ``heavytop --help`` answers at once.
"""

try:
    from heavytop.cli import ask, inspect, report, run, studies
    from heavytop.cli.command import EXIT_CODES, Exit, app, exit_code, main, register
except KeyboardInterrupt:  # before there is a command that could say so
    raise SystemExit(130) from None

__all__ = ["EXIT_CODES", "Exit", "app", "exit_code", "main"]

register(
    *(run.run, inspect.classify, inspect.plan, studies.drift, studies.resume, studies.atlas),
    *(studies.stress, studies.workprec, studies.certify, report.validate, inspect.reference),
    *(ask.find, ask.sweep),
    *(report.check, report.report, report.film, report.explore),
    *(inspect.scenes, inspect.derive, inspect.doctor),
)
