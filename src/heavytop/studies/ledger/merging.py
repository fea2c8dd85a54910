"""Merging: the ended tasks of several folders of one study, brought into one of them."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import asdict

from heavytop.errors import ForeignFile
from heavytop.studies.ledger.canonical import canonical
from heavytop.studies.ledger.folder import Folder
from heavytop.studies.ledger.kinds import study_of


def merge(target: Folder, sources: Iterable[str | os.PathLike[str]]) -> tuple[str, ...]:
    """Take over every ended task of other folders of the same study.

    All folders are read, and held against their digests and against each other, before anything
    is written. Each task arrives whole or not at all: what was interrupted is merged again. The
    rows in memory are those of one segment.

    Parameters
    ----------
    target : Folder
        Open for writing.
    sources : iterable of path

    Returns
    -------
    tuple of str
        The tasks that have not ended in any of them.

    Raises
    ------
    ForeignStudy
        A folder holds another study; every difference is listed.
    ForeignFile
        A file is damaged or was changed; two folders say different things of the same task.
    StoppedEarly
        The disk is full.
    ValueError
        The target is not open for writing.
    """
    tasks = study_of(target.identity).tasks
    looked = [Folder.look(path).expect(target.identity) for path in sources]
    for task in tasks:
        _agree(task, [folder for folder in (target, *looked) if folder.entry(task).ended])
    for source in looked:
        for task in tasks:
            if source.entry(task).ended and not target.entry(task).ended:
                target.take_over(task, source)
    return tuple(task for task in tasks if not target.entry(task).ended)


def _agree(task: str, folders: Sequence[Folder]) -> None:
    """Refuse folders that do not hold the same of a task, digests of its rows included."""
    for other in folders[1:]:
        if _text(other, task) != _text(folders[0], task):
            here, there = other.origin(task), folders[0].origin(task)
            raise ForeignFile(f"{here}: not the same result as in {there}")


def _text(folder: Folder, task: str) -> str:
    return canonical(asdict(folder.entry(task)))
