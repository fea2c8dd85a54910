"""Who does the work: processes here, or the workers of a dask cluster.

Worker processes do not run the caller's script and do not outlive their parent. On a cluster only
this package must be installed where the workers are; a worker does one task at a time, so it is
started with one thread: ``dask worker ADDRESS --nworkers 8 --nthreads 1``.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, MutableMapping
from concurrent import futures
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from importlib.util import find_spec
from types import ModuleType
from typing import Any, Final, Self, TypeVar

from heavytop.errors import HeavyTopError, MissingPackage, NoScheduler

SPAWN: Final = multiprocessing.get_context("spawn")  # a fork would copy locks of other threads
SET_UP_S: Final = 120.0  # for the first call of a method, which may compile and import
GRACE_S: Final = 2.0  # for workers to end processes of their own
TIMEOUT_S: Final = 10.0  # until somebody answers, and until there is a worker

T = TypeVar("T")

# --- worker processes ------------------------------------------------------------------------


@contextmanager
def _changed(table: MutableMapping[str, T], key: str, value: T) -> Iterator[None]:
    """Let a key have another value inside this block."""
    before = table.get(key)
    table[key] = value
    try:
        yield
    finally:
        if before is None:
            del table[key]
        else:
            table[key] = before


@contextmanager
def starting() -> Iterator[None]:
    """Start processes inside this block.

    They do not import the caller's script again, which may have no ``if __name__ ==
    "__main__"``; nor modules from the current folder; and Ctrl-C is left to this process. A worker
    of dask, which is a daemon, may start them too, as they end with it.
    """
    mine = getattr(multiprocessing.current_process(), "_config", {})
    with (
        _uninterrupted(),
        _changed(sys.modules, "__main__", ModuleType("__main__")),
        _changed(os.environ, "PYTHONSAFEPATH", "1"),
        _changed(mine, "daemon", False),
    ):
        yield


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Hear no Ctrl-C inside this block, nor ever in a process that is started there."""
    if not hasattr(signal, "pthread_sigmask"):  # not POSIX
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Processes(ProcessPoolExecutor):
    """A pool of so many worker processes."""

    def __init__(self, workers: int) -> None:
        super().__init__(workers, SPAWN, follow_parent)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function."""
        with starting():
            return super().submit(fn, *args, **kwargs)

    def kill(self, grace_s: float = 0.0) -> list[int | None]:
        """End all workers, whatever they are at; return how each of them left.

        In a time of grace those that have a process of their own end it, and leave nothing behind.
        """
        there = list((self._processes or {}).values())
        if grace_s:
            for process in there:
                process.terminate()
            for process in there:
                process.join(grace_s)
        for process in there:
            process.kill()
        self.shutdown(cancel_futures=True)
        return [process.exitcode for process in there]


def follow_parent() -> None:
    """In a worker: end with the parent, and print where it does not disturb results."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    signal.signal(signal.SIGTERM, _end)
    with suppress(OSError):  # stderr may be closed
        os.dup2(2, 1)


def _end(*_: object) -> None:
    TIMED_WORKER.close()
    gc.collect()  # what is left of its pools gives their semaphores back
    os._exit(1)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


# --- calls with a limit of time --------------------------------------------------------------
# In a process that is killed when its time is up: nothing less helps, as a solver that hangs inside
# its own compiled code hears no signal.


class TimedOut(HeavyTopError):
    """A call that did not return in time; its process was killed."""


class Lost(HeavyTopError):
    """A process that died of a call, or an exception in it; the message says which."""


_AT_WORK: Final[list[Iterator[Any]]] = []  # in a worker: what it goes through


def _begin(function: Callable[..., Iterator[T]], *args: Any) -> T:
    """In a worker: begin with what a function yields."""
    _AT_WORK[:] = [function(*args)]
    return next(_AT_WORK[0])  # type: ignore[no-any-return]


def _go_on() -> Any:
    return next(_AT_WORK[0])


class TimedWorker:
    """One process for calls; after one that had to be killed, or died, the next call starts one."""

    def __init__(self) -> None:
        self._pool: Processes | None = None

    def __enter__(self) -> Self:
        """Return the worker."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process."""
        self.close()

    def call(self, function: Callable[..., T], *args: Any, timeout: float | None = None) -> T:
        """Return what a function of a module returns there, within so many seconds.

        Starting the process takes none of them.

        Raises
        ------
        TimedOut
            It did not return in time.
        Lost
            The process died of it, or it raised something; what is a HeavyTopError is raised here.
        """
        if self._pool is None:
            self._pool = Processes(1)
            self._pool.submit(os.getpid).result()  # it is ready
        future = self._pool.submit(function, *args)
        if not futures.wait([future], timeout).done:
            self.close()
            raise TimedOut(f"it did not return within {timeout:g} s")
        fault = future.exception()
        if isinstance(fault, futures.BrokenExecutor):
            raise Lost(f"its process was lost: {_how_it_left(*self.close())}")
        if fault is not None and not isinstance(fault, HeavyTopError):
            raise Lost(f"its process was lost: {type(fault).__name__}: {fault}")
        return future.result()  # type: ignore[no-any-return]

    def stages(
        self, function: Callable[..., Iterator[T]], *args: Any, limits: Iterable[float]
    ) -> Iterator[T]:
        """Yield what a generator of a module yields there, each within its limit [s].

        Raises
        ------
        TimedOut, Lost
            As of `call`.
        """
        each = iter(limits)
        yield self.call(_begin, function, *args, timeout=next(each))
        for limit in each:
            yield self.call(_go_on, timeout=limit)

    def close(self) -> list[int | None]:
        """End the process, at once; return how it left."""
        pool, self._pool = self._pool, None
        return [] if pool is None else pool.kill()


def _how_it_left(code: int | None = None) -> str:
    if code is not None and code < 0:
        return f"killed by {signal.Signals(-code).name}"
    return f"left with code {code or 0}"


TIMED_WORKER: Final = TimedWorker()
"""Of this process: it does one task at a time, and so needs one."""

# --- a dask cluster ---------------------------------------------------------------------------


def executor_at(address: str, *, timeout_s: float = TIMEOUT_S) -> Cluster:
    """The executor of a dask scheduler, connected while a study or a ``with`` block uses it.

    Parameters
    ----------
    address : str
        Such as ``tcp://192.168.0.2:8786``.
    timeout_s : float
        How long to wait for the scheduler, and then for its first worker [s].

    Returns
    -------
    concurrent.futures.Executor
        For the argument ``executor`` of `drift`, `stress`, `atlas`, `certify` and `resume`. In a
        ``with`` block several studies share one connection.

    Raises
    ------
    NoScheduler
        When it connects: nobody answers there in time, or there is no worker.
    MissingPackage
        When it connects: dask is not installed here.

    Examples
    --------
    >>> executor = executor_at("tcp://192.168.0.2:8786")
    >>> executor.workers  # it is not connected yet
    0
    """
    return Cluster(address, timeout_s)


@contextmanager
def _connected(address: str, timeout_s: float) -> Iterator[tuple[Any, Executor]]:
    """A client of a dask scheduler and its executor, closed in the end."""
    if find_spec("distributed") is None:
        raise MissingPackage("a cluster", ["distributed"], "cluster")
    from distributed import Client

    with ExitStack() as stack:
        try:
            client = stack.enter_context(Client(address, timeout=timeout_s, set_as_default=False))
            client.wait_for_workers(1, timeout=timeout_s)
        except (OSError, ValueError, TypeError) as fault:  # not reached; not an address; no worker
            why = "no dask scheduler with a worker answers there"
            raise NoScheduler(f"{address}: {why} ({fault})") from None
        yield client, client.get_executor(pure=False)  # no result of an earlier call


class Cluster(Executor):
    """The workers of a scheduler, as many as there are at the moment.

    It is connected inside ``with`` blocks, of which each study has one: the outermost closes it.
    """

    def __init__(self, address: str, timeout_s: float) -> None:
        self._where = address, timeout_s
        self._blocks = 0  # that are entered
        self._client: Any = None

    def __enter__(self) -> Self:
        """Connect, unless it is connected."""
        if not self._blocks:
            self._connection = _connected(*self._where)
            self._client, self._executor = self._connection.__enter__()
        self._blocks += 1
        return self

    def __exit__(self, *fault: Any) -> None:
        """Close the connection, if no other block uses it."""
        self._blocks -= 1
        if not self._blocks:
            self._client = None
            self._connection.__exit__(*fault)

    @property
    def workers(self) -> int:
        """How many worker processes there are now; none when the scheduler has gone."""
        try:
            return len(self._client.nthreads())
        except Exception:  # closed, cut off, timed out
            return 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function."""
        if not self._blocks:
            raise RuntimeError("not connected: submit inside a with block")
        return self._executor.submit(fn, *args, **kwargs)
