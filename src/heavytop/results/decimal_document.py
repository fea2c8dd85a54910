"""What a run in more than double precision has to say, as decimal texts above fifteen digits."""

from __future__ import annotations

from typing import Any

from heavytop.numbers.decimals import Number
from heavytop.run.decimals.polish import Polished
from heavytop.run.decimals.result import Decimals

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
    vectors = {"axis": (end.axis, 3), "omega": (end.omega, 3)}
    for name, (vector, width) in vectors.items():
        final[name] = [shown(decimals, x) for x in vector or (None,) * width]
    quaternion = end.quaternion or (None,) * 4
    final["quaternion"] = [shown(decimals, x) for x in quaternion] if attitude else None
    return final


def _with_turns(decimals: Decimals, angle: str, value: Number | None) -> dict[str, Any]:
    turns, rest = None, None
    if value is not None:
        ctx = decimals.run.reader.ctx
        turns = int(ctx.floor(value / (2 * ctx.pi)))
        rest = value - turns * 2 * ctx.pi
    texts = {angle: shown(decimals, value), f"{angle}_mod": shown(decimals, rest)}
    return texts | {f"{angle}_turns": turns}


def event_rows(decimals: Decimals, most: int) -> list[dict[str, Any]]:
    """Return the first rows of the table of events."""
    return [_row(decimals, event) for event in decimals.events[:most]]


def _row(decimals: Decimals, event: Polished) -> dict[str, Any]:
    numbers = {n: getattr(event.sample, n) for n in ("t", "theta", "phi", "phidot")}
    row: dict[str, Any] = {name: shown(decimals, x) for name, x in numbers.items()}
    return {"kind": event.kind} | row | {"residual": float(event.residual)}


def shown(decimals: Decimals, x: Number | None) -> float | str | None:
    """Return a number as the document has it."""
    if x is None or decimals.digits > NUMBER_DIGITS:
        return decimals.text(x)
    return float(x)
