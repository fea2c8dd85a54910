"""What one process does for a study: it records, and it tells how far things are."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from heavytop.errors import ForeignFile, ForeignWorker, Stop, StoppedEarly
from heavytop.studies.ledger.book import Book
from heavytop.studies.ledger.piece import Piece
from heavytop.studies.ledger.progress import Progress
from heavytop.studies.ledger.study import Study

Show = Callable[[Progress], object]

TICK_S = 0.1  # how long Ctrl-C may go unheard
LIVES = 2  # a task whose worker dies once gets another; twice is no accident


class BrokenTask(Exception):
    """A bug in the code of a task, seen in a worker; its traceback is in the notes."""


class Effort:
    """Tasks of a study, the book it is written in, and what was left when this process began.

    Parameters
    ----------
    study : Study
    book : Book
    show : callable, optional
    tasks : sequence of str, optional
        Those to be done; else all.

    Raises
    ------
    ValueError
        The study has no such task.
    """

    def __init__(
        self, study: Study, book: Book, show: Show | None, tasks: Sequence[str] | None = None
    ) -> None:
        self.study, self.book = study, book
        self.tasks = study.tasks if tasks is None else _part(study, tasks)
        self.left = tuple(t for t in self.tasks if not book.entry(t).ended)
        self._show, self._start, self._before = show, time.monotonic(), self._fraction()
        self._tell()

    def record(self, task: str, piece: Piece) -> None:
        """Write down a piece."""
        self.book.record(task, piece)
        self._tell()

    def fail(self, task: str, why: str) -> None:
        """Write down that a task cannot reach its end."""
        self.book.fail(task, why)
        self._tell()

    def take(self, task: str, message: dict[str, Any]) -> None:
        """Write down what a worker said of a task; what ends the study is raised."""
        match message:
            case {"piece": dict(fields)}:
                self.record(task, Piece.of_json(fields))
            case {"failed": str(why)}:
                self.fail(task, why)
            case {"foreign": str(why)}:
                raise self.foreign(task, why)
            case {"stranger": str(who), "differences": list(found)}:
                raise ForeignWorker(who, found)
            case _:
                bug = BrokenTask(f"{task}: {message.get('bug')}")
                bug.add_note(str(message.get("trace", "")))
                raise bug

    def foreign(self, task: str, why: str) -> ForeignFile:
        """What refuses the checkpoint of a task."""
        return ForeignFile(f"{self.book.origin(task)}: {why}")

    def interrupted(self) -> StoppedEarly:
        """What ends a study when an end was asked for."""
        return self.stopped(Stop.INTERRUPTED, "interrupted")

    def stopped(self, stop: Stop, why: str) -> StoppedEarly:
        """What ends a study early, with where it is kept."""
        return StoppedEarly(stop, why, self.book.path)

    def _fraction(self) -> float:
        tasks = self.tasks
        return sum(self.book.entry(t).fraction for t in tasks) / len(tasks) if tasks else 1.0

    def _tell(self) -> None:
        if self._show is None:
            return
        done, tasks = self._fraction(), self.tasks
        ended = sum(self.book.entry(t).ended for t in tasks)
        elapsed = time.monotonic() - self._start
        self._show(Progress(done, ended, len(tasks), elapsed, done - self._before))


def _part(study: Study, tasks: Sequence[str]) -> tuple[str, ...]:
    """These tasks in the order of the study, if it has them all."""
    wanted = set(tasks)
    if strangers := wanted.difference(study.tasks):
        raise ValueError(f"task {min(strangers)!r}: not one of this study")
    return tuple(task for task in study.tasks if task in wanted)
