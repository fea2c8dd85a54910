"""The folder of a study: what is asked, where every task stands, and what it gave."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from heavytop.errors import ForeignFile, ForeignStudy
from heavytop.files import make_folder
from heavytop.studies.ledger.canonical import plain
from heavytop.studies.ledger.costs import Costs
from heavytop.studies.ledger.doorway import (
    LOCK,
    STUDY,
    TASKS,
    begin,
    clean,
    expect_there,
    file_of,
    kept_identity,
    named,
    refuse_strangers,
    writing,
)
from heavytop.studies.ledger.entry import Entry
from heavytop.studies.ledger.lock import Lock, held
from heavytop.studies.ledger.piece import Piece
from heavytop.studies.ledger.shelf import CHECKPOINT, Shelf
from heavytop.studies.ledger.study import Identity, differences, is_name, study_digest

COST = "cost.json"


class Folder:
    """A study on the disk. It is opened by `create_or_open`, `open` or `look`.

    The first two hold the lock until `close`: there is one writer. As a context manager it
    closes itself.

    Attributes
    ----------
    path : Path
    identity : dict
        What is asked, as it stands in the folder.
    """

    def __init__(self, path: Path, lock: Lock | None) -> None:
        self.path: Path = path
        self._lock = lock
        self.identity: Identity = kept_identity(path)
        self._file = file_of(path)
        self._study = study_digest(self.identity)
        self._entries = {task: self._shelf(task).read() for task in self._written()}
        self._costs = Costs.read(path / COST)

    @classmethod
    def create_or_open(cls, path: str | os.PathLike[str], identity: Identity) -> Folder:
        """Begin a study in a new or empty folder, or take up the one with this identity.

        Raises
        ------
        ForeignStudy
            The folder holds another study; its message names every difference.
        ForeignFile
            It holds something else, or a file of it is damaged or was changed.
        InUse
            Another process is writing it.
        OSError
            It cannot be made or written to.
        """
        place = named(path)
        refuse_strangers(place)
        make_folder(place)
        with held(place / LOCK) as lock:
            clean(place)
            if not (place / STUDY).exists():
                begin(place, plain(identity))
            return cls(place, lock).expect(plain(identity))

    @classmethod
    def open(
        cls, path: str | os.PathLike[str], versions: Mapping[str, str | None] | None = None
    ) -> Folder:
        """Take up the study in a folder; its ``versions`` must be those given.

        Raises
        ------
        ForeignStudy
            It was begun with other versions.
        ForeignFile
            It is no study, or a file of it is damaged or was changed.
        InUse
            Another process is writing it.
        StoppedEarly
            It cannot be written to.
        """
        place = named(path)
        kept_identity(place)  # before anything is made there
        with writing(place, place), held(place / LOCK) as lock:
            clean(place)
            folder = cls(place, lock)
            if versions is None:
                return folder
            return folder.expect({**folder.identity, "versions": plain(dict(versions))})

    @classmethod
    def look(cls, path: str | os.PathLike[str]) -> Folder:
        """Read a study, whoever is writing it; nothing can be recorded.

        Raises
        ------
        ForeignFile
            It is no study, or a file of it is damaged or was changed.
        """
        return cls(named(path), None)

    def close(self) -> None:
        """Let another process write; a second time does nothing."""
        lock, self._lock = self._lock, None
        if lock is not None:
            lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        self.close()

    def entry(self, task: str) -> Entry:
        """Where a task stands."""
        return self._entries.get(task, Entry())

    def finished(self, tasks: Sequence[str]) -> bool:
        """Whether every one of these tasks is at its end."""
        return all(self.entry(task).ended for task in tasks)

    def record(self, task: str, piece: Piece) -> None:
        """Write down a piece; when this returns it is on the disk.

        Raises
        ------
        StoppedEarly
            It cannot be written: the disk is full, the folder has gone; that is not made again.
            What was written before is as it was.
        """
        self._write(task, self.entry(task).after(piece))
        self._spend(task, piece.spent_s)

    def fail(self, task: str, why: str) -> None:
        """Write down that a task cannot reach its end."""
        self._write(task, self.entry(task).given_up(why))

    def take_over(self, task: str, source: Folder) -> None:
        """Write down an ended task as another folder of this study has it, byte for byte.

        Raises
        ------
        ForeignFile
            A file there was changed meanwhile.
        StoppedEarly
            As for `record`.
        """
        entry = source.entry(task)
        shelf = self._writable(task)
        with writing(shelf.folder, self.path):
            shelf.take_over(source._shelf(task), entry)
        self._entries[task] = entry
        self._spend(task, source.spent_s(task))

    def rows(self, task: str) -> Iterator[dict[str, Any]]:
        """The rows of a task in their order, one segment in memory at a time.

        Raises
        ------
        ForeignFile
            A segment was changed meanwhile.
        """
        return self._shelf(task).rows(self.entry(task))

    def spent_s(self, task: str) -> float:
        """The time that the pieces of a task took [s], in all processes that did them."""
        return self._costs.of(task)

    def origin(self, task: str, row: int | None = None) -> str:
        """The file of the checkpoint, or of a row, of a task."""
        return str(self._shelf(task).origin(self.entry(task), row))

    def _write(self, task: str, entry: Entry) -> None:
        shelf = self._writable(task)
        with writing(shelf.folder, self.path):
            self._entries[task] = shelf.write(entry)

    def _spend(self, task: str, seconds: float) -> None:
        self._costs.add(task, seconds)
        with writing(self.path / COST, self.path):
            self._costs.write()

    def _writable(self, task: str) -> Shelf:
        if self._lock is None:
            raise ValueError(f"{self.path}: not opened for writing")
        expect_there(self.path, self._file)
        return self._shelf(task)

    def _shelf(self, task: str) -> Shelf:
        """The files of a task, if they lie inside the folder."""
        if not is_name(task):
            raise ForeignFile(f"{self.path}: task {task!r:.80}: not words joined by slashes")
        place = self.path / TASKS / task
        if not place.resolve().is_relative_to(self.path.resolve()):
            raise ForeignFile(f"{place}: leads out of the folder")
        return Shelf(place, task, self._study)

    def _written(self) -> list[str]:
        """The tasks that have a checkpoint."""
        tasks = self.path / TASKS
        return sorted(c.parent.relative_to(tasks).as_posix() for c in tasks.rglob(CHECKPOINT))

    def expect(self, identity: Identity) -> Folder:
        """Return this folder, if it holds the study with this identity.

        Raises
        ------
        ForeignStudy
            It holds another.
        """
        if found := differences(self.identity, identity):
            raise ForeignStudy(self.path, found)
        return self


def identity_of(path: str | os.PathLike[str]) -> Identity:
    """What is asked in a folder; nothing else in it is read.

    Raises
    ------
    ForeignFile
        It is no study.
    """
    return kept_identity(named(path))
