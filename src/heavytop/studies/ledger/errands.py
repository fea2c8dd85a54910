"""Sending out errands: the tasks of a study done by an executor, while this process writes."""

from __future__ import annotations

import json
import time
import warnings
from collections import Counter, deque
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextlib import suppress

from heavytop.errors import NoWorkerWarning, Stop
from heavytop.machine import usable_cpus
from heavytop.studies.ledger.effort import LIVES, TICK_S, Effort
from heavytop.studies.ledger.errand import errand, order
from heavytop.studies.ledger.halt import Halt
from heavytop.studies.ledger.kinds import module_of

SECONDS = 5.0  # of an errand: setting up a task again costs some hundredths of one
PATIENCE_S = 60.0  # without a worker: nobody else would notice that none comes
NOTICED_S = 5.0  # without a worker, before that is said: one may be changing places with another
AHEAD = 2  # errands a worker: it has the next one before it is asked what it did

# How an executor says that a worker has gone. dask's is known by its name, which needs no dask;
# KeyboardInterrupt is a pool process that heard a Ctrl-C meant for this one.
_LOST = (BrokenExecutor, CancelledError, KeyboardInterrupt)
_LOST_BY_NAME = frozenset({"KilledWorker", "FutureCancelledError"})


class Errands:
    """The tasks of a study that wait, and those that are away."""

    def __init__(self, effort: Effort, halt: Halt, executor: Executor) -> None:
        if module_of(effort.study.identity) != effort.study.module:
            raise ValueError("a study of another module: errands go by the kind of a study")
        self._effort, self._halt, self._executor = effort, halt, executor
        self._waiting = deque(effort.left)
        self._away: dict[Future[str], str] = {}
        self._losses: Counter[str] = Counter()
        self._seen = time.monotonic()  # a worker, or somebody who does not count them
        self._told = False  # that none is seen

    def work(self) -> None:
        """Do the tasks; however this ends, no errand waits to be begun."""
        try:
            self._send()
            while self._away:
                if self._halt.asked:
                    self._settle()
                    self._stop()
                self._listen()
                self._send()
        finally:
            self._recall()

    def _send(self) -> None:
        """Give the workers what they have room for: no more results than that are in memory."""
        while self._waiting and len(self._away) < AHEAD * workers(self._executor):
            task = self._waiting.popleft()
            self._away[self._submitted(task)] = task

    def _submitted(self, task: str) -> Future[str]:
        effort = self._effort
        text = order(effort.study.identity, task, effort.book.entry(task).checkpoint, SECONDS)
        try:
            return self._executor.submit(errand, text)
        except Exception as fault:  # broken, shut down, out of reach: each has its own kinds
            why = f"the executor takes no errand: {_said(fault)}"
            raise self._lost(why) from fault

    def _listen(self) -> None:
        done, _ = wait(self._away, timeout=TICK_S, return_when=FIRST_COMPLETED)
        for future in done:
            self._take(self._away.pop(future), future)
        self._expect_workers(heard=bool(done))

    def _expect_workers(self, heard: bool) -> None:
        """End the study when an executor that counts its workers has had none for long."""
        if heard or getattr(self._executor, "workers", 1) != 0:
            self._seen, self._told = time.monotonic(), False
            return
        alone = time.monotonic() - self._seen
        if alone > PATIENCE_S:
            raise self._lost(f"no worker for {PATIENCE_S:.0f} s")
        if alone > NOTICED_S and not self._told:
            self._told = True
            left = f"{PATIENCE_S - alone:.0f} s"
            text = f"no worker is left: unless one comes, the study ends in {left}"
            warnings.warn(text, NoWorkerWarning, stacklevel=2)

    def _take(self, task: str, future: Future[str]) -> None:
        """Write down what came back; what has not ended is the next to go out again."""
        fault = _fault(future)
        if fault is None:
            self._write(task, future)
        elif _is_loss(fault):
            self._count(task, fault)
        else:
            raise self._lost(f"the errand for {task} did not come back: {_said(fault)}") from fault
        if not self._effort.book.entry(task).ended:
            self._waiting.appendleft(task)

    def _write(self, task: str, future: Future[str]) -> None:
        for message in json.loads(future.result()):
            self._effort.take(task, message)

    def _count(self, task: str, fault: BaseException) -> None:
        self._losses[task] += 1
        if self._losses[task] >= LIVES:
            raise self._lost(f"the worker on {task} was lost twice ({_said(fault)})") from fault

    def _lost(self, why: str) -> Exception:
        self._settle()
        return self._effort.stopped(Stop.WORKER_LOST, why)

    def _stop(self) -> None:
        if not all(self._effort.book.entry(t).ended for t in self._effort.left):
            raise self._effort.interrupted()

    def _settle(self) -> None:
        """Call off what has not begun, and write down what has come back."""
        for future in self._away:
            _call_off(future)
        while self._away:
            future, task = self._away.popitem()
            if future.done() and _fault(future) is None:
                self._write(task, future)

    def _recall(self) -> None:
        while self._away:
            _call_off(self._away.popitem()[0])


def workers(executor: Executor) -> int:
    """How many workers an executor has: what it says, or as many as processors are here.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(3) as pool:
    ...     workers(pool)
    3
    """
    for name in ("workers", "_max_workers"):  # ours; those of Python, and those that imitate them
        found = getattr(executor, name, None)
        if isinstance(found, int):
            return max(1, found)
    return usable_cpus()


def _call_off(future: Future[str]) -> None:
    """Call off an errand; an executor that is out of reach cannot be told."""
    with suppress(Exception):
        future.cancel()


def _fault(future: Future[str]) -> BaseException | None:
    return CancelledError("called off") if future.cancelled() else future.exception()


def _is_loss(fault: BaseException) -> bool:
    names = {kind.__name__ for kind in type(fault).__mro__}
    return isinstance(fault, _LOST) or not names.isdisjoint(_LOST_BY_NAME)


def _said(fault: BaseException) -> str:
    return " ".join(f"{type(fault).__name__}: {fault}".split())
