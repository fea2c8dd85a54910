"""Tables of rich: labels and texts, columns below headings, and forms that fit their place."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text


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
