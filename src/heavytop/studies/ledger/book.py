"""A book: where the pieces of a study are written down. Here, the one kept in memory."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

from heavytop.studies.ledger.entry import Entry
from heavytop.studies.ledger.piece import Piece


class Book(Protocol):
    """What is known of the tasks of a study so far, and room for more."""

    @property
    def path(self) -> Path | None:
        """The folder, if it is kept in one."""

    def entry(self, task: str) -> Entry:
        """Return where a task stands."""

    def record(self, task: str, piece: Piece) -> None:
        """Add a piece; when this returns it is not lost any more.

        Raises
        ------
        StoppedEarly
            It cannot be written down.
        """

    def fail(self, task: str, why: str) -> None:
        """Note that a task cannot reach its end."""

    def rows(self, task: str) -> Iterator[dict[str, Any]]:
        """Yield the rows of a task, in their order."""

    def spent_s(self, task: str) -> float:
        """Return the time that the pieces of a task took [s]; no result, and never the same."""

    def origin(self, task: str, row: int | None = None) -> str:
        """Return where the checkpoint or a row of a task is kept, for messages."""


class Memory:
    """The book of a study without a folder: it lives as long as the process."""

    path = None

    def __init__(self) -> None:
        self._entries: dict[str, Entry] = {}
        self._spent: dict[str, float] = {}

    def entry(self, task: str) -> Entry:
        """Where a task stands."""
        return self._entries.get(task, Entry())

    def record(self, task: str, piece: Piece) -> None:
        """Add a piece."""
        self._entries[task] = self.entry(task).after(piece)
        self._spent[task] = self.spent_s(task) + piece.spent_s

    def fail(self, task: str, why: str) -> None:
        """Note that a task cannot reach its end."""
        self._entries[task] = self.entry(task).given_up(why)

    def rows(self, task: str) -> Iterator[dict[str, Any]]:
        """The rows of a task, in their order."""
        yield from map(json.loads, self.entry(task).pending)

    def spent_s(self, task: str) -> float:
        """The time that the pieces of a task took [s]."""
        return self._spent.get(task, 0.0)

    def origin(self, task: str, row: int | None = None) -> str:
        """The name of a task: there are no files."""
        return task
