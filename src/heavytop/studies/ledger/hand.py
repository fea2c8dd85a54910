"""A hand: one worker process as the writing process sees it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from typing import Any

from heavytop.studies.ledger.canonical import canonical
from heavytop.studies.ledger.study import Study

Message = dict[str, Any] | None  # None: the worker has gone
Inbox = SimpleQueue[tuple["Hand", Message]]

# -P and this path: a worker imports what this process would, and nothing beside it from the
# folder the person happens to be in.
_BOOT = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[3]); "
    "from heavytop.studies.ledger.worker import main; main(sys.argv[1], int(sys.argv[2]))"
)


class Hand:
    """A worker, and the task it has; what it says comes to the inbox."""

    def __init__(self, study: Study, inbox: Inbox) -> None:
        self.task = ""
        self._identity = study.identity
        options = (study.module, str(os.getpid()), json.dumps([*map(str, sys.path)]))
        with _no_interrupt():
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-c", _BOOT, *options],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                encoding="utf-8",
            )
        self._listener = threading.Thread(target=self._listen, args=(inbox,), daemon=True)
        self._listener.start()

    def take(self, task: str, checkpoint: dict[str, Any] | None) -> None:
        """Give it a task to follow from a checkpoint."""
        self.task = task
        self._tell({"identity": self._identity, "task": task, "checkpoint": checkpoint})

    def go_on(self) -> None:
        """Let it begin the next piece."""
        self._tell({})

    def fate(self) -> str:
        """How it ended, when it has said that it can say no more."""
        with suppress(subprocess.TimeoutExpired):  # its channel closes a moment before
            self._process.wait(timeout=1)
        return _said(self._process.poll())

    def end(self) -> None:
        """End it, at once."""
        self._process.kill()
        for stream in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                if stream is self._process.stdout:
                    self._listener.join()
                if stream is not None:
                    stream.close()
        self._process.wait()

    def _tell(self, order: dict[str, Any]) -> None:
        with suppress(OSError):  # it has gone: the inbox says so
            assert self._process.stdin is not None
            self._process.stdin.write(canonical(order) + "\n")
            self._process.stdin.flush()

    def _listen(self, inbox: Inbox) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.endswith("\n"):  # else it was killed in the middle of it
                inbox.put((self, json.loads(line)))
        inbox.put((self, None))


def _said(code: int | None) -> str:
    if code is None:
        return "it fell silent"
    if code < 0:
        return f"killed by {signal.Signals(-code).name}"
    return f"it left with code {code}"


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Hold Ctrl-C back: a process started meanwhile never hears it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
