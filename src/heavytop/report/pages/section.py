"""What a page is made of: sections, their pictures, and the numbers behind these."""

from __future__ import annotations

import re
import tempfile
import warnings
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.report.pages.tables import Table

POINT: Final = 4 / 3  # pixels of a style sheet


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
    listed : str
        The part of the numbers that is a list, or columns, to be saved as CSV; all of them if
        empty.
    """

    ident: str
    title: str
    alt: str
    svg: bytes
    table: Table
    data: Mapping[str, Any]
    command: str
    turns: bool = False
    listed: str = ""

    @property
    def width(self) -> int:
        """How wide it is drawn [pixels of a style sheet]."""
        found = re.search(rb'<svg\b[^>]*? width="([\d.]{1,9})pt"', self.svg[:2000])
        return round(float(found[1]) * POINT) if found else 640

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
    parted : str
        The column by whose values the table is shown in parts that open, if any.
    pictures : tuple of Picture
    command : str
        What makes it.
    scene : str
        The scene as a file, where no shipped one is it.
    top : mapping or None
        What the player plays.
    notes : tuple of str
        What there is to say beside.
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
    notes: tuple[str, ...] = ()
    parted: str = ""


def drawn(figure: Figure) -> bytes:
    """The SVG of a figure."""
    from heavytop.plots.figures import save

    with tempfile.TemporaryDirectory(prefix="heavytop-") as place, warnings.catch_warnings():
        # Of names that leave no room the picture is small; the page is none the worse.
        warnings.filterwarnings("ignore", message="constrained_layout", category=UserWarning)
        path = Path(place) / "figure.svg"
        save(figure, path)
        return path.read_bytes()
