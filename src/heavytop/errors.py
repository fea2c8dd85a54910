"""The exceptions and warnings of the package, and the exit codes of its commands.

All exceptions derive from `HeavyTopError`, so that one ``except`` catches what the package raises
on purpose, and nothing else.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from itertools import chain
from pathlib import Path
from typing import Any, Final

from heavytop.text import printable


class Exit(IntEnum):
    """The exit codes of all verbs; of several the largest counts."""

    OK = 0
    BUG = 1
    USAGE = 2
    BAD_SCENE = 3
    ENDED_EARLY = 4
    OUT_OF_BOUND = 5
    INTERRUPTED = 130
    CLOSED = 141


class HeavyTopError(Exception):
    """The base of every error this package raises on purpose."""

    exit: Exit = Exit.BAD_SCENE
    """The exit code of a command."""


class Refused(HeavyTopError, ValueError):
    """A value that an option does not take: the rule, and a hint at a similar value."""

    def __init__(self, rule: str, hint: str = "") -> None:
        super().__init__(rule, hint)
        self.rule, self.hint = rule, hint

    def __str__(self) -> str:
        return f"{self.rule} ({self.hint})" if self.hint else self.rule


class NotANumber(Refused):
    """A value that is not an exact finite real number; the message has the rule."""


class WrongType(HeavyTopError, TypeError):
    """An argument of a wrong type; the message has its name and the right type."""

    exit = Exit.BUG


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault: its place, its key and value, and the rule that it breaks.

    Attributes
    ----------
    file : str
        The file, or another source such as ``--set``; empty for the argument of a call.
    line : int or None
        Its line in the file.
    key, value : str
        The key, and its value as text.
    rule : str
        The rule for values of the key.
    hint : str
        A hint, such as the nearest known name; or empty.
    """

    file: str
    line: int | None
    key: str
    value: str
    rule: str
    hint: str = ""

    def __str__(self) -> str:
        line = "" if self.line is None else f":{self.line}"
        place = f"{self.file}{line}: " if self.file else ""
        what = f"{self.key} = {self.value}" if self.value else self.key
        hint = f" ({self.hint})" if self.hint else ""
        return printable(f"{place}{what}: {self.rule}{hint}")


class Impossible(HeavyTopError, ValueError):
    """Values that break rules; `faults` lists all of them at once.

    Parameters
    ----------
    broken : iterable of Fault or (str, str)
        Faults, or names of values and the rules that they break.

    Attributes
    ----------
    faults : tuple of Fault
        All faults, each with file, line, key, value, rule and hint.
    """

    def __init__(self, broken: Iterable[Fault | tuple[str, str]]) -> None:
        pairs = (x if isinstance(x, Fault) else Fault("", None, x[0], "", x[1]) for x in broken)
        self.faults = tuple(pairs)
        super().__init__(self.faults)

    def __str__(self) -> str:
        return "\n".join(map(str, self.faults))


class ImpossibleTop(Impossible):
    """Numbers that no top has, such as an A that is not positive, or a negative C."""


class ImpossibleStart(Impossible):
    """A start that no motion has; the message has the nearest possible value."""


class BadScene(Impossible):
    """A scene that cannot be run, or options that are impossible for it."""


def refuse(*found: Iterable[Fault]) -> None:
    """Raise a BadScene of all faults, if there are any."""
    if faults := tuple(chain.from_iterable(found)):
        raise BadScene(faults)


class NoClosedForm(HeavyTopError):
    """A kind of motion whose closed form the package does not hold; the message names it."""


class NotCertified(HeavyTopError):
    """A run of which nothing can be proved; the message says why."""


@dataclass(eq=False)
class Unseparated(NoClosedForm):
    """A number that is not separated from another, or not known to the digits, by the most bits.

    Attributes
    ----------
    what : str
        The message.
    bound : float
        A proved upper bound of the difference, or of the error.
    """

    what: str
    bound: float

    def __str__(self) -> str:
        return self.what


class ForeignFile(HeavyTopError, ValueError):
    """A file that is damaged or not of this package, or a folder that holds another study.

    It is also raised for a worker with other versions than those of the study.
    """


class NoScheduler(HeavyTopError):
    """An address where no cluster answers, or one without workers; the message says which."""

    exit = Exit.USAGE


@dataclass(eq=False)
class InUse(HeavyTopError):
    """A folder that another process is writing.

    Attributes
    ----------
    folder : Path
        The folder.
    pid, host : str
        The number of that process and its computer; empty where they are not known.
    """

    folder: Path
    pid: str = ""
    host: str = ""
    exit = Exit.USAGE

    def __str__(self) -> str:
        process = f"process {self.pid}" if self.pid else "another process"
        return f"{self.folder}: is being written by {process}{self.host and f' on {self.host}'}"


INSTALL_HEYOKA: Final = (
    "pip install heyoka" if sys.platform == "linux" else "conda install -c conda-forge heyoka.py"
)  # pip has it for Linux only
IN_CLONE: Final = "pip install '.[{}]'"  # of an extra, where the package is not in an index


@dataclass(eq=False)
class MissingPackage(HeavyTopError, ImportError):
    """A method that needs packages which are not installed, or fail when they are imported.

    Attributes
    ----------
    method : str
        The method that needs them.
    packages : sequence of str
        The missing packages.
    extra : str
        The extra of this package that installs them, except heyoka.
    broken : str
        The error of an installed one when it is imported; empty where it is missing.
    """

    method: str
    packages: Sequence[str]
    extra: str = "rivals"
    broken: str = ""
    exit = Exit.USAGE

    @property
    def command(self) -> str:
        """The command that installs them; one of pip's is for the clone of the repository."""
        return INSTALL_HEYOKA if "heyoka" in self.packages else IN_CLONE.format(self.extra)

    def __str__(self) -> str:
        where = "" if "heyoka" in self.packages else " in the clone"
        fails = f" (the installed one fails: {self.broken})" if self.broken else ""
        needs = " and ".join(self.packages)
        return f"{self.method} needs {needs}: {self.command}{where}{fails}"


class NotDrawnWarning(UserWarning):
    """A picture of a result that could not be drawn; the result itself is whole."""


class ImpossibleBodyWarning(UserWarning):
    """Moments that no rigid body has; the message has the inequality that they break."""


class FoldedTiltWarning(UserWarning):
    """A θ outside [0, π] that was replaced by one inside, of the same motion."""


class DoubtfulWarning(UserWarning):
    """A result that the precision of a run does not determine; the message names it."""


class MissedDigitsWarning(DoubtfulWarning):
    """Quantities with larger errors than the digits that were asked for; the message names them."""


class Outcome(StrEnum):
    """The end of an integration: complete, at a singularity, by the limit on steps, by Ctrl-C."""

    FINISHED = "finished"
    SINGULAR = "singular"
    STEP_LIMIT = "step-limit"
    INTERRUPTED = "interrupted"


@dataclass(eq=False)
class EndedEarly(HeavyTopError):
    """An integration that did not reach its end.

    Attributes
    ----------
    outcome : Outcome
        Why it ended.
    trajectory : Trajectory
        The part that was integrated.
    why : str
        The cause, and a remedy, where these are known.
    """

    outcome: Outcome
    trajectory: Any
    why: str = ""

    def __post_init__(self) -> None:
        self.outcome = Outcome(self.outcome)
        self.exit = Exit.INTERRUPTED if self.outcome is Outcome.INTERRUPTED else Exit.ENDED_EARLY

    def __str__(self) -> str:
        return f"{self.outcome}: {self.why}" if self.why else f"{self.outcome}"


class Stop(StrEnum):
    """The reason why a study was not finished."""

    INTERRUPTED = "interrupted"
    UNWRITABLE = "unwritable"
    WORKER_LOST = "worker-lost"


@dataclass(eq=False)
class StoppedEarly(HeavyTopError):
    """A study that was not finished.

    Attributes
    ----------
    outcome : Stop
        The reason.
    why : str
        The reason in words.
    folder : Path or None
        The folder with the part that was done, if it is kept.
    goes_on : bool
        Whether `heavytop.resume` can continue it from there.
    """

    outcome: Stop
    why: str
    folder: Path | None
    goes_on: bool = True

    def __post_init__(self) -> None:
        self.outcome = Stop(self.outcome)
        self.exit = Exit.INTERRUPTED if self.outcome is Stop.INTERRUPTED else Exit.ENDED_EARLY

    @classmethod
    def unwritable(
        cls, fault: OSError, path: Path, folder: Path | None, goes_on: bool = True
    ) -> StoppedEarly:
        """The error where a file cannot be written: the one of `fault`, or else `path`.

        Parameters
        ----------
        fault : OSError
            The error of the system.
        path : Path
            The file that was to be written.
        folder : Path or None
            The folder with the part that was done, if it still exists.
        goes_on : bool
            Whether `heavytop.resume` can continue from there.

        Examples
        --------
        >>> full = OSError(28, "No space left on device")
        >>> StoppedEarly.unwritable(full, Path("out/stress.json"), None).why
        'ended early: cannot write out/stress.json: No space left on device'
        """
        why = f"cannot write {fault.filename or path}: {fault.strerror or fault}"
        if folder is not None and not folder.is_dir():
            why, folder = f"{folder}: the folder has gone", None
        return cls(Stop.UNWRITABLE, f"ended early: {why}", folder, goes_on)

    def __str__(self) -> str:
        if self.folder is None:
            return f"{self.why}; nothing was kept"
        resume = f"; resume with:\n{resuming(self.folder)}" if self.goes_on else ""
        return f"{self.why}; the partial result is in {self.folder}{resume}"


def resuming(folder: Path) -> str:
    """The command that resumes the study or run in a folder.

    Examples
    --------
    >>> resuming(Path("long runs"))
    "heavytop resume 'long runs'"
    """
    name = str(folder)
    return f"heavytop resume {shlex.quote(f'./{name}' if name.startswith('-') else name)}"


def is_interrupt(error: BaseException) -> bool:
    """Whether an error is Ctrl-C, which during an import is the cause of another error."""
    return isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt)
