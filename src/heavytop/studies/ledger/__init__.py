"""The ledger: work that is never lost.

A study is many tasks, each a long way in small pieces. One process writes down what each piece
gave, so that a study that was killed is taken up again, bit for bit. The ledger knows nothing of
what it keeps: a kind of study gives it the tasks and follows them.
"""

from __future__ import annotations

from heavytop.studies.ledger.book import Book, Memory
from heavytop.studies.ledger.crew import run
from heavytop.studies.ledger.folder import Folder, identity_of
from heavytop.studies.ledger.kinds import study_of
from heavytop.studies.ledger.merging import merge
from heavytop.studies.ledger.piece import Piece
from heavytop.studies.ledger.progress import Progress
from heavytop.studies.ledger.study import Study, shard

__all__ = [
    "Book",
    "Folder",
    "Memory",
    "Piece",
    "Progress",
    "Study",
    "identity_of",
    "merge",
    "run",
    "shard",
    "study_of",
]
