"""Files that are there whole or not at all, that show damage, and that one process holds."""

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

from heavytop.errors import ForeignFile, InUse
from heavytop.text import printable

FAULTS: Final = (
    OSError, LookupError, TypeError, ValueError, ArithmeticError, AttributeError, RuntimeError
)  # fmt: skip
"""What reading a file raises that is not as it was written."""
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
    """Let `write` fill a temporary neighbour of `path`, then rename it into place.

    A reader, or a crash at any moment, finds the old file or the new one, never a part.
    """
    part = path.parent / f".{os.getpid()}{get_ident()}.{path.name[-200:]}"
    try:
        write(part)
        with part.open("r+b") as written:
            os.fsync(written.fileno())
        part.replace(path)
    except BaseException as error:
        with suppress(OSError):  # it is not there, or nothing can be changed there
            part.unlink()
        if isinstance(error, OSError) and error.errno:
            error.filename = str(path)  # as it is named at last; a full disk does not say where
        raise


def remove_parts(folder: Path, names: Collection[str]) -> None:
    """Remove what writers that were killed have left of files with these names."""
    for path in folder.glob(".*"):
        if (part := re.fullmatch(r"\.\d+\.(.+)", path.name)) and part[1] in names:
            path.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text, whole, as UTF-8, with the same ends of lines on every system."""
    write_atomic(path, lambda part: part.write_text(text, encoding="utf-8", newline="\n"))


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a result document as JSON, whole."""
    write_text(path, as_json(document) + "\n")


@contextmanager
def expect_intact(path: object) -> Iterator[None]:
    """Refuse a file by its name where what it holds is not what a command wrote.

    Raises
    ------
    ForeignFile
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
    """Hold the lock of a folder; it ends with its holder, however that ends.

    Raises
    ------
    InUse
        Another process holds it.
    ForeignFile
        There is something else, such as a link to a file elsewhere.
    OSError
        The file cannot be made.
    """
    import fcntl  # which POSIX alone has

    if os.path.lexists(path) and (path.is_symlink() or path.stat().st_nlink > 1):
        raise ForeignFile(f"{path}: not the lock of a folder but a link")
    with path.open("ab+", buffering=0) as file:
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


# --- HDF5, which hangs or reads other numbers where bytes are damaged ------------------------
# Its checksums (fletcher32, libver latest) are not of texts, nor of the links of dimensions: of
# 1167 damaged files 36 were read as something else, and 6 hung.


def digest(data: Any) -> bytes:
    """The digest by which damage shows: of a file, or of a line."""
    return sha256(data).hexdigest().encode()


def write_sealed(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make an HDF5 file, whole; its digest goes behind the end, where none reads."""

    def sealed(part: Path) -> None:
        write(part)
        with part.open("r+b") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
            file.seek(0, os.SEEK_END)
            file.write(SEAL % digest(data))

    write_atomic(path, sealed)


def expect_sealed(path: Path) -> None:
    """Expect a file that ends in the digest of all that stands before.

    Raises
    ------
    ValueError, OSError
    """
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
        end = len(data) - len(SEAL % digest(b""))
        if data[end:] != SEAL % digest(memoryview(data)[:end]):
            raise ValueError("its digest is not there, or of something else: cut or changed")


@contextmanager
def open_sealed(path: Path) -> Iterator[Any]:
    """Open an HDF5 file that is as `write_sealed` wrote it.

    Raises
    ------
    ForeignFile
        It is not; or reading it fails, here or in the context, in any of the libraries.
    """
    import h5py

    with expect_intact(path):
        expect_sealed(path)
        with h5py.File(path, "r") as found:
            yield found


def array(file: Any, name: str) -> Any:
    """Read an array of an HDF5 file; letters become texts along the last axis."""
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
