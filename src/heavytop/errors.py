"""Every way the package refuses or fails, by name.

All exceptions derive from `HeavyTopError`, so that one ``except`` catches what the package
raises on purpose, and nothing else.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import Any, Final

from heavytop.text import harmless


class Exit(IntEnum):
    """What the exit code of every verb means; of several the greatest counts."""

    OK = 0
    BUG = 1
    USAGE = 2
    BAD_SCENE = 3
    ENDED_EARLY = 4
    OUT_OF_BOUND = 5
    INTERRUPTED = 130


class HeavyTopError(Exception):
    """The base of every error this package raises on purpose."""

    exit: Exit = Exit.BAD_SCENE
    """What a command exits with."""


class NotANumber(HeavyTopError, ValueError):
    """A value that is not an exact finite real number; the message says the rule."""


class WrongType(HeavyTopError, TypeError):
    """An argument that is not what a function takes; the message names it and says what is."""

    exit = Exit.BUG


class Impossible(HeavyTopError, ValueError):
    """Values that break a rule; `broken` lists (name, rule) for each one that does.

    Attributes
    ----------
    broken : tuple of (str, str)
        The names of the values, and the rules.
    """

    def __init__(self, broken: Sequence[tuple[str, ...]]) -> None:
        self.broken = tuple((name, rule) for name, rule, *_ in broken)
        super().__init__(self.broken)

    def __str__(self) -> str:
        return "; ".join(f"{name}: {rule}" for name, rule in self.broken)


class ImpossibleTop(Impossible):
    """Moments with which nothing moves: A is not positive, or C is negative."""


class ImpossibleStart(Impossible):
    """A start that no motion has, with the nearest possible value."""


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing wrong with a scene: where it stands, what it says, which rule it breaks.

    Attributes
    ----------
    file : str
        The file, or what else holds it, such as ``--set``.
    line : int or None
        Its line there.
    key, value : str
        What stands there.
    rule : str
        What may stand there instead.
    hint : str
        The nearest name that is known, or what may have been meant; or empty.
    """

    file: str
    line: int | None
    key: str
    value: str
    rule: str
    hint: str = ""

    def __str__(self) -> str:
        place = self.file if self.line is None else f"{self.file}:{self.line}"
        what = f"{self.key} = {self.value}" if self.value else self.key
        hint = f" ({self.hint})" if self.hint else ""
        return harmless(f"{place}: {what}: {self.rule}{hint}")


class BadScene(HeavyTopError, ValueError):
    """A scene that cannot be run; `faults` lists everything wrong with it at once.

    Attributes
    ----------
    faults : tuple of Fault
        What is wrong: file, line, key, value, rule and hint of each.
    """

    def __init__(self, faults: tuple[Fault, ...]) -> None:
        super().__init__(faults)
        self.faults = tuple(faults)

    def __str__(self) -> str:
        return "\n".join(str(fault) for fault in self.faults)


class NoClosedForm(HeavyTopError):
    """A kind of motion whose closed form the package does not hold; the message names it."""


class NotCertified(HeavyTopError):
    """A run of which nothing can be proved; the message says why."""


class Unseparated(NoClosedForm):
    """A number that so many bits do not tell from another, or do not give the digits asked.

    Attributes
    ----------
    bound : float
        What is proved all the same: an upper bound of the difference, or of the error.
    """

    def __init__(self, what: str, bound: float) -> None:
        super().__init__(what, bound)
        self.bound = bound

    def __str__(self) -> str:
        return str(self.args[0])


class ForeignFile(HeavyTopError, ValueError):
    """A result file that is damaged or not of this package, or a folder that holds another study.

    A worker elsewhere whose versions are not those of the study is one too.
    """


class NoScheduler(HeavyTopError):
    """An address where no cluster answers, or one without workers; the message says which."""

    exit = Exit.USAGE


class InUse(HeavyTopError):
    """A folder that another process is writing.

    Attributes
    ----------
    folder : Path
        Which one.
    pid, host : str
        The number of that process and its computer; empty where they are not known.
    """

    exit = Exit.USAGE

    def __init__(self, folder: Path, pid: str = "", host: str = "") -> None:
        super().__init__(folder, pid, host)
        self.folder, self.pid, self.host = folder, pid, host

    def __str__(self) -> str:
        process = f"process {self.pid}" if self.pid else "another process"
        return f"{self.folder}: is being written by {process}{self.host and f' on {self.host}'}"


INSTALL_HEYOKA: Final = (
    "pip install heyoka" if sys.platform == "linux" else "conda install -c conda-forge heyoka.py"
)  # pip has it for Linux only
IN_CLONE: Final = "pip install '.[{}]'"  # of an extra, where the package is not in an index


class MissingPackage(HeavyTopError, ImportError):
    """A method that needs packages which are not installed, or fail when they are imported.

    Attributes
    ----------
    method : str
        What needs them.
    packages : tuple of str
        What is missing.
    extra : str
        The extra of this package that brings them; empty for heyoka.
    broken : str
        What an installed one says when it is imported.
    """

    exit = Exit.USAGE

    def __init__(
        self, method: str, packages: Sequence[str], extra: str = "", broken: str = ""
    ) -> None:
        super().__init__(method, tuple(packages), extra, broken)
        self.method, self.packages, self.broken = method, tuple(packages), broken
        self.extra = extra or ("" if "heyoka" in packages else "rivals")

    @property
    def command(self) -> str:
        """The command that installs them; one of pip's is for the clone of the repository."""
        return IN_CLONE.format(self.extra) if self.extra else INSTALL_HEYOKA

    def instead_of(self, name: str) -> type:
        """Return what stands for a function or a class that needs them: called, it raises this.

        Parameters
        ----------
        name : str

        Examples
        --------
        >>> MissingPackage("a film", ["pillow"], "film").instead_of("film").__doc__
        "a film needs pillow: pip install '.[film]' in the clone"
        """

        def refuse(*_: object, **__: object) -> None:
            raise MissingPackage(*self.args)

        return type(name, (), {"__new__": refuse, "__doc__": str(self)})

    def __str__(self) -> str:
        where = " in the clone" if self.extra else ""
        fails = f" (the installed one fails: {self.broken})" if self.broken else ""
        return f"{self.method} needs {' and '.join(self.packages)}: {self.command}{where}{fails}"


class NotDrawnWarning(UserWarning):
    """A picture of a result that could not be drawn; the result itself is whole."""


class ImpossibleBodyWarning(UserWarning):
    """Moments that no rigid body has; the message says which inequality they break."""


class FoldedTiltWarning(UserWarning):
    """A θ outside [0, π] that was taken for the same motion inside; the message says which."""


class DoubtfulWarning(UserWarning):
    """Something that a run gives, and that its precision cannot tell; the message says what."""


class MissedDigitsWarning(DoubtfulWarning):
    """Quantities that are farther off than the digits asked for allow; the message says which."""


class Outcome(StrEnum):
    """How an integration ended; `sentence` says it in words."""

    FINISHED = "finished"
    SINGULAR = "singular"
    STEP_LIMIT = "step-limit"
    INTERRUPTED = "interrupted"

    @property
    def sentence(self) -> str:
        """The outcome as a person would say it.

        Examples
        --------
        >>> Outcome("step-limit").sentence
        'the limit on the number of steps was reached'
        """
        return _SENTENCES[self]


_SENTENCES = {
    Outcome.FINISHED: "the whole span was integrated",
    Outcome.SINGULAR: "the equations became singular or overflowed",
    Outcome.STEP_LIMIT: "the limit on the number of steps was reached",
    Outcome.INTERRUPTED: "the run was interrupted",
}


class EndedEarly(HeavyTopError):
    """An integration that did not reach its end.

    Attributes
    ----------
    outcome : Outcome
        Why it ended.
    trajectory : Trajectory
        The part that was integrated.
    why : str
        What made it so, and what to do instead, where that is known.
    """

    def __init__(self, outcome: Outcome | str, trajectory: Any, why: str = "") -> None:
        self.outcome = Outcome(outcome)
        self.exit = Exit.INTERRUPTED if self.outcome is Outcome.INTERRUPTED else Exit.ENDED_EARLY
        self.trajectory = trajectory
        self.why = why
        super().__init__(self.outcome.sentence + (f": {why}" if why else ""))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.outcome, self.trajectory, self.why)


class Stop(StrEnum):
    """What ended a study before its end."""

    INTERRUPTED = "interrupted"
    UNWRITABLE = "unwritable"
    WORKER_LOST = "worker-lost"


class StoppedEarly(HeavyTopError):
    """A study that did not reach its end.

    Attributes
    ----------
    outcome : Stop
        What ended it.
    why : str
        The same for a person, with what it was about.
    folder : Path or None
        Where the part that was done is kept, ready to be taken up again.
    """

    def __init__(self, outcome: Stop | str, why: str, folder: Path | None) -> None:
        super().__init__(outcome, why, folder)
        self.outcome, self.why, self.folder = Stop(outcome), why, folder
        self.exit = Exit.INTERRUPTED if self.outcome is Stop.INTERRUPTED else Exit.ENDED_EARLY

    @classmethod
    def unwritable(cls, fault: OSError, path: Path, folder: Path | None) -> StoppedEarly:
        """The end of what cannot write a file: `path`, where `fault` does not say which.

        Parameters
        ----------
        fault : OSError
            What the system said.
        path : Path
            The file that was to be written.
        folder : Path or None
            Where the part that was done is kept, if it has not gone.

        Examples
        --------
        >>> full = OSError(28, "No space left on device")
        >>> StoppedEarly.unwritable(full, Path("out/stress.json"), None).why
        'ended early: cannot write out/stress.json: No space left on device'
        """
        why = f"cannot write {fault.filename or path}: {fault.strerror or fault}"
        if folder is not None and not folder.is_dir():
            why, folder = f"{folder}: the folder has gone", None
        return cls(Stop.UNWRITABLE, f"ended early: {why}", folder)

    @property
    def command(self) -> str:
        """The command that takes the study up again; empty where nothing was kept."""
        return "" if self.folder is None else resuming(self.folder)

    def __str__(self) -> str:
        if self.folder is not None:
            kept = f"the partial result is in {self.folder}; resume with:\n{self.command}"
        elif self.outcome is Stop.UNWRITABLE:
            return self.why
        else:
            kept = "nothing was kept, as there is no folder"
        return f"{self.why}; {kept}"


def resuming(folder: Path) -> str:
    """The command that goes on with what a folder holds.

    Examples
    --------
    >>> resuming(Path("long runs"))
    "heavytop resume 'long runs'"
    """
    name = str(folder)
    return f"heavytop resume {shlex.quote(f'./{name}' if name.startswith('-') else name)}"


def is_interrupt(error: BaseException) -> bool:
    """Whether it is Ctrl-C; one during an import comes wrapped in another error."""
    return isinstance(error, KeyboardInterrupt) or isinstance(error.__cause__, KeyboardInterrupt)
