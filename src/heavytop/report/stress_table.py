"""A stress test's document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import MISSING, Fitted, grid, two_columns
from heavytop.results.stress_marks import MARKS, UNTOLD, heading

UNTOLD_RULE: Final = "nothing to tell: conditioning leaves no digits, and what is there is chance"
ACROSS: Final = 8  # methods side by side, or fewer where it is narrow


def stress_table(document: Mapping[str, Any]) -> Group:
    """The table of one stress test.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/stress/1``.

    Returns
    -------
    rich.console.Group
        A row for each case with a column for each method, what the marks mean, and what failed
        and why.
    """
    return Group(*_parts(document))


def _parts(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    found = {(run["case"], run["method"]): run for run in document["cases"]}
    names = [m for m in document["methods"] if any(m == run["method"] for run in document["cases"])]
    yield Text("stress: digits lost beyond what conditioning allows", style="bold")

    def tables(across: int) -> Group:
        parts = (names[first : first + across] for first in range(0, len(names), across))
        return Group(*(each for part in parts for each in (_table(document, part, found), Text())))

    yield Fitted(tables, range(ACROSS, 0, -1))
    yield two_columns(_meanings(document))
    if failed := list(_failed(document)):
        yield Text()
        yield two_columns(failed)
    if notes := list(_notes(document)):
        yield Text()
        yield two_columns(notes)


def _table(
    document: Mapping[str, Any],
    names: list[str],
    found: Mapping[tuple[str, str], Mapping[str, Any]],
) -> Table:
    table = grid(["case", *(heading(document, name).replace(" ", "\n") for name in names)])
    for case in document["hard"]:
        cells = [cell(found.get((case, name))) for name in names]
        if any(each != MISSING for each in cells):
            table.add_row(case, *cells)
    return table


def cell(run: Mapping[str, Any] | None) -> str:
    """One run in a few letters: the digits it lost, and a mark where it failed.

    Examples
    --------
    >>> cell({"outcome": "inaccurate", "digits_lost": 9.42, "untold": False, "turns": None})
    '9.4 !'
    """
    if run is None:
        return MISSING
    if run["untold"]:
        return UNTOLD
    lost = run["digits_lost"]
    number = [] if lost is None else [f"{lost:.1f}" if lost else "0"]
    mark = [MARKS[run["outcome"]]] if run["outcome"] in MARKS else []
    return " ".join([*number, *mark])


def _meanings(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    seen = {run["outcome"] for run in document["cases"]}
    for word, rule in document["rules"].items():
        if word in seen and word in MARKS:
            yield f"{MARKS[word]} {word}", rule
    if any(run["untold"] for run in document["cases"]):
        yield UNTOLD, UNTOLD_RULE


def _failed(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What failed, a line for each case, outcome and note, with the methods it befell."""
    groups: dict[tuple[str, str, str], list[str]] = {}
    for run in document["cases"]:
        if run["outcome"] != "ok" or run["untold"] or any(run["turns"] or ()):
            key = (run["case"], run["outcome"], run["note"])
            groups.setdefault(key, []).append(run["method"])
    order = list(document["hard"])
    for (case, word, note), names in sorted(groups.items(), key=lambda kv: order.index(kv[0][0])):
        yield case, f"{word}: {', '.join(names)}{note and f': {note}'}"


def _notes(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    apart: dict[tuple[str, str], int] = {}
    for each in document["apart"]:
        key = (each["method"], each["reason"])
        apart[key] = apart.get(key, 0) + 1
    for (method, reason), n in apart.items():
        yield "left out", f"{method} at {n} case{'s'[: n > 1]}: {reason}"
    reasons: dict[str, list[str]] = {}
    for each in document["skipped"]:
        reasons.setdefault(each["reason"], []).append(f"{each['case']}/{each['method']}")
    for reason, names in reasons.items():
        yield "skipped", f"{reason}: {', '.join(names)}"
    wrong = document["auto"]["silently_wrong"]
    told = f"silently wrong: {', '.join(wrong) or 'nowhere'}"
    yield "auto", told if document["auto"]["run"] else "was not run"
    if document["files"]:
        yield "files", ", ".join(map(str, document["files"].values()))
