"""One writer: a lock that its holder loses by dying, however it dies."""

from __future__ import annotations

import errno
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from heavytop.errors import ForeignFile, InUse

_FLAGS = os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NOFOLLOW", 0)


class Lock:
    """The hold of this process on a folder. The file stays; what counts is who holds it.

    Raises
    ------
    InUse
        Another process holds it.
    ForeignFile
        The lock is a link to somewhere else.
    OSError
        It cannot be made, or this system has no such locks.
    """

    def __init__(self, path: Path) -> None:
        self._file = _opened(path)
        try:
            _grasp(self._file)
        except BlockingIOError:
            holder = os.pread(self._file, 300, 0).decode("ascii", "replace").split()
            self.release()
            raise InUse(path.parent, *holder[:2]) from None
        except BaseException:
            self.release()
            raise
        with suppress(OSError):  # a full disk: the lock holds, without a name on it
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, f"{os.getpid()} {platform.node()}\n".encode(), 0)

    def release(self) -> None:
        """Let go; a second time does nothing."""
        file, self._file = self._file, -1
        if file >= 0:
            _let_go(file)
            os.close(file)


@contextmanager
def held(path: Path) -> Iterator[Lock]:
    """A lock that is kept, unless what follows is refused."""
    lock = Lock(path)
    try:
        yield lock
    except BaseException:
        lock.release()
        raise


def _opened(path: Path) -> int:
    try:
        return os.open(path, _FLAGS, 0o666)
    except OSError as fault:
        if fault.errno == errno.ELOOP:
            raise ForeignFile(f"{path}: a link; the lock of a study is a file") from None
        raise


def _let_go(file: int) -> None:
    """Give the lock back, even where a forked child still has the file open."""
    with suppress(ImportError, OSError):
        import fcntl

        fcntl.flock(file, fcntl.LOCK_UN)


def _grasp(file: int) -> None:
    try:
        import fcntl
    except ImportError:
        raise OSError(errno.ENOSYS, "this system has no locks that end with a process") from None
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
