"""Tables of the documentation that a validation script writes, with machine and versions."""

from __future__ import annotations

import platform
import re
from pathlib import Path
from typing import Any

from heavytop.machine import cpu_model, version

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


def foot() -> str:
    """Machine and versions in a line."""
    packages = ("heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
    versions = ", ".join(f"{name} {version(name)}" for name in packages if version(name))
    return f"*{cpu_model() or platform.machine()}, Python {platform.python_version()}; {versions}.*"


def drift_rows(found: Any) -> str:
    """A drift study as a table: a row for each method, its errors at the last time."""
    head = (
        "| method | periods | µs a period | energy | as t^ | phase [s] | as t^ | axis |\n"
        "|---|--:|--:|--:|--:|--:|--:|--:|"
    )
    return "\n".join([head, *map(_drift_row, found.methods)])


def _drift_row(each: Any) -> str:
    if each.skipped:
        return f"| `{each.name}` | skipped: {each.skipped} | | | | | | |"
    cells = (
        f"{each.periods[-1]:.3g}",
        f"{each.us_per_period:.3g}",
        f"{each.energy[-1]:.1e}",
        _power(each.energy_growth),
        "lost" if each.phase_s[-1] is None else f"{each.phase_s[-1]:.1e}",
        _power(each.phase_growth),
        "–" if each.axis[-1] is None else f"{each.axis[-1]:.1e}",
    )
    return f"| `{each.name}` | {' | '.join(cells)} |"


def _power(growth: Any) -> str:
    return "–" if growth is None else f"{growth.exponent:.2f}"
