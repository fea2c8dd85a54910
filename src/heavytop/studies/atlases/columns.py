"""What is known of every pixel: the columns of an atlas, and how a tile of them is written down."""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import ForeignFile
from heavytop.studies.atlas_plane import Columns


class Column(NamedTuple):
    """The type of a column on the disk, and what it is."""

    dtype: str
    unit: str
    text: str


CODES: Final = {
    "kind": Column("u1", "", "kind of motion"),
    "detail": Column("u1", "", "what tells motions of one kind apart"),
    "certified": Column("u1", "", "1 where the kind is proved"),
}
"""With ``only="kind"``."""

ROWS: Final = CODES | {
    "tags": Column("u1", "", "tags that hold, as bits"),
    "open_tags": Column("u1", "", "tags that are neither proved nor disproved, as bits"),
    "margin": Column("<f8", "1", "how far the nearest other verdict is"),
    "theta_min": Column("<f8", "rad", "smallest tilt"),
    "theta_max": Column("<f8", "rad", "largest tilt"),
    "period": Column("<f8", "s", "nutation period; nan where nothing nutates"),
    "precession": Column("<f8", "rad", "advance of φ in a nutation period"),
    "spin": Column("<f8", "rad", "advance of ψ in a nutation period"),
}
"""By default."""

INTEGRATED: Final = ROWS | {
    "integrated": Column("u1", "", "kind of motion, told by the events of a run"),
}
"""With ``integrate=True``."""

SETS: Final = {"kind": CODES, "rows": ROWS, "integrate": INTEGRATED}


def size(what: str) -> int:
    """Bytes of a pixel, written down."""
    return sum(np.dtype(each.dtype).itemsize for each in SETS[what].values())


def packed(columns: Columns) -> dict[str, str]:
    """Columns as texts: their bytes, compressed where that is worth its time."""
    return {name: _text(array) for name, array in columns.items()}


def unpacked(texts: Mapping[str, Any], what: str, shape: tuple[int, int]) -> Columns:
    """The columns that texts hold.

    Raises
    ------
    ForeignFile
        They are not those of such a tile.
    """
    wanted = SETS[what]
    if set(texts) != set(wanted):
        raise ForeignFile(f"columns {', '.join(map(str, texts))!r:.80}: not {', '.join(wanted)}")
    return {name: _array(name, texts[name], wanted[name].dtype, shape) for name in wanted}


def _text(array: NDArray[Any]) -> str:
    data = np.ascontiguousarray(array).tobytes()
    return b64encode(zlib.compress(data, 1) if array.dtype.itemsize == 1 else data).decode()


def _array(name: str, text: object, dtype: str, shape: tuple[int, int]) -> NDArray[Any]:
    kind = np.dtype(dtype)
    wanted = shape[0] * shape[1] * kind.itemsize
    try:
        if not isinstance(text, str):
            raise ValueError("not a text")
        data = b64decode(text, validate=True)
        if kind.itemsize == 1:
            data = _inflated(data, wanted)
        if len(data) != wanted:
            raise ValueError(f"{len(data)} bytes, not {wanted}")
    except (ValueError, zlib.error) as fault:
        raise ForeignFile(f"column {name}: damaged ({fault})") from None
    return np.frombuffer(data, kind).reshape(shape)


def _inflated(data: bytes, wanted: int) -> bytes:
    """What was compressed, and no more than there can be."""
    stream = zlib.decompressobj()
    found = stream.decompress(data, wanted + 1)
    if stream.unconsumed_tail or not stream.eof:
        raise ValueError("of another length")
    return found
