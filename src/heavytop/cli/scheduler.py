"""The option by which the workers of a cluster do what processes here would do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop.errors import NoScheduler

if TYPE_CHECKING:
    from concurrent.futures import Executor

Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Of dask: its workers do the work."),
]


@contextmanager
def executor(address: str | None, jobs: int | None = None) -> Iterator[Executor | None]:
    """The executor at an address; none without one."""
    if address is None:
        yield None
        return
    if jobs is not None and jobs > 1:
        raise typer.BadParameter("a scheduler has its own workers", param_hint="--jobs")
    from heavytop.studies.executors import executor_at

    with ExitStack() as stack:
        try:
            found = stack.enter_context(executor_at(address))
        except NoScheduler as nobody:
            raise typer.BadParameter(str(nobody), param_hint="--scheduler") from nobody
        yield found
