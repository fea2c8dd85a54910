"""What tables and charts of a stress test call its methods and outcomes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

MARKS: Final = {
    "inaccurate": "!",
    "singular": "sing",
    "stalled": "stall",
    "diverged": "div",
    "step-limit": "steps",
    "time-limit": "time",
    "refused": "no",
    "missed-events": "ev",
}
UNTOLD: Final = "?"


def heading(document: Mapping[str, Any], method: str) -> str:
    """A method's short name and its tolerance, or its steps in a period.

    Examples
    --------
    >>> heading({"methods": {"m": "lsoda:a"}, "settings": {"m": "1e-11"}}, "m")
    'lsoda:a 1e-11'
    """
    return f"{document['methods'][method]} {document['settings'][method]}".rstrip()
