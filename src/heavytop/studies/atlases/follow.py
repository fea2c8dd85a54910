"""Following one task of an atlas: a tile, computed at once."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any

from heavytop.errors import ForeignFile
from heavytop.studies.atlases.columns import packed
from heavytop.studies.atlases.study import Study
from heavytop.studies.atlases.tiles import counts, details, tile_of
from heavytop.studies.ledger import Piece
from heavytop.studies.ledger.canonical import canonical


def tasks(identity: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the tiles of a study."""
    return tuple(Study.of(identity).tiles)


@lru_cache(maxsize=2)
def _study(identity: str) -> Study:
    """The study of an identity as text; a worker is asked for one tile after the other."""
    return Study.of(json.loads(identity))


def follow(
    identity: Mapping[str, Any], task: str, checkpoint: Mapping[str, Any] | None
) -> Iterator[Piece]:
    """Compute a tile; its one row holds the columns.

    Parameters
    ----------
    identity : mapping
        Of the study.
    task : str
    checkpoint : mapping, optional
        There is nothing half-way.

    Yields
    ------
    Piece

    Raises
    ------
    ForeignFile
        No tile wrote the checkpoint.
    """
    if checkpoint is not None:
        raise ForeignFile("checkpoint: a tile has none before its end")
    began = time.perf_counter()
    study = _study(canonical(dict(identity)))
    found = tile_of(study.plane, study.tiles[task], study.what)
    row = {
        "counts": counts(found.columns),
        "details": details(found.columns),
        "sent": found.sent,
        "uncertified": int((found.columns["certified"] == 0).sum()),
        "columns": packed(found.columns),
    }
    yield Piece({}, (row,), done=True, fraction=1.0, spent_s=time.perf_counter() - began)
