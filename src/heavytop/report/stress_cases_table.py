"""The cases of a stress test as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rich.console import Group
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import two_columns

SHOWN: Final = ("short", "formulation", "setting")
LEFT_OUT: Final = tuple((name, "0") for name in ("phi", "psi", "phidot", "thetadot"))


def stress_cases_table(document: Mapping[str, Any]) -> Group:
    """The table of the cases: top, start, span and why each is hard; and the methods.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/stress-cases/1``.
    """
    table = Table(box=None, pad_edge=False, header_style="cyan")
    table.add_column("case", no_wrap=True)
    for name in ("top (A, C, gMR)", "start", "span", "why it is hard"):
        table.add_column(name, overflow="fold")
    for case in document["cases"]:
        top = ", ".join(case["top"].values())
        given = (pair for pair in case["start"].items() if pair not in LEFT_OUT)
        start = ", ".join("=".join(pair) for pair in given)
        table.add_row(*map(Text, (case["name"], top, start, case["span"], case["why"])))
    methods = [
        (each["name"], ", ".join(filter(None, (each[key] for key in SHOWN))))
        for each in document["methods"]
    ]
    own = "no case can be added: for a scene of your own there are drift and workprec"
    return Group(table, Text(), two_columns(methods), Text(), Text(own))
