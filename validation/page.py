"""Tables of the documentation that a validation script writes, with machine and versions."""

from __future__ import annotations

import platform
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from heavytop.doctor import cpu_model, version
from heavytop.results.base import Table
from heavytop.scene.quantities import Quantity

DOCS = Path(__file__).parents[1] / "docs"


def rewrite(page: str, marker: str, table: str) -> None:
    """Put a table between the markers of a page of docs/, its foot under it."""
    path = DOCS / page
    text = path.read_text("utf-8")
    begin, end = f"<!-- begin {marker} -->", f"<!-- end {marker} -->"
    body = f"{begin}\n{table.rstrip()}\n\n{foot()}\n{end}"
    found, count = re.subn(
        f"{re.escape(begin)}.*?{re.escape(end)}", lambda _: body, text, flags=re.S
    )
    if count != 1:
        raise ValueError(f"{page}: no table {marker}")
    path.write_text(found, "utf-8")


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> str:
    """A table of texts in Markdown; of so many columns at the left not aligned to the right."""
    columns = [str(k) for k in range(len(head))]
    table = [dict(zip(columns, row, strict=True)) for row in rows]
    about = {name: Quantity(text, "") for name, text in zip(columns, head, strict=True)}
    return Table(table, columns, meanings=about, left=left).markdown


def foot() -> str:
    """Machine and versions in a line."""
    packages = ("heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
    versions = ", ".join(f"{name} {version(name)}" for name in packages if version(name))
    return f"*{cpu_model() or platform.machine()}, Python {platform.python_version()}; {versions}.*"
