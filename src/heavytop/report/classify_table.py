"""What is known of a scene without integrating it, as a table for reading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import Any, Final

from rich.console import Group

from heavytop.report.fact_rows import fact_rows
from heavytop.report.rows import MEANS, MISSING, constants, number, swing, tilt, title, two_columns

DIGITS: Final = 17  # shown of what is enclosed


def classify_table(document: Mapping[str, Any]) -> Group:
    """The table of one classification.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/classify/1``.

    Raises
    ------
    KeyError
        A part of the document is missing.
    """
    return Group(title(document["scene"]), two_columns(_rows(document)))


def _rows(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield from _verdict(document["motion"])
    yield from _course(document["motion"], document["enclosure"])
    yield from constants(document["constants"])
    yield from fact_rows(document["facts"])


def _verdict(motion: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "kind", f"{motion['kind']}, {_proof(motion)}"
    if motion["tags"]:
        yield "tags", ", ".join(motion["tags"])
    if motion["open_tags"]:
        yield "tags undecided", ", ".join(motion["open_tags"])
    yield "why", motion["why"]
    if motion["certified"]:
        low, high = motion["margin_enclosure"]
        within = f", to {high - low:.0e}" if high > low else ""
        yield "margin", f"{number(motion['margin'])}{within}"


def _proof(motion: Mapping[str, Any]) -> str:
    return "proved" if motion["certified"] else f"|x| < {number(motion['bound'])}"


def _course(motion: Mapping[str, Any], enclosure: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Range of tilt, period, and means per period, to as many digits as are proved."""
    names = ("theta_min", "theta_max", *(name for _, name, _ in MEANS))
    shown = {name: _shown(motion[name], enclosure[name]) for name in names}
    yield tilt(shown["theta_min"], shown["theta_max"])
    for label, name, unit in MEANS:
        if shown[name] != MISSING:
            yield label, f"{shown[name]} {unit}"
            if name == "period":
                yield from swing(motion)


def _shown(value: Any, bounds: Sequence[str] | None) -> str:
    return number(value) if bounds is None else between(*bounds)


def between(low: str, high: str) -> str:
    """A number between two bounds, of 17 digits or as many as are certain to a unit of the last.

    Examples
    --------
    >>> between("0.09999999999999999999", "0.10000000000000000001"), between("0.1234", "0.1240")
    ('0.1', '0.124')
    """
    least, most = Decimal(low), Decimal(high)
    middle, radius = (least + most) / 2, (most - least) / 2
    last = middle.adjusted() - DIGITS + 1
    if radius:
        last = max(last, radius.adjusted() + 1)
    text = round(middle, -last).normalize()
    return f"{text:f}" if -6 < text.adjusted() < DIGITS else f"{text:e}"
