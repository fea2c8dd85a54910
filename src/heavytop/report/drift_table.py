"""A drift study's document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import MISSING, grid, title, two_columns

HEADINGS: Final = ("method", "µs/\nperiod", "energy", "as t^", "phase\n[s]", "as t^", "axis")


def drift_table(document: Mapping[str, Any]) -> Group:
    """The table of one drift study.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/drift/1``.

    Returns
    -------
    rich.console.Group
        Title, what was asked, a row for each method with its errors at the last time, what was
        skipped and why.
    """
    return Group(*_parts(document))


def _parts(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    yield title(document["scene"])
    yield two_columns(_asked(document))
    yield Text()
    yield _methods([each for each in document["methods"] if each["skipped"] is None])
    if notes := list(_notes(document)):
        yield Text()
        yield two_columns(iter(notes))


def _asked(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    count = document["ensemble"]
    several = f"{count} starts within {document['spread']:.0%} (seed {document['seed']}), RMS"
    starts = "its own start" if count == 1 else several
    yield "drift", f"{document['periods']:g} nutation periods, {starts}"
    yield "errors", "at the last time; energy relative to max(|E'|, gMR)"
    yield "as t^", "grows as this power of time, with its standard error: 1.40(2) means 1.40 ± 0.02"


def _methods(methods: list[Mapping[str, Any]]) -> Table:
    table = grid(HEADINGS)
    for each in methods:
        table.add_row(each["name"], _cost(each), *_grown(each), _last(each["axis"]))
    return table


def _grown(method: Mapping[str, Any]) -> tuple[str, ...]:
    energy, phase = (_power(method, name) for name in ("energy", "phase"))
    return _last(method["energy"]), energy, _phase(method), phase


def _cost(method: Mapping[str, Any]) -> str:
    cost = method.get("us_per_period")
    return MISSING if cost is None else f"{cost:.3g}"


def _last(values: list[float | None]) -> str:
    return f"{values[-1]:.1e}" if values and values[-1] is not None else MISSING


def _phase(method: Mapping[str, Any]) -> str:
    """A phase error; one beyond a twentieth of a period is no number any more."""
    return (
        "lost" if method["periods"] and method["phase_s"][-1] is None else _last(method["phase_s"])
    )


def _power(method: Mapping[str, Any], name: str) -> str:
    """An exponent as physicists write it: 1.40(2) is 1.40 ± 0.02."""
    exponent, error = method[f"{name}_exponent"], method["stderr"][name]
    if exponent is None:
        return MISSING
    hundredths = max(1, round(100 * error))
    return f"{exponent:.2f}({hundredths})" if hundredths < 100 else f"{exponent:.0f}({error:.0f})"


def _notes(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for each in document["methods"]:
        if each["skipped"] is not None:
            yield each["name"], f"skipped: {each['skipped']}"
        elif each["periods"] and each["periods"][-1] < 0.5 * document["periods"]:
            yield each["name"], f"to {each['periods'][-1]:.4g} periods"
        for number, why in each["ended"].items():
            yield each["name"], f"start {number} ended early: {why}"
    if document["files"]:
        yield "files", ", ".join(map(str, document["files"].values()))
