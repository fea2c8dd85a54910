"""Rows that tables of documents share: labels, values and units."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, Final

from rich.table import Table
from rich.text import Text

MISSING: Final = "–"
MEANS: Final = (
    ("period", "period", "s"),
    ("Δφ per period", "precession", "rad"),
    ("Δψ per period", "spin", "rad"),
)
OFF: Final = {  # what distances from the closed form are measured in
    "theta": " rad",
    "phi": " rad",
    "psi": " rad",
    "axis": " (a length)",
    "energy": " (relative)",
    "event_time": " s",
    "input_rounding": " rad",
}


def title(scene: Mapping[str, Any]) -> Text:
    """The name of a scene and its title."""
    words = " — ".join(filter(None, (scene.get("name"), scene.get("title"))))
    return Text(words, style="bold")


def two_columns(rows: Iterable[tuple[str, str]]) -> Table:
    """Labels and texts side by side."""
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for label, text in rows:
        table.add_row(Text(label), Text(text))  # Text: what a scene says is never markup
    return table


def kind(motion: Mapping[str, Any]) -> str:
    """Kind and tags of a motion, whether they are proved, and the margin."""
    tags = f" ({', '.join(motion['tags'])})" if motion["tags"] else ""
    if not motion["certified"]:
        return f"{motion['kind']}{tags}"
    return f"{motion['kind']}{tags}, proved, margin {short(motion['margin'])}"


def course(motion: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Range of tilt, period, and means per period, of those there are."""
    low, high = motion["theta_min"], motion["theta_max"]
    if low is not None and high is not None:
        yield tilt(number(low), number(high))
    for label, name, unit in MEANS:
        if motion[name] is not None:
            yield label, f"{number(motion[name])} {unit}"
            if name == "period":
                yield from swing(motion)


def distances(found: Mapping[str, Any], told: Callable[[float], str]) -> Iterator[str]:
    """The distances from the closed form that are known, each with its unit.

    Parameters
    ----------
    found : mapping
        What a document has under ``errors``.
    told : callable
        How a size is written.
    """
    for name, size in found.items():
        if isinstance(size, int | float):
            yield f"{name.replace('_', ' ')} {told(size)}{OFF.get(name, '')}"


def swing(motion: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What the period of θ is to a pendulum in a plane: θ is the same to either side."""
    if motion["kind"] == "planar-pendulum" and "swinging" in motion["tags"]:
        there_and_back = number(2 * float(motion["period"]))
        yield "", f"the swing there and back {there_and_back} s; φ jumps by π at the vertical"


def tilt(low: str, high: str) -> tuple[str, str]:
    """The range of θ, from numbers as they are shown."""
    least, greatest = (f"{math.degrees(float(end)):.2f}°" for end in (low, high))
    if low == high:
        return "θ", f"{low} rad ({least}), constant"
    return "θ between", f"{low} and {high} rad ({least} to {greatest})"


def constants(values: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """The constants of the motion, of those there are."""
    for label, name, unit in (
        ("E", "E", "J"),
        ("E'", "E_prime", "J"),
        ("p_φ", "p_phi", "kg m²/s"),
        ("p_ψ", "p_psi", "kg m²/s"),
    ):
        if values[name] is not None:
            yield label, f"{number(values[name])} {unit}"


def number(value: Any) -> str:
    """A value to 12 digits, or as the document spells it when it is a decimal string."""
    if value is None:
        return MISSING
    return value if isinstance(value, str) else f"{value:.12g}"


def brief(value: Any) -> str:
    """A value to 12 digits, however many the document has."""
    return number(float(value) if isinstance(value, str) else value)


def short(value: Any) -> str:
    """A value to 3 digits."""
    return MISSING if value is None else f"{float(value):.3g}"
