"""An end that is asked for by Ctrl-C or SIGTERM, and given after the piece at hand."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType
from typing import Any, Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Halt:
    """Whether an end was asked for; the second signal does what it did before.

    Only the main thread of a process can listen to signals; elsewhere nothing is changed. A
    signal that is ignored (a job in the background, nohup) stays ignored.
    """

    def __init__(self) -> None:
        self.asked = False
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._heard)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        while self._before:
            signal.signal(*self._before.popitem())

    def _heard(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        self.__exit__(None, None, None)
