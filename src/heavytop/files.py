"""Files that are either there whole or not there at all, and those of others."""

from __future__ import annotations

import json
import os
import platform
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, Final

from heavytop.errors import ForeignFile, HeavyTopError, InUse

SHORT: Final = 200  # bytes of a name, of the 255 that a file system has


def as_json(document: Mapping[str, Any]) -> str:
    """The text of a result document: one JSON object, ASCII, never NaN or Infinity.

    Raises
    ------
    ValueError
        For a number that JSON cannot hold.

    Examples
    --------
    >>> print(as_json({"kind": "loops", "period": 0.25}))
    {
      "kind": "loops",
      "period": 0.25
    }
    """
    return json.dumps(document, indent=2, allow_nan=False)


def write_whole(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary neighbour of `path`, then rename it into place.

    A reader, or a crash at any moment, finds the old file or the new one, never a part. What is
    written stays written when the power goes.
    """
    part = path.with_name(f".{os.getpid()}.{_short(path.name)}")
    try:
        write(part)
        with part.open("r+b") as written:  # Windows waits only for what may be written
            os.fsync(written.fileno())
        part.replace(path)
        _sync(path.parent)
    except BaseException as error:
        part.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno and error.filename is None:
            error.filename = str(path)  # a full disk does not say where
        raise


def _short(name: str) -> str:
    """A name to which some letters can be put in front; one that is nearly too long by its end."""
    return name if len(os.fsencode(name)) <= SHORT else name[-SHORT // 5 :]


def _sync(folder: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    if os.name != "posix":  # elsewhere a folder cannot be opened
        return
    file = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, and wait until they are on the disk."""
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for place in missing:
        _sync(place.parent)


def write_text(path: Path, text: str) -> None:
    """Write a text, whole, as UTF-8, with the same ends of lines on every system."""
    write_whole(path, lambda part: part.write_text(text, encoding="utf-8", newline="\n"))


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a result document as JSON, whole."""
    write_text(path, as_json(document) + "\n")


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of a folder; it ends with its holder, however that ends.

    Raises
    ------
    InUse
        Another process holds it.
    ForeignFile
        There is something else, such as a link to a file elsewhere.
    HeavyTopError
        This system is not POSIX.
    OSError
        The file cannot be made.
    """
    try:
        import fcntl
    except ModuleNotFoundError:
        why = "runs and studies are kept in folders on POSIX systems only (Linux, macOS)"
        raise HeavyTopError(f"{path.parent}: {why}") from None
    with _open_lock(path) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            holder = file.read(300).decode("ascii", "replace").split()
            raise InUse(path.parent, *holder[:2]) from None
        with suppress(OSError):  # a full disk: the lock holds, without a name on it
            file.truncate(0)
            file.write(f"{os.getpid()} {platform.node()}\n".encode())
        try:
            yield
        finally:
            fcntl.flock(file, fcntl.LOCK_UN)  # closing is not enough where a forked child has it


def _open_lock(path: Path) -> IO[bytes]:
    """Open a lock, or make it; it is a file of its folder alone, never a link to one elsewhere."""
    if os.path.lexists(path):
        there = path.lstat()
        if not stat.S_ISREG(there.st_mode) or there.st_nlink > 1:
            raise ForeignFile(f"{path}: not the lock of a folder but a link, or no file at all")
    return open(path, "ab+", buffering=0, opener=_follow_no_link)


def _follow_no_link(path: str, flags: int) -> int:
    """Open or make a file, but not through a link that was put there a moment ago."""
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)
