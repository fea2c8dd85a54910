"""The time that tasks took: kept beside the results, never in them, for it is never the same."""

from __future__ import annotations

import sys
from pathlib import Path

from heavytop.errors import ForeignFile
from heavytop.files import write_document
from heavytop.studies.ledger.canonical import contents, parsed

SCHEMA = "heavytop/cost/1"


class Costs:
    """Seconds by task, in a file that no result depends on."""

    def __init__(self, path: Path, spent: dict[str, float]) -> None:
        self._path, self._spent = path, spent

    @classmethod
    def read(cls, path: Path) -> Costs:
        """The costs in a file; none where it is missing or damaged, which harms no result."""
        if not path.exists():
            return cls(path, {})
        try:
            spent = dict(parsed(path, contents(path))["spent_s"])
        except (ForeignFile, KeyError, TypeError, ValueError):
            return cls(path, {})
        return cls(path, {task: float(s) for task, s in spent.items() if _is_time(s)})

    def of(self, task: str) -> float:
        """The time spent on a task [s]."""
        return self._spent.get(task, 0.0)

    def add(self, task: str, seconds: float) -> None:
        """Count more of it."""
        self._spent[task] = self.of(task) + seconds

    def write(self) -> None:
        """Write the file, whole."""
        write_document(self._path, {"schema": SCHEMA, "spent_s": self._spent})


def _is_time(seconds: object) -> bool:
    """Whether this is a finite number that is not negative."""
    if isinstance(seconds, bool) or not isinstance(seconds, int | float):
        return False
    return 0 <= seconds <= sys.float_info.max
