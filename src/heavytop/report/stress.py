"""A stress test, as tables and facts; and the cases and methods of one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from heavytop.report.parts import MISSING, FactRows, Fitting, Known, Part, Table, files, grouped
from heavytop.results.stress import MARKS, UNTOLD

UNTOLD_RULE: Final = "nothing to tell: conditioning leaves no digits, and what is there is chance"
SHOWN: Final = ("short", "formulation", "setting")
LEFT_OUT: Final = tuple((name, "0") for name in ("phi", "psi", "phidot", "thetadot"))


def stress_parts(document: Known) -> Iterator[Part]:
    """A row for each case with a column for each method; what the marks mean; what failed."""
    run = {each["method"] for each in document["cases"]}
    names = [name for name in document["methods"] if name in run]
    yield "stress: digits lost beyond what conditioning allows"
    if names:
        yield Fitting(tuple(_tables(document, names, n) for n in range(len(names), 0, -1)))
    for facts in (_meanings(document), _failed(document), [*_notes(document), *files(document)]):
        if rows := tuple(facts):
            yield FactRows(rows)


def stress_cases_parts(document: Known) -> Iterator[Part]:
    """The cases: top, start, span and why each is hard; and the methods."""
    yield FactRows.of((case["name"], _described(case)) for case in document["cases"])
    yield FactRows.of(
        (each["name"], ", ".join(each[key] for key in SHOWN if each[key]))
        for each in document["methods"]
    )
    yield "no case can be added: for a scene of your own there are drift and workprec"


def _described(case: Known) -> str:
    """Why a case is hard; then its top, start and span."""
    known = [*case["top"].items(), *case["start"].items()]
    given = ", ".join(f"{name} = {value}" for name, value in known if (name, value) not in LEFT_OUT)
    return f"{case['why']}\n{given}; {case['span']}"


def _tables(document: Known, names: Sequence[str], across: int) -> tuple[Table, ...]:
    """Tables of so many methods side by side."""
    found = {(run["case"], run["method"]): run for run in document["cases"]}
    tables = []
    for first in range(0, len(names), across):
        some = names[first : first + across]
        rows = ((case, *(cell(found.get((case, n))) for n in some)) for case in document["hard"])
        head = ("case", *(document["methods"][name].replace(" ", "\n") for name in some))
        tables.append(Table(head, tuple(row for row in rows if {*row[1:]} != {MISSING})))
    return tuple(tables)


def cell(run: Known | None) -> str:
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


def _meanings(document: Known) -> Iterator[tuple[str, str]]:
    seen = {run["outcome"] for run in document["cases"]}
    for word, rule in document["rules"].items():
        if word in seen and word in MARKS:
            yield f"{MARKS[word]} {word}", rule
    if any(run["untold"] for run in document["cases"]):
        yield UNTOLD, UNTOLD_RULE


def _failed(document: Known) -> Iterator[tuple[str, str]]:
    """What failed, a line for each case, outcome and note, with the methods it befell."""
    order = list(document["hard"])
    failed = [
        run
        for run in sorted(document["cases"], key=lambda run: order.index(run["case"]))
        if run["outcome"] != "ok" or run["untold"] or any(run["turns"] or ())
    ]
    for (case, word, note), runs in grouped(failed, "case", "outcome", "note").items():
        yield case, f"{word}: {', '.join(r['method'] for r in runs)}{note and f': {note}'}"


def _notes(document: Known) -> Iterator[tuple[str, str]]:
    for (reason,), some in grouped(document["skipped"], "reason").items():
        yield (
            "skipped",
            f"{reason}: {', '.join(each['case'] + '/' + each['method'] for each in some)}",
        )
    wrong = document["auto"]["silently_wrong"]
    told = f"silently wrong: {', '.join(wrong) or 'nowhere'}"
    yield "auto", told if document["auto"]["run"] else "was not run"
