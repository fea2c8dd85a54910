"""Programs in groups of processes of their own, each of which ends with all that it began.

What leaves for a session of its own (``setsid``) is no longer seen, and may stay.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final, TypeAlias

LETTERS: Final = {"PYTHONUTF8": "1", "PYTHONIOENCODING": "utf-8"}
"""Of an environment: what is printed in it is UTF-8, wherever the person happens to be."""

Process: TypeAlias = subprocess.Popen[bytes]


def begin(words: Sequence[str], said: Path, environment: Mapping[str, str], cwd: Path) -> Process:
    """Begin what Python runs; its stderr goes to the file `said`, and its stdout is not kept."""
    with said.open("wb") as file:
        return subprocess.Popen(
            [sys.executable, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=file,
            env=environment,
            cwd=cwd,
            start_new_session=True,
        )


def end(processes: Sequence[Process], grace: float) -> None:
    """End processes, and what they began: first asked, and `grace` seconds later killed."""
    try:
        for each in processes:
            _send(each, signal.SIGTERM)
        until = time.monotonic() + grace
        for each in processes:
            with suppress(subprocess.TimeoutExpired):
                each.wait(max(0.0, until - time.monotonic()))
    finally:  # even where Ctrl-C is pressed twice
        for each in processes:
            _send(each, signal.SIGKILL)
            each.wait()


def tail(said: Path, most: int) -> str:
    """The end of what was said, of so many bytes."""
    with said.open("rb") as file:
        file.seek(max(0, said.stat().st_size - most))
        return file.read().decode("utf-8", "replace")


def _send(process: Process, number: int) -> None:
    with suppress(ProcessLookupError, PermissionError):  # the latter where all are zombies
        os.killpg(process.pid, number)
