"""Doing the tasks of a study, here or in several workers, while one process writes."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

from heavytop.errors import ForeignFile, HeavyTopError, Stop
from heavytop.studies.ledger.book import Book, Memory
from heavytop.studies.ledger.effort import LIVES, TICK_S, BrokenTask, Effort, Show
from heavytop.studies.ledger.errands import Errands
from heavytop.studies.ledger.folder import Folder
from heavytop.studies.ledger.halt import Halt
from heavytop.studies.ledger.hand import Hand, Inbox, Message
from heavytop.studies.ledger.kinds import follower
from heavytop.studies.ledger.piece import Piece
from heavytop.studies.ledger.study import Study


def run(
    study: Study,
    folder: Folder | None = None,
    *,
    jobs: int = 1,
    tasks: Sequence[str] | None = None,
    executor: Executor | None = None,
    on_progress: Show | None = None,
) -> Book:
    """Do what is left of a study.

    Parameters
    ----------
    study : Study
    folder : Folder, optional
        Where everything is written down, open for writing; else it is kept in memory.
    jobs : int
        Worker processes; with 1 the work is done here. Results do not depend on it.
        With an executor it means nothing.
    tasks : sequence of str, optional
        Do these alone, such as a `shard` of them; the folder is that of the whole study.
    executor : concurrent.futures.Executor, optional
        Its workers do the tasks, wherever they are; results do not depend on it either.
    on_progress : callable, optional
        It is given a `Progress` after every piece.

    Returns
    -------
    Book
        The folder, or the memory: where every task stands and its rows.

    Raises
    ------
    ValueError
        jobs < 1; a task that the study does not have; with an executor, a study whose kind is
        another module's.
    StoppedEarly
        Ctrl-C or SIGTERM; the disk is full; the worker of one task died twice; the executor takes
        no more work. What was done is in the folder, and running it again goes on from there.
    ForeignStudy
        The folder holds another study.
    ForeignWorker
        A worker of the executor has other versions than the study.
    ForeignFile
        The checkpoint of a task is not one that the task writes.
    BrokenTask
        A bug in a task, in a worker; here the exception itself.
    """
    if jobs < 1:
        raise ValueError(f"jobs = {jobs}: at least 1")
    book: Book = Memory() if folder is None else folder.expect(study.identity)
    effort = Effort(study, book, on_progress, tasks)
    with Halt() as halt:
        if executor is not None:
            Errands(effort, halt, executor).work()
        elif jobs == 1:
            _alone(effort, halt)
        else:
            _Crew(effort, halt).work(jobs)
    return book


def _alone(effort: Effort, halt: Halt) -> None:
    """Do the tasks one after the other in this process."""
    for task in effort.left:
        _follow(effort, halt, task)


def _follow(effort: Effort, halt: Halt, task: str) -> None:
    book = effort.book
    pieces = _pieces(effort.study, task, book.entry(task).checkpoint)
    while not book.entry(task).ended:
        if halt.asked:
            raise effort.interrupted()
        try:
            piece = next(pieces, None)
        except ForeignFile as fault:
            raise effort.foreign(task, str(fault)) from None
        except HeavyTopError as refusal:
            effort.fail(task, str(refusal))
            return
        if piece is None:
            raise BrokenTask(f"{task}: it ended before it was done")
        effort.record(task, Piece.of_json(piece.as_json()))  # as a worker would send it


def _pieces(study: Study, task: str, checkpoint: dict[str, Any] | None) -> Iterator[Piece]:
    yield from follower(study.module).follow(study.identity, task, checkpoint)


class _Crew:
    """Workers, the tasks they have, and those that wait."""

    def __init__(self, effort: Effort, halt: Halt) -> None:
        self._effort, self._halt = effort, halt
        self._inbox: Inbox = SimpleQueue()
        self._waiting = deque(effort.left)
        self._hands: set[Hand] = set()
        self._deaths: Counter[str] = Counter()

    def work(self, jobs: int) -> None:
        """Do the tasks; however this ends, no worker is left."""
        try:
            for _ in range(min(jobs, len(self._waiting))):
                self._give(self._hire(), self._waiting.popleft())
            while self._hands:
                self._listen()
        finally:
            self._dismiss()

    def _hire(self) -> Hand:
        try:
            hand = Hand(self._effort.study, self._inbox)
        except OSError as fault:  # no memory, no more processes
            why = f"cannot start a worker: {fault.strerror or fault}"
            raise self._effort.stopped(Stop.WORKER_LOST, why) from fault
        self._hands.add(hand)
        return hand

    def _give(self, hand: Hand, task: str) -> None:
        hand.take(task, self._effort.book.entry(task).checkpoint)

    def _listen(self) -> None:
        """Take one message, or see that an end is asked for."""
        if self._halt.asked:
            self._stop()
            return
        with suppress(Empty):
            self._take(*self._inbox.get(timeout=TICK_S))

    def _stop(self) -> None:
        self._settle()
        if not all(self._effort.book.entry(t).ended for t in self._effort.left):
            raise self._effort.interrupted()

    def _settle(self) -> None:
        """End the workers, and write down what they had sent."""
        self._dismiss()
        while not self._inbox.empty():
            hand, message = self._inbox.get()
            if message is not None:
                self._effort.take(hand.task, message)

    def _dismiss(self) -> None:
        while self._hands:
            self._hands.pop().end()

    def _take(self, hand: Hand, message: Message) -> None:
        if message is None:
            self._bury(hand)
            return
        self._effort.take(hand.task, message)
        if not self._effort.book.entry(hand.task).ended:
            hand.go_on()
        elif self._waiting:
            self._give(hand, self._waiting.popleft())
        else:
            self._hands.remove(hand)
            hand.end()

    def _bury(self, hand: Hand) -> None:
        """Go on with the task of a dead worker in a new one, once."""
        if hand not in self._hands:  # it was sent away
            return
        self._hands.remove(hand)
        how, task = hand.fate(), hand.task
        hand.end()
        self._deaths[task] += 1
        if self._deaths[task] >= LIVES:
            self._settle()
            why = f"the worker on {task} died twice ({how}; out of memory?)"
            raise self._effort.stopped(Stop.WORKER_LOST, why)
        self._give(self._hire(), task)
