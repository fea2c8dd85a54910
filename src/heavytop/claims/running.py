"""Running scripts, a few at a time, each in a process of its own under a limit of time."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from heavytop.claims.register import PACKAGE
from heavytop.studies.process_groups import LETTERS, Process, begin, end, tail

ASKED: Final = "HEAVYTOP_CLAIMS_ASKED"  # as validation/claim.py reads it
TOLD: Final = "HEAVYTOP_CLAIMS_TOLD"
OF: Final = "HEAVYTOP_CLAIMS_OF"
FOREIGN: Final = (ASKED, TOLD, OF, "PYTHONSAFEPATH")  # with the last, no script finds its helpers
LOOK: Final = 0.05  # s between two looks at what is running
GRACE: Final = 2.0  # s from SIGTERM to SIGKILL
TAIL: Final = 65536  # bytes of what a script said: its last line is in them
MOST: Final = 2**20  # bytes that a script may tell: a line for each claim
DONE: Final = (0, 5)  # codes of a script that came to its end: all holds, or not


@dataclass(frozen=True, slots=True)
class Errand:
    """One script to run.

    Parameters
    ----------
    script : Path
    asked : tuple of str, optional
        The claims to measure; None for whatever the script has.
    limit : float
        Seconds after which it is ended.
    """

    script: Path
    asked: tuple[str, ...] | None
    limit: float


@dataclass(frozen=True, slots=True)
class Ended:
    """What one script told, and how it ended.

    Parameters
    ----------
    errand : Errand
    code : int, optional
        Its exit code, negative for a signal; None where it was not done within its limit.
    told : bytes
        What it wrote of its claims; no more than a byte beyond `MOST`.
    said : str
        The last line of its stderr.
    seconds : float
        How long it took.
    """

    errand: Errand
    code: int | None
    told: bytes
    said: str
    seconds: float

    @property
    def trouble(self) -> str:
        """Why it did not come to its end; empty where it did."""
        if self.code is None:
            return f"not done in {self.errand.limit:g} s"
        if self.code not in DONE:
            return f"ended {_by(self.code)}: {self.said or 'it said nothing'}"
        return f"it told more than {MOST >> 20} MB" if len(self.told) > MOST else ""


def _by(code: int) -> str:
    return f"with code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"


@dataclass(frozen=True, slots=True)
class _Running:
    errand: Errand
    process: Process
    folder: Path
    began: float

    @property
    def over(self) -> bool:
        return time.monotonic() - self.began > self.errand.limit

    def ended(self, code: int | None) -> Ended:
        seconds = time.monotonic() - self.began
        told, said = _told(self.folder / "told"), _last(self.folder / "said")
        return Ended(self.errand, code, told, said, seconds)


def run_scripts(
    errands: Sequence[Errand], jobs: int = 2, started: Callable[[Errand], object] | None = None
) -> Iterator[Ended]:
    """Run scripts, and give each as it ends; what still runs when this is closed is ended.

    What a script begins goes with it, unless that leaves for a session of its own.

    Parameters
    ----------
    errands : sequence of Errand
    jobs : int
        How many run at a time, at least 1.
    started : callable, optional
        It is told of each errand as it begins.
    """
    waiting, running = list(errands), list[_Running]()
    # What a script that is killed leaves in the folder for what is temporary goes with ours; what
    # dies may still write in it.
    with TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True) as place:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    errand = waiting.pop(0)
                    if started is not None:
                        started(errand)
                    running.append(_begin(errand, Path(place)))
                yield from _looked_at(running)
        finally:
            end([each.process for each in running], GRACE)


def _looked_at(running: list[_Running]) -> Iterator[Ended]:
    time.sleep(LOOK)
    for each in tuple(running):
        code = each.process.poll()
        if code is None and not each.over:
            continue
        end([each.process], GRACE)
        running.remove(each)
        yield each.ended(code)


def _begin(errand: Errand, place: Path) -> _Running:
    folder = place / errand.script.stem
    folder.mkdir()
    here = _environment(errand, place)
    process = begin([str(errand.script)], folder / "said", here, Path.cwd())
    return _Running(errand, process, folder, time.monotonic())


def _environment(errand: Errand, place: Path) -> Mapping[str, str]:
    here = {name: value for name, value in os.environ.items() if name not in FOREIGN}
    asked = {} if errand.asked is None else {ASKED: ",".join(errand.asked)}
    told = str(place / errand.script.stem / "told")
    return {**here, **asked, **LETTERS, TOLD: told, OF: str(PACKAGE), "TMPDIR": str(place)}


def _told(path: Path) -> bytes:
    if not path.is_file():
        return b""
    with path.open("rb") as file:
        return file.read(MOST + 1)


def _last(said: Path) -> str:
    lines = tail(said, TAIL).split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "")
