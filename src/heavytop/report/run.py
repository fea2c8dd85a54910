"""A run, a plan and what is known of a motion without integrating: as facts and tables."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Final

from heavytop.report.parts import (
    MISSING,
    FactRows,
    Fitting,
    Known,
    Part,
    Table,
    files,
    headed,
    number,
    short,
)
from heavytop.run.estimates import duration

ROUNDING: Final = 8 * sys.float_info.epsilon  # of the largest in a column
MANY_TURNS: Final = 1000  # from which on an angle is also told as turns and a rest
FIRST_EVENTS: Final = 8  # rows shown at a terminal; the rest is counted
MOST_DIGITS, FEWEST_DIGITS = 12, 3  # of the numbers of an event
MEANS: Final = (
    ("period", "period", "s"),
    ("Δφ per period", "precession", "rad"),
    ("Δψ per period", "spin", "rad"),
)
OFF: Final = {  # what distances from the closed form are measured in
    "axis": "(a length)", "energy": "(relative)", "event_time": "s",
}  # fmt: skip


def run_parts(document: Known) -> Iterator[Part]:
    """A run: what is known without integrating, the plan, the end, the events, the errors."""
    motion, rows = document["motion"], document["events"]["table"]
    yield FactRows.of(_facts(document))
    if rows:
        yield events(rows, document["events"]["omitted"])
    bounds = [("off the closed form", _errors(document["errors"]))]
    if rows and motion["kind"].startswith("through-"):
        bounds.append(("at the pole", "φ is that before or after, π apart; φ̇ is its limit"))
    cost = [("cost", _cost(document["cost"]))] if "derive_s" in document["cost"] else []
    yield FactRows.of([*bounds, *cost, *files(document)])


def plan_parts(document: Known) -> Iterator[Part]:
    """A plan: the equations, their precision, why, and what is expected."""
    plan = document["plan"]
    expected = [("warning", warning) for warning in plan["warnings"]]
    if plan["cost_s"] is not None and plan["states"]:
        off = "no digit right" if plan["error"] >= 1 else f"off by {short(plan['error'])}"
        expected.append(("expected", f"{duration(plan['cost_s'])}, {off} at the end"))
    yield FactRows.of([*_plan(plan), *expected])


def _facts(document: Known) -> Iterator[tuple[str, str]]:
    yield "kind", _kind(document["motion"])
    yield from course(document["motion"], document["motion"])
    yield from constants(document["constants"])
    yield from _plan(document["plan"])
    if document["final"] is not None:
        yield from _final(document["final"])
        yield "events", _counts(document["events"])
    if missed := document["missed_digits"]:
        yield "digits missed", ", ".join(f"{name} {size:.1e}" for name, size in missed.items())
    if document["outcome"] != "finished":
        yield "outcome", document["outcome"]


def _kind(motion: Known) -> str:
    """Kind and tags of a motion, whether they are proved, and the margin."""
    tags = f" ({', '.join(motion['tags'])})" if motion["tags"] else ""
    proved = f", proved, margin {short(motion['margin'])}" if motion["certified"] else ""
    return f"{motion['kind']}{tags}{proved}"


def course(motion: Known, values: Known) -> Iterator[tuple[str, str]]:
    """Range of tilt, period, and means per period, of those there are, with their values."""
    low, high = (number(values[name]) for name in ("theta_min", "theta_max"))
    if MISSING not in (low, high):
        least, greatest = (f"{math.degrees(float(end)):.2f}°" for end in (low, high))
        if low == high:
            yield "θ", f"{low} rad ({least}), constant"
        else:
            yield "θ between", f"{low} and {high} rad ({least} to {greatest})"
    for label, name, unit in MEANS:
        if values[name] is not None:
            yield label, f"{number(values[name])} {unit}"
        if (
            name == "period"
            and motion["kind"] == "planar-pendulum"
            and "swinging" in motion["tags"]
        ):
            twice = number(2 * float(motion["period"]))
            yield "", f"the swing there and back {twice} s; φ jumps by π at the vertical"


def constants(values: Known) -> Iterator[tuple[str, str]]:
    """The constants of the motion, of those there are."""
    for label, name, unit in (
        ("E", "E", "J"),
        ("E'", "E_prime", "J"),
        ("p_φ", "p_phi", "kg m²/s"),
        ("p_ψ", "p_psi", "kg m²/s"),
    ):
        if values[name] is not None:
            yield label, f"{number(values[name])} {unit}"


def _plan(plan: Known) -> Iterator[tuple[str, str]]:
    marks = [mark for mark in ("projected", "folded") if plan[mark]]
    tolerance = f"tolerance {short(plan['tolerance'])}"
    how = (plan["precision"], f"{plan['states']} states", tolerance) if plan["states"] else ()
    yield "plan", ", ".join((plan["formulation"], *how, *marks))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def _final(final: Known) -> Iterator[tuple[str, str]]:
    angles = (("θ", "theta"), ("φ", "phi"), ("ψ", "psi"))
    known = [
        f"{label} = {number(final[name])}" for label, name in angles if final.get(name) is not None
    ]
    yield f"at t = {number(final['t'])} s", ", ".join(known) + " rad" if known else MISSING
    for label, name in angles[1:]:
        if abs(final.get(f"{name}_turns") or 0) >= MANY_TURNS:
            rest = number(final[f"{name}_mod"])
            yield "", f"{label} = {final[f'{name}_turns']} turns and {rest} rad"


def _counts(found: Known) -> str:
    counts = ((name, found[name]) for name in ("turning", "reversal", "cusp"))
    asked = [f"{count} {name}" for name, count in counts if count is not None]
    return ", ".join(asked) or "none asked for"


def events(rows: list[Known], omitted: int) -> Fitting:
    """The events, with as many digits as fit; units below the headings where it is narrow."""
    columns = {name: settled(row[name] for row in rows) for name in ("t", "theta", "phi", "phidot")}
    heads = ("event", *map(headed, columns), "residual [rad/s]")

    def table(digits: int) -> Table:
        below = "\n" if digits < MOST_DIGITS else " "
        numbers = zip(*([number(x, digits) for x in c] for c in columns.values()), strict=True)
        return Table(
            tuple(head.replace(" ", below) for head in heads),
            tuple(
                (row["kind"], *each, short(row["residual"]))
                for row, each in zip(rows, numbers, strict=True)
            ),
            first=FIRST_EVENTS,
            more=omitted,
        )

    return Fitting(tuple((table(n),) for n in range(MOST_DIGITS, FEWEST_DIGITS - 1, -1)))


def settled(values: Iterable[Any]) -> list[float | None]:
    """The numbers of a column, those that are rounding beside the largest as 0.

    Examples
    --------
    >>> settled([-15, -7.1e-15, "12.3", None])
    [-15.0, 0.0, 12.3, None]
    """
    found = [None if value is None else float(value) for value in values]
    least = ROUNDING * max((abs(value) for value in found if value is not None), default=0.0)
    return [0.0 if value is not None and abs(value) < least else value for value in found]


def _errors(found: Mapping[str, Any]) -> str:
    known = (
        f"{name.replace('_', ' ')} {short(size)} {OFF.get(name, 'rad')}"
        for name, size in found.items()
        if isinstance(size, int | float)
    )
    return ", ".join(filter(None, (*known, found.get("why_not"))))


def _cost(cost: Known) -> str:
    parts = [f"{cost['steps']} steps"]
    for label, name in (("derive", "derive_s"), ("compile", "compile_s"), ("run", "integrate_s")):
        if cost[name] is not None:
            parts.append(f"{label} {1000 * cost[name]:.1f} ms")
    if cost["us_per_period"] is not None:
        parts.append(f"{cost['us_per_period']:.1f} µs a period")
    return ", ".join(parts)
