"""Run the tasks of a study in any executor, and resume a study that was killed.

A kind of study is a module with three functions; `STUDIES` has all modules:

    tasks(parameters) -> names of the tasks, always the same and in the same order
    advance(parameters, task, checkpoint) -> Iterator[Chunk]    # after a checkpoint, None at first
    complete(journal, **how) -> Result    # runs what is left, with arguments of `run`

Parameters are for JSON, with ``kind``, the name of the module, and ``versions`` of what it needs.
The rows of a task depend on parameters and task alone, not on who did the work or how often it was
interrupted. A HeavyTopError in `advance` ends a task as failed.
"""

from __future__ import annotations

import math
import os
import platform
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent import futures
from concurrent.futures import Executor, Future
from contextlib import closing
from functools import cache
from importlib import import_module
from threading import Event, Lock
from types import ModuleType
from typing import Any, Final, NamedTuple

from heavytop import errors
from heavytop.comparison import user
from heavytop.doctor import versions
from heavytop.errors import ForeignFile
from heavytop.results.base import Result
from heavytop.results.registry import RESULTS
from heavytop.scene.arguments import JOBS, path_of, read_argument
from heavytop.studies.journal import RUN, STUDY, Chunk, Journal, Parameters, differences
from heavytop.studies.workers import (
    TIMED_WORKER,
    InProcess,
    Processes,
    check_how,
    sent_tasks,
    stop_signal,
)
from heavytop.text import in_a_line

_MODULES: Final = [each.study for each in RESULTS.values() if each.study]
STUDIES: Final = {name.rpartition(".")[2]: f"heavytop.{name}" for name in _MODULES}
"""The module of each kind of study. A file may name a kind, never a module."""

SLICE_S: Final = 1.0  # of work between two lines of the journal
KILL_COST: Final = 0.02  # share of a task's work that a kill may cost: slices grow with the task
TICK_S: Final = 0.1  # the longest wait between two looks for Ctrl-C

# Exceptions of executors whose worker was killed; dask's by name, as it may be missing here.
# A process of a pool that took a Ctrl-C meant for this one says KeyboardInterrupt.
_LOST: Final = (futures.BrokenExecutor, futures.CancelledError, KeyboardInterrupt)
_LOST_BY_NAME: Final = ("KilledWorker", "FutureCancelledError")

# The precision of mpmath and of python-flint is global, so that threads take turns.
_ONE_AT_A_TIME: Final = Lock()


class Progress(NamedTuple):
    """How far a study is.

    Attributes
    ----------
    fraction : float
        Part of the whole study that is done, 0 to 1.
    ended, tasks : int
        How many tasks are at their end, and how many there are.
    """

    fraction: float
    ended: int
    tasks: int


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
    end = time.monotonic() + (math.inf if budget is None else budget)

    def show() -> None:
        if on_progress is not None:
            done = [1.0 if each.ended else each.last.fraction for each in records] or [1.0]
            ended = sum(each.ended for each in records)
            on_progress(Progress(sum(done) / len(done), ended, len(records)))

    show()
    waiting = deque(task for task in tasks if not journal.record(task).ended)
    running: dict[Future[Chunk], str] = {}
    lost = Counter[str]()
    with stop_signal() as stop, closing(TIMED_WORKER):
        pool = executor or (InProcess(stop) if jobs == 1 else Processes(jobs))
        try:
            while (waiting or running) and not stop.is_set():
                if time.monotonic() >= end:
                    waiting.clear()
                # After a loss all tasks that may have caused it run alone, each for a slice.
                while waiting and len(running) < (1 if lost else sent_tasks(pool)):
                    task = waiting.popleft()
                    running[_submit(pool, study, journal, task, slice_s)] = task
                for future in futures.wait(running, TICK_S, futures.FIRST_COMPLETED).done:
                    task = running.pop(future)
                    if fault := _loss(future):
                        lost[task] += 1
                        if lost[task] > 1:
                            why = f"the worker on {task} was lost twice ({in_a_line(fault)})"
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
                pool.kill() if running else pool.close()
    if stop.is_set() and not all(record.ended for record in records):
        raise errors.StoppedEarly(errors.Stop.INTERRUPTED, "interrupted", journal.folder)


def resume(
    folder: str | os.PathLike[str],
    *,
    methods: Sequence[str | user.Method | Callable[..., Any]] = (),
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Result:
    """Continue a study of any kind where its folder says it was left.

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
    Drift, Atlas, Stress, WorkPrecision, Certificate or Validation
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
    check_how(progress, executor)
    path, jobs = path_of("folder", folder), read_argument("jobs", jobs, JOBS)
    parameters = _update_versions(Journal.read(path).parameters)
    if methods:
        from heavytop.studies.methods import read_methods

        errors.refuse(read_methods(str(path), methods, str)[1])
    user.expect_named(parameters.get("own", {}))
    for name, digest in parameters.get("own", {}).items():
        if user.registered(name).digest != digest:
            raise ForeignFile(f"{path}: {name} is not the code with which it was begun")
    try:
        study = study_of(parameters)
        study.tasks(parameters)
    except (LookupError, TypeError, ValueError, AttributeError) as fault:
        raise ForeignFile(f"{path / STUDY}: no study of this package ({fault})") from None
    how = {"jobs": jobs, "executor": executor, "on_progress": progress}
    with Journal.open(path, parameters) as journal:
        return study.complete(journal, **how)  # type: ignore[no-any-return]


def study_of(parameters: Parameters) -> ModuleType:
    """Return the module for a kind of study.

    Raises
    ------
    ForeignFile
        The kind is unknown.
    """
    kind = parameters.get("kind")
    if kind not in STUDIES:
        run = "a run, which `heavytop resume`, or heavytop.extend of its trajectory, continues"
        what = run if kind == RUN else "not a kind of study known here"
        raise ForeignFile(f"kind = {kind!r:.40}: {what}")
    return import_module(STUDIES[kind])


def _update_versions(parameters: Parameters) -> Parameters:
    """Return parameters with the versions that the libraries they name have in this process."""
    here = _versions()
    return {**parameters, "versions": {name: here.get(name) for name in parameters["versions"]}}


_versions = cache(versions)


def _submit(
    pool: Executor, study: ModuleType, journal: Journal, task: str, slice_s: float
) -> Future[Chunk]:
    """Return the future of a slice; where the pool takes no more work, one that is lost already."""
    record = journal.record(task)
    seconds = max(slice_s, KILL_COST * record.seconds)
    work = (study.__name__, journal.parameters, task, record.last.checkpoint, seconds)
    try:
        return pool.submit(advance_task, *work, user.origins(journal.parameters.get("own", {})))
    except Exception as fault:  # shut down, broken, out of reach, no more processes
        future: Future[Chunk] = Future()
        future.set_exception(futures.BrokenExecutor(f"no new work is accepted: {in_a_line(fault)}"))
        return future


def advance_task(
    module: str, parameters: Parameters, task: str, checkpoint: Any, seconds: float,
    methods: user.Origins = (), stop: Event | None = None,
) -> Chunk:  # fmt: skip
    """In a worker, anywhere: advance a task for about so many seconds, and return one chunk."""
    user.load(methods)
    if found := differences(_update_versions(parameters), parameters):
        worker = f"process {os.getpid()} on {platform.node()}"
        raise ForeignFile(f"{worker}: this worker does not match the study: {'; '.join(found)}")
    last, rows, spent = Chunk(checkpoint), list[dict[str, Any]](), 0.0
    chunks: Iterator[Chunk] = import_module(module).advance(parameters, task, checkpoint)
    with _ONE_AT_A_TIME:
        end = time.monotonic() + seconds
        try:
            for last in chunks:
                rows += last.rows
                spent += last.seconds
                if last.done or time.monotonic() >= end or (stop and stop.is_set()):
                    return last._replace(rows=rows, seconds=spent)
        except errors.HeavyTopError as refusal:
            return last._replace(rows=rows, seconds=spent, fraction=1.0, failed=str(refusal))
    raise RuntimeError(f"{task}: ended before it was done")


def _loss(future: Future[Chunk]) -> BaseException | None:
    """Return the exception of a lost worker, or None; what the task raised is raised here."""
    fault = futures.CancelledError() if future.cancelled() else future.exception()
    if fault is None or isinstance(fault, _LOST) or type(fault).__name__ in _LOST_BY_NAME:
        return fault
    raise fault
