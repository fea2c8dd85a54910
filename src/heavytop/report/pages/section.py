"""What a page is made of: sections, their pictures, and the numbers behind these."""

from __future__ import annotations

import re
import tempfile
import warnings
from base64 import b64encode
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from heavytop.report.parts import FactRows, Fitting, Part, Table
from heavytop.scene.scene_file import written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.report.pages.load import Result

POINT: Final = 4 / 3  # pixels of a style sheet


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with what stands behind it.

    Attributes
    ----------
    name : str
        Unique in its section.
    title : str
        What is under it.
    svg : bytes
    table : Table
    data : mapping
        The numbers, whole.
    listed : str
        The part of the numbers that is a list, or columns, to be saved as CSV; all of them if
        empty.
    turns : bool
        Whether its numbers are surfaces and lines in space, which can be turned.
    """

    name: str
    title: str
    svg: bytes
    table: Table
    data: Mapping[str, Any]
    listed: str = ""
    turns: bool = False

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
    result : Result
    ident, heading : str
    parts : tuple of Part
        What it says.
    pictures : tuple of Picture
    top : mapping or None
        What the player plays.
    """

    result: Result
    ident: str
    heading: str
    parts: tuple[Part, ...]
    pictures: tuple[Picture, ...] = ()
    top: Mapping[str, Any] | None = None

    @property
    def command(self) -> str:
        """The command that made it; empty where it was made in Python."""
        return self.result.document.get("command") or ""

    @property
    def scene(self) -> Mapping[str, Any]:
        """Its scene; empty where it is about none."""
        return self.result.document.get("scene") or {}

    @property
    def source(self) -> str:
        """The source that its scene names."""
        return self.scene.get("source") or ""

    @property
    def scene_file(self) -> str:
        """Its scene as TOML."""
        tables = {name: x for name, x in self.scene.items() if name != "name" and x != ""}
        return written(tables) if tables else ""

    @property
    def shown(self) -> Iterator[FactRows | Table | str]:
        """Its parts; of tables that come in several forms, the best."""
        for part in self.parts:
            yield from part.forms[0] if isinstance(part, Fitting) else [part]

    def document(self) -> dict[str, Any]:
        """What the document of a page has of it."""
        return {
            "id": self.ident,
            "heading": self.heading,
            "schema": self.result.document["schema"],
            "file": self.result.name,
            "sha256": self.result.sha256,
            "command": self.command,
            "parts": [part if isinstance(part, str) else part._asdict() for part in self.shown],
            "figures": [f"{self.ident}-{picture.name}" for picture in self.pictures],
        }


def drawn(figure: Figure) -> bytes:
    """The SVG of a figure."""
    from heavytop.plots.figures import save

    with tempfile.TemporaryDirectory(prefix="heavytop-") as place, warnings.catch_warnings():
        # Of names that leave no room the picture is small; the page is none the worse.
        warnings.filterwarnings("ignore", message="constrained_layout", category=UserWarning)
        path = Path(place) / "figure.svg"
        save(figure, path)
        return path.read_bytes()
