"""Parts of a result at a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Final

from rich.console import Group, RenderableType
from rich.text import Text

from heavytop.report.atlas_table import atlas_table
from heavytop.report.classification import classify_parts
from heavytop.report.drift import drift_parts
from heavytop.report.energy_momentum import energy_momentum_parts
from heavytop.report.parts import FAIL, FactRows, Fitting, Known, Part, Table, title
from heavytop.report.rich_tables import Fitted, grid, two_columns
from heavytop.report.run import plan_parts, run_parts
from heavytop.report.stress import stress_cases_parts, stress_parts
from heavytop.report.validation import validate_parts
from heavytop.report.work_precision import work_precision_parts

PARTS: Final[Mapping[str, Callable[[Known], Iterable[Part]]]] = {
    "heavytop/run/1": run_parts,
    "heavytop/plan/1": plan_parts,
    "heavytop/classify/1": classify_parts,
    "heavytop/drift/1": drift_parts,
    "heavytop/workprec/1": work_precision_parts,
    "heavytop/stress/1": stress_parts,
    "heavytop/stress-cases/1": stress_cases_parts,
    "heavytop/energy-momentum/1": energy_momentum_parts,
    "heavytop/validate/1": validate_parts,
}
"""What a document says, by its schema."""


def rendered(document: Known) -> RenderableType:
    """A document at a terminal, below the title of its scene if it has one."""
    if document["schema"] == "heavytop/atlas/1":
        return atlas_table(document)
    scene = document.get("scene")
    found: list[RenderableType] = [Text(title(scene), style="bold")] if scene else []
    for k, part in enumerate(PARTS[document["schema"]](document)):
        found += [Text()] * (k > 0) + [_one(part)]
    return Group(*found)


def _one(part: Part) -> RenderableType:
    if isinstance(part, FactRows):
        return two_columns(part.rows)
    if isinstance(part, Fitting):
        return Fitted(lambda k: _tables(part.forms[k]), range(len(part.forms)))
    return _tables([part]) if isinstance(part, Table) else Text(part, style="bold")


def _tables(tables: Iterable[Table]) -> Group:
    found: list[RenderableType] = []
    for each in tables:
        found += [Text()] * bool(found) + [Text(each.title, style="cyan")] * bool(each.title)
        found.append(below := grid(each.head, each.left))
        for row in each.rows[: each.first]:
            below.add_row(*(Text(text, style="red" if text == FAIL else "") for text in row))
        more = each.more + len(each.rows[each.first :] if each.first else ())
        found += [Text(f"… and {more} more")] * bool(more)
    return Group(*found)
