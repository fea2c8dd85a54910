"""What scripts tell: a line of JSON for each claim, taken for nothing that it is not."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

Table = Mapping[str, Any]


def tables(data: bytes) -> tuple[list[Table], str]:
    """The lines of what a script told, and what is wrong with the first that is none.

    Examples
    --------
    >>> tables(b'{"id": "x", "measured": 1}')
    ([{'id': 'x', 'measured': 1}], '')
    >>> tables(b"[1]")
    ([], 'line 1 of what it told is no JSON object')
    """
    found: list[Table] = []
    trouble = ""
    for n, line in enumerate(data.splitlines(), 1):
        table = _table(line)
        if table is not None:
            found.append(table)
        elif not trouble:
            trouble = f"line {n} of what it told is no JSON object"
    return found, trouble


def _table(line: bytes) -> Table | None:
    try:
        found = json.loads(line.decode("utf-8"))
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def number(value: object) -> float | None:
    """A finite number, or None where it is anything else.

    Examples
    --------
    >>> number(2), number("2"), number(True), number(10**400), number(float("inf"))
    (2.0, None, None, None, None)
    """
    if not isinstance(value, int | float) or isinstance(value, bool):
        return None
    try:
        found = float(value)
    except OverflowError:
        return None
    return found if math.isfinite(found) else None


def words(value: object, most: int = 500) -> str:
    """A text on one line that can be printed; of anything else, how Python spells it.

    Examples
    --------
    >>> words("of two" + chr(10) + "lines"), words([1])
    ('of two lines', '[1]')
    """
    text = value if isinstance(value, str) else repr(value)
    line = " ".join(text.split())
    shown = "".join(x if x.isprintable() else "�" for x in line)
    return shown if len(shown) <= most else f"{shown[: most - 1]}…"
