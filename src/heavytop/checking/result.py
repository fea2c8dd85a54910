"""What a check says of a trajectory: its numbers, as a document and in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from heavytop.checking.comparison import MOMENT_NAMES, Origin
from heavytop.checking.method import Count, Phase
from heavytop.checking.reading import Array
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.text import Plotted, harmless

CHECK_SCHEMA: Final = "heavytop/check/1"
CHARTED: Final = 1000  # rows in the document
MOST_NAMED: Final = 6  # columns that are ignored, in a line
CHECKED_QUANTITIES: Final = ("axis", *ANGLES, "energy", "p_phi", "p_psi")
PLAIN_ERRORS: Final = (
    *("origin", "assumed", "errors", "growth", "events", "condition", "digits", "digits_as_given"),
    *("conventions", "method", "slip"),
)
"""The attributes that are as they are in the document, or nearly so."""
START_NUMBERS: Final = (*ANGLES, *RATES, "omega3")
ORIGINS: Final = {"scene": "of the scene", "first row": "of the first row", "fitted": "fitted"}
ERROR_UNITS: Final = {"axis": "", "energy": " (of max(|E'|, gMR))"} | dict.fromkeys(
    ("p_phi", "p_psi"), " (relative)"
)
EVENT_WORDS: Final = {"turning": "turning points", "reversal": "reversals", "cusp": "cusps"}


class Size(NamedTuple):
    """How large an error is over all rows.

    Attributes
    ----------
    max, rms : float
        Its largest magnitude, its root mean square [rad, or relative].
    t_max : float
        When it is largest [s].
    """

    max: float
    rms: float
    t_max: float


class Finding(NamedTuple):
    """A convention that the data are written in, or what they lack.

    Attributes
    ----------
    name : str
        Such as ``degrees`` or ``y-up``.
    sentence : str
        The same for a person, with its numbers.
    gain : float or None
        How many times smaller the misfit is when it is undone; None where a header declares it.
    """

    name: str
    sentence: str
    gain: float | None


class Slip(NamedTuple):
    """The first of the conventions.

    Attributes
    ----------
    name, sentence : str
        As of `Finding`.
    error_before, error_after : float or None
        The RMS error of the data as they are, None where they fit no motion, and what is left
        when all conventions are undone.
    """

    name: str
    sentence: str
    error_before: float | None
    error_after: float


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
        By quantity, as far as the data give it and conventions are undone: axis, theta, phi
        (precession), psi (spin) [rad]; energy E' of max(|E'|, gMR), p_phi and p_psi of the larger
        momentum.
    digits, digits_as_given : float
        Decimal digits [1] of all that is compared, where they are fewest: with the conventions
        undone, and as the data are.
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
    conventions : tuple of Finding
        Those that are sure, the one of the largest gain first; then those that headers declare.
    alternatives : tuple of tuples of Finding
        Where several explain the data alike: each of them.
    method : mapping
        Order, what is conserved, the floor of the precision, and a sentence.
    assumed : tuple of str
        What was done to the data, and found in them.
    slip : Slip or None
        The first of the conventions.
    curves : mapping from str to array
        The errors at the times ``t`` [s], in their units, and ``phase`` [s] at ``phase_t`` [s].
    """

    name: str
    top: Top
    start: State
    origin: Origin
    errors: Mapping[str, Size]
    digits: float
    digits_as_given: float
    phase: Phase | None
    growth: Mapping[str, float | None]
    events: Mapping[str, Count]
    condition: float
    columns: Mapping[str, str]
    conventions: tuple[Finding, ...]
    alternatives: tuple[tuple[Finding, ...], ...]
    method: Mapping[str, Any]
    assumed: tuple[str, ...]
    slip: Slip | None
    curves: Mapping[str, Array] = field(repr=False)

    def __str__(self) -> str:
        return "\n".join(f"{name:14}  {text}" for name, text in lines(self.document()))

    def document(self) -> dict[str, Any]:
        """The document of the schema ``heavytop/check/1``; of long curves some rows."""
        t, found = self.curves["t"], {name: _plain(getattr(self, name)) for name in PLAIN_ERRORS}
        some = {name: x[:: -(-x.size // CHARTED) or 1].tolist() for name, x in self.curves.items()}
        errors = {name: found["errors"].get(name) for name in CHECKED_QUANTITIES}
        return found | {
            "schema": CHECK_SCHEMA,
            "scene": {
                "name": self.name,
                "title": "",
                "top": {name: float(getattr(self.top, name)) for name in MOMENT_NAMES},
                "start": {name: float(getattr(self.start, name)) for name in START_NUMBERS},
            },
            "data": {
                "file": self.name,
                "rows": t.size,
                "span": [float(t[0]), float(t[-1])],
                "columns": {name: quantity or None for name, quantity in self.columns.items()},
                "read_as": [*dict.fromkeys(x for x in self.columns.values() if x not in ("", "t"))],
            },
            "errors": errors | {"phase_s": _plain(self.phase)},
            "events": {name: found["events"].get(name) for name in EVENT_WORDS},
            "alternatives": [
                {
                    "names": [x.name for x in each],
                    "sentence": "; ".join(dict.fromkeys(x.sentence for x in each)),
                }
                for each in self.alternatives
            ],
            "curves": {n: [None if x != x else x for x in curve] for n, curve in some.items()},
        }


def _plain(value: Any) -> Any:
    """A value as JSON has it: named tuples by their names."""
    if hasattr(value, "_asdict"):
        return value._asdict()
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    return [*map(_plain, value)] if isinstance(value, tuple) else value


def lines(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Labels and texts: what a document ``heavytop/check/1`` says to a person.

    Parameters
    ----------
    document : mapping
    """
    of, method = document["data"], document["method"]
    yield "verdict", _verdict(document)
    yield "data", "{file}: {rows} rows from {span[0]:g} s to {span[1]:g} s".format(**of)
    yield "columns", _columns(of["columns"])
    start = (f"{k} = {value:.10g}" for k, value in document["scene"]["start"].items() if value)
    yield "start", f"{ORIGINS[document['origin']]}: {', '.join(start)}"
    for text in document["assumed"]:
        yield "assumed", harmless(text)
    for each in document["conventions"]:
        gain = "" if each["gain"] is None else f" (undoing it: misfit {each['gain']:.1e} smaller)"
        yield "convention", f"{each['name']}: {each['sentence']}{gain}"
    for each in document["alternatives"]:
        yield "could be", f"{' and '.join(each['names']) or 'none'}: {each['sentence']}"
    given = f" ({document['digits_as_given']:.1f} as given)" * bool(document["conventions"])
    yield "digits", f"{document['digits']:.1f}{given}"
    for name in CHECKED_QUANTITIES:
        if (size := document["errors"].get(name)) is not None:
            text = "{max:.2e} at t = {t_max:g} s, RMS {rms:.2e}".format(**size)
            yield name, text + ERROR_UNITS.get(name, " (rad)")
    if (phase := document["errors"]["phase_s"]) is not None:
        way, power = "behind" if phase["last"] < 0 else "ahead", document["growth"]["phase"]
        grows = "" if power is None else f", grows as t^{power:.1f}"
        lost = "" if phase["lost"] is None else f"lost at t = {phase['lost']:.3g} s, "
        yield "phase", f"{lost}{abs(phase['last']):.2e} s {way} at t = {phase['t']:g} s{grows}"
    elif method["no_phase"]:
        yield "phase", method["no_phase"]
    for name, plural in EVENT_WORDS.items():
        if (count := document["events"].get(name)) is not None:
            lacks = name != "turning" and document["errors"]["phi"] is None
            yield plural, "no φ in the data" if lacks else _count(count)
    kept = [f"{x} {method[x]}" for x in ("energy", "p_phi", "p_psi") if method.get(x)]
    yield "method", "; ".join([method["sentence"], *kept])
    change = "effect of a change in the last binary digit of the problem"
    yield "conditioning", f"{document['condition']:.1e} rad: {change}"


def _verdict(document: Mapping[str, Any]) -> str:
    """Two sentences: what the data are written in, and how good they are then."""
    names = [each["name"] for each in document["conventions"]]
    others = [" and ".join(each["names"]) or "none" for each in document["alternatives"]]
    first = f"Conventions: {', '.join(names)}." if names else "No convention has to be undone."
    if others:
        first = f"{first if names else ''} It could be {' or '.join(others)}.".strip()
    end: str = document["method"]["sentence"]
    return f"{first} The data have {document['digits']:.1f} digits then: {end}."


def _count(count: Mapping[str, Any]) -> str:
    """How many events there are in the data, beside the proved number."""
    found = "too few rows to count" if count["data"] is None else str(count["data"])
    exact, most = count["exact"], count["exact_most"]
    return f"{found}; exact {exact}" + (f" to {most}" if most > exact else "")


def _columns(columns: Mapping[str, str | None]) -> str:
    """The columns that were used, and the others, or the first of very many."""
    ignored = [name for name, quantity in columns.items() if not quantity]
    used = [f"{name} ({q})" if q != name else name for name, q in columns.items() if q]
    others = f"; ignored: {', '.join(ignored[:MOST_NAMED])}" if ignored else ""
    more = f" and {len(ignored) - MOST_NAMED} more" if len(ignored) > MOST_NAMED else ""
    return harmless(", ".join(used) + others + more)
