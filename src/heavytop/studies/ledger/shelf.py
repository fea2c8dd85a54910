"""The files of one task: a checkpoint, and the segments of rows it names.

A segment is written before the checkpoint that names it. One that no checkpoint names was left
by a kill: it is not read, and the same rows are written over it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from typing import Any

from heavytop.errors import ForeignFile
from heavytop.files import make_folder, write_text
from heavytop.studies.ledger.canonical import canonical, contents, digest, parsed, sealed, unsealed
from heavytop.studies.ledger.entry import Entry, Lines, Segment, cut

CHECKPOINT = "checkpoint.json"
SCHEMA = "heavytop/checkpoint/1"
ROWS = "heavytop/rows/1"


@dataclass(frozen=True, slots=True)
class Shelf:
    """The folder of one task of one study.

    Attributes
    ----------
    folder : Path
    task : str
    study : str
        The digest of the study that every file here names.
    """

    folder: Path
    task: str
    study: str

    @property
    def checkpoint(self) -> Path:
        """The file that says where the task stands."""
        return self.folder / CHECKPOINT

    def segment(self, i: int) -> Path:
        """The file of segment i, from 0."""
        return self.folder / f"rows-{i + 1:04d}.json"

    def write(self, entry: Entry) -> Entry:
        """Write an entry, full segments first; return it with these named.

        Raises
        ------
        OSError
        """
        make_folder(self.folder)
        full, left = cut(entry.pending, last=entry.ended)
        segments = list(entry.segments)
        for lines in full:
            text = self._segment_text(lines)
            write_text(self.segment(len(segments)), text)
            segments.append(Segment(digest(text), len(lines)))
        entry = replace(entry, segments=tuple(segments), pending=left)
        write_text(self.checkpoint, sealed(self._document(entry)))
        return entry

    def take_over(self, other: Shelf, entry: Entry) -> None:
        """Write the files of an ended task as another folder has them, segments first.

        Raises
        ------
        ForeignFile
            A file there was changed meanwhile.
        OSError
        """
        make_folder(self.folder)
        for i, segment in enumerate(entry.segments):
            write_text(self.segment(i), other._whole(i, segment).decode("utf-8"))
        write_text(self.checkpoint, sealed(self._document(entry)))

    def read(self) -> Entry:
        """Read the entry, and hold every segment it names against its digest.

        Raises
        ------
        ForeignFile
            A file is missing, damaged, changed, or of another study or task.
        """
        document = unsealed(self.checkpoint, SCHEMA)
        self._own(self.checkpoint, document)
        try:
            entry = self._entry(document)
        except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as fault:
            raise ForeignFile(f"{self.checkpoint}: damaged ({fault})") from None
        for i, segment in enumerate(entry.segments):
            self._whole(i, segment)
        return entry

    def rows(self, entry: Entry) -> Iterator[dict[str, Any]]:
        """Yield the rows of an entry, one segment in memory at a time."""
        for i, segment in enumerate(entry.segments):
            document = parsed(self.segment(i), self._whole(i, segment))
            self._own(self.segment(i), document)
            rows = document.get("rows")
            if not isinstance(rows, list) or len(rows) != segment.rows:
                raise ForeignFile(f"{self.segment(i)}: damaged (rows: not {segment.rows})")
            yield from rows
        yield from (parsed(self.checkpoint, line.encode()) for line in entry.pending)

    def origin(self, entry: Entry, row: int | None) -> Path:
        """The file that holds a row of an entry; without one, the checkpoint."""
        ends = accumulate(s.rows for s in entry.segments)
        inside = (i for i, end in enumerate(ends) if row is not None and row < end)
        found = next(inside, None)
        return self.checkpoint if found is None else self.segment(found)

    def _segment_text(self, lines: Lines) -> str:
        head = canonical({"schema": ROWS, "study": self.study, "task": self.task})
        rows = ",\n".join(lines)
        return f'{head[:-1]},"rows":[\n{rows}\n]}}\n'

    def _whole(self, i: int, segment: Segment) -> bytes:
        text = contents(self.segment(i))
        if digest(text) != segment.sha256:
            raise ForeignFile(f"{self.segment(i)}: cut short or changed since it was written")
        return text

    def _own(self, path: Path, document: dict[str, Any]) -> None:
        for name, own in (("study", self.study), ("task", self.task)):
            if (found := document.get(name)) != own:
                raise ForeignFile(f"{path}: of another {name} ({found!r:.80}, not {own!r:.80})")

    def _document(self, entry: Entry) -> dict[str, Any]:
        return {
            "schema": SCHEMA,
            "study": self.study,
            "task": self.task,
            "checkpoint": entry.checkpoint,
            "segments": [
                {"file": self.segment(i).name, "sha256": s.sha256, "rows": s.rows}
                for i, s in enumerate(entry.segments)
            ],
            "pending": [parsed(self.checkpoint, line.encode()) for line in entry.pending],
            "done": entry.done,
            "failed": entry.failed,
            "fraction": entry.fraction,
        }

    def _entry(self, document: dict[str, Any]) -> Entry:
        return Entry(
            checkpoint=_either(document["checkpoint"], dict),
            segments=tuple(self._named(i, s) for i, s in enumerate(document["segments"])),
            pending=tuple(map(canonical, document["pending"])),
            done=_a(document["done"], bool),
            failed=_either(document["failed"], str),
            fraction=min(1.0, max(0.0, float(document["fraction"]))),
        )

    def _named(self, i: int, fields: dict[str, Any]) -> Segment:
        """A segment, which has one possible name: a checkpoint cannot lead out of its folder."""
        if fields["file"] != self.segment(i).name:
            raise ValueError(f"segment {fields['file']!r:.80}: expected {self.segment(i).name}")
        return Segment(_a(fields["sha256"], str), _a(fields["rows"], int))


def _either(value: Any, kind: type) -> Any:
    """A value that is of a kind, or null."""
    return None if value is None else _a(value, kind)


def _a(value: Any, kind: type) -> Any:
    """A value that is of a kind."""
    if type(value) is not kind:
        raise TypeError(f"{value!r:.80}: not {kind.__name__}")
    return value
