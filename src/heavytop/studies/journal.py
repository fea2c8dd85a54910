"""The journal of a study: its parameters in the first line of a file, then a line for each slice.

``pandas.read_json("study.jsonl", lines=True)`` reads it. Every line begins with its digest. A last
line that a kill cut short is dropped.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import IO, Any, Final, NamedTuple, Self

from heavytop import errors
from heavytop.errors import ForeignFile
from heavytop.files import digest, lock
from heavytop.results.base import typed
from heavytop.scene.arguments import path_of

Parameters = dict[str, Any]
STUDY, LOCK = "study.jsonl", "lock"
RUN: Final = "run"
"""The kind of the journal of a run, no study, which has a first line alone."""
DIGEST: Final = b'{"sha256":"%b",'
DIGEST_BEGINS: Final = DIGEST.partition(b"%")[0]
BUDGET: Final = "budget"
"""The record whose checkpoint is the time that a study may take [s]; it has no rows."""


class Chunk(NamedTuple):
    """The result of one piece of work on a task.

    Attributes
    ----------
    checkpoint : object
        All that is needed to go on from here, for JSON.
    rows : sequence of dict
        Results since the chunk before, for JSON, without wall-clock times.
    done : bool
        Whether the task is at its end.
    fraction : float
        Part of the task that is done, 0 to 1.
    seconds : float
        Time it took [s].
    failed : str or None
        Why the task cannot go on.
    """

    checkpoint: Any = None
    rows: Sequence[dict[str, Any]] = ()
    done: bool = False
    fraction: float = 1.0
    seconds: float = 0.0
    failed: str | None = None


_NOT_BEGUN: Final = Chunk(fraction=0.0)


@dataclass(slots=True)
class TaskRecord:
    """The stored part of a task: its last chunk, the seconds of all, their places in the file."""

    last: Chunk = _NOT_BEGUN
    seconds: float = 0.0
    places: list[int] = field(default_factory=list)

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to do."""
        return self.last.done or self.last.failed is not None


class Journal:
    """The stored part of a study, in a folder or in memory.

    Attributes
    ----------
    parameters : dict
        All that distinguishes this study from others, as JSON: kind, scene, options, versions.
    folder : Path or None
    """

    def __init__(self, parameters: Parameters, folder: Path | None = None) -> None:
        self.parameters: Parameters = json.loads(canonical_json(parameters))
        self.folder = folder
        self._file: IO[bytes] = BytesIO()
        self._end = 0
        self._records: dict[str, TaskRecord] = {}

    @classmethod
    def read(cls, folder: str | os.PathLike[str]) -> Self:
        """Read the study of a folder.

        Raises
        ------
        ForeignFile
            It is not the folder of a study, or damaged.
        """
        place = Path(folder)
        if not (about := first_line(place)):
            raise ForeignFile(f"{place}: there is neither a study nor a run")
        journal = cls(about["parameters"], place)
        with (place / STUDY).open("rb") as file:
            journal._end, size = len(file.readline()), os.fstat(file.fileno()).st_size
            for number, line in enumerate(file, 2):
                try:
                    journal._add(journal._end, **read_line(line))
                except (TypeError, ValueError) as fault:
                    if journal._end + len(line) == size:  # a kill may have cut the last line short
                        break
                    raise ForeignFile(f"{place / STUDY}: line {number}: {fault}") from None
                journal._end += len(line)
        return journal

    @classmethod
    @contextmanager
    def open(
        cls, folder: object, parameters: Parameters, files: Sequence[str] = (), **about: Any
    ) -> Iterator[Self]:
        """Begin a study in a new or empty folder, or continue the one with these parameters.

        Where the folder is None it is in memory. With `files` the folder need not be empty, only
        without these files. The first line holds `about` too.

        Raises
        ------
        ForeignFile
            The folder holds another study, of which every difference is named, or something else.
        InUse
            Another process is writing it.
        OSError
            It cannot be made or written to.
        StoppedEarly
            Ctrl-C while it is open.
        """
        if folder is None:
            yield cls(parameters)
            return
        path = path_of("folder", folder)
        if path.exists() and not path.is_dir():
            raise ForeignFile(f"{path}: not a folder")
        there = {each.name for each in path.glob("*")} - {STUDY, LOCK}
        others, begun = sorted(there.intersection(files or there)), first_line(path)
        if others and not begun:
            names = ", ".join(others[:3])
            raise ForeignFile(f"{path}: not empty and not the folder of a study ({names})")
        path.mkdir(parents=True, exist_ok=True)
        with lock(path / LOCK), (path / STUDY).open("ab", buffering=0) as file:
            if not first_line(path):
                file.truncate(0)
                _write_line(file, {"command": typed(), "parameters": parameters, **about})
            journal = cls.read(path)
            journal.expect(parameters)
            file.truncate(journal._end)
            journal._file = file
            try:
                yield journal
            except BaseException as fault:
                if not errors.is_interrupt(fault):
                    raise
                raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", path) from None

    def expect(self, parameters: Parameters) -> None:
        """Refuse parameters other than those of the folder.

        Raises
        ------
        ForeignFile
        """
        if found := differences(self.parameters, json.loads(canonical_json(parameters))):
            which = RUN if self.parameters["kind"] == RUN else "study"
            raise ForeignFile(f"{self.folder}: holds another {which}: {'; '.join(found)}")

    def record(self, task: str) -> TaskRecord:
        """Return the record of a task, an empty one before it began."""
        return self._records.setdefault(task, TaskRecord())

    def rows(self, task: str) -> list[dict[str, Any]]:
        """Return the results of a task so far, read from the file."""
        found: list[dict[str, Any]] = []
        path = self.folder and self.folder / STUDY
        with path.open("rb") if path else nullcontext(self._file) as file:
            for place in self.record(task).places:
                file.seek(place)
                found += read_line(file.readline())["rows"]
        return found

    def append(self, task: str, chunk: Chunk) -> None:
        """Write down a chunk of a task; on return it is on the disk.

        Raises
        ------
        StoppedEarly
            The disk is full, or the folder has gone.
        """
        line = {"task": task, **chunk._asdict()}
        try:
            if self.folder:
                (self.folder / STUDY).stat()  # what has gone would be written to all the same
            place = _write_line(self._file, line)
        except OSError as fault:
            raise errors.StoppedEarly.unwritable(fault, Path(STUDY), self.folder) from fault
        self._add(place, **line)

    def _add(self, place: int, task: str, **chunk: Any) -> None:
        """Add a chunk at a place in the file to the record of a task."""
        record, last = self.record(task), Chunk(**chunk)
        if record.ended:  # two have written, where a lock does not hold
            raise ValueError(f"{task} had ended before")
        record.last = last._replace(rows=())
        record.seconds += last.seconds
        record.places.append(place)


def first_line(folder: Path) -> dict[str, Any]:
    """Return the first line of a folder, its command and parameters; empty where none is whole.

    Raises
    ------
    ForeignFile
        It is damaged.
    """
    path = folder / STUDY
    try:
        if path.is_symlink() or (path.exists() and not path.is_file()):
            raise ValueError("no regular file")
        with path.open("rb") as file:
            line = file.readline()
        cut = not line.endswith(b"\n") and DIGEST_BEGINS.startswith(line[: len(DIGEST_BEGINS)])
        return {} if cut else read_line(line)
    except FileNotFoundError:
        return {}
    except ForeignFile as fault:
        raise ForeignFile(f"{path}: line 1: {fault}") from None
    except (OSError, ValueError) as fault:  # a name with a null byte
        why = getattr(fault, "strerror", fault)
        raise ForeignFile(f"{path}: not readable ({why})") from None


def keep_budget(journal: Journal, budget: float | None, default: float) -> float:
    """Write down the budget of a study, or read that of one that is resumed (None); return it."""
    if budget is not None:
        journal.append(BUDGET, Chunk(budget))
    written = journal.record(BUDGET).last.checkpoint
    return default if written is None else float(written)


def canonical_json(value: Any) -> str:
    """Return the one JSON text of a value: keys in order, no spaces, never NaN.

    Raises
    ------
    TypeError, ValueError
        For what JSON cannot hold.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def differences(there: Any, here: Any, name: str = "") -> tuple[str, ...]:
    """Return the differences of two JSON values, as sentences that begin with their keys.

    Examples
    --------
    >>> differences({"scene": {"theta": "0.1"}}, {"scene": {"theta": "0.2"}})
    ('scene.theta: "0.1" there, "0.2" here',)
    """
    if isinstance(there, dict) and isinstance(here, dict):
        every = ((key, there.get(key), here.get(key)) for key in sorted({*there, *here}))
        found = (differences(a, b, f"{name}.{key}".removeprefix(".")) for key, a, b in every)
        return tuple(difference for each in found for difference in each)
    text = partial(json.dumps, separators=(",", ":"), ensure_ascii=False)  # ° stays as it is
    a, b = ("nothing" if each is None else text(each) for each in (there, here))
    return () if a == b else (f"{name}: {a:.80} there, {b:.80} here",)


def seal(text: bytes) -> bytes:
    """Return the line for the text of a JSON object, with the digest of that as its first key."""
    return DIGEST % digest(text) + text[1:] + b"\n"


def read_line(line: bytes) -> dict[str, Any]:
    """Return the object of a line, without its digest, if it is as it was written.

    Raises
    ------
    ForeignFile
    """
    text = b"{" + line[len(DIGEST % digest(b"")) : -1]
    if line != seal(text):
        raise ForeignFile("damaged, its digest is of something else")
    found: dict[str, Any] = json.loads(text)
    return found


def _write_line(file: IO[bytes], document: dict[str, Any]) -> int:
    """Append a line and wait until it is on the disk; return its place."""
    place, rest = file.seek(0, os.SEEK_END), seal(canonical_json(document).encode())
    try:
        while rest:  # unbuffered: a buffer would be written again when a full disk is closed
            rest = rest[file.write(rest) :]
        if not isinstance(file, BytesIO):
            os.fsync(file.fileno())
    except OSError as fault:
        fault.filename = file.name  # a full disk does not say where
        raise
    return place
