"""A plan as a table for reading."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group

from heavytop.report.rows import short, title, two_columns
from heavytop.run.estimates import duration


def plan_table(document: Mapping[str, Any]) -> Group:
    """The table of one plan.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/plan/1``.

    Raises
    ------
    KeyError
        A part of the document is missing.
    """
    return Group(title(document["scene"]), two_columns(_rows(document["plan"])))


def _rows(plan: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    marks = [mark for mark in ("projected", "folded") if plan[mark]]
    yield "formulation", ", ".join((plan["formulation"], f"{plan['states']} states", *marks))
    if plan["states"]:
        yield "precision", f"{plan['precision']}, tolerance {short(plan['tolerance'])}"
    labels = ["why", *[""] * len(plan["reasons"])]
    yield from zip(labels, plan["reasons"], strict=False)
    yield from (("warning", warning) for warning in plan["warnings"])
    if plan["cost_s"] is not None and plan["states"]:
        none = plan["error"] >= 1
        off = "no digit right" if none else f"off by {short(plan['error'])}"
        yield "expected", f"{duration(plan['cost_s'])}, {off} at the end"
