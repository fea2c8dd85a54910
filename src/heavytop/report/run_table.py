"""A run's document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import (
    MISSING,
    Fitted,
    constants,
    course,
    distances,
    grid,
    in_digits,
    kind,
    number,
    settled,
    short,
    title,
    two_columns,
)

MANY_TURNS = 1000  # from which on an angle is also told as turns and a rest
EVENT_HEADINGS = ("event", "t [s]", "θ [rad]", "φ [rad]", "φ̇ [rad/s]", "residual [rad/s]")
FIRST_EVENTS = 8  # rows shown; the rest is counted
MOST_DIGITS, FEWEST_DIGITS = 12, 3  # of the numbers of an event


def run_table(document: Mapping[str, Any]) -> Group:
    """The table of one run.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/run/1``.

    Returns
    -------
    rich.console.Group
        Title, what is known without integrating, the plan, the end, the events, the errors.

    Raises
    ------
    KeyError
        A part of the document is missing.
    """
    return Group(*_parts(document))


def _parts(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    yield title(document["scene"])
    yield two_columns(_rows(document))
    if document["events"]["table"]:
        yield Text()
        yield from _events(document["events"]["table"], document["events"]["omitted"])
        if document["motion"]["kind"].startswith("through-"):
            yield Text("at the pole: φ is that before or after, π apart; φ̇ is its limit", "dim")
    yield Text()
    yield two_columns(_bounds(document))


def _rows(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "kind", kind(document["motion"])
    yield from course(document["motion"])
    yield from constants(document["constants"])
    yield from _plan(document["plan"])
    if document["final"] is not None:
        yield from _final(document["final"])
        yield "events", _counts(document["events"])


def _plan(plan: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    marks = [mark for mark in ("projected", "folded") if plan[mark]]
    tolerance = f"tolerance {short(plan['tolerance'])}"
    how = (plan["precision"], f"{plan['states']} states", tolerance) if plan["states"] else ()
    yield "plan", ", ".join((plan["formulation"], *how, *marks))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def _final(final: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    known = [
        f"{label} = {number(final[name])}"
        for label, name in (("θ", "theta"), ("φ", "phi"), ("ψ", "psi"))
        if final.get(name) is not None
    ]
    yield f"at t = {number(final['t'])} s", ", ".join(known) + " rad" if known else MISSING
    for label, name in (("φ", "phi"), ("ψ", "psi")):
        if abs(final.get(f"{name}_turns") or 0) >= MANY_TURNS:
            rest = number(final[f"{name}_mod"])
            yield "", f"{label} = {final[f'{name}_turns']} turns and {rest} rad"


def _counts(events: Mapping[str, Any]) -> str:
    counts = ((name, events[name]) for name in ("turning", "reversal", "cusp"))
    asked = [f"{count} {name}" for name, count in counts if count is not None]
    return ", ".join(asked) or "none asked for"


def _events(rows: list[Mapping[str, Any]], omitted: int) -> Iterator[RenderableType]:
    """The first events, with as many digits as fit; units below the headings where it is narrow."""
    columns = [settled(row[name] for row in rows) for name in ("t", "theta", "phi", "phidot")]

    def table(digits: int) -> Table:
        below = "\n" if digits < MOST_DIGITS else " "
        found = grid([heading.replace(" ", below) for heading in EVENT_HEADINGS])
        for row, *numbers in zip(rows[:FIRST_EVENTS], *columns, strict=False):
            told = (in_digits(value, digits) for value in numbers)
            found.add_row(row["kind"], *told, short(row["residual"]))
        return found

    yield Fitted(table, range(MOST_DIGITS, FEWEST_DIGITS - 1, -1))
    if len(rows) > FIRST_EVENTS:
        yield Text(f"… and {len(rows) - FIRST_EVENTS + omitted} more")


def _bounds(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "off the closed form", _errors(document["errors"])
    yield "cost", _cost(document["cost"])
    if document["files"]:
        yield "files", ", ".join(map(str, document["files"].values()))


def _errors(found: Mapping[str, Any]) -> str:
    return ", ".join(filter(None, (*distances(found, short), found.get("why_not"))))


def _cost(cost: Mapping[str, Any]) -> str:
    parts = [f"{cost['steps']} steps"]
    for label, name in (("derive", "derive_s"), ("compile", "compile_s"), ("run", "integrate_s")):
        if cost[name] is not None:
            parts.append(f"{label} {1000 * cost[name]:.1f} ms")
    if cost["us_per_period"] is not None:
        parts.append(f"{cost['us_per_period']:.1f} µs a period")
    return ", ".join(parts)
