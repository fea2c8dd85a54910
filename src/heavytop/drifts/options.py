"""The options of a drift study: what may be given for each, and the plain number it becomes."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Mapping
from decimal import Decimal
from numbers import Real
from typing import Any, Final

from heavytop.errors import Fault
from heavytop.scene_text import shown

BOUNDS: Final = {
    "periods": (1, 1e12),
    "ensemble": (1, 10_000),
    "samples": (2, 10_000),
    "seed": (0, 2**63 - 1),
}
JOBS: Final = {"jobs": (1, 1024)}


def taken(
    file: str, given: Mapping[str, object], bounds: Mapping[str, tuple[float, float]] = BOUNDS
) -> tuple[dict[str, Any], list[Fault]]:
    """Return options as plain numbers, and what is wrong with the others.

    Parameters
    ----------
    file : str
        What the faults name.
    given : mapping from str to object
        Periods may be any real number; the others any whole one.
    bounds : mapping from str to (least, most)
    """
    values, faults = {}, []
    for name, value in given.items():
        least, most = bounds[name]
        found = _real(value) if name == "periods" else _whole(value)
        if found is None or not least <= found <= most:  # nan too
            kind = "" if name == "periods" else "a whole number "
            rule = f"{kind}from {least:g} to {most:g}"
            faults.append(Fault(file, None, name, shown(value), rule))
        else:
            values[name] = found
    return values, faults


def names(file: str, given: object) -> tuple[list[str], list[Fault]]:
    """Return the names of methods, and what is wrong with the others."""
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        return [], [Fault(file, None, "methods", shown(given), "a sequence of names")]
    every = list(given)
    if not every:
        return [], [Fault(file, None, "methods", "", "at least one method")]
    texts = [each for each in every if isinstance(each, str)]
    others = [each for each in every if not isinstance(each, str)]
    return texts, [Fault(file, None, "methods", shown(each), "a name, as text") for each in others]


def _whole(value: object) -> int | None:
    if isinstance(value, bool):
        return None
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return None


def _real(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, Real | Decimal):
        return None
    try:
        return float(value)
    except (OverflowError, ValueError):  # longer than any float; a signalling nan
        return None
