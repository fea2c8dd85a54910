"""Worker processes that do not run the caller's script and do not outlive their parent."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from types import ModuleType
from typing import Any, Final

SPAWN: Final = multiprocessing.get_context("spawn")  # a fork would copy locks of other threads


@contextmanager
def starting() -> Iterator[None]:
    """Start processes inside this block.

    They do not import the caller's script again, which may have no ``if __name__ ==
    "__main__"``; nor modules from the current folder; and Ctrl-C is left to this process.
    """
    main, safe = sys.modules["__main__"], os.environ.get("PYTHONSAFEPATH")
    sys.modules["__main__"] = ModuleType("__main__")
    os.environ["PYTHONSAFEPATH"] = "1"
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        del os.environ["PYTHONSAFEPATH"]
        if safe is not None:
            os.environ["PYTHONSAFEPATH"] = safe
        sys.modules["__main__"] = main


class Processes(Executor):
    """A pool of so many worker processes, which can be replaced when one was killed."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        self._pool = ProcessPoolExecutor(workers, SPAWN, follow_parent)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function."""
        with starting():
            return self._pool.submit(fn, *args, **kwargs)

    def replace(self) -> None:
        """Take new workers."""
        self.shutdown()
        self._pool = ProcessPoolExecutor(self.workers, SPAWN, follow_parent)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End all workers at once, whatever they are at."""
        for process in list((self._pool._processes or {}).values()):
            process.kill()
        self._pool.shutdown(wait, cancel_futures=True)


def follow_parent() -> None:
    """In a worker: end with the parent, and print where it does not disturb results."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(OSError):  # stderr may be closed
        os.dup2(2, 1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
