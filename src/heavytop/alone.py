"""One at a time: a lock that a copy of its owner does not share."""

from __future__ import annotations

from threading import Lock


class Alone:
    """A lock that can be copied and pickled: each copy is a new one."""

    def __init__(self) -> None:
        self._lock = Lock()

    def __enter__(self) -> None:
        self._lock.acquire()

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def __reduce__(self) -> tuple[type[Alone], tuple[()]]:
        return Alone, ()
