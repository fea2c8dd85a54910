"""The store of a study: its parameters, and one record for each task, replaced as a whole.

In a folder these are ``study.json`` and one file a task under ``tasks/``. Where the study is
killed each of them is the old file or the new one, so that it goes on from the last record.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import asdict, dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

from pydantic import ConfigDict

from heavytop.errors import ForeignFile, Stop, StoppedEarly
from heavytop.files import locked, make_folder, write_text
from heavytop.results.base import read, typed
from heavytop.scene.arguments import path_of

Parameters = dict[str, Any]
STUDY, LOCK, TASKS = "study.json", "lock", "tasks"
BUDGET: Final = "budget"
"""The name of a record without rows: its checkpoint is the time that a study may take [s]."""
UNFINISHED: Final = ".[0-9]*.json"  # what `write_text` leaves where it is killed


class Chunk(NamedTuple):
    """What one chunk of the work on a task gave.

    Attributes
    ----------
    checkpoint : object
        All that is needed to go on from here, for JSON.
    rows : sequence of dict
        Results since the chunk before, for JSON, without wall-clock values.
    done : bool
        Whether the task is at its end.
    fraction : float
        Part of the task that is done, 0 to 1.
    seconds : float
        Time it took [s]; it is no result and is not stored.
    failed : str or None
        Why the task cannot go on.
    """

    checkpoint: Any = None
    rows: Sequence[dict[str, Any]] = ()
    done: bool = False
    fraction: float = 1.0
    seconds: float = 0.0
    failed: str | None = None


@dataclass(frozen=True, slots=True)
class Record:
    """One task, as far as it is.

    Attributes
    ----------
    task : str
    checkpoint : object
        Where it goes on; None at its start.
    rows : list of dict
        Its results so far.
    done : bool
    failed : str or None
        Why it cannot go on.
    fraction : float
        Part of it that is done.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")

    task: str
    checkpoint: Any = None
    rows: list[dict[str, Any]] = field(default_factory=list)
    done: bool = False
    failed: str | None = None
    fraction: float = 0.0

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to do."""
        return self.done or self.failed is not None

    def after(self, chunk: Chunk) -> Record:
        """Return the record with one more chunk."""
        return replace(
            self,
            checkpoint=chunk.checkpoint,
            rows=[*self.rows, *chunk.rows],
            done=chunk.done,
            failed=chunk.failed,
            fraction=1.0 if chunk.done else chunk.fraction,
        )


class MemoryStore:
    """The records of a study without a folder.

    Attributes
    ----------
    parameters : dict
        All that makes this study another one, as JSON: kind, scene, options, versions.
    path : Path or None
        The folder, if there is one.
    seconds : dict from str to float
        The time taken by tasks that began in this process [s].
    """

    path: Path | None = None

    def __init__(self, parameters: Parameters) -> None:
        self.parameters: Parameters = json.loads(canonical_json(parameters))
        self.seconds: dict[str, float] = {}
        self._texts: dict[str, str] = {}

    def load(self, task: str) -> Record:
        """Return the record of a task, an empty one before it began.

        Raises
        ------
        ForeignFile
            Its file cannot be read.
        """
        text = self._texts.get(task)
        return Record(**json.loads(text)) if text else Record(task)

    def save(self, record: Record) -> None:
        """Replace the record of a task; on return it is safe.

        Raises
        ------
        StoppedEarly
            The disk is full, or the folder has gone.
        """
        self._texts[record.task] = canonical_json(asdict(record))


class Store(MemoryStore):
    """The records of a study in a folder. `Store.open` is for writing; this is for reading.

    Raises
    ------
    ForeignFile
        It is not the folder of a study.
    """

    path: Path

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        found: Parameters = read(self.path / STUDY, Parameters).found
        found.pop("command", None)
        if not (isinstance(found.get("kind"), str) and isinstance(found.get("versions"), dict)):
            raise ForeignFile(f"{self.path / STUDY}: not a study of this version of heavytop")
        super().__init__(found)

    @classmethod
    @contextmanager
    def open(cls, path: str | os.PathLike[str], parameters: Parameters) -> Iterator[Self]:
        """Begin a study in a new or empty folder, or take up the one with these parameters.

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
        folder = Path(path)
        _refuse_others(folder)
        make_folder(folder / TASKS)
        with locked(folder / LOCK):
            for part in (*folder.glob(UNFINISHED), *folder.glob(f"{TASKS}/{UNFINISHED}")):
                part.unlink(missing_ok=True)
            if not (folder / STUDY).exists():
                asked = {"command": typed(), **parameters}
                write_text(folder / STUDY, json.dumps(asked, indent=2, allow_nan=False))
            store = cls(folder)
            store.expect(parameters)
            try:
                yield store
            except KeyboardInterrupt:
                raise StoppedEarly(Stop.INTERRUPTED, "interrupted", folder) from None

    def expect(self, parameters: Parameters) -> None:
        """Refuse parameters other than those of the folder.

        Raises
        ------
        ForeignFile
        """
        if found := differences(self.parameters, json.loads(canonical_json(parameters))):
            raise ForeignFile(f"{self.path}: holds another study: {'; '.join(found)}")

    def load(self, task: str) -> Record:
        """Return the record of a task, an empty one before it began."""
        path = self._file(task)
        found: Record = read(path, Record).found if path.exists() else Record(task)
        if found.task != task:
            raise ForeignFile(f"{path}: the record of {found.task!r:.60}, not of {task}")
        return found

    def save(self, record: Record) -> None:
        """Replace the record of a task; on return it is on the disk."""
        path = self._file(record.task)
        try:
            write_text(path, canonical_json(asdict(record)))
        except OSError as fault:
            folder = self.path if self.path.exists() else None
            raise StoppedEarly.unwritable(fault, path, folder) from fault

    def _file(self, task: str) -> Path:
        return self.path / TASKS / f"{sha256(task.encode()).hexdigest()[:24]}.json"


def open_store(folder: object, parameters: Parameters) -> AbstractContextManager[MemoryStore]:
    """Open the store of a study for writing: in a folder, or in memory where there is none."""
    if folder is None:
        return nullcontext(MemoryStore(parameters))
    return Store.open(path_of("folder", folder), parameters)


def keep_budget(store: MemoryStore, budget: float | None, default: float) -> float:
    """Write the budget of a study down; of one that is resumed (None) return what was written."""
    if budget is not None:
        store.save(Record(BUDGET, budget))
        return budget
    written = store.load(BUDGET).checkpoint
    with reading(f"record {BUDGET}"):
        return default if written is None else float(written)


@contextmanager
def reading(what: object) -> Iterator[None]:
    """Name what does not hold what was written there.

    Raises
    ------
    ForeignFile
    """
    try:
        yield
    except (LookupError, TypeError, ValueError, AttributeError, zlib.error) as fault:
        if isinstance(fault, ForeignFile):
            raise
        raise ForeignFile(f"{what}: damaged ({fault})") from None


def canonical_json(value: Any) -> str:
    """Return the one JSON text of a value: keys in order, no spaces, never NaN.

    Raises
    ------
    TypeError, ValueError
        For what JSON cannot hold.
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def differences(there: Any, here: Any) -> tuple[str, ...]:
    """Return what two JSON values say differently, each by its name.

    Examples
    --------
    >>> differences({"scene": {"theta": "0.1"}}, {"scene": {"theta": "0.2"}})
    ('scene.theta: "0.1" there, "0.2" here',)
    """
    a, b = _leaves("", there), _leaves("", here)
    names = sorted(name for name in {*a, *b} if a.get(name) != b.get(name))
    return tuple(
        f"{name}: {a.get(name, 'nothing'):.80} there, {b.get(name, 'nothing'):.80} here"
        for name in names
    )


def _leaves(name: str, value: Any) -> dict[str, str]:
    """The numbers and texts of a JSON value, each by its name."""
    if isinstance(value, dict) and value:
        inner = {f"{name}.{key}".removeprefix("."): x for key, x in value.items()}
    elif isinstance(value, list) and value:
        inner = {f"{name}[{i}]": x for i, x in enumerate(value)}
    else:
        return {name: canonical_json(value)}
    return {leaf: text for key, x in inner.items() for leaf, text in _leaves(key, x).items()}


def _refuse_others(folder: Path) -> None:
    """Refuse a file, and a folder that holds something other than a study."""
    if folder.exists() and not folder.is_dir():
        raise ForeignFile(f"{folder}: not a folder")
    tasks = folder / TASKS
    if os.path.lexists(tasks) and (tasks.is_symlink() or not tasks.is_dir()):
        raise ForeignFile(f"{tasks}: not a folder of its own, as a study has for its tasks")
    if (folder / STUDY).exists():
        return
    own = (LOCK, TASKS)
    others = (p.name for p in folder.glob("*") if p.name not in own and not p.match(UNFINISHED))
    if found := sorted(others):
        some = ", ".join(found[:3])
        raise ForeignFile(f"{folder}: not empty and not the folder of a study ({some})")
