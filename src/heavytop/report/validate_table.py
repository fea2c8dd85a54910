"""A validation's document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import MISSING, two_columns

MARKS: Final = {True: "ok", False: "FAIL", None: "skip"}


def validate_table(document: Mapping[str, Any]) -> Group:
    """The table of one validation.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/validate/1``.

    Returns
    -------
    rich.console.Group
        For each authority, what is claimed: measured beside its bound; then what went wrong or
        was skipped, and why.
    """
    return Group(*_parts(document))


def _parts(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    claims = document["claims"]
    yield Text("validate: what is measured is at most its bound", style="bold")
    for authority in dict.fromkeys(claim["authority"] for claim in claims):
        yield Text()
        yield Text(authority, style="cyan")
        yield _table([claim for claim in claims if claim["authority"] == authority])
    if reasons := list(_reasons(claims)):
        yield Text()
        yield two_columns(reasons)
    yield Text()
    yield Text(summary(document), style="bold")


def _table(claims: list[Mapping[str, Any]]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="cyan")
    table.add_column("", no_wrap=True)
    table.add_column("claim", ratio=1, overflow="fold")
    table.add_column("numbers", no_wrap=True)
    table.add_column("measured", justify="right", no_wrap=True)
    table.add_column("bound", justify="right", no_wrap=True)
    for claim in claims:
        mark = Text(MARKS[claim["passed"]], style="red" if claim["passed"] is False else "")
        said = Text(claim["statement"])
        found = number(claim["measured"]), number(claim["bound"])
        table.add_row(mark, said, Text(claim["numbers"]), *found)
    return table


def number(value: float | None) -> str:
    """A number to two digits.

    Examples
    --------
    >>> number(1.8e-14), number(None)
    ('1.8e-14', '–')
    """
    return MISSING if value is None else f"{value:.2g}"


def _reasons(claims: list[Mapping[str, Any]]) -> Iterator[tuple[str, str]]:
    for claim in claims:
        if claim["skipped"]:
            yield claim["id"], f"skipped: {claim['skipped']}"
        elif claim["failure"]:
            yield claim["id"], claim["failure"]


def summary(document: Mapping[str, Any]) -> str:
    """How many claims hold, on how many authorities.

    Examples
    --------
    >>> summary({"counts": {"passed": 3, "failed": 0, "skipped": 1}, "authorities": 2})
    '3 claims hold, 1 was skipped; 2 authorities'
    """
    held, failed, skipped = (document["counts"][word] for word in ("passed", "failed", "skipped"))
    parts = [f"{held} claim{_s(held)} hold{'' if held != 1 else 's'}"]
    if failed:
        parts.append(f"{failed} fail{'' if failed != 1 else 's'}")
    if skipped:
        parts.append(f"{skipped} {'was' if skipped == 1 else 'were'} skipped")
    n = document["authorities"]
    return f"{', '.join(parts)}; {n} {'authority' if n == 1 else 'authorities'}"


def _s(n: int) -> str:
    return "" if n == 1 else "s"
