"""Damaged result files: each is refused, and before HDF5, which may hang, sees a byte of it.

python validation/fuzz_damage.py [SEED [COUNT]]
"""

from __future__ import annotations

import random
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import h5py

import heavytop as ht
from heavytop.files import open_sealed

SHAPE = (12, 12)


def misses(seed: int, count: int) -> list[str]:
    """Return a line for each of `count` damaged files that is read, or that HDF5 is given."""
    found = []
    with tempfile.TemporaryDirectory() as place:
        files = _files(Path(place))
        for path, read in files.items():
            read(path)  # they are read as they are
        whole = {path: path.read_bytes() for path in files}
        for number in range(count):
            path, read = list(files.items())[number % len(files)]
            draw = random.Random(f"{seed} {number}")
            damage = draw.choice(DAMAGES)
            data = damage(draw, whole[path])
            if data == whole[path]:
                continue
            path.write_bytes(data)
            if wrong := _wrong(read, path):
                found.append(f"{path.name}, {damage.__name__}, seed {seed}, {number}: {wrong}")
    return found


def _wrong(read: Callable[[Path], object], path: Path) -> str:
    try:
        with patch.object(h5py, "File", side_effect=AssertionError("HDF5 was asked")):
            read(path)
    except ht.ForeignFile as refused:
        return "HDF5 was given it" if isinstance(refused.__cause__, AssertionError) else ""
    except Exception as fault:  # any other is a miss too
        return f"{type(fault).__name__}: {fault}"
    return "it was read"


def _files(place: Path) -> dict[Path, Callable[[Path], object]]:
    """Write a file of every kind; return how each is read."""
    scene = ht.load_scene("sicm-kicked", ["span.time=0.3"])
    digits = ht.load_scene("sicm-kicked", ["span.time=0.1", "want.digits=20", "want.samples=5"])
    ht.propagate(scene).save(place / "run.nc")
    ht.propagate(digits).save(place / "digits.nc")
    from heavytop.report.files import write_study

    (place / "a").mkdir()
    write_study(ht.drift(scene, methods=["taylor-axis"], periods=3, samples=2), place / "a",
                figures=False)  # fmt: skip
    plane = {"x": f"phidot=-20:20:{SHAPE[1]}", "y": f"theta=0.1:3:{SHAPE[0]}"}
    write_study(ht.atlas(scene, **plane, only="kind"), place / "a", figures=False)
    return {
        place / "run.nc": ht.load_trajectory,
        place / "digits.nc": ht.load_trajectory,
        place / "a" / "drift.nc": _opened,
        place / "a" / "atlas.nc": lambda path: ht.Atlas.load(path.with_name("atlas.json"))["kind"],
    }


def _opened(path: Path) -> None:
    with open_sealed(path):
        pass


def flipped(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes with one to three bits turned."""
    return _flipped(draw, data, 0, len(data))


def flipped_head(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes with bits turned where HDF5 keeps its tables."""
    return _flipped(draw, data, 0, min(4000, len(data)))


def flipped_seal(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes with bits turned at the end."""
    return _flipped(draw, data, len(data) - 90, len(data))


def _flipped(draw: random.Random, data: bytes, low: int, high: int) -> bytes:
    changed = bytearray(data)
    for _ in range(draw.randint(1, 3)):
        changed[draw.randrange(low, high)] ^= 1 << draw.randrange(8)
    return bytes(changed)


def cut(draw: random.Random, data: bytes) -> bytes:
    """Return the first of the bytes."""
    return data[: draw.randrange(len(data))]


def cut_by_little(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes without the last few."""
    return data[: -draw.randint(1, 100)]


def zeroed(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes with a stretch of zeros."""
    at, size = draw.randrange(len(data)), draw.choice((1, 16, 512, 4096))
    return data[:at] + bytes(len(data[at : at + size])) + data[at + size :]


def swapped(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes with two blocks exchanged."""
    size = draw.choice((8, 64, 512))
    blocks = [data[at : at + size] for at in range(0, len(data), size)]
    i, j = draw.sample(range(len(blocks) - 1), 2)
    blocks[i], blocks[j] = blocks[j], blocks[i]
    return b"".join(blocks)


def grown(draw: random.Random, data: bytes) -> bytes:
    """Return the bytes with others among them or behind them."""
    at = draw.choice((draw.randrange(len(data)), len(data)))
    return data[:at] + draw.randbytes(draw.randint(1, 64)) + data[at:]


DAMAGES = (
    flipped, flipped_head, flipped_seal, cut, cut_by_little, zeroed, swapped, grown,
)  # fmt: skip


if __name__ == "__main__":
    asked = [int(word) for word in sys.argv[1:]]
    lines = misses(*(asked + [0, 2000][len(asked) :]))
    print("\n".join(lines) or "every damaged file was refused unseen")
    sys.exit(bool(lines))
