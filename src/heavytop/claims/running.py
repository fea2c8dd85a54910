"""Running scripts, a few at a time, each in a process of its own under a limit of time."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

ASKED: Final = "HEAVYTOP_CLAIMS_ASKED"  # as validation/claim.py reads it
TOLD: Final = "HEAVYTOP_CLAIMS_TOLD"
LOOK: Final = 0.05  # s between two looks at what is running


@dataclass(frozen=True, slots=True)
class Errand:
    """One script to run.

    Parameters
    ----------
    script : Path
    asked : tuple of str, optional
        The claims to measure; None for whatever the script has.
    limit : float
        Seconds after which it is killed.
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
    told : tuple of dict
        A line for each claim, in its order.
    trouble : str
        Why it ended before its end; empty where it did not.
    """

    errand: Errand
    told: tuple[dict[str, Any], ...]
    trouble: str


@dataclass(slots=True)
class _Running:
    errand: Errand
    process: subprocess.Popen[bytes]
    folder: Path
    until: float

    def ended(self, code: int | None) -> Ended:
        trouble = "" if code in (0, 5) else f"ended with code {code}: {_last(self.folder / 'said')}"
        if code is None:
            trouble = f"not done in {self.errand.limit:g} s"
        return Ended(self.errand, tuple(_lines(self.folder / "told")), trouble)

    def kill(self) -> None:
        """Kill it with all that it started."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


def run_scripts(
    errands: Sequence[Errand], jobs: int = 2, started: Callable[[Errand], object] | None = None
) -> Iterator[Ended]:
    """Run scripts, and give each as it ends; what still runs when this is left is killed.

    Parameters
    ----------
    errands : sequence of Errand
    jobs : int
        How many run at a time.
    started : callable, optional
        It is told of each errand as it begins.
    """
    waiting, running = list(errands), list[_Running]()
    with TemporaryDirectory(prefix="heavytop-claims-") as place:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    errand = waiting.pop(0)
                    if started is not None:
                        started(errand)
                    running.append(_begin(errand, Path(place) / errand.script.stem))
                yield from _looked_at(running)
        finally:
            for each in running:
                each.kill()


def _looked_at(running: list[_Running]) -> Iterator[Ended]:
    time.sleep(LOOK)
    for each in tuple(running):
        code = each.process.poll()
        if code is None and time.monotonic() < each.until:
            continue
        if code is None:
            each.kill()
        running.remove(each)
        yield each.ended(code)


def _begin(errand: Errand, folder: Path) -> _Running:
    folder.mkdir()
    with (folder / "said").open("wb") as said:
        process = subprocess.Popen(
            [sys.executable, str(errand.script)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            env=_environment(errand, folder / "told"),
            start_new_session=True,  # so that it can be killed with all that it starts
        )
    return _Running(errand, process, folder, time.monotonic() + errand.limit)


def _environment(errand: Errand, told: Path) -> Mapping[str, str]:
    here = {name: value for name, value in os.environ.items() if name not in (ASKED, TOLD)}
    asked = {} if errand.asked is None else {ASKED: ",".join(errand.asked)}
    return {**here, **asked, TOLD: str(told)}


def _lines(path: Path) -> Iterator[dict[str, Any]]:
    text = path.read_text("utf-8") if path.exists() else ""
    for line in text.splitlines():
        with suppress(json.JSONDecodeError):  # it was killed in the midst of it
            yield json.loads(line)


def _last(path: Path) -> str:
    lines = path.read_text("utf-8", errors="replace").split("\n")
    return next((line.strip() for line in reversed(lines) if line.strip()), "it said nothing")
