"""The results that folders hold, each file read and cut to its schema."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any, Final, NamedTuple

from heavytop.errors import ForeignFile
from heavytop.report.pages.foreign import cut, expect_file, read
from heavytop.report.pages.shapes import SHAPES
from heavytop.spelling import harmless

FILES: Final = {
    "run.json": "heavytop/run/1",
    "traces.json": "heavytop/traces/1",
    "drift.json": "heavytop/drift/1",
    "workprec.json": "heavytop/workprec/1",
    "stress.json": "heavytop/stress/1",
    "atlas.json": "heavytop/atlas/1",
    "energy_momentum.json": "heavytop/energy-momentum/1",
    "validate.json": "heavytop/validate/1",
}
"""The documents that verbs write, by the name of the file, in the order of the page."""

MOST: Final = 60  # results on a page
MOST_BYTES: Final = 128 * 2**20  # of all their documents
TOLD: Final = 20  # faults of one error
BESIDE: Final = {"heavytop/run/1": "trajectory.nc", "heavytop/atlas/1": "atlas.nc"}
MOST_BESIDE: Final = 512 * 2**20  # of one of these


class Finding(NamedTuple):
    """One result.

    Attributes
    ----------
    path : Path
        The file.
    schema : str
    document : dict
        What the shape of its schema has of it.
    sha256 : str
    size : int
        Bytes of the file.
    name : str
        What a page calls it: the end of its path that no other has.
    """

    path: Path
    schema: str
    document: dict[str, Any]
    sha256: str
    size: int
    name: str


class Found(NamedTuple):
    """What folders hold.

    Attributes
    ----------
    results : tuple of Finding
        In the order of the page.
    again : tuple of (str, str)
        Files that are there twice, each with a word about the one that is shown.
    """

    results: tuple[Finding, ...]
    again: tuple[tuple[str, str], ...] = ()


def findings(folders: Sequence[Path]) -> Found:
    """Return what lies in the folders.

    Parameters
    ----------
    folders : sequence of Path
        Each holds results itself, or folders that do.

    Returns
    -------
    Found
        The results, in the order of the page, and what was there twice.

    Raises
    ------
    ForeignFile
        Folders hold none, files are not what their names promise, or there are too many. Every
        fault has a line.
    """
    faults: list[str] = []
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            paths |= dict.fromkeys(_within(folder))
        except ForeignFile as fault:
            faults.append(str(fault))
    if len(paths) > MOST:
        faults.append(f"{len(paths)} results, more than the {MOST} that a page is made of")
        paths.clear()
    found = list(_read(list(paths), faults))
    if faults:
        more = [f"and {len(faults) - TOLD} more"] if len(faults) > TOLD else []
        raise ForeignFile("\n".join([*faults[:TOLD], *more]))
    order = list(FILES.values())
    return _once(sorted(found, key=lambda each: order.index(each.schema)))


def _within(folder: Path) -> list[Path]:
    """The documents in a folder, and in those directly in it."""
    try:
        below = sorted(place for place in folder.iterdir() if place.is_dir())
        places = [place / name for place in (folder, *below) for name in FILES]
        found = [_whole(path) for path in places if os.path.lexists(path)]
    except OSError as fault:
        raise ForeignFile(f"{harmless(folder)}: {fault.strerror or fault}") from None
    if not found:
        raise ForeignFile(f"{harmless(folder)}: holds no results ({', '.join(FILES)})")
    return found


def _whole(path: Path) -> Path:
    """The path from the root; a link keeps its name."""
    return Path(os.path.abspath(path))  # noqa: PTH100


def _read(paths: list[Path], faults: list[str]) -> Iterator[Finding]:
    """Read documents; what is wrong with one is put to the other faults."""
    size = 0
    for path, name in zip(paths, _names(paths), strict=True):
        try:
            finding = _one(path, name)
        except ForeignFile as fault:
            faults.append(str(fault))
            continue
        size += finding.size
        if size > MOST_BYTES:
            faults.append(f"documents of more than {MOST_BYTES >> 20} MB in all")
            return
        yield finding


def _one(path: Path, name: str) -> Finding:
    schema = FILES[path.name]
    document, data = read(path)
    there = document.get("schema")
    if there != schema:
        raise ForeignFile(f"{harmless(path)}: schema = {there!r:.60}: expected {schema}")
    kept = cut(path, document, SHAPES[schema])
    return Finding(path, schema, kept, sha256(data).hexdigest(), len(data), name)


def _names(paths: Sequence[Path]) -> list[str]:
    """The end of every path, of two parts or more, that no other path has."""
    whole = [path.parts for path in paths]
    return [_end(parts, whole) for parts in whole]


def _end(parts: tuple[str, ...], whole: Sequence[tuple[str, ...]]) -> str:
    for count in range(2, len(parts)):
        if sum(other[-count:] == parts[-count:] for other in whole) == 1:
            return harmless(Path(*parts[-count:]))
    return harmless(Path(*parts))


def _once(found: Sequence[Finding]) -> Found:
    """Each result once: a copy, with what lies beside it, says nothing new."""
    counts = Counter((each.schema, each.sha256) for each in found)
    first: dict[tuple[str, str, str], Finding] = {}
    again: list[tuple[str, str]] = []
    for each in found:
        beside = _beside(each) if counts[each.schema, each.sha256] > 1 else ""
        same = first.setdefault((each.schema, each.sha256, beside), each)
        if same is not each:
            again.append((each.name, f"the same as {same.name}, which is here"))
    return Found(tuple(first.values()), tuple(again))


def _beside(finding: Finding) -> str:
    """What lies beside a document and is read with it, by its contents."""
    path = finding.path.with_name(BESIDE.get(finding.schema, "none"))
    if finding.schema not in BESIDE or not os.path.lexists(path):
        return ""
    try:
        expect_file(path, MOST_BESIDE)
        with path.open("rb") as file:
            return file_digest(file, "sha256").hexdigest()
    except (OSError, ForeignFile):
        return str(path)  # like no other: whoever reads it says what is wrong with it
