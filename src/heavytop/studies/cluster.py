"""A dask cluster: workers on other computers, behind one address.

Only this package must be installed where the workers are. A worker does one task at a time, so
it is started with one thread: ``dask worker ADDRESS --nworkers 8 --nthreads 1``.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from heavytop.errors import MissingPackage, NoScheduler

TIMEOUT_S = 10.0  # until somebody answers, and until there is a worker
_LOUD = ("distributed", "tornado", "asyncio")  # they log what is said here in one sentence


@contextmanager
def executor_at(address: str, *, timeout_s: float = TIMEOUT_S) -> Iterator[Executor]:
    """The executor of a dask scheduler, closed in the end.

    Parameters
    ----------
    address : str
        Such as ``tcp://192.168.0.2:8786``.
    timeout_s : float
        How long to wait for the scheduler, and then for its first worker [s].

    Yields
    ------
    concurrent.futures.Executor
        For the argument ``executor`` of `drift`, `atlas` and `resume`.

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

    with _quiet():
        _expect_scheduler(address, timeout_s)
        with Client(address, timeout=timeout_s, set_as_default=False, name="heavytop") as client:
            try:
                client.wait_for_workers(1, timeout=timeout_s)
            except TimeoutError:
                start = f"dask worker {address} --nthreads 1"
                raise NoScheduler(f"{address}: a scheduler without workers: {start}") from None
            yield _Cluster(client)


class _Cluster(Executor):
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
        found: Future[Any] = self._executor.submit(fn, *args, **kwargs)
        return found


def _expect_scheduler(address: str, timeout_s: float) -> None:
    """Ask who is there: a client would wait for ever for an answer from something else."""
    from distributed.core import rpc

    async def kind() -> object:
        async with rpc(address, timeout=timeout_s) as there:
            return (await asyncio.wait_for(there.identity(), timeout_s)).get("type")

    try:
        with ThreadPoolExecutor(1) as aside:  # the loop that may run here, in a notebook, is busy
            found = aside.submit(asyncio.run, kind()).result()
    except (OSError, ValueError, TypeError) as fault:  # not reached; not an address
        words = " ".join(str(fault).split()) or type(fault).__name__
        raise NoScheduler(f"{address}: no dask scheduler answers there ({words})") from None
    if found != "Scheduler":
        raise NoScheduler(f"{address}: not a dask scheduler but a {found}")


@contextmanager
def _quiet() -> Iterator[None]:
    """Switch the loggers of dask off."""
    names = [n for n in logging.root.manager.loggerDict if n.partition(".")[0] in _LOUD]
    before = {name: logging.getLogger(name).level for name in names}
    for name in before:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)
