"""Running scripts, a few at a time, each in a process of its own under a limit of time."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from heavytop.claims.register import PACKAGE, Claim
from heavytop.studies.executors import LETTERS, Process, begin, end, tail

ASKED: Final = "HEAVYTOP_CLAIMS_ASKED"  # as validation/claim.py reads it
TOLD: Final = "HEAVYTOP_CLAIMS_TOLD"
OF: Final = "HEAVYTOP_CLAIMS_OF"
FOREIGN: Final = (ASKED, TOLD, OF, "PYTHONSAFEPATH")  # with the last, no script finds its helpers
LOOK: Final = 0.05  # s between two looks at what is running
GRACE: Final = 2.0  # s from SIGTERM to SIGKILL
TAIL: Final = 65536  # bytes of what a script said: its last line is in them
DONE: Final = (0, 5)  # codes of a script that came to its end: all holds, or not


@dataclass(frozen=True, slots=True)
class Script:
    """One script to run: the claims to measure (none: its own), and its limit of time [s]."""

    path: Path
    claims: tuple[Claim, ...]
    limit: float


@dataclass(frozen=True, slots=True)
class Ended:
    """What one script told of its claims, the last line of its stderr, and how it ended.

    The code is negative for a signal, and None where it was not done within its limit.
    """

    script: Script
    code: int | None
    told: str
    said: str
    seconds: float

    @property
    def trouble(self) -> str:
        """Why it did not come to its end; empty where it did."""
        if self.code is None:
            return f"not done in {self.script.limit:g} s"
        if self.code in DONE:
            return ""
        by = -self.code in list(signal.Signals)
        how = f"by {signal.Signals(-self.code).name}" if by else f"with code {self.code}"
        return f"ended {how}: {self.said or 'it said nothing'}"


@dataclass(frozen=True, slots=True)
class _Running:
    script: Script
    process: Process
    folder: Path
    began: float

    def ended(self) -> Ended | None:
        """How it ended; None while it runs, and has time left."""
        code, seconds = self.process.poll(), time.monotonic() - self.began
        if code is None and seconds < self.script.limit:
            return None
        end([self.process], GRACE)
        told, said = self.folder / "told", tail(self.folder / "said", TAIL).split("\n")
        last = next((line.strip() for line in reversed(said) if line.strip()), "")
        text = told.read_text("utf-8", "replace") if told.is_file() else ""
        return Ended(self.script, code, text, last, seconds)


def run_scripts(
    scripts: Sequence[Script], jobs: int, tell: Callable[[str], object]
) -> Generator[Ended]:
    """Run scripts, and give each as it ends; what still runs when this is closed is ended.

    What a script begins goes with it, unless that leaves for a session of its own.
    """
    waiting, running = list(scripts), list[_Running]()
    # What a script that is killed leaves in the folder for what is temporary goes with ours; what
    # dies may still write in it.
    with TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True) as place:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    tell(f"running {waiting[0].path.name}")
                    running.append(_begin(waiting.pop(0), Path(place)))
                time.sleep(LOOK)
                for each in tuple(running):
                    if ended := each.ended():
                        running.remove(each)
                        yield ended
        finally:
            end([each.process for each in running], GRACE)


def _begin(script: Script, place: Path) -> _Running:
    """A script in a process of its own, told which claims to measure and where to tell them."""
    folder = place / script.path.stem
    folder.mkdir()
    here = {name: value for name, value in os.environ.items() if name not in FOREIGN} | LETTERS
    here |= {TOLD: str(folder / "told"), OF: str(PACKAGE), "TMPDIR": str(place)}
    if script.claims:
        here[ASKED] = ",".join(claim.id for claim in script.claims)
    process = begin([str(script.path)], folder / "said", here, Path.cwd())
    return _Running(script, process, folder, time.monotonic())
