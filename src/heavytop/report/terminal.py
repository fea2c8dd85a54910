"""Results at a terminal: their parts as tables of rich, as wide as the terminal is."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.table import Table as Grid
from rich.text import Text

from heavytop.report.parts import FAIL, FactRows, Fitting, Known, Part, Row, Table, title


def rendered(document: Known) -> RenderableType:
    """A document at a terminal, below the title of its scene if it has one."""
    from heavytop.report.studies import PARTS  # which takes its time to import

    scene = document.get("scene")
    found: list[RenderableType] = [Text(title(scene), style="bold")] if scene else []
    for k, part in enumerate(PARTS[document["schema"]](document)):
        found += [Text()] * (k > 0) + [_one(part)]
    return Group(*found)


def _one(part: Part) -> RenderableType:
    if isinstance(part, FactRows):
        return two_columns(part.rows)
    if isinstance(part, Fitting):
        return _Fitted([_tables(form) for form in part.forms])
    return _tables([part]) if isinstance(part, Table) else Text(part, style="bold")


def two_columns(rows: Iterable[Row]) -> Grid:
    """Labels and texts side by side."""
    grid = Grid(box=None, show_header=False, pad_edge=False)
    grid.add_column(style="cyan", no_wrap=True)
    grid.add_column(overflow="fold")
    for label, text in rows:
        grid.add_row(Text(label), Text(text))  # Text: what a scene says is never markup
    return grid


def _tables(tables: Iterable[Table]) -> Group:
    found: list[RenderableType] = []
    for each in tables:
        found += [Text()] * bool(found) + [Text(each.title, style="cyan")] * bool(each.title)
        found.append(grid := Grid(box=None, pad_edge=False, header_style="cyan"))
        for at, heading in enumerate(each.head):  # what is too wide is folded, not cut
            justify = "left" if at < each.left else "right"
            grid.add_column(Text(heading), justify=justify, overflow="fold")  # type: ignore[arg-type]
        for row in each.rows[: each.first]:
            grid.add_row(*(Text(text, style="red" if text == FAIL else "") for text in row))
        if more := each.more + len(each.rows) - len(each.rows[: each.first]):
            found.append(Text(f"… and {more} more"))
    return Group(*found)


@dataclass(frozen=True)
class _Fitted:
    """The first of several forms that is no wider than where it is printed, or the last."""

    forms: Sequence[RenderableType]

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        anywhere = options.update_width(sys.maxsize)
        widths = (Measurement.get(console, anywhere, form).maximum for form in self.forms)
        fitting = (f for f, w in zip(self.forms, widths, strict=True) if w <= options.max_width)
        yield next(fitting, self.forms[-1])
