"""What one process does for a study: it records, and it tells how far things are."""

from __future__ import annotations

import time
from collections.abc import Callable

from heavytop.errors import ForeignFile, Stop, StoppedEarly
from heavytop.ledger.book import Book
from heavytop.ledger.piece import Piece
from heavytop.ledger.progress import Progress
from heavytop.ledger.study import Study

Show = Callable[[Progress], object]


class Effort:
    """A study, the book it is written in, and the tasks that were left when this process began."""

    def __init__(self, study: Study, book: Book, show: Show | None) -> None:
        self.study, self.book = study, book
        self.left = tuple(t for t in study.tasks if not book.entry(t).ended)
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
        tasks = self.study.tasks
        return sum(self.book.entry(t).fraction for t in tasks) / len(tasks) if tasks else 1.0

    def _tell(self) -> None:
        if self._show is None:
            return
        done, tasks = self._fraction(), self.study.tasks
        ended = sum(self.book.entry(t).ended for t in tasks)
        elapsed = time.monotonic() - self._start
        self._show(Progress(done, ended, len(tasks), elapsed, done - self._before))
