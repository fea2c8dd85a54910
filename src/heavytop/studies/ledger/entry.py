"""What is written down about one task, and how rows become segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from heavytop.studies.ledger.canonical import canonical
from heavytop.studies.ledger.piece import Piece

# A segment is full at so many characters. Where it is cut depends on the rows alone, so that the
# files of a study that was killed are those of one that was not.
FULL = 65536

Lines = tuple[str, ...]


class Segment(NamedTuple):
    """A file of rows: its digest, and how many there are."""

    sha256: str
    rows: int


@dataclass(frozen=True, slots=True)
class Entry:
    """One task, as far as it is.

    Attributes
    ----------
    checkpoint : dict or None
        Where it goes on; None at its start.
    segments : tuple of Segment
        The files of rows that are whole.
    pending : tuple of str
        Rows after those, one JSON text each: not enough yet for a file.
    done : bool
        Whether it reached its end.
    failed : str or None
        Why it cannot, in words.
    fraction : float
        Part of it that is done.
    """

    checkpoint: dict[str, Any] | None = None
    segments: tuple[Segment, ...] = ()
    pending: Lines = ()
    done: bool = False
    failed: str | None = None
    fraction: float = 0.0

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to do."""
        return self.done or self.failed is not None

    def after(self, piece: Piece) -> Entry:
        """The entry when a piece was added, all its rows pending."""
        return replace(
            self,
            checkpoint=piece.checkpoint,
            pending=(*self.pending, *map(canonical, piece.rows)),
            done=piece.done,
            fraction=1.0 if piece.done else min(1.0, max(0.0, piece.fraction)),
        )

    def given_up(self, why: str) -> Entry:
        """The entry of a task that cannot go on; the rows it gave are kept."""
        return replace(self, checkpoint=None, failed=why, fraction=1.0)


def cut(lines: Sequence[str], last: bool) -> tuple[list[Lines], Lines]:
    """Rows as full segments, and those left over: none after the `last` row of a task."""
    full: list[Lines] = []
    part: list[str] = []
    size = 0
    for line in lines:
        part.append(line)
        size += len(line)
        if size >= FULL:
            full.append(tuple(part))
            part, size = [], 0
    if last and part:
        full.append(tuple(part))
        part = []
    return full, tuple(part)
