"""The runs of a stress test as a worker process does them, so that one that hangs can be ended.

Each task comes in two pieces: the truth of its case, on which no clock runs, and the run.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

from heavytop.studies.ledger import Piece
from heavytop.studies.stresses.cases import cases
from heavytop.studies.stresses.compiled import ready
from heavytop.studies.stresses.conditioning import reference
from heavytop.studies.stresses.methods import METHODS
from heavytop.studies.stresses.outcome import judged
from heavytop.studies.stresses.running import run


def tasks(identity: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the runs of a stress test: ``CASE/METHOD``."""
    return tuple(identity["tasks"])


def follow(
    identity: Mapping[str, Any], task: str, checkpoint: Mapping[str, Any] | None
) -> Iterator[Piece]:
    """Yield a piece when the truth of the case is known, and one with the run, judged.

    Parameters
    ----------
    identity : mapping
    task : str
    checkpoint : mapping, optional
        Not used: a run is done whole.
    """
    name, _, chosen = task.partition("/")
    case, method, truth = cases()[name], METHODS[chosen], reference(name)
    ready(case, method, truth)
    yield Piece({}, fraction=0.1)
    began = time.perf_counter()
    with _unheard():
        raw = run(case, method, truth, identity["step_limit"])
    spent = time.perf_counter() - began
    found = asdict(judged(raw, truth, by_angles=method.angles)) | {
        "steps": raw.steps,
        "smallest_step": raw.smallest,
        "energy_error": raw.energy,
        "plan": raw.plan,
        "condition": min(truth.condition, 1e300),
    }
    yield Piece({}, (found,), done=True, fraction=1.0, spent_s=spent)


@contextmanager
def _unheard() -> Iterator[None]:
    """Let the Fortran and C of solvers print into nothing; what they return is judged."""
    kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)
