"""A study: what is asked, exactly, and the names of the tasks that answer it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from heavytop.studies.ledger.canonical import canonical, digest, plain

Identity = dict[str, Any]
_WORD = re.compile(r"[A-Za-z0-9][A-Za-z0-9_+=-]*(\.[A-Za-z0-9_+=-]+)*")
LONGEST = 200


@dataclass(frozen=True, slots=True)
class Study:
    """A question and its tasks.

    Attributes
    ----------
    identity : dict
        All that makes this study another one, as JSON: kind, scene, options, versions.
    tasks : tuple of str
        The names of its tasks: words joined by slashes.
    module : str
        The module whose `follow` does the tasks. It comes from code, never from a file.
    """

    identity: Identity
    tasks: tuple[str, ...]
    module: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "identity", plain(self.identity))
        object.__setattr__(self, "tasks", checked(self.tasks))


def study_digest(identity: Identity) -> str:
    """The digest by which every file of a study says to which it belongs."""
    return digest(canonical(identity))


def checked(tasks: Sequence[str]) -> tuple[str, ...]:
    """The names of tasks, if each can be the name of a folder inside another and none is twice.

    Raises
    ------
    ValueError
        For the first that cannot.
    """
    for task, times in Counter(tasks).items():
        if not is_name(task):
            raise ValueError(f"task {task!r}: not words joined by slashes")
        if times > 1:
            raise ValueError(f"task {task!r}: named {times} times")
    return tuple(tasks)


def shard(tasks: Sequence[str], i: int, n: int) -> tuple[str, ...]:
    """Part i of n of the tasks: the i-th, the one n after it, and so on. All n are the whole.

    Raises
    ------
    ValueError
        Unless 1 <= i <= n.

    Examples
    --------
    >>> shard(["a", "b", "c", "d", "e"], 2, 3)
    ('b', 'e')
    """
    if not 1 <= i <= n:
        raise ValueError(f"shard {i}/{n}: the parts of a whole are 1/n to n/n")
    return tuple(tasks[i - 1 :: n])


def is_name(task: str) -> bool:
    """Whether a name keeps inside the folder, and clear of the files in it.

    Examples
    --------
    >>> is_name("taylor-axis/003"), is_name("../elsewhere"), is_name("a/rows-0001.json")
    (True, False, False)
    """
    words = task.split("/")
    whole = all(_WORD.fullmatch(word) and not word.endswith(".json") for word in words)
    return whole and len(task) <= LONGEST


def differences(there: Any, here: Any) -> tuple[str, ...]:
    """What two identities say differently, each by its name.

    Examples
    --------
    >>> differences({"scene": {"theta": "0.1"}}, {"scene": {"theta": "0.2"}})
    ('scene.theta: "0.1" there, "0.2" here',)
    """
    return tuple(_differences("", there, here))


def _differences(name: str, there: Any, here: Any) -> Iterator[str]:
    if isinstance(there, dict) and isinstance(here, dict):
        for key in sorted({*there, *here}):
            inner = f"{name}.{key}" if name else key
            yield from _differences(inner, there.get(key, _Nothing), here.get(key, _Nothing))
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for i, pair in enumerate(zip(there, here, strict=True)):
            yield from _differences(f"{name}[{i}]", *pair)
    elif (a := _said(there)) != (b := _said(here)):
        yield f"{name}: {_short(a)} there, {_short(b)} here"


class _Nothing:
    """A key that is not there, which is not null."""


def _said(value: Any) -> str:
    return "nothing" if value is _Nothing else canonical(value)


def _short(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:77]}..."
