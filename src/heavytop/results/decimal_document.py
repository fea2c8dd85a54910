"""What a run in more than double precision has to say, as decimal texts above fifteen digits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from heavytop.numbers.decimals import Number

if TYPE_CHECKING:
    from heavytop.run.events import Event
    from heavytop.run.high_precision import Decimals

NUMBER_DIGITS = 15  # what a number of JSON surely holds


def final_document(decimals: Decimals, *, attitude: bool) -> dict[str, Any]:
    """Return the motion at the end.

    Parameters
    ----------
    decimals : Decimals
    attitude : bool
        Whether the quaternion is wanted.
    """
    end = decimals.samples[-1]
    final: dict[str, Any] = {"t": shown(decimals, end.t), "theta": shown(decimals, end.theta)}
    for angle in ("phi", "psi"):
        final |= _with_turns(decimals, angle, getattr(end, angle))
    rates = ("thetadot", "phidot", "psidot")
    final |= {name: shown(decimals, getattr(end, name)) for name in rates}
    final |= {n: [shown(decimals, x) for x in getattr(end, n)] for n in ("axis", "omega")}
    quaternion = [shown(decimals, x) for x in end.quaternion]
    return final | {"quaternion": quaternion if attitude else None}


def _with_turns(decimals: Decimals, angle: str, value: Number) -> dict[str, Any]:
    turns, rest = None, value
    if value == value:
        ctx = decimals.run.ctx
        turns = int(ctx.floor(value / (2 * ctx.pi)))
        rest = value - turns * 2 * ctx.pi
    texts = {angle: shown(decimals, value), f"{angle}_mod": shown(decimals, rest)}
    return texts | {f"{angle}_turns": turns}


def event_rows(decimals: Decimals, most: int) -> list[dict[str, Any]]:
    """Return the first rows of the table of events."""
    return [_row(decimals, event) for event in decimals.events[:most]]


def _row(decimals: Decimals, event: Event) -> dict[str, Any]:
    numbers = {n: getattr(event.sample, n) for n in ("t", "theta", "phi", "phidot")}
    row: dict[str, Any] = {name: shown(decimals, x) for name, x in numbers.items()}
    return {"kind": event.kind} | row | {"residual": float(event.residual)}


def shown(decimals: Decimals, x: Number) -> float | str | None:
    """Return a number as the document has it, None for nan."""
    text = decimals.text(x)
    return text if text is None or decimals.digits > NUMBER_DIGITS else float(x)
