"""HDF5 files of unknown origin, looked over before anything in them is read."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from heavytop.errors import ForeignFile

MOST_BYTES: Final = 8 * 2**30  # of all arrays together, as they are declared


def expect_harmless(path: Path) -> None:
    """Refuse a file whose arrays lie in other files, or would not fit into memory.

    Parameters
    ----------
    path : Path
        An HDF5 file.

    Raises
    ------
    ForeignFile
    OSError
        It cannot be opened as HDF5.
    """
    import h5py

    with h5py.File(path, "r") as file:
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise ForeignFile(f"{path}: {name!r:.60}: a link, which no result file has")
        bytes_in_all = 0
        for name, array in _arrays(file):
            if array.external or array.is_virtual:
                raise ForeignFile(f"{path}: {name!r:.60}: lies in another file")
            bytes_in_all += array.size * array.dtype.itemsize
        if bytes_in_all > MOST_BYTES:
            raise ForeignFile(f"{path}: declares {bytes_in_all} bytes, at most {MOST_BYTES}")


def _arrays(group: Any) -> Iterator[tuple[str, Any]]:
    """Every array of a group, by name; links are not followed."""
    import h5py

    found: list[tuple[str, Any]] = []

    def look(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            found.append((name, item))

    group.visititems(look)
    yield from found
