"""Rows that tables of documents share: labels, values and units."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

MISSING: Final = "–"
ROUNDING: Final = 8 * sys.float_info.epsilon  # of the largest in a column
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
    table.add_column(overflow="fold")
    for label, text in rows:
        table.add_row(Text(label), Text(text))  # Text: what a scene says is never markup
    return table


def grid(headings: Sequence[str], left: int = 1) -> Table:
    """A table without lines, the first columns to the left; what is too wide is folded, not cut."""
    table = Table(box=None, pad_edge=False, header_style="cyan")
    for at, heading in enumerate(headings):
        justify: Any = "left" if at < left else "right"
        table.add_column(Text(heading), justify=justify, overflow="fold")
    return table


class Fitted:
    """The first of several forms of a table that is no wider than where it is printed, or the last.

    Parameters
    ----------
    build : callable
        Makes the table of a size: so many digits, or columns.
    sizes : iterable of int
        The best first.
    """

    def __init__(self, build: Callable[[int], RenderableType], sizes: Iterable[int]) -> None:
        self.forms = [build(size) for size in sizes]

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        anywhere = options.update_width(sys.maxsize)
        widths = (Measurement.get(console, anywhere, form).maximum for form in self.forms)
        fitting = (f for f, w in zip(self.forms, widths, strict=True) if w <= options.max_width)
        yield next(fitting, self.forms[-1])


def in_digits(value: float | None, digits: int) -> str:
    """A value to so many digits."""
    return MISSING if value is None else f"{value:.{digits}g}"


def settled(values: Iterable[Any]) -> list[float | None]:
    """The numbers of a column, those that are rounding beside the largest as 0.

    Examples
    --------
    >>> settled([-15, -7.1e-15, "12.3", None])
    [-15.0, 0.0, 12.3, None]
    """
    found = [None if value is None else float(value) for value in values]
    least = ROUNDING * max((abs(value) for value in found if value is not None), default=0.0)
    return [0.0 if value is not None and abs(value) < least else value for value in found]


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


def short(value: Any) -> str:
    """A value to 3 digits."""
    return MISSING if value is None else f"{float(value):.3g}"
