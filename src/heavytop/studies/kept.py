"""Processes under a keeper: none outlives this process, nor does what it began.

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

KEEPER: Final = Path(__file__).with_name("keeper.py")

LETTERS: Final = {"PYTHONUTF8": "1", "PYTHONIOENCODING": "utf-8"}
"""Of an environment: what is printed in it is UTF-8, wherever the person happens to be."""

Process: TypeAlias = subprocess.Popen[bytes]


def begin(
    words: Sequence[str],
    said: Path,
    environment: Mapping[str, str],
    temporary: Path | None = None,
) -> Process:
    """Begin what Python runs, in a group of processes of its own.

    Parameters
    ----------
    words : sequence of str
        What stands behind ``python``.
    said : Path
        The file for its stderr; its stdout is not kept.
    environment : mapping from str to str
    temporary : Path, optional
        A folder that this process will remove; its keeper does where this is killed before.

    Raises
    ------
    OSError
        It cannot be begun.
    """
    with said.open("wb") as file:
        return subprocess.Popen(
            [sys.executable, "-I", "-S", str(KEEPER), str(temporary or ""), *words],
            stdin=subprocess.PIPE,  # never written to: it closes when this process is gone
            stdout=subprocess.DEVNULL,
            stderr=file,
            env=environment,
            start_new_session=True,  # so that it can be ended with all that it begins
        )


def end(processes: Sequence[Process], grace: float) -> None:
    """Let processes go, and what they began: first asked, and `grace` seconds later killed."""
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
            each.communicate()  # closes the pipe, and waits


def tail(said: Path, most: int) -> str:
    """The end of what was said, of so many bytes."""
    with said.open("rb") as file:
        file.seek(max(0, said.stat().st_size - most))
        return file.read().decode("utf-8", "replace")


def _send(process: Process, number: int) -> None:
    with suppress(ProcessLookupError, PermissionError):  # the latter where all are zombies
        os.killpg(process.pid, number)
