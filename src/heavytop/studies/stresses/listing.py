"""What a stress test consists of: its cases and its methods, as a document."""

from __future__ import annotations

from typing import Any, Final

from heavytop.studies.stresses.cases import Case, cases
from heavytop.studies.stresses.methods import METHODS, Method

SCHEMA: Final = "heavytop/stress-cases/1"


def listing() -> dict[str, Any]:
    """Return all cases and methods as the document heavytop/stress-cases/1.

    Examples
    --------
    >>> [found] = [case for case in listing()["cases"] if case["name"] == "cusp"]
    >>> found["start"]["psidot"], found["span"]
    ('140', '2.618 periods')
    """
    return {
        "schema": SCHEMA,
        "cases": [_case(each) for each in cases().values()],
        "methods": [_method(each) for each in METHODS.values()],
    }


def _case(case: Case) -> dict[str, Any]:
    scene = case.scene
    span = f"{scene.time} s" if scene.periods is None else f"{scene.periods} periods"
    return {
        "name": case.name,
        "top": {name: str(getattr(scene.top, name)) for name in ("A", "C", "gMR")},
        "start": {name: str(value) for name, value in scene.start.given},
        "span": span,
        "why": case.hard,
        "events": case.counted,
    }


def _method(method: Method) -> dict[str, Any]:
    names = ("name", "short", "formulation", "setting")
    return {name: getattr(method, name) for name in names}
