"""The cases of a stress test as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from rich.console import Group
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
    cases = [(case["name"], _described(case)) for case in document["cases"]]
    methods = [
        (each["name"], ", ".join(filter(None, (each[key] for key in SHOWN))))
        for each in document["methods"]
    ]
    own = "no case can be added: for a scene of your own there are drift and workprec"
    return Group(two_columns(cases), Text(), two_columns(methods), Text(), Text(own))


def _described(case: Mapping[str, Any]) -> str:
    """Why a case is hard; then its top, start and span."""
    known = [*case["top"].items(), *case["start"].items()]
    given = ", ".join(f"{name} = {value}" for name, value in known if (name, value) not in LEFT_OUT)
    return f"{case['why']}\n{given}; {case['span']}"
