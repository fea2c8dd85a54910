"""Files that are written completely or not at all, that show damage; and locks of folders."""

from __future__ import annotations

import json
import os
import platform
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from hashlib import sha256
from mmap import ACCESS_READ, mmap
from pathlib import Path
from threading import get_ident
from typing import Any, Final

from heavytop.errors import ForeignFile, Impossible, InUse
from heavytop.text import printable

FAULTS: Final = (
    OSError, LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RuntimeError
)  # fmt: skip
"""The errors that reading a damaged file raises."""
SEAL: Final = b"\nheavytop sha256 %b\n"


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


def write_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it to `path`.

    A reader, or a crash at any moment, finds the old file or the new one, never a part. A folder
    that is missing is made.
    """
    if not path.name:
        raise Impossible([("path", f"the name of a file, not {str(path)!r}")])
    part = path.parent / f".{os.getpid()}{get_ident()}.{path.name[-200:]}"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(part)
        with part.open("r+b") as written:
            os.fsync(written.fileno())
        part.replace(path)
    except BaseException as error:
        with suppress(OSError):  # there is no such file, or the folder cannot be changed
            part.unlink()
        if isinstance(error, OSError) and error.errno:
            error.filename = str(path)  # the final name, also for a full disk, which names none
        raise


def remove_parts(folder: Path, names: Collection[str]) -> None:
    """Remove the temporary files that killed writers of files with these names have left."""
    for path in folder.glob(".*"):
        if (part := re.fullmatch(r"\.\d+\.(.+)", path.name)) and part[1] in names:
            path.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text as UTF-8, with the same line endings on every system."""
    write_atomic(path, lambda part: part.write_text(text, encoding="utf-8", newline="\n"))


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a result document as JSON."""
    write_text(path, as_json(document) + "\n")


@contextmanager
def expect_intact(path: object) -> Iterator[None]:
    """Turn errors of reading a file into `ForeignFile` with its name.

    Raises
    ------
    ForeignFile
        The file is damaged, or was not written by a command.
    """
    try:
        yield
    except ForeignFile:
        raise
    except FAULTS as fault:
        why = f"not what was written ({type(fault).__name__}: {fault})"
        if isinstance(fault, FileNotFoundError):
            why = "no such file"
        raise ForeignFile(f"{printable(path)}: {printable(why)[:240]}") from fault


@contextmanager
def lock(path: Path) -> Iterator[None]:
    """Hold the lock of a folder; it is released when the process ends, however that happens.

    Raises
    ------
    InUse
        Another process holds it.
    ForeignFile
        The file of the lock is a link.
    OSError
        The file cannot be made.
    """
    import fcntl  # only on POSIX systems

    if os.path.lexists(path) and (path.is_symlink() or path.stat().st_nlink > 1):
        raise ForeignFile(f"{path}: not the lock of a folder but a link")
    with path.open("ab+", buffering=0) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            holder = file.read(300).decode("ascii", "replace").split()
            raise InUse(path.parent, *holder[:2]) from None
        with suppress(OSError):  # a full disk: the lock holds without the name of its holder
            file.truncate(0)
            file.write(f"{os.getpid()} {platform.node()}\n".encode())
        try:
            yield
        finally:
            fcntl.flock(file, fcntl.LOCK_UN)  # closing is not enough if a forked child has the file


# --- HDF5, which hangs or reads other numbers where bytes are damaged ------------------------
# Its checksums (fletcher32, libver latest) cover neither texts nor the links of dimensions: of 1167
# damaged files 36 were read with other contents, and 6 hung.


def digest(data: Any) -> bytes:
    """The digest of a file or a line, which shows damage."""
    return sha256(data).hexdigest().encode()


def write_sealed(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make an HDF5 file, and append its digest, which HDF5 does not read."""

    def sealed(part: Path) -> None:
        write(part)
        with part.open("r+b") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
            file.seek(0, os.SEEK_END)
            file.write(SEAL % digest(data))

    write_atomic(path, sealed)


def expect_sealed(path: Path) -> None:
    """Check that a file ends with the digest of the bytes before it.

    Raises
    ------
    ValueError, OSError
        The digest is missing or another one, or the file cannot be read.
    """
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
        end = len(data) - len(SEAL % digest(b""))
        if data[end:] != SEAL % digest(memoryview(data)[:end]):
            raise ValueError("its digest is not there, or of something else: cut or changed")


@contextmanager
def open_sealed(path: Path) -> Iterator[Any]:
    """Open an HDF5 file that `write_sealed` wrote.

    Raises
    ------
    ForeignFile
        The file was changed; or reading it fails, here or within the ``with`` block.
    """
    import h5py

    with expect_intact(path):
        expect_sealed(path)
        with h5py.File(path, "r") as found:
            yield found


def array(file: Any, name: str) -> Any:
    """Read an array of an HDF5 file; single letters along the last axis become texts."""
    import numpy as np

    values = np.asarray(file[name][()])
    if values.dtype != "S1":
        return values
    texts = np.ascontiguousarray(values).view(f"S{values.shape[-1]}")
    return np.char.decode(texts.reshape(values.shape[:-1]), "utf-8")


def attribute(item: Any, name: str) -> Any:
    """Read an attribute of an HDF5 file or an array, a text or a number."""
    value = item.attrs[name]
    return value if isinstance(value, str) else value.item()
