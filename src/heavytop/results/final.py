"""The state at the end of a run, in doubles or in more digits: decimal texts above fifteen."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from heavytop.numbers.decimals import Number

if TYPE_CHECKING:
    from heavytop.run.events import Event
    from heavytop.run.trajectory import Decimals

NUMBER_DIGITS: Final = 15  # what a number of JSON surely holds


def final_document(
    end: Any,
    shown: Callable[[Any], Any],
    turned: Callable[[str], tuple[int | None, Any]],
    *,
    attitude: bool,
) -> dict[str, Any]:
    """Return the motion at the end.

    Parameters
    ----------
    end : object
        The state.
    shown : callable
        A number as the document has it.
    turned : callable
        The whole turns of an angle, by its name, and the rest.
    attitude : bool
        Whether the quaternion is wanted.
    """
    final = {name: shown(getattr(end, name)) for name in ("t", "theta")}
    for angle in ("phi", "psi"):
        turns, rest = turned(angle)
        final |= {angle: shown(getattr(end, angle)), f"{angle}_turns": turns}
        final |= {f"{angle}_mod": shown(rest)}
    final |= {name: shown(getattr(end, name)) for name in ("thetadot", "phidot", "psidot")}
    final |= {name: [shown(x) for x in getattr(end, name)] for name in ("axis", "omega")}
    return final | {"quaternion": [shown(x) for x in end.quaternion] if attitude else None}


def split(angle: Any, math: Any) -> tuple[int | None, Any]:
    """Whole turns and the rest, by the pi and the floor of `math`."""
    if angle != angle:
        return None, angle
    turns = int(math.floor(angle / (2 * math.pi)))
    return turns, angle - turns * 2 * math.pi


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
