"""Executors of tasks (this process, others here, a dask cluster), signals, calls with time limits.

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
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from multiprocessing import connection
from multiprocessing.util import Finalize
from types import FrameType, ModuleType
from typing import Any, Final, TypeVar, cast

from heavytop.doctor import usable_cpus
from heavytop.errors import HeavyTopError, MissingPackage, NoScheduler
from heavytop.scene.arguments import check_callable, expect

SPAWN: Final = multiprocessing.get_context("spawn")  # a fork would copy locks of other threads
STOPS: Final = (signal.SIGINT, signal.SIGTERM)
SET_UP_S: Final = 120.0  # for the first call of a method, which may compile and import
GRACE_S: Final = 0.5  # after Ctrl-C, for what is done to be written down
CLOSING_S: Final = 5.0  # with a worker that has nothing to do any more, until it ends
TIMEOUT_S: Final = 10.0  # until a scheduler answers, and until there is a worker

T = TypeVar("T")

# --- worker processes ------------------------------------------------------------------------


@contextmanager
def start_processes() -> Iterator[None]:
    """A block in which worker processes are started.

    They do not import the caller's script again, which may have no ``if __name__ ==
    "__main__"``, nor modules from the current folder. Ctrl-C and SIGTERM, which the whole process
    group gets, are handled by this process alone. A worker of dask, which is a daemon, may start
    processes too, as they end with it.
    """
    config = getattr(multiprocessing.current_process(), "_config", {})
    tables: tuple[Any, ...] = sys.modules, os.environ, config
    keys = "__main__", "PYTHONSAFEPATH", "daemon"
    before = [table.get(key) for table, key in zip(tables, keys, strict=True)]
    posix = hasattr(signal, "pthread_sigmask")
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, STOPS) if posix else set()
    try:
        for table, key, value in zip(tables, keys, (ModuleType(keys[0]), "1", False), strict=True):
            table[key] = value
        yield
    finally:
        for table, key, value in zip(tables, keys, before, strict=True):
            if value is None:
                del table[key]
            else:
                table[key] = value
        if posix:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


class Processes(ProcessPoolExecutor):
    """A pool of so many worker processes."""

    def __init__(self, workers: int) -> None:
        super().__init__(workers, SPAWN, follow_parent)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function."""
        with start_processes():
            return super().submit(fn, *args, **kwargs)

    @property
    def processes(self) -> list[Any]:
        """The workers that were started."""
        return list((self._processes or {}).values())

    def close(self, patience_s: float = CLOSING_S) -> None:
        """Let the workers end, and kill those that do not, because of a user's thread perhaps."""
        processes = self.processes
        self.shutdown(wait=False)
        for process in processes:
            if not connection.wait([process.sentinel], patience_s):
                process.kill()

    def kill(self) -> None:
        """Kill all workers."""
        for process in self.processes:
            process.kill()
        self.shutdown(cancel_futures=True)


def follow_parent() -> None:
    """In a worker: end with the parent, and print to stderr, as stdout belongs to results."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with suppress(OSError):  # stderr may be closed
        os.dup2(2, 1)


def _end_with_parent() -> None:
    """Wait until the parent ends, and then end this process."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


class InProcess(Executor):
    """Runs what is submitted at once, in this process, and hands it the event to stop."""

    def __init__(self, stop: threading.Event) -> None:
        self.stop = stop

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call a function now."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs, stop=self.stop))
        except Exception as fault:
            future.set_exception(fault)
        return future


def check_how(progress: object, executor: object) -> None:
    """Refuse a progress that is neither None nor callable, and an executor that is none."""
    check_callable("progress", progress)
    if executor is not None:
        expect("executor", executor, Executor)


def sent_tasks(executor: Executor) -> int:
    """Return how many tasks an executor has at a time: two for each worker, so that none waits.

    Examples
    --------
    >>> from concurrent.futures import ThreadPoolExecutor
    >>> with ThreadPoolExecutor(3) as pool:
    ...     sent_tasks(pool)
    6
    """
    if isinstance(executor, InProcess):
        return 1
    known = (getattr(executor, name, None) for name in ("workers", "_max_workers"))
    return 2 * max(1, next((n for n in known if isinstance(n, int)), usable_cpus()))


@contextmanager
def stop_signal(grace_s: float = GRACE_S) -> Iterator[threading.Event]:
    """An event that Ctrl-C or SIGTERM sets; the second signal does what it did before.

    After `grace_s` this process gets a Ctrl-C, which ends the block wherever it is, unless a
    process is just being started. A library may swallow the KeyboardInterrupt; the event stays set.
    Only the main thread can handle signals, and one that is ignored (nohup) stays ignored.
    """
    event, again = threading.Event(), list[threading.Timer]()
    numbers = STOPS if threading.current_thread() is threading.main_thread() else ()
    before: dict[int, Any] = {number: signal.getsignal(number) for number in numbers}

    def stop(number: int, frame: FrameType | None) -> None:
        event.set()
        signal.signal(number, before[number])
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if hasattr(signal, "pthread_kill"):
            ours = threading.get_ident(), signal.SIGINT
            again.append(threading.Timer(grace_s, signal.pthread_kill, ours))
            again[-1].start()

    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, stop)
    try:
        yield event
    except KeyboardInterrupt:
        if not event.is_set():
            raise
    finally:
        for timer in again:
            timer.cancel()
        for number, handler in before.items():
            signal.signal(number, handler)


# --- calls with a limit of time --------------------------------------------------------------
# They run in a process that is killed when its time is up: a solver that hangs inside its compiled
# code handles no signal.


class TimedOut(HeavyTopError):
    """A call that did not return in time; its process was killed."""


class WorkerLost(HeavyTopError):
    """A process that died of a call, or an exception in it; the message says which."""


class TimedWorker:
    """One process for calls with time limits; a call starts it where there is none."""

    _pool: Processes | None = None
    _end: Callable[[], Any]

    def call(self, function: Callable[..., T], *args: Any, timeout: float | None = None) -> T:
        """Call a function of a module in the process, and return its result.

        The time limit [s] does not include starting the process.

        Raises
        ------
        TimedOut
            It did not return in time.
        WorkerLost
            The process died of it, or it raised something other than a HeavyTopError, which is
            raised here.
        """
        if self._pool is None:
            self._pool = Processes(1)
            # At exit Python waits for the workers of a pool: this one is killed before that.
            self._end = Finalize(None, self._pool.kill, exitpriority=10)
            self._pool.submit(os.getpid).result()  # it is ready
        [process] = self._pool.processes
        try:
            future = self._pool.submit(function, *args)
            ended = wait([future], timeout).done
        except (KeyboardInterrupt, BrokenProcessPool):  # stopped; or died before it was asked
            self.close()
            raise
        if not ended:
            self.close()
            raise TimedOut(f"it did not return within {timeout:.3g} s")
        fault = future.exception()
        if fault is None or isinstance(fault, HeavyTopError):
            return cast(T, future.result())
        why = f"{type(fault).__name__}: {fault}"
        if isinstance(fault, BrokenProcessPool):
            process.join()
            self.close()
            code = process.exitcode or 0
            why = f"killed by {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
        raise WorkerLost(f"its process was lost: {why}")

    def stages(
        self, function: Callable[..., Iterator[T]], *args: Any, limits: Iterable[float]
    ) -> Iterator[T]:
        """Run a generator of a module in the process; yield its values, each within its limit [s].

        Raises
        ------
        TimedOut, WorkerLost
            As of `call`.
        """
        first: tuple[Any, ...] = (function, *args)
        for limit in limits:
            yield self.call(_next, *first, timeout=limit)
            first = ()

    def close(self) -> None:
        """Kill the process."""
        if self._pool is not None:
            self._end()
            self._pool = None


_GENERATOR: Final[list[Iterator[Any]]] = []  # in a worker: the one that it runs


def _next(function: Callable[..., Iterator[T]] | None = None, *args: Any) -> Any:
    """In a worker: return the next value of its generator, a new one where a function is given."""
    if function is not None:
        _GENERATOR[:] = [function(*args)]
    return next(_GENERATOR[0])


TIMED_WORKER: Final = TimedWorker()
"""The one of this process, which does one task at a time."""

# --- a dask cluster ---------------------------------------------------------------------------


def executor_at(address: str, *, timeout_s: float = TIMEOUT_S) -> Cluster:
    """The executor of a dask scheduler, connected until it is shut down or its ``with`` block ends.

    Parameters
    ----------
    address : str
        Such as ``tcp://192.168.0.2:8786``.
    timeout_s : float
        How long to wait for the scheduler, and then for its first worker [s].

    Returns
    -------
    concurrent.futures.Executor
        For the argument ``executor`` of `drift`, `stress`, `atlas`, `certify` and `resume`, one
        after the other.

    Raises
    ------
    NoScheduler
        Nobody answers there in time, or there is no worker.
    MissingPackage
        dask is not installed here.
    """
    if find_spec("distributed") is None:
        raise MissingPackage("a cluster", ["distributed"], "cluster")
    from distributed import Client

    gc.collect()  # a client that failed before: collected while another starts it waits for ever
    client = None
    try:
        client = Client(address, timeout=timeout_s, set_as_default=False)
        client.wait_for_workers(1, timeout=timeout_s)
    except (OSError, ValueError, TypeError) as fault:  # not reached; not an address; no worker
        if client is not None:
            client.close()
        why = "no dask scheduler with a worker answers there"
        raise NoScheduler(f"{address}: {why} ({fault})") from None
    return Cluster(client)


class Cluster(Executor):
    """The workers of a scheduler, as many as there are at the moment."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._executor = client.get_executor(pure=False)  # no result of an earlier call

    @property
    def workers(self) -> int:
        """How many worker processes there are now; none when the scheduler has gone."""
        try:
            return len(self._client.nthreads())
        except Exception:  # closed, cut off, timed out
            return 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function."""
        return self._executor.submit(fn, *args, **kwargs)  # type: ignore[no-any-return]

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Close the connection."""
        self._client.close()
