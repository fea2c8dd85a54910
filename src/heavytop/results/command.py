"""The command line that makes a result: kept in its document as a text, which nothing executes."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from heavytop.files import regular
from heavytop.spelling import harmless

_TYPED: ContextVar[str | None] = ContextVar("command", default=None)


def typed() -> str | None:
    """What was typed, where this process is a command; None where Python is used."""
    return _TYPED.get()


def spelt(words: Sequence[str]) -> str:
    """A command line as a shell takes it, in letters that a terminal does not act on.

    Examples
    --------
    >>> spelt(["run", "my scene.toml"])
    "heavytop run 'my scene.toml'"
    """
    return harmless(shlex.join(["heavytop", *words]))


@contextmanager
def typing(command: str | None) -> Iterator[None]:
    """Let results be those of a command."""
    token = _TYPED.set(command)
    try:
        yield
    finally:
        _TYPED.reset(token)


def with_command(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document of a result with the command that makes it, unless it names one."""
    return {"schema": document["schema"], "command": typed(), **document}


def command_of(path: Path) -> str | None:
    """The command that a document names, if there is one that does."""
    try:
        with regular(path) as file:
            found = json.loads(file.read())["command"]
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return None
    return found if isinstance(found, str) else None
