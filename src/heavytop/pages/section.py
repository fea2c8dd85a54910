"""What a page is made of: sections, their pictures, and the numbers behind these."""

from __future__ import annotations

import tempfile
import warnings
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_ROWS: Final = 60  # of a table on the page; the data have all of them
MISSING: Final = "–"


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of texts; of long ones, rows that are evenly spaced, and how many there are."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    all_rows: int
    every: int = 1  # of so many rows one is there

    @classmethod
    def of(cls, columns: Mapping[str, Sequence[Any]], most: int = MOST_ROWS) -> Table:
        """The table of columns of equal length.

        Examples
        --------
        >>> Table.of({"t": [0.0, 1 / 3], "kind": ["cusp", None]}).rows
        (('0', 'cusp'), ('0.333333', '–'))
        """
        count = max(map(len, columns.values()), default=0)
        every = max(1, -(-count // most))
        rows = tuple(zip(*(map(cell, c[::every]) for c in columns.values()), strict=True))
        return cls(tuple(columns), rows, count, every)


def cell(value: Any) -> str:
    """A value to 6 digits; a text, or a decimal of many digits, as it begins."""
    if value is None or value != value:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return f"{value:.6g}"
    words = str(value)
    return words if len(words) <= 300 else f"{words[:299]}…"


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with what stands behind it.

    Attributes
    ----------
    ident : str
        Its name on the page, unique there.
    title, alt : str
        What is under it, and what it shows, for those who do not see it.
    svg : bytes
    table : Table
    data : mapping
        The numbers, whole.
    command : str
        What makes it.
    turns : bool
        Whether its numbers are surfaces and lines in space, which can be turned.
    """

    ident: str
    title: str
    alt: str
    svg: bytes
    table: Table
    data: Mapping[str, Any]
    command: str
    turns: bool = False

    @property
    def address(self) -> str:
        """The picture as an address that an image takes: in an image, no script of it can run."""
        return f"data:image/svg+xml;base64,{b64encode(self.svg).decode('ascii')}"


@dataclass(frozen=True, slots=True)
class Section:
    """One result on the page.

    Attributes
    ----------
    ident, heading : str
    source : str
        The source that the scene names.
    words : str
        What was done.
    facts : tuple of (str, str)
        Labels and texts.
    table : Table or None
        What is no picture's.
    pictures : tuple of Picture
    scene : str
        The scene as a file, where no shipped one is it.
    top : mapping or None
        What the player plays.
    """

    ident: str
    heading: str
    words: str = ""
    source: str = ""
    facts: tuple[tuple[str, str], ...] = ()
    table: Table | None = None
    pictures: tuple[Picture, ...] = ()
    command: str = ""
    scene: str = ""
    top: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = field(default=())


def drawn(figure: Figure) -> bytes:
    """The SVG of a figure."""
    from heavytop.report.figures import save

    with tempfile.TemporaryDirectory(prefix="heavytop-") as place, warnings.catch_warnings():
        # Of names that leave no room the picture is small; the page is none the worse.
        warnings.filterwarnings("ignore", message="constrained_layout", category=UserWarning)
        path = Path(place) / "figure.svg"
        save(figure, path)
        return path.read_bytes()
