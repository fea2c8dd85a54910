"""A piece of a task: about a second of whole blocks, and where the task stands after them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

from heavytop.studies.ledger.canonical import plain


@dataclass(frozen=True, slots=True)
class Piece:
    """What one piece of work gave.

    Attributes
    ----------
    checkpoint : dict
        All that is needed to go on from here, as JSON; floats as hexadecimal texts.
    rows : tuple of dict
        Results since the piece before, as JSON, without wall-clock values.
    done : bool
        Whether the task is at its end.
    fraction : float
        Part of the task that is done, 0 to 1.
    spent_s : float
        Time this piece took [s]; kept apart from the results.
    """

    checkpoint: dict[str, Any]
    rows: tuple[dict[str, Any], ...] = ()
    done: bool = False
    fraction: float = 0.0
    spent_s: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """The piece as plain JSON values."""
        return dict(plain({f.name: getattr(self, f.name) for f in fields(self)}))

    @classmethod
    def of_json(cls, document: dict[str, Any]) -> Piece:
        """Return the piece that `as_json` made."""
        return cls(**{**document, "rows": tuple(document["rows"])})


class Follower(Protocol):
    """What the module of a kind of study offers, as two functions."""

    def tasks(self, identity: dict[str, Any]) -> Sequence[str]:
        """Return the names of the tasks of a study, always the same and in the same order."""

    def follow(
        self, identity: dict[str, Any], task: str, checkpoint: dict[str, Any] | None
    ) -> Iterator[Piece]:
        """Yield the pieces of a task after a checkpoint (None: from its start), the last one done.

        Rows and the last checkpoint depend on nothing but `identity` and `task`: not on where
        the pieces are cut, nor on how often the task was taken up. A HeavyTopError ends the task
        as failed; what was yielded before it is kept, so the last whole blocks are yielded first.
        A ForeignFile refuses the checkpoint, and ends the study.
        """
