"""What a check says of a trajectory: its numbers, as a document and in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from heavytop.checking.data import ANGLES, RATES, Array, plain
from heavytop.checking.problem import Origin
from heavytop.checking.slips import SOUGHT, Slip
from heavytop.display import Plotted
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.spelling import harmless

SCHEMA: Final = "heavytop/check/1"
CHARTED: Final = 1000  # rows in the document
MOST_NAMED: Final = 6  # columns that are ignored, in a line
UNKNOWN: Final = (
    "no known mistake fits: halve the step or the tolerance; if the error stays, compare A, C, gMR "
    "and the start"
)
MEASURED: Final = ("axis", *ANGLES, "energy", "p_phi", "p_psi")
START: Final = (*ANGLES, *RATES, "omega3")
ORIGINS: Final = {"scene": "of the scene", "first row": "of the first row", "fitted": "fitted"}
UNITS: Final = {
    "axis": "a length",
    "energy": "of max(|E'|, gMR)",
    "p_phi": "relative",
    "p_psi": "relative",
}
EVENTS: Final = {  # what they are called, and what has to be told for them
    "turning": ("turning points", ("theta",)),
    "reversal": ("reversals", ("phi",)),
    "cusp": ("cusps", ("theta", "phi")),
}


class Size(NamedTuple):
    """How large an error is over all rows.

    Attributes
    ----------
    max : float
        Its largest magnitude [rad, or relative].
    rms : float
        Its root mean square.
    t_max : float
        When it is largest [s].
    """

    max: float
    rms: float
    t_max: float


class Phase(NamedTuple):
    """How far ahead the data run.

    Attributes
    ----------
    last : float
        Of the nutation, or of the precession where the tilt is steady, near the end [s].
    rms : float
        The root mean square, of windows of whole periods [s].
    max : float
        The one of largest magnitude [s].
    t : float
        When the last is [s]: the middle of the last period, or of some.
    """

    last: float
    rms: float
    max: float
    t: float


class Count(NamedTuple):
    """How many events of a kind there are.

    Attributes
    ----------
    data : int or None
        In the data; None where their rows are too far apart to count.
    exact, exact_most : int
        In the exact motion, proved; two numbers where one may lie at an end of the data.
    """

    data: int | None
    exact: int
    exact_most: int


@dataclass(frozen=True, slots=True, eq=False)
class Check(Plotted):
    """What is to be said of a trajectory that somebody else computed.

    Attributes
    ----------
    name : str
        Where it is from.
    top : Top
        What spins.
    start : State
        The start of the exact motion that the data are held against.
    origin : {"scene", "first row", "fitted"}
        Where that start is from.
    errors : mapping from str to Size
        By quantity, as far as the data tell it: axis, theta, phi (precession), psi (spin) [rad];
        energy E' of max(|E'|, gMR), p_phi and p_psi of the larger momentum.
    digits : float
        Decimal digits of the axis, or of the first angle that is told, where they are fewest.
    phase : Phase or None
        How far the data run ahead; None where they do not tell it.
    growth : mapping from str to (float or None)
        The powers [1] of time by which phase, axis and energy grow; None where that is not clear.
    events : mapping from str to Count
        Turning points, reversals and cusps.
    condition : float
        How far the axis moves at most when every number of the problem changes in its last binary
        digit [rad].
    columns : mapping from str to str
        Of every column the quantity that was taken from it; empty where none was.
    slip : Slip or None
        The usual slip that explains the error.
    curves : mapping from str to array
        The errors at the times ``t`` [s], in their units, and ``phase`` [s] at ``phase_t`` [s].
    """

    name: str
    top: Top
    start: State
    origin: Origin
    errors: Mapping[str, Size]
    digits: float
    phase: Phase | None
    growth: Mapping[str, float | None]
    events: Mapping[str, Count]
    condition: float
    columns: Mapping[str, str]
    slip: Slip | None
    curves: Mapping[str, Array] = field(repr=False)

    def __str__(self) -> str:
        return "\n".join(f"{name:14}  {text}" for name, text in told(self.document()))

    def document(self) -> dict[str, Any]:
        """The document of the schema ``heavytop/check/1``; of long curves some rows."""
        t = self.curves["t"]
        errors = {n: self.errors[n]._asdict() if n in self.errors else None for n in MEASURED}
        some = {n: x[:: -(-x.size // CHARTED) or 1].tolist() for n, x in self.curves.items()}
        return {
            "schema": SCHEMA,
            "scene": {
                "name": self.name,
                "title": "",
                "top": {name: float(getattr(self.top, name)) for name in ("A", "C", "gMR")},
                "start": {name: float(getattr(self.start, name)) for name in START},
            },
            "origin": self.origin,
            "data": {
                "file": self.name,
                "rows": t.size,
                "span": [float(t[0]), float(t[-1])],
                "columns": {name: quantity or None for name, quantity in self.columns.items()},
                "read_as": [*dict.fromkeys(x for x in self.columns.values() if x not in ("", "t"))],
            },
            "errors": errors | {"phase_s": None if self.phase is None else self.phase._asdict()},
            "growth": dict(self.growth),
            "events": {name: count._asdict() for name, count in self.events.items()},
            "condition": self.condition,
            "digits": self.digits,
            "slip": None if self.slip is None else self.slip._asdict(),
            "curves": {n: [None if x != x else x for x in curve] for n, curve in some.items()},
        }


def told(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Labels and texts: what a document ``heavytop/check/1`` says to a person.

    Parameters
    ----------
    document : mapping
    """
    known = {name: size for name, size in document["errors"].items() if size is not None}
    phase, of = known.pop("phase_s", None), document["data"]
    start = (f"{k} = {value:.10g}" for k, value in document["scene"]["start"].items() if value)
    yield "data", "{file}: {rows} rows from {span[0]:g} s to {span[1]:g} s".format(**of)
    yield "columns", _columns(of["columns"])
    yield "start", f"{ORIGINS[document['origin']]}: {', '.join(start)}"
    yield "digits", f"{document['digits']:.1f}"
    for name, size in known.items():
        unit = UNITS.get(name, "rad")
        yield name, "{max:.2e} at t = {t_max:g} s, RMS {rms:.2e} ({unit})".format(unit=unit, **size)
    if phase is not None:
        way, power = "behind" if phase["last"] < 0 else "ahead", document["growth"]["phase"]
        grows = "" if power is None else f", grows as t^{power:.1f}"
        yield "phase", f"{abs(phase['last']):.2e} s {way} at t = {phase['t']:g} s{grows}"
    for name, count in document["events"].items():
        plural, needed = EVENTS[name]
        lacking = " and ".join(x for x in needed if x not in known)
        found = f"{lacking} is not in the data" if lacking else "too few rows to count"
        found = found if count["data"] is None else str(count["data"])
        exact, most = count["exact"], count["exact_most"]
        exact = f"{exact} to {most}" if most > exact else f"{exact}"
        yield plural, f"{found}; exact {exact}"
    change = "effect of a change in the last binary digit of the problem"
    yield "conditioning", f"{document['condition']:.1e} rad: {change}"
    if (slip := document["slip"]) is not None:
        before, after = slip["error_before"], slip["error_after"]
        smaller = "inf" if before is None else f"{before / after:.1e}"
        mended = f"undoing it makes the error {smaller} times smaller ({slip['digits']:.1f} digits)"
        yield "slip", f"{slip['name']}: {slip['sentence']}; {mended}"
    elif _misfit(known) > max(SOUGHT, document["condition"]):
        yield "slip", UNKNOWN


def _misfit(errors: Mapping[str, Any]) -> float:
    """The RMS error by which a slip is looked for: that of the axis, or of the first angle told."""
    return next((float(errors[name]["rms"]) for name in ("axis", *ANGLES) if name in errors), 0.0)


def _columns(columns: Mapping[str, str | None]) -> str:
    """The columns that were used, and the others, or the first of very many."""
    ignored = [name for name, quantity in columns.items() if not quantity]
    known = ", ".join(
        harmless(name if plain(name).startswith(plain(quantity)) else f"{name} ({quantity})")
        for name, quantity in columns.items()
        if quantity
    )
    if not ignored:
        return known
    more = len(ignored) - MOST_NAMED
    others = ", ".join(map(harmless, ignored[:MOST_NAMED]))
    return f"{known}; ignored: {others}" + (f" and {more} more" if more > 0 else "")
