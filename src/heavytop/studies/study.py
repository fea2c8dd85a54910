"""Studies: tasks that any executor advances, each step a line of one file; killed, they go on.

The file ``study.jsonl`` has the parameters in its first line, and then a line for each slice of
work: ``pandas.read_json("study.jsonl", lines=True)`` shows it. Only the process that calls `run`
writes it, and rows do not depend on who did the work, nor on how often it was interrupted.
"""

from __future__ import annotations

import json
import os
import platform
import signal
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent import futures
from concurrent.futures import Executor, Future
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from io import BytesIO
from pathlib import Path
from threading import Event, Lock, current_thread, main_thread
from types import FrameType
from typing import IO, Any, Final, NamedTuple, Protocol, Self, cast

from heavytop import errors
from heavytop.comparison import own
from heavytop.doctor import usable_cpus, versions
from heavytop.errors import ForeignFile
from heavytop.files import locked
from heavytop.results.base import Result, typed
from heavytop.results.registry import RESULTS
from heavytop.scene.arguments import check_callable, path_of, whole
from heavytop.studies.workers import TIMED_WORKER, Processes

Parameters = dict[str, Any]
STUDY, LOCK = "study.jsonl", "lock"
BUDGET: Final = "budget"
"""The name of a record without rows: its checkpoint is the time that a study may take [s]."""

STUDIES: Final = {
    entry.study.rpartition(".")[2]: f"heavytop.{entry.study}"
    for entry in RESULTS.values()
    if entry.study
}
"""The module of each kind of study. A file may name a kind, never a module."""

SLICE_S: Final = 1.0  # of work between two lines of the journal
KILL_COST: Final = 0.02  # of a task's work that a kill may cost: slices grow longer with the task
TICK_S: Final = 0.1  # how long Ctrl-C may wait for an answer

# How executors say that a worker was killed; dask's exceptions by name, as it may be missing here.
# A process of a pool that took a Ctrl-C meant for this one says KeyboardInterrupt.
_LOST: Final = (futures.BrokenExecutor, futures.CancelledError, KeyboardInterrupt)
_LOST_BY_NAME: Final = ("KilledWorker", "FutureCancelledError")

# The precision of mpmath and of python-flint is global, so that threads take turns.
_ONE_AT_A_TIME: Final = Lock()


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
    """One task, as far as it is: its last chunk, the time of all of them, and where they stand."""

    last: Chunk = _NOT_BEGUN
    seconds: float = 0.0
    places: list[int] = field(default_factory=list)

    @property
    def ended(self) -> bool:
        """Whether there is nothing left to do."""
        return self.last.done or self.last.failed is not None


class Journal:
    """What is done of a study: in a folder, or in memory.

    Attributes
    ----------
    parameters : dict
        All that makes this study another one, as JSON: kind, scene, options, versions.
    folder : Path or None
    """

    def __init__(self, parameters: Parameters, folder: Path | None = None) -> None:
        self.parameters: Parameters = json.loads(canonical_json(parameters))
        self.folder = folder
        self._file: IO[bytes] = BytesIO()
        self._records: dict[str, TaskRecord] = {}

    @classmethod
    def read(cls, folder: str | os.PathLike[str]) -> Self:
        """Read the study of a folder.

        Raises
        ------
        ForeignFile
            It is not the folder of a study, or damaged.
        """
        path, number = Path(folder) / STUDY, 1
        try:
            with path.open("rb") as file:
                journal = cls(json.loads(file.readline())["parameters"], Path(folder))
                if not {"kind", "versions"} <= journal.parameters.keys():
                    raise ValueError("no kind of study, or no versions")
                place = file.tell()
                for number, line in enumerate(file, 2):  # noqa: B007
                    if line.endswith(b"\n"):  # a kill may have cut the last line short
                        journal._add(place, **json.loads(line))
                    place += len(line)
        except OSError as fault:
            raise ForeignFile(f"{path}: not readable ({fault.strerror})") from None
        except (LookupError, TypeError, ValueError, AttributeError) as fault:
            raise ForeignFile(f"{path}: line {number}: damaged ({fault})") from None
        return journal

    @classmethod
    @contextmanager
    def open(cls, folder: object, parameters: Parameters) -> Iterator[Self]:
        """Begin a study in a new or empty folder, or take up the one with these parameters.

        Where there is no folder (None) it is in memory.

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
        others = sorted(each.name for each in path.glob("*") if each.name != LOCK)
        if others and STUDY not in others:
            names = ", ".join(others[:3])
            raise ForeignFile(f"{path}: not empty and not the folder of a study ({names})")
        path.mkdir(parents=True, exist_ok=True)
        with locked(path / LOCK), (path / STUDY).open("ab", buffering=0) as file:
            end = (path / STUDY).read_bytes().rfind(b"\n") + 1
            file.truncate(end)
            if not end:
                _write_line(file, {"command": typed(), "parameters": parameters})
            journal = cls.read(path)
            journal.expect(parameters)
            journal._file = file
            try:
                yield journal
            except KeyboardInterrupt:
                raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", path) from None

    def expect(self, parameters: Parameters) -> None:
        """Refuse parameters other than those of the folder.

        Raises
        ------
        ForeignFile
        """
        if found := differences(self.parameters, json.loads(canonical_json(parameters))):
            raise ForeignFile(f"{self.folder}: holds another study: {'; '.join(found)}")

    def record(self, task: str) -> TaskRecord:
        """Return how far a task is; an empty record before it began."""
        return self._records.setdefault(task, TaskRecord())

    def rows(self, task: str) -> list[dict[str, Any]]:
        """Return the results of a task so far; they are not kept in memory."""
        found: list[dict[str, Any]] = []
        path = self.folder and self.folder / STUDY
        with path.open("rb") if path else nullcontext(self._file) as file:
            for place in self.record(task).places:
                file.seek(place)
                found += json.loads(file.readline())["rows"]
        return found

    def append(self, task: str, chunk: Chunk) -> None:
        """Add what was done of a task; on return it is safe.

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
            file = (self.folder or Path()) / STUDY
            raise errors.StoppedEarly.unwritable(fault, file, self.folder) from fault
        self._add(place, **line)

    def _add(self, place: int, task: str, **chunk: Any) -> None:
        record, last = self.record(task), Chunk(**chunk)
        record.last = last._replace(rows=())
        record.seconds += last.seconds
        record.places.append(place)


def keep_budget(journal: Journal, budget: float | None, default: float) -> float:
    """Write the budget of a study down; of one that is resumed (None) return what was written."""
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
    """Return what two JSON values say differently, each by its name.

    Examples
    --------
    >>> differences({"scene": {"theta": "0.1"}}, {"scene": {"theta": "0.2"}})
    ('scene.theta: "0.1" there, "0.2" here',)
    """
    if isinstance(there, dict) and isinstance(here, dict):
        every = ((key, there.get(key), here.get(key)) for key in sorted({*there, *here}))
        found = (differences(a, b, f"{name}.{key}".removeprefix(".")) for key, a, b in every)
        return tuple(difference for each in found for difference in each)
    a, b = ("nothing" if each is None else canonical_json(each) for each in (there, here))
    return () if a == b else (f"{name}: {a:.80} there, {b:.80} here",)


def _write_line(file: IO[bytes], line: dict[str, Any]) -> int:
    """Append a line and wait until it is on the disk; return its place."""
    place, rest = file.seek(0, os.SEEK_END), canonical_json(line).encode() + b"\n"
    while rest:  # without a buffer, which would be tried again when a full disk is closed
        rest = rest[file.write(rest) :]
    if not isinstance(file, BytesIO):
        os.fsync(file.fileno())
    return place


# --- running ---------------------------------------------------------------------------------


class Study(Protocol):
    """What the module of a kind of study offers."""

    __name__: str

    def tasks(self, parameters: Parameters) -> Sequence[str]:
        """Return the names of the tasks, always the same and in the same order."""

    def advance(self, parameters: Parameters, task: str, checkpoint: Any) -> Iterator[Chunk]:
        """Yield the chunks of a task after a checkpoint (None: from its start), the last one done.

        All rows together depend on `parameters` and `task` alone, not on where chunks end. A
        HeavyTopError ends the task as failed.
        """

    def complete(self, journal: Journal, **how: Any) -> Result:
        """Do what is left, with arguments of `run`, and return the result of the study."""


@dataclass(frozen=True, slots=True)
class Progress:
    """Where a study stands.

    Attributes
    ----------
    fraction : float
        Part of the whole study that is done, 0 to 1.
    ended, tasks : int
        How many tasks are at their end, and how many there are.
    elapsed_s : float
        Time since this process took the study up [s].
    gained : float
        Part of the whole study that this process did.
    """

    fraction: float
    ended: int
    tasks: int
    elapsed_s: float
    gained: float

    @property
    def per_s(self) -> float:
        """Part of the whole study done per second; 0 before anything is known [1/s]."""
        return self.gained / self.elapsed_s if self.elapsed_s > 0 else 0.0


def run(
    journal: Journal,
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], object] | None = None,
    slice_s: float = SLICE_S,
    budget: float | None = None,
) -> None:
    """Bring the tasks of a study to their end.

    Parameters
    ----------
    journal : Journal
        Open for writing.
    jobs : int
        Processes; with 1 the work is done in this one.
    executor : concurrent.futures.Executor, optional
        What does the work, in place of own processes.
    on_progress : callable, optional
        It is given a `Progress` after every slice.
    slice_s : float
        How long the work on a task takes, at least, between two lines of the journal [s].
    budget : float, optional
        Time after which no slice is begun, and what is left stays [s].

    Raises
    ------
    StoppedEarly
        Ctrl-C or SIGTERM; a full disk; two workers that were killed on one task.
    ForeignFile
        A worker has other versions than the study; its kind is unknown, or a record cannot be read.
    """
    study = study_of(journal.parameters)
    tasks = list(study.tasks(journal.parameters))
    records = [journal.record(task) for task in tasks]
    started, before = time.monotonic(), _fraction(records)

    def show() -> None:
        if on_progress is not None:
            done, ended = _fraction(records), sum(r.ended for r in records)
            elapsed = time.monotonic() - started
            on_progress(Progress(done, ended, len(records), elapsed, done - before))

    show()
    waiting = deque(task for task in tasks if not journal.record(task).ended)
    running: dict[Future[Chunk], str] = {}
    lost = Counter[str]()
    with stop_signal() as stop, TIMED_WORKER:
        pool = executor or (_Here(stop) if jobs == 1 else Processes(jobs))
        try:
            while (waiting or running) and not stop.is_set():
                if budget is not None and time.monotonic() >= started + budget:
                    waiting.clear()
                # After a loss all tasks it may be due to run alone, each for a slice.
                while waiting and len(running) < (1 if lost else count_sent(pool)):
                    task = waiting.popleft()
                    running[_submit(pool, study, journal, task, slice_s)] = task
                for future in futures.wait(running, TICK_S, futures.FIRST_COMPLETED).done:
                    task = running.pop(future)
                    if fault := _loss(future):
                        lost[task] += 1
                        if lost[task] > 1:
                            why = f"the worker on {task} was lost twice ({_words(fault)})"
                            stopped = errors.Stop.WORKER_LOST
                            raise errors.StoppedEarly(stopped, why, journal.folder) from fault
                        waiting.appendleft(task)
                        if isinstance(pool, Processes):
                            pool.kill()
                            pool = Processes(jobs)
                        continue
                    del lost[task]
                    journal.append(task, future.result())
                    if not journal.record(task).ended:
                        (waiting.append if lost else waiting.appendleft)(task)
                    show()
        finally:
            for future in running:
                future.cancel()
            if isinstance(pool, Processes):
                pool.kill()
    if stop.is_set() and not all(record.ended for record in records):
        raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", journal.folder)


def resume(
    folder: str | os.PathLike[str],
    *,
    methods: Sequence[str | own.Method | Callable[..., Any]] = (),
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Result:
    """Take up a study of any kind where its folder says it was left.

    A budget is that with which it was begun, and counts from now on.

    Parameters
    ----------
    folder : path
        Where it was written.
    methods : sequence of str, Method or callable
        Those of your own that the study runs: a stored study starts no code that is not named
        again.
    jobs : int
        Processes; results do not depend on it.
    executor : concurrent.futures.Executor, optional
        What does the work, in place of own processes.
    progress : callable, optional
        It is given a `Progress` again and again.

    Returns
    -------
    Drift, Atlas, Stress or WorkPrecision
        The study, whole.

    Raises
    ------
    ForeignFile
        It is no study, was made by other versions, or is damaged.
    InUse
        Another process is writing it.
    StoppedEarly
        As for `heavytop.drift` and `heavytop.atlas`.
    WrongType
        It is no path.

    Notes
    -----
    Accuracy: ``tests/studies/test_study.py`` holds a study that was killed to one that was not,
    bit for bit.

    Examples
    --------
    >>> import heavytop as ht
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     scene = ht.load_scene("sicm-kicked")
    ...     first = ht.drift(scene, methods=["taylor-axis"], periods=10, samples=3, folder=place)
    ...     print(resume(place).document() == first.document())
    True
    """
    check_callable("progress", progress)
    path, jobs = path_of("folder", folder), whole("jobs", jobs, 1)
    parameters = _with_own_versions(Journal.read(path).parameters)
    if methods:
        from heavytop.studies.methods import load_methods

        load_methods(methods, str(path))
    for name, digest in parameters.get("own", {}).items():
        if own.registered(name).digest != digest:
            raise ForeignFile(f"{path}: {name} is not the code with which it was begun")
    try:
        study = study_of(parameters)
        study.tasks(parameters)
    except (LookupError, TypeError, ValueError, AttributeError) as fault:
        raise ForeignFile(f"{path / STUDY}: no study of this package ({fault})") from None
    how = {"jobs": jobs, "executor": executor, "on_progress": progress}
    with Journal.open(path, parameters) as journal:
        return study.complete(journal, **how)


def study_of(parameters: Parameters) -> Study:
    """Return the module for a kind of study.

    Raises
    ------
    ForeignFile
        The kind is unknown.
    """
    kind = parameters.get("kind")
    if kind not in STUDIES:
        raise ForeignFile(f"kind = {kind!r:.40}: not a kind of study known here")
    return cast(Study, import_module(STUDIES[kind]))


def _with_own_versions(parameters: Parameters) -> Parameters:
    """Return parameters with the versions of this process, of the libraries that they name."""
    here = _versions()
    return {**parameters, "versions": {name: here.get(name) for name in parameters["versions"]}}


_versions = cache(versions)


def _fraction(records: Sequence[TaskRecord]) -> float:
    done = sum(1.0 if r.ended else r.last.fraction for r in records)
    return done / len(records) if records else 1.0


def count_sent(executor: Executor) -> int:
    """Return how many tasks are sent to an executor: two for each worker, so that none waits.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(3) as pool:
    ...     count_sent(pool)
    6
    """
    if isinstance(executor, _Here):
        return 1
    known = (getattr(executor, name, None) for name in ("workers", "_max_workers"))
    return 2 * max(1, next((n for n in known if isinstance(n, int)), usable_cpus()))


class _Here(Executor):
    """Does what is submitted at once, in this process, until the signal to stop."""

    def __init__(self, stop: Event) -> None:
        self.stop = stop

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function now."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs, stop=self.stop))
        except Exception as fault:
            future.set_exception(fault)
        return future


def _submit(
    pool: Executor, study: Study, journal: Journal, task: str, slice_s: float
) -> Future[Chunk]:
    """The future of a slice; one that is lost already where the pool takes no more."""
    record = journal.record(task)
    seconds = max(slice_s, KILL_COST * record.seconds)
    work = (study.__name__, journal.parameters, task, record.last.checkpoint, seconds)
    try:
        return pool.submit(advance_task, *work, own.origins(journal.parameters.get("own", {})))
    except Exception as fault:  # shut down, broken, out of reach, no more processes
        future: Future[Chunk] = Future()
        future.set_exception(futures.BrokenExecutor(f"no new work is accepted: {_words(fault)}"))
        return future


def advance_task(
    module: str, parameters: Parameters, task: str, checkpoint: Any, seconds: float,
    methods: own.Origins = (), stop: Event | None = None,
) -> Chunk:  # fmt: skip
    """Advance a task for about so many seconds; in a worker, which may be far away."""
    own.load(methods)
    if found := differences(_with_own_versions(parameters), parameters):
        worker = f"process {os.getpid()} on {platform.node()}"
        raise ForeignFile(f"{worker}: this worker does not match the study: {'; '.join(found)}")
    last, rows, spent = Chunk(checkpoint), list[dict[str, Any]](), 0.0
    with _ONE_AT_A_TIME:
        end = time.monotonic() + seconds
        try:
            for last in cast(Study, import_module(module)).advance(parameters, task, checkpoint):
                rows += last.rows
                spent += last.seconds
                if last.done or time.monotonic() >= end or (stop and stop.is_set()):
                    return last._replace(rows=rows, seconds=spent)
        except errors.HeavyTopError as refusal:
            return last._replace(rows=rows, seconds=spent, fraction=1.0, failed=str(refusal))
    raise RuntimeError(f"{task}: ended before it was done")


def _loss(future: Future[Chunk]) -> BaseException | None:
    """How the worker was lost, if it was; what the task raised is raised here."""
    fault = futures.CancelledError() if future.cancelled() else future.exception()
    if fault is None or isinstance(fault, _LOST) or type(fault).__name__ in _LOST_BY_NAME:
        return fault
    raise fault


def _words(fault: BaseException) -> str:
    return " ".join(f"{type(fault).__name__}: {fault}".split())


@contextmanager
def stop_signal(*, at_once: bool = False) -> Iterator[Event]:
    """An event that Ctrl-C or SIGTERM sets; the second signal does what it did before.

    With `at_once` it raises KeyboardInterrupt too, which a library may swallow: the event stays.
    Only the main thread can listen to signals, and one that is ignored (nohup) stays ignored.
    """
    event, before = Event(), dict[int, Any]()

    def stop(number: int, frame: FrameType | None) -> None:
        event.set()
        signal.signal(number, before[number])
        if at_once:
            raise KeyboardInterrupt

    if current_thread() is main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop)
    try:
        yield event
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
