"""Exit codes, and the exceptions they stand for."""

from __future__ import annotations

import errno
from enum import IntEnum

from heavytop import errors


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
    UNREAD = 141  # nobody reads what is printed, as with | head: what a shell says of such an end


# The first that fits. What is not here is a bug of ours.
REFUSALS: tuple[tuple[type[BaseException], Exit], ...] = (
    (errors.BadScene, Exit.BAD_SCENE),
    (errors.Impossible, Exit.BAD_SCENE),
    (errors.NotANumber, Exit.BAD_SCENE),
    (errors.NoClosedForm, Exit.BAD_SCENE),
    (errors.EndedEarly, Exit.ENDED_EARLY),
    (errors.StoppedEarly, Exit.ENDED_EARLY),
    (errors.InUse, Exit.USAGE),
    (errors.ForeignRun, Exit.BAD_SCENE),
    (errors.ForeignFile, Exit.FOREIGN_FILE),
    (errors.MissingPackage, Exit.MISSING_PACKAGE),
)

FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO})

EXIT_CODES = (
    "Exit codes: 0 ok; 1 a bug; 2 a bad option; 3 a bad scene, or another run's folder; 4 ended "
    "early, the partial result is kept; 5 a check is out of its bound; 6 a damaged or foreign "
    "file; 7 an optional package is missing; 130 interrupted; 141 unread."
)


def interrupted(error: BaseException) -> bool:
    """Whether it is an interrupt; one in the middle of an import is wrapped up by what is read."""
    return isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt)


def exit_code(error: BaseException) -> Exit:
    """The exit code that an exception stands for."""
    if interrupted(error):
        return Exit.INTERRUPTED
    if isinstance(error, errors.EndedEarly) and error.outcome is errors.Outcome.INTERRUPTED:
        return Exit.INTERRUPTED
    if isinstance(error, errors.StoppedEarly) and error.outcome is errors.Stop.INTERRUPTED:
        return Exit.INTERRUPTED
    if isinstance(error, OSError) and error.errno in FULL:
        return Exit.ENDED_EARLY
    return next((code for kind, code in REFUSALS if isinstance(error, kind)), Exit.BUG)


def explain(error: BaseException, code: Exit) -> str:
    """One error in words."""
    if code is Exit.BUG:
        what = " ".join(f"{type(error).__name__}: {error}".split())
        return f"a bug: {what} (--debug shows where)"
    if isinstance(error, OSError):
        return f"cannot write: {error.strerror or error}"
    if isinstance(error, errors.BadScene):
        return f"the scene cannot be run:\n{error}"
    return "interrupted" if interrupted(error) else str(error)
