"""One command in a process of its own, which ends when its time is up, or this process is gone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from heavytop.studies.kept import LETTERS, begin, end, tail

GRACE: Final = 5.0  # s from SIGTERM to SIGKILL: what checks the claims ends its scripts meanwhile
TAIL: Final = 4096  # bytes of what a command said

# The command imports what this process would, and nothing beside it from the folder the person
# happens to be in.
_BOOT: Final = (
    "import json, runpy, sys; sys.path[:] = json.loads(sys.argv.pop(1)); "
    "runpy.run_module('heavytop', run_name='__main__', alter_sys=True)"
)


class Ended(NamedTuple):
    """How a command ended: its exit code, None where its time was up, and what it said last."""

    code: int | None
    said: str


def run(words: Sequence[str], place: Path, limit_s: float) -> Ended:
    """Run a command of heavytop; its group of processes is gone when this returns.

    Parameters
    ----------
    words : sequence of str
        The verb, and what it is given.
    place : Path
        An empty folder for what it says, and for what is temporary.
    limit_s : float
        Seconds after which it is ended.

    Raises
    ------
    OSError
        It cannot be begun.
    """
    boot = ("-P", "-c", _BOOT, json.dumps([*map(str, sys.path)]))
    said = place / "said"
    process = begin((*boot, *words), said, os.environ | LETTERS | {"TMPDIR": str(place)})
    try:
        code: int | None = process.wait(limit_s)
    except subprocess.TimeoutExpired:
        code = None
    finally:
        end([process], GRACE)
    return Ended(code, _last(said))


def _last(said: Path) -> str:
    """What was said last, on one line, without the usage of a command."""
    words = " ".join(tail(said, TAIL).split())
    return words.rpartition("Error: ")[2].removeprefix("heavytop: ")[-300:]
