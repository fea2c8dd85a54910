"""Results in words: what a scene gives, what was left out, and what pictures of a run show."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

from heavytop.report.pages.tables import cell, shown

Columns = Mapping[str, Sequence[Any]]
NOTHING: Final = "Nothing was measured: there is no figure."
ROUNDING: Final = 1e-12  # of the energy: a potential so small is 0
LEAP: Final = 1.0  # rad: no angle goes so far from one of these numbers to the next

GIVEN: Final = {
    "A": ("A", "kg m²"), "C": ("C", "kg m²"), "gMR": ("gMR", "J"), "theta": ("θ", "rad"),
    "phi": ("φ", "rad"), "psi": ("ψ", "rad"), "thetadot": ("θ̇", "rad/s"),
    "phidot": ("φ̇", "rad/s"), "psidot": ("ψ̇", "rad/s"), "omega3": ("ω₃", "rad/s"),
    "p_phi": ("p_φ", "kg m²/s"), "p_psi": ("p_ψ", "kg m²/s"), "E": ("E", "J"),
}  # fmt: skip


def called(document: Mapping[str, Any]) -> str:
    """What the scene of a result is called: by its title, else by its name."""
    scene = document["scene"]
    return str(scene["title"] or scene["name"])


def given(values: Mapping[str, Any]) -> str:
    """What a scene gives of a top or of its start, zeros left out.

    Examples
    --------
    >>> given({"theta": 0.1, "phi": 0, "phidot": -15})
    'θ = 0.1 rad, φ̇ = -15 rad/s'
    """
    words = []
    for name, value in values.items():
        sign, unit = GIVEN.get(name, (name, ""))
        if value not in (0, None):
            words.append(f"{sign} = {cell(value)} {unit}".rstrip())
    return ", ".join(words) or "all zero"


def left_out(skipped: Sequence[Mapping[str, Any]]) -> tuple[str, ...]:
    """What a study did not run, and how often for which reason; nothing where there is nothing."""
    if not skipped:
        return ()
    reasons: dict[str, int] = {}
    for each in skipped:
        reason = str(each.get("reason", "no reason given"))[:120]
        reasons[reason] = reasons.get(reason, 0) + 1
    words = [f"{reason} ({count})" for reason, count in list(reasons.items())[:8]]
    return (f"Not run: {len(skipped)}, for these reasons: {'; '.join(words)}.",)


def described(which: str, columns: Columns) -> str:
    """What a picture of a run shows.

    Parameters
    ----------
    which : str
        The name of the picture.
    columns : mapping of sequences
        The numbers behind it; None where there is no number.

    Examples
    --------
    >>> described("phase", {"theta": [0.1, 0.2], "thetadot": [-3.0, 3.0]})
    'The tilt goes from 5.73° to 11.5°. The tilt rate goes from -3 to 3 rad/s.'
    """
    return " ".join(WORDS[which](columns)) or "There is nothing in it."


def _overview(columns: Columns) -> Iterator[str]:
    yield from _tilt(columns)
    if len(phi := _known(columns, "phi")) > 1:
        yield f"The axis goes {shown((phi[-1] - phi[0]) / math.tau, 3)} turns about the vertical."
        back = _reversals(phi)
        yield f"It turns back {back} times on the way." if back else "It never turns back."


def _angles(columns: Columns) -> Iterator[str]:
    yield from _tilt(columns)
    for name, word in (("phi", "Precession"), ("psi", "Spin")):
        if known := _known(columns, name):
            yield f"{word} goes from {shown(known[0], 3)} to {shown(known[-1], 3)} rad."
    if known := _known(columns, "psidot"):
        yield f"The rate of spin is between {_between(known)} rad/s."


def _potential(columns: Columns) -> Iterator[str]:
    pairs = zip(columns["potential_J"], columns["theta"], strict=True)
    height, tilt = min(each for each in pairs if each[0] is not None)
    level, *ends = (columns[name][0] for name in ("E_prime_J", "theta_min", "theta_max"))
    least = height if abs(height) > ROUNDING * abs(level) else 0
    yield f"The potential is least, {shown(least, 3)} J, at a tilt of {_degrees(tilt)}."
    words = _span(ends)  # of the motion: on the grid the ends of what is allowed are coarse
    moves = f"at tilts from {words}" if " to " in words else f"and stays at a tilt of {words}"
    yield f"The motion has the energy E′, {shown(level, 3)} J, {moves}."


def _phase(columns: Columns) -> Iterator[str]:
    yield from _tilt(columns)
    if known := _known(columns, "thetadot"):
        yield f"The tilt rate goes from {_between(known, 'to')} rad/s."


def _errors(columns: Columns) -> Iterator[str]:
    for name, unit in (("theta", " rad"), ("phi", " rad"), ("psi", " rad"), ("axis", "")):
        if known := _known(columns, name):
            yield f"The error of {name} is at most {shown(max(map(abs, known)), 2)}{unit}."


def _tilt(columns: Columns) -> Iterator[str]:
    if known := _known(columns, "theta"):
        words = _span(known)
        yield f"The tilt goes from {words}." if " to " in words else f"The tilt stays at {words}."


def _known(columns: Columns, name: str) -> list[float]:
    return [x for x in columns.get(name, ()) if x is not None]


def _span(tilts: Sequence[float]) -> str:
    """The least and the greatest tilt, or the one that both are as they are written."""
    low, high = _degrees(min(tilts)), _degrees(max(tilts))
    return low if low == high else f"{low} to {high}"


def _degrees(tilt: float) -> str:
    return f"{shown(math.degrees(tilt), 3)}°"


def _between(known: Sequence[float], word: str = "and") -> str:
    return f"{shown(min(known), 3)} {word} {shown(max(known), 3)}"


def _reversals(angles: Sequence[float]) -> int:
    """How often an angle turns back; rounding is no turning, nor is the half turn at a pole."""
    least = 1e-9 * (1.0 + max(map(abs, angles)))
    steps = [b - a for a, b in pairwise(angles) if least < abs(b - a) < LEAP]
    return sum(a * b < 0 for a, b in pairwise(steps))


WORDS: Final[Mapping[str, Callable[[Columns], Iterator[str]]]] = {
    "overview": _overview,
    "angles": _angles,
    "potential": _potential,
    "phase": _phase,
    "errors": _errors,
}
"""By picture of a run, the sentences about it."""
