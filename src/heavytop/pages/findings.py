"""The results that folders hold, each file read and held against its schema."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, NamedTuple

from heavytop.errors import ForeignFile
from heavytop.pages.foreign import Place, document_at, hold
from heavytop.pages.shapes import SHAPES

FILES: Final = {
    "validate.json": "heavytop/validate/1",
    "run.json": "heavytop/run/1",
    "traces.json": "heavytop/traces/1",
    "drift.json": "heavytop/drift/1",
    "workprec.json": "heavytop/workprec/1",
    "stress.json": "heavytop/stress/1",
    "atlas.json": "heavytop/atlas/1",
    "energy_momentum.json": "heavytop/energy-momentum/1",
}
"""The documents that verbs write, by the name of the file, in the order of the page."""

MOST: Final = 60  # results on a page


class Finding(NamedTuple):
    """One result: where it lies, what it is, what it says, and its fingerprint."""

    path: Path
    schema: str
    document: dict[str, Any]
    sha256: str


def findings(folders: Sequence[Path]) -> list[Finding]:
    """Return what lies in the folders, in the order of the page.

    Parameters
    ----------
    folders : sequence of Path
        Each holds results itself, or folders that do.

    Raises
    ------
    ForeignFile
        A folder holds none, a file is not what its name promises, or there are too many.
    """
    found = [each for folder in folders for each in _within(folder)]
    if len(found) > MOST:
        raise ForeignFile(f"{len(found)} results, more than the {MOST} that a page is made of")
    order = list(FILES.values())
    return sorted(found, key=lambda each: order.index(each.schema))


def _within(folder: Path) -> list[Finding]:
    try:
        below = sorted(place for place in folder.iterdir() if place.is_dir())
    except OSError as fault:
        raise ForeignFile(f"{folder}: {fault.strerror or fault}") from None
    found = [each for place in (folder, *below) for each in _here(place)]
    if not found:
        raise ForeignFile(f"{folder}: holds no results ({', '.join(FILES)})")
    return found


def _here(folder: Path) -> Iterator[Finding]:
    for name, schema in FILES.items():
        path = folder / name
        if not path.exists():
            continue
        document = document_at(path)
        if document.get("schema") != schema:
            raise ForeignFile(f"{path}: schema = {document.get('schema')!r:.60}: expected {schema}")
        hold(Place(path, document), SHAPES[schema])
        yield Finding(path, schema, document, sha256(path.read_bytes()).hexdigest())
