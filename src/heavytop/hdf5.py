"""Result files in HDF5 that end in a digest of themselves, by which damage is seen at once.

HDF5 does not survive damaged bytes: it hangs, or reads other numbers. The digest stands behind the
end of the HDF5 file, where no reader looks, and is checked before HDF5 sees any of it. Where
somebody has made it anew, no more is read than what is asked for by name and lies in the file.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import ForeignFile
from heavytop.files import write_whole

MOST_BYTES: Final = 8 * 2**30  # of a file
MARK: Final = b"\nheavytop sha256 "
SEAL_BYTES: Final = len(MARK) + 2 * sha256().digest_size + 1
BLOCK: Final = 2**20
MOST_OF_A_CHUNK: Final = 2**24
TYPES: Final = ("<f8", "<i8", "|S1")


def write_sealed(path: Path, write: Callable[[Path], object]) -> None:
    """Let `write` make an HDF5 file and put its digest behind it, whole or not at all.

    Raises
    ------
    OSError
    """

    def sealed(part: Path) -> None:
        write(part)
        seal(part)

    write_whole(path, sealed)


def seal(path: Path) -> None:
    """Put the digest of a file behind its end."""
    with path.open("r+b") as file:
        file.write(_seal(file, path.stat().st_size))


def _seal(file: IO[bytes], size: int) -> bytes:
    """The last bytes of a file that begins with so many of this one."""
    digest = sha256()
    for at in range(0, size, BLOCK):
        digest.update(file.read(min(BLOCK, size - at)))
    return MARK + digest.hexdigest().encode() + b"\n"


def expect_sealed(path: Path) -> None:
    """Expect a regular file that ends in the digest of all that stands before.

    Raises
    ------
    ValueError, OSError
    """
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END) - SEAL_BYTES
        if size > MOST_BYTES:
            raise ValueError(f"more than {MOST_BYTES >> 30} GiB")
        file.seek(max(size, 0))
        last = file.read()
        if not last.startswith(MARK):
            raise ValueError("no digest at its end: cut short, changed, or of an earlier version")
        file.seek(0)
        if last != _seal(file, size):
            raise ValueError("damaged: it is not what its digest was made of")


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open an HDF5 file that is as `write_sealed` wrote it.

    Raises
    ------
    ForeignFile
        It is not; or reading it fails, here or in the context, in any of the libraries.
    """
    import h5py

    try:
        expect_sealed(path)
        with h5py.File(path, "r") as file:
            yield file
    except Exception as fault:
        why = getattr(fault, "strerror", None) or fault
        raise ForeignFile(f"{path}: not a readable result file ({why})") from fault


def dataset(file: Any, name: str) -> Any:
    """One array of a file, nothing of it read: it lies there, in parts of no more than 16 MiB.

    Raises
    ------
    ValueError
    """
    import h5py

    found = file[name] if isinstance(file.get(name, getlink=True), h5py.HardLink) else None
    if not isinstance(found, h5py.Dataset):
        raise ValueError(f"no array {name!r:.60}")
    if found.external or found.is_virtual:
        raise ValueError(f"{name!r:.60}: lies in another file")
    if math.prod(found.chunks or ()) * found.dtype.itemsize > MOST_OF_A_CHUNK:
        raise ValueError(f"{name!r:.60}: in parts that are too large")
    return found


def array(file: Any, name: str) -> NDArray[Any]:
    """Read an array that is stored as it is; letters become texts along the last axis.

    Raises
    ------
    ValueError
        It is not there, is of a type that no trajectory has, or declares more than is stored.
    """
    found = dataset(file, name)
    if found.dtype.str not in TYPES:
        raise ValueError(f"{name!r:.60}: of type {found.dtype}")
    if found.size and found.id.get_offset() is None:  # compressed, or declared and not stored
        raise ValueError(f"{name!r:.60}: not in one piece")
    if found.nbytes > Path(file.filename).stat().st_size:
        raise ValueError(f"{name!r:.60}: {found.nbytes} bytes, more than the file")
    values = np.asarray(found[()])
    if values.dtype != "S1":
        return values
    texts = np.ascontiguousarray(values).view(f"S{values.shape[-1]}")
    return np.char.decode(texts.reshape(values.shape[:-1]), "utf-8")


def attribute(item: Any, name: str) -> Any:
    """Read one attribute of a file or an array, a text or a number.

    Raises
    ------
    KeyError, ValueError
        It is not there, or is a list.
    """
    if item.attrs.get_id(name).shape not in ((), (1,)):
        raise ValueError(f"{name}: a list")
    value = item.attrs[name]
    return value.item() if isinstance(value, np.ndarray | np.generic) else value
