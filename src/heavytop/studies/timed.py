"""Calls with a limit of time: in a process that is killed when its time is up.

Nothing less helps: a solver that hangs inside its own compiled code hears no signal.
"""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from signal import Signals
from typing import Any, Self, TypeVar

from heavytop.studies.executors import SPAWN, follow_parent, starting

T = TypeVar("T")


class TimedOut(Exception):
    """A call that did not return in time; its process was killed."""


class Lost(Exception):
    """A process that died of a call, or an exception in it; the message says which."""


class Worker:
    """One process for calls; after one that had to be killed, or died, the next call starts one."""

    def __init__(self) -> None:
        self._process: BaseProcess | None = None
        self._pipe: Connection

    def __enter__(self) -> Self:
        """Return the worker."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self.close()

    def call(self, function: Callable[..., T], *args: Any, timeout: float | None = None) -> T:
        """Return what a function of a module returns there, within so many seconds.

        Starting the process takes none of them.

        Raises
        ------
        TimedOut
            It did not return in time.
        Lost
            The process died of it, or it raised something.
        """
        try:
            if self._process is None:
                self._start()
            self._pipe.send((function, args))
            if not self._pipe.poll(timeout):
                self.close()
                raise TimedOut
            fault, value = self._pipe.recv()
        except (EOFError, OSError):
            raise Lost(self._fate()) from None
        if fault is not None:
            raise Lost(fault)
        return value  # type: ignore[no-any-return]

    def close(self) -> None:
        """End the process, at once."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._pipe.close()
            self._process = None

    def _start(self) -> None:
        self._pipe, theirs = SPAWN.Pipe()
        self._process = SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
        with starting():
            self._process.start()
        theirs.close()
        self._pipe.recv()  # it is ready

    def _fate(self) -> str:
        """Say how the process ended."""
        assert self._process is not None
        self._process.join(1)
        code = self._process.exitcode
        self.close()
        return (
            f"killed by {Signals(-code).name}" if code and code < 0 else f"it left with code {code}"
        )


def _serve(pipe: Connection) -> None:
    follow_parent()
    pipe.send("ready")
    while True:
        function, args = pipe.recv()
        try:
            pipe.send((None, function(*args)))
        except Exception as fault:
            pipe.send((f"{type(fault).__name__}: {fault}", None))
