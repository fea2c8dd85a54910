"""An errand: a task followed for a while by a worker that somebody else runs, on any computer.

One text goes out and one comes back. Both are JSON, and the kind of the study is looked up where
the errand is done: no object and no code travels.
"""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Iterator
from functools import cache
from threading import Lock
from typing import Any

from heavytop.machine import versions
from heavytop.studies.ledger.canonical import canonical
from heavytop.studies.ledger.kinds import module_of
from heavytop.studies.ledger.study import Identity, differences
from heavytop.studies.ledger.telling import told

# The precision of mpmath and of python-flint is global: of two threads, each would change the
# other's. A process does one errand at a time.
_ALONE = Lock()


def order(identity: Identity, task: str, checkpoint: dict[str, Any] | None, seconds: float) -> str:
    """The text that asks for an errand: a task, from a checkpoint, for so long [s]."""
    asked = {"identity": identity, "task": task, "checkpoint": checkpoint, "seconds": seconds}
    return canonical(asked)


def errand(order: str) -> str:
    """Do an errand: follow the task until it ends, or until a piece ends after the time is up.

    Returns
    -------
    str
        A list of messages: pieces, and what ended them.

    Raises
    ------
    ForeignFile
        The kind of study is not known here.
    """
    asked = json.loads(order)
    with _ALONE:
        return canonical(list(_messages(**asked)))


def _messages(
    identity: Identity, task: str, checkpoint: dict[str, Any] | None, seconds: float
) -> Iterator[dict[str, Any]]:
    if strange := _strange(identity):
        yield {"stranger": f"process {os.getpid()} on {platform.node()}", "differences": strange}
        return
    end = time.monotonic() + seconds
    for message in told(module_of(identity), identity, task, checkpoint):
        yield message
        if time.monotonic() >= end:
            return


def _strange(identity: Identity) -> tuple[str, ...]:
    """What is not here as the study has it; of the versions, those that it names."""
    study = identity.get("versions")
    if not isinstance(study, dict):
        return ()
    here = {name: _versions().get(name) for name in study}
    return differences({"versions": here}, {"versions": study})


@cache
def _versions() -> dict[str, str | None]:
    return versions()
