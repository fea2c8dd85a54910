"""A cluster of dask: workers on other computers, behind one address. The one door to dask.

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
_LOUD = ("distributed", "tornado", "asyncio")  # they log what is told here in one sentence


class _Cluster(Executor):
    """The workers of a scheduler, as many as there are at the moment."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._executor: Executor = client.get_executor(pure=False)  # no result of an errand before

    @property
    def workers(self) -> int:
        """How many worker processes there are now; none when the scheduler has gone."""
        try:
            return len(self._client.nthreads())
        except Exception:  # closed, cut off, timed out: nobody can be counted
            return 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Let a worker call a function."""
        return self._executor.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Take no more work."""
        self._executor.shutdown(wait=wait and not cancel_futures)


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
    import distributed  # noqa: F401  # it makes its loggers

    with _quiet(), _client(address, timeout_s) as client:
        _expect_workers(client, address, timeout_s)
        cluster = _Cluster(client)
        try:
            yield cluster
        finally:
            cluster.shutdown(wait=False)


@contextmanager
def _client(address: str, timeout_s: float) -> Iterator[Any]:
    from distributed import Client

    with ThreadPoolExecutor(1) as aside:  # the loop that may run here, in a notebook, is not ours
        _expect_scheduler(address, aside.submit(asyncio.run, _kind(address, timeout_s)))
    client = Client(address, timeout=timeout_s, set_as_default=False, name="heavytop")
    try:
        yield client
    finally:
        client.close()


def _expect_scheduler(address: str, answer: Future[str]) -> None:
    """Ask before a client is made: one that reaches nobody leaves a traceback when it goes."""
    try:
        kind = answer.result()
    except (OSError, ValueError, TypeError) as fault:  # not reached; not an address
        raise NoScheduler(f"{address}: no dask scheduler answers there ({_said(fault)})") from None
    if kind != "Scheduler":
        raise NoScheduler(f"{address}: not a dask scheduler but a {kind}")


async def _kind(address: str, timeout_s: float) -> str:
    from distributed.core import rpc

    async with rpc(address, timeout=timeout_s) as there:
        found = await asyncio.wait_for(there.identity(), timeout_s)
    return str(found.get("type"))


def _expect_workers(client: Any, address: str, timeout_s: float) -> None:
    try:
        client.wait_for_workers(1, timeout=timeout_s)
    except TimeoutError:
        start = f"dask worker {address} --nthreads 1"
        raise NoScheduler(f"{address}: a scheduler without workers: {start}") from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Let dask keep to itself what it logs."""
    names = [n for n in logging.root.manager.loggerDict if n.partition(".")[0] in _LOUD]
    before = {name: logging.getLogger(name).level for name in names}
    for name in before:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


def _said(fault: BaseException) -> str:
    return " ".join(str(fault).split()) or type(fault).__name__
