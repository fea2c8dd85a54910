"""The runner of a study: its tasks are advanced here, in processes, or by any executor.

Only the process that calls `run` writes the store. Records do not depend on who did the work,
nor on how often it was interrupted.
"""

from __future__ import annotations

import os
import platform
import signal
import time
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent import futures
from concurrent.futures import Executor, Future
from contextlib import closing, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from threading import Event, Lock, current_thread, main_thread
from types import FrameType
from typing import TYPE_CHECKING, Any, Final, Protocol, cast

from heavytop import errors
from heavytop.comparison import own
from heavytop.machine import usable_cpus, versions
from heavytop.scene.arguments import heard, path_of, whole
from heavytop.studies.executors import WORKER, Cluster, Processes
from heavytop.studies.store import (
    STUDY,
    Chunk,
    MemoryStore,
    Parameters,
    Record,
    Store,
    differences,
    reading,
)

if TYPE_CHECKING:
    from heavytop.results.drift import Drift
    from heavytop.results.stress import Stress
    from heavytop.results.work_precision import WorkPrecision
    from heavytop.studies.atlas import Atlas

KINDS: Final = {
    "drift": "heavytop.studies.drift",
    "atlas": "heavytop.studies.atlas",
    "stress": "heavytop.studies.stress",
    "work_precision": "heavytop.studies.work_precision",
    "certificate": "heavytop.studies.certificate",
}
"""The module of each kind of study. A file may name a kind, never a module."""

SLICE_S: Final = 3.0  # of work that a worker is sent; setting up a task takes some hundredths
TICK_S: Final = 0.1  # how long Ctrl-C may go unheard

# How executors say that a worker was killed; dask's exceptions by name, as it may be missing here.
# A process of a pool that heard a Ctrl-C meant for this one says KeyboardInterrupt.
_LOST: Final = (futures.BrokenExecutor, futures.CancelledError, KeyboardInterrupt)
_LOST_BY_NAME: Final = ("KilledWorker", "FutureCancelledError")

# The precision of mpmath and of python-flint is global, so that threads take turns.
_ONE_AT_A_TIME: Final = Lock()


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

    def complete(self, store: MemoryStore, **how: Any) -> Any:
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
    store: MemoryStore,
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    on_progress: Callable[[Progress], object] | None = None,
) -> None:
    """Bring the tasks of a study to their end.

    Parameters
    ----------
    store : MemoryStore or Store
        A `Store` is open for writing.
    jobs : int
        Processes; with 1 the work is done in this one.
    executor : concurrent.futures.Executor, optional
        What does the work, in place of own processes.
    on_progress : callable, optional
        It is given a `Progress` after every chunk.

    Raises
    ------
    StoppedEarly
        Ctrl-C or SIGTERM; a full disk; two workers that were killed on one task.
    ForeignFile
        A worker has other versions than the study; its kind is unknown, or a record cannot be read.
    """
    study = study_of(store.parameters)
    records = {task: _light(store.load(task)) for task in study.tasks(store.parameters)}
    started, before = time.monotonic(), _fraction(records)

    def tell() -> None:
        if on_progress is not None:
            done, ended = _fraction(records), sum(r.ended for r in records.values())
            elapsed = time.monotonic() - started
            on_progress(Progress(done, ended, len(records), elapsed, done - before))

    tell()
    left = {task: record.checkpoint for task, record in records.items() if not record.ended}
    store.seconds |= {task: 0.0 for task, checkpoint in left.items() if checkpoint is None}
    connected = executor if isinstance(executor, Cluster) else nullcontext()
    with _stop_signal() as stop, WORKER, connected:
        if executor is None and jobs == 1:
            chunks = _here(study, store.parameters, left, stop)
        else:
            chunks = _in_workers(study, store, left, executor or Processes(jobs), stop)
        with closing(chunks):
            for task, chunk in chunks:
                record = records[task].after(chunk)
                store.save(record)
                records[task] = _light(record)
                if task in store.seconds:
                    store.seconds[task] += chunk.seconds
                tell()
    if not all(record.ended for record in records.values()):
        raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", store.path)


def resume(
    folder: str | os.PathLike[str],
    *,
    methods: Sequence[str | own.Method | Callable[..., Any]] = (),
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Drift | Atlas | Stress | WorkPrecision:
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
    Accuracy: ``tests/studies/test_runner.py`` holds a study that was killed to one that was not,
    bit for bit.

    Examples
    --------
    >>> import heavytop as ht
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     scene = ht.load_scene("sicm-kicked")
    ...     first = ht.drift(scene, methods=["taylor-axis"], periods=10, samples=3, folder=place)
    ...     print(resume(place).document(costs=False) == first.document(costs=False))
    True
    """
    heard("progress", progress)
    path, jobs = path_of("folder", folder), whole("jobs", jobs, 1)
    parameters = with_versions_here(Store(path).parameters)
    study = study_of(parameters)
    if methods:
        from heavytop.studies.methods import admitted

        admitted(methods, str(path))
    for name, digest in parameters.get("own", {}).items():
        if own.admitted(name).digest != digest:
            raise errors.ForeignFile(f"{path}: {name} is not the code with which it was begun")
    with reading(path / STUDY):
        study.tasks(parameters)
    how = {"jobs": jobs, "executor": executor, "on_progress": progress}
    with Store.open(path, parameters) as store:
        found: Drift | Atlas | Stress | WorkPrecision = study.complete(store, **how)
    return found


def study_of(parameters: Parameters) -> Study:
    """Return the module for a kind of study.

    Raises
    ------
    ForeignFile
        The kind is unknown.
    """
    kind = parameters.get("kind")
    if kind not in KINDS:
        raise errors.ForeignFile(f"kind = {kind!r:.40}: not a kind of study known here")
    return cast(Study, import_module(KINDS[kind]))


def with_versions_here(parameters: Parameters) -> Parameters:
    """Return parameters with the versions of this process, of the libraries that they name."""
    return {
        **parameters,
        "versions": {name: _versions().get(name) for name in parameters["versions"]},
    }


@cache
def _versions() -> dict[str, str | None]:
    return versions()


def _light(record: Record) -> Record:
    """A record as it is kept in memory: without rows, once they are whole."""
    return replace(record, rows=[]) if record.ended else record


def _fraction(records: dict[str, Record]) -> float:
    return sum(r.fraction for r in records.values()) / len(records) if records else 1.0


def _here(
    study: Study, parameters: Parameters, left: dict[str, Any], stop: Event
) -> Generator[tuple[str, Chunk]]:
    """Yield the chunks of tasks, computed in this process."""
    for task, checkpoint in left.items():
        for chunk in _advance(study, parameters, task, checkpoint):
            yield task, chunk
            if stop.is_set():
                return


def _in_workers(
    study: Study, store: MemoryStore, left: dict[str, Any], pool: Executor, stop: Event
) -> Generator[tuple[str, Chunk]]:
    """Yield the chunks of tasks, computed in slices by the workers of a pool."""
    waiting, lost = deque(left), Counter[str]()
    running: dict[Future[list[Chunk]], str] = {}
    try:
        while (waiting or running) and not stop.is_set():
            # After a loss all tasks it may be due to run alone, each for a slice.
            room = 1 if lost else 2 * workers(pool)
            while waiting and len(running) < room:
                task = waiting.popleft()
                running[_sent(pool, study.__name__, store.parameters, task, left[task])] = task
            for future in futures.wait(running, TICK_S, futures.FIRST_COMPLETED).done:
                task = running.pop(future)
                if fault := _loss(future):
                    lost[task] += 1
                    if lost[task] > 1:
                        why = f"the worker on {task} was lost twice ({_words(fault)})"
                        raise errors.StoppedEarly(
                            errors.Stop.WORKER_LOST, why, store.path
                        ) from fault
                    waiting.appendleft(task)
                    if isinstance(pool, Processes):
                        pool.kill()
                        pool = Processes(workers(pool))
                    continue
                del lost[task]
                for chunk in future.result():
                    yield task, chunk
                left[task] = chunk.checkpoint
                if not chunk.done and chunk.failed is None:
                    (waiting.append if lost else waiting.appendleft)(task)
    finally:
        for future in running:
            future.cancel()
        if isinstance(pool, Processes):
            pool.kill()


def workers(executor: Executor) -> int:
    """Return how many workers an executor has: what it says, or as many as processors are here.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(3) as pool:
    ...     workers(pool)
    3
    """
    known = (getattr(executor, name, None) for name in ("workers", "_max_workers"))
    return max(1, next((n for n in known if isinstance(n, int)), usable_cpus()))


def _sent(
    pool: Executor, module: str, parameters: Parameters, task: str, checkpoint: Any
) -> Future[list[Chunk]]:
    """The future of a slice; one that is lost already where the pool takes no more."""
    try:
        methods = own.passes(parameters.get("own", {}))
        return pool.submit(_slice, module, parameters, task, checkpoint, SLICE_S, methods)
    except Exception as fault:  # shut down, broken, out of reach, no more processes
        future: Future[list[Chunk]] = Future()
        future.set_exception(futures.BrokenExecutor(f"no new work is accepted: {_words(fault)}"))
        return future


def _slice(
    module: str, parameters: Parameters, task: str, checkpoint: Any, seconds: float,
    methods: Sequence[tuple[str, str, str]] = (),
) -> list[Chunk]:  # fmt: skip
    """Advance a task for about so many seconds; in a worker, which may be far away."""
    own.let_pass(methods)
    if found := differences(with_versions_here(parameters), parameters):
        worker = f"process {os.getpid()} on {platform.node()}"
        raise errors.ForeignFile(
            f"{worker}: this worker does not match the study: {'; '.join(found)}"
        )
    chunks = []
    with _ONE_AT_A_TIME:
        end = time.monotonic() + seconds
        study = cast(Study, import_module(module))
        for chunk in _advance(study, parameters, task, checkpoint):
            chunks.append(chunk)
            if time.monotonic() >= end:
                break
    return chunks


def _advance(study: Study, parameters: Parameters, task: str, checkpoint: Any) -> Iterator[Chunk]:
    """The chunks of a task; what it refuses is the last one."""
    try:
        for chunk in study.advance(parameters, task, checkpoint):
            yield chunk
            if chunk.done:
                return
    except errors.HeavyTopError as refusal:
        yield Chunk(failed=str(refusal))
        return
    raise RuntimeError(f"{task}: ended before it was done")


def _loss(future: Future[list[Chunk]]) -> BaseException | None:
    """How the worker was lost, if it was; what the task raised is raised here."""
    fault = futures.CancelledError() if future.cancelled() else future.exception()
    if fault is None or isinstance(fault, _LOST) or type(fault).__name__ in _LOST_BY_NAME:
        return fault
    raise fault


def _words(fault: BaseException) -> str:
    return " ".join(f"{type(fault).__name__}: {fault}".split())


@contextmanager
def _stop_signal() -> Iterator[Event]:
    """An event that Ctrl-C or SIGTERM sets; the second signal does what it did before.

    Only the main thread can listen to signals, and one that is ignored (nohup) stays ignored.
    """
    event = Event()
    before: dict[int, Any] = {}

    def restore() -> None:
        while before:
            signal.signal(*before.popitem())

    def struck(number: int, frame: FrameType | None) -> None:
        event.set()
        restore()

    if current_thread() is main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, struck)
    try:
        yield event
    finally:
        restore()
