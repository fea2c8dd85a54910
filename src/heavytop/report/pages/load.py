"""The results that folders hold."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from heavytop.errors import ForeignFile
from heavytop.results.documents import FILES, read_document
from heavytop.spelling import harmless


class Result(NamedTuple):
    """One result.

    Attributes
    ----------
    path : Path
        The file of its document.
    name : str
        What a page calls it: its path below what all of them lie in.
    document : dict
    sha256 : str
        The fingerprint of the file.
    """

    path: Path
    name: str
    document: dict[str, Any]
    sha256: str


def load_results(folders: Sequence[Path]) -> tuple[Result, ...]:
    """Return what lies in the folders, in the order of a page.

    Parameters
    ----------
    folders : sequence of Path
        Each holds results itself, or folders that do.

    Returns
    -------
    tuple of Result

    Raises
    ------
    ForeignFile
        Folders hold none, or files are not what their names promise. Every fault has a line.
    """
    faults: list[str] = []
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            found = dict.fromkeys(_within(folder))
        except OSError as fault:
            faults.append(f"{harmless(folder)}: {fault.strerror or fault}")
            continue
        if not found:
            faults.append(f"{harmless(folder)}: holds no results ({', '.join(FILES)})")
        paths |= found
    results = []
    for path in sorted(paths, key=lambda path: list(FILES).index(path.name)):
        try:
            results.append(Result(path, _below(path, list(paths)), *read_document(path)))
        except ForeignFile as fault:
            faults.append(str(fault))
    if faults:
        raise ForeignFile("\n".join(faults))
    return tuple(results)


def _within(folder: Path) -> Iterator[Path]:
    """The documents in a folder, and in those directly in it; a link keeps its name."""
    for place in (folder, *sorted(each for each in folder.iterdir() if each.is_dir())):
        for name in FILES:
            if os.path.lexists(place / name):
                yield Path(os.path.abspath(place / name))  # noqa: PTH100


def _below(path: Path, paths: Sequence[Path]) -> str:
    """A path as seen from where all of them lie, with its folder at least."""
    return harmless(path.relative_to(os.path.commonpath([each.parent.parent for each in paths])))
