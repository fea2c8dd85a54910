"""A validation: what is claimed, measured beside its bound."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Final

from heavytop.report.parts import FAIL, FactRows, Known, Part, Table, files, grouped, number

MARKS: Final = {True: "ok", False: FAIL, None: "skip"}
HEAD: Final = ("", "claim", "numbers", "measured", "bound")


def validate_parts(document: Known) -> Iterator[Part]:
    """For each authority its claims; then what went wrong or was skipped, and why."""
    yield "validate: what is measured is at most its bound"
    yield from (
        Table(HEAD, tuple(map(_row, claims)), authority, left=3)
        for (authority,), claims in grouped(document["claims"], "authority").items()
    )
    if reasons := [*_reasons(document["claims"]), *files(document)]:
        yield FactRows.of(reasons)
    yield summary(document["claims"])


def _row(claim: Known) -> tuple[str, ...]:
    found = number(claim["measured"], 2), number(claim["bound"], 2)
    return MARKS[claim["passed"]], claim["statement"], claim["numbers"], *found


def _reasons(claims: list[Known]) -> Iterator[tuple[str, str]]:
    for claim in claims:
        if claim["skipped"]:
            yield claim["id"], f"skipped: {claim['skipped']}"
        elif claim["failure"] or claim["passed"] is False:
            yield claim["id"], claim["failure"] or "out of its bound"


def summary(claims: list[Known]) -> str:
    """How many claims hold, fail and were skipped.

    Examples
    --------
    >>> summary([{"passed": True}, {"passed": None}])
    '1 holds, none fails, 1 skipped'
    """
    count = Counter(claim["passed"] for claim in claims)
    words = [f"{count[True]} {'holds' if count[True] == 1 else 'hold'}"]
    words.append(f"{count[False] or 'none'} {'fail' if count[False] > 1 else 'fails'}")
    return ", ".join([*words, f"{count[None]} skipped"] if count[None] else words)
