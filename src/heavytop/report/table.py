"""A run's document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

FIRST_EVENTS = 8  # rows shown; the rest is counted
_MISSING = "–"


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
    yield Text(_title(document["scene"]), style="bold")
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    for label, text in _rows(document):
        table.add_row(Text(label), Text(text))  # Text: what a scene says is never markup
    yield table
    if document["events"]["table"]:
        yield Text()
        yield _event_table(document["events"]["table"])
    yield Text()
    yield _bounds(document)


def _title(scene: Mapping[str, Any]) -> str:
    return " — ".join(filter(None, (scene.get("name"), scene.get("title"))))


def _rows(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "kind", _kind(document["motion"])
    yield from _motion(document["motion"])
    yield from _constants(document["constants"])
    yield from _plan(document["plan"])
    yield from _final(document["final"])
    yield "events", _counts(document["events"])


def _kind(motion: Mapping[str, Any]) -> str:
    tags = f" ({', '.join(motion['tags'])})" if motion["tags"] else ""
    proof = "proved" if motion["certified"] else "by sign, not proved"
    margin = "" if motion["margin"] is None else f", margin {_short(motion['margin'])}"
    return f"{motion['kind']}{tags}; {proof}{margin}"


def _motion(motion: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    low, high = motion["theta_min"], motion["theta_max"]
    if low is not None and high is not None:
        yield "θ between", f"{_number(low)} and {_number(high)} rad ({_degrees(low, high)})"
    for label, name, unit in (
        ("period", "period", "s"),
        ("Δφ per period", "precession", "rad"),
        ("Δψ per period", "spin", "rad"),
    ):
        if motion[name] is not None:
            yield label, f"{_number(motion[name])} {unit}"


def _degrees(low: Any, high: Any) -> str:
    return f"{math.degrees(float(low)):.2f}° to {math.degrees(float(high)):.2f}°"


def _constants(constants: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for label, name, unit in (
        ("E", "E", "J"),
        ("E'", "E_prime", "J"),
        ("p_φ", "p_phi", "kg m²/s"),
        ("p_ψ", "p_psi", "kg m²/s"),
    ):
        if constants[name] is not None:
            yield label, f"{_number(constants[name])} {unit}"


def _plan(plan: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    marks = [mark for mark in ("projected", "folded") if plan[mark]]
    tolerance = f"tolerance {_short(plan['tolerance'])}"
    states = f"{plan['states']} states"
    yield "plan", ", ".join((plan["formulation"], plan["precision"], states, tolerance, *marks))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def _final(final: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    known = [
        f"{label} = {_number(final[name])}"
        for label, name in (("θ", "theta"), ("φ", "phi"), ("ψ", "psi"))
        if final.get(name) is not None
    ]
    yield f"at t = {_short(final['t'])} s", ", ".join(known) + " rad" if known else _MISSING


def _counts(events: Mapping[str, Any]) -> str:
    counts = ((name, events[name]) for name in ("turning", "reversal", "cusp"))
    asked = [f"{count} {name}" for name, count in counts if count is not None]
    return ", ".join(asked) or "none asked for"


def _event_table(rows: list[Mapping[str, Any]]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="cyan")
    table.add_column("event")
    for heading in ("t [s]", "θ [rad]", "φ [rad]", "φ̇ [rad/s]", "residual"):
        table.add_column(heading, justify="right")
    for row in rows[:FIRST_EVENTS]:
        numbers = (_number(row[name]) for name in ("t", "theta", "phi", "phidot"))
        table.add_row(row["kind"], *numbers, _short(row["residual"]))
    if len(rows) > FIRST_EVENTS:
        table.add_row(f"… and {len(rows) - FIRST_EVENTS} more")
    return table


def _bounds(document: Mapping[str, Any]) -> Table:
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="cyan", no_wrap=True)
    table.add_column()
    table.add_row("off the closed form", Text(_errors(document["errors"])))
    table.add_row("cost", Text(_cost(document["cost"])))
    if document["files"]:
        table.add_row("files", Text(", ".join(map(str, document["files"].values()))))
    return table


def _errors(found: Mapping[str, Any]) -> str:
    sizes = {name: size for name, size in found.items() if isinstance(size, int | float)}
    known = [f"{name.replace('_', ' ')} {_short(size)}" for name, size in sizes.items()]
    return ", ".join(filter(None, (*known, found.get("why_not"))))


def _cost(cost: Mapping[str, Any]) -> str:
    parts = [f"{cost['steps']} steps"]
    for label, name in (("derive", "derive_s"), ("compile", "compile_s"), ("run", "integrate_s")):
        if cost[name] is not None:
            parts.append(f"{label} {1000 * cost[name]:.1f} ms")
    if cost["us_per_period"] is not None:
        parts.append(f"{cost['us_per_period']:.1f} µs a period")
    return ", ".join(parts)


def _number(value: Any) -> str:
    """A value to 12 digits, or as the document spells it when it is a decimal string."""
    if value is None:
        return _MISSING
    return value if isinstance(value, str) else f"{value:.12g}"


def _short(value: Any) -> str:
    return _MISSING if value is None else f"{float(value):.3g}"
