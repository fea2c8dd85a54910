"""What a worker says of a task, wherever the worker is: messages, each a JSON object."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from typing import Any

from heavytop.errors import ForeignFile, HeavyTopError
from heavytop.studies.ledger.kinds import follower
from heavytop.studies.ledger.study import Identity


def told(
    module: str, identity: Identity, task: str, checkpoint: dict[str, Any] | None
) -> Iterator[dict[str, Any]]:
    """Follow a task, and yield a message for each of its pieces; what it raises is one too."""
    try:
        for piece in follower(module).follow(identity, task, checkpoint):
            yield {"piece": piece.as_json()}
            if piece.done:
                return
    except ForeignFile as fault:
        yield {"foreign": str(fault)}
    except HeavyTopError as refusal:
        yield {"failed": str(refusal)}
    except Exception as bug:
        yield {"bug": f"{type(bug).__name__}: {bug}", "trace": traceback.format_exc()}
    else:
        yield {"bug": "it ended before it was done", "trace": ""}
