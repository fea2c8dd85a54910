"""What is said of a run: one rule for each word, the first that holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from heavytop.run.events import Counts
from heavytop.studies.stresses.conditioning import Reference
from heavytop.studies.stresses.raw import Raw

KEPT: Final = 0.5  # of the digits that conditioning leaves
ASTRAY: Final = 0.1  # an error of the axis, of 2 at most
STILL: Final = 1e-3  # of the way the axis went
UNTOLD: Final = "nothing to tell: no digits left"


class Word(StrEnum):
    """How a run ended; `RULES` says when each is used."""

    OK = "ok"
    INACCURATE = "inaccurate"
    SINGULAR = "singular"
    STALLED = "stalled"
    DIVERGED = "diverged"
    STEP_LIMIT = "step-limit"
    TIME_LIMIT = "time-limit"
    REFUSED = "refused"
    MISSED_EVENTS = "missed-events"


RULES: Final = {
    Word.REFUSED: "it says beforehand that it cannot, and why",
    Word.TIME_LIMIT: "it had not come back at its time limit, or took longer",
    Word.STEP_LIMIT: "it had taken all the steps it may take, or more",
    Word.SINGULAR: "it stopped on the way: the equations gave no finite numbers",
    Word.STALLED: "its steps vanished or have no solution; or it rests where the axis moves",
    Word.DIVERGED: f"it says it has arrived, {ASTRAY:g} or more from the axis (where they are "
    "judged, from φ or ψ), or with no numbers",
    Word.INACCURATE: "it says it has arrived, without half of the digits that conditioning leaves",
    Word.MISSED_EVENTS: "it arrived in place, with more events or fewer than there are",
    Word.OK: "it arrived, with at least half of the digits that conditioning leaves",
}


@dataclass(frozen=True, slots=True)
class Finding:
    """What a run gave, judged.

    Attributes
    ----------
    outcome : Word
    error : float or None
        Distance of the axis from the true one at the end; of the tilt, where only that is given;
        of φ or ψ, where they are judged.
    digits_lost : float or None
        Decimal digits of it beyond what conditioning allows.
    note : str
        What the run says, and what is wrong with it.
    named : bool
        Whether the run itself said, by an error or a warning, that something is wrong.
    untold : bool
        Whether the outcome is chance, as conditioning leaves no digits.
    turns : (int, int), or None
        Whole turns by which φ and ψ are wrong, where the run follows them.
    """

    outcome: Word
    error: float | None
    digits_lost: float | None
    note: str
    named: bool
    untold: bool = False
    turns: tuple[int, int] | None = None


def judged(raw: Raw, truth: Reference, *, by_angles: bool = False) -> Finding:
    """Return what is said of a run.

    Parameters
    ----------
    raw : Raw
    truth : Reference
    by_angles : bool
        Whether φ and ψ are judged, and not the axis.
    """
    if raw.ending in ("refused", "singular", "step-limit"):
        return Finding(Word(raw.ending), None, None, raw.said, named=True)
    if raw.ending == "failed":
        return Finding(Word.STALLED, None, None, raw.said, named=True)
    off = _off(raw, truth)
    truth = truth.of_angles() if by_angles else truth
    error = max(map(abs, off), default=math.nan) if by_angles else _error(raw, truth)
    if not math.isfinite(error):
        return Finding(Word.DIVERGED, None, None, "no numbers at the end", named=False)
    lost = truth.digits_lost(error)
    word, why = _word(raw, truth, error, lost)
    untold = truth.hopeless and not raw.more_bits
    turns = tuple(round(angle / math.tau) for angle in off)
    notes = [UNTOLD if untold else "", why, _turned(turns), *_leaving(raw, truth), raw.said]
    return Finding(
        word, error, lost, "; ".join(filter(None, notes)), bool(raw.said), untold,
        (turns[0], turns[1]) if turns else None,
    )  # fmt: skip


def _off(raw: Raw, truth: Reference) -> tuple[float, ...]:
    """How far φ and ψ are off [rad]; nothing where they are not followed."""
    if raw.angles is None:
        return ()
    return tuple(found - true for found, true in zip(raw.angles, truth.angles, strict=True))


def _turned(turns: tuple[int, ...]) -> str:
    """Say by how many whole turns φ and ψ are wrong: an axis and an energy do not see them."""
    named = zip(("φ", "ψ"), turns, strict=False)
    return ", ".join(f"{name} is off by {n:+d} turn{'s'[: abs(n) > 1]}" for name, n in named if n)


def _error(raw: Raw, truth: Reference) -> float:
    if raw.axis is not None:
        return math.dist(raw.axis, truth.axis)
    return math.nan if raw.theta is None else abs(raw.theta - truth.theta)


def _word(raw: Raw, truth: Reference, error: float, lost: float) -> tuple[Word, str]:
    still = raw.resting or raw.moved <= STILL * truth.moved
    poor = lost > (1 - KEPT) * truth.digits
    if still and poor:
        return Word.STALLED, f"at rest after {raw.steps} steps, and says that it has arrived"
    if error >= ASTRAY:
        return Word.DIVERGED, f"says that it has arrived{_energy(raw)}"
    if poor:
        return Word.INACCURATE, f"says that it has arrived{_energy(raw)}"
    if missed := missed_events(raw.counted, truth.counts):
        return Word.MISSED_EVENTS, "" if missed_already(raw) else missed
    return Word.OK, ""


def _energy(raw: Raw) -> str:
    return "" if raw.energy is None else f"; its energy is off by {raw.energy:.0e}"


def _leaving(raw: Raw, truth: Reference) -> list[str]:
    """Say where doubles hold nothing any more, whoever computes with them."""
    if truth.leaves is None or raw.more_bits:
        return []
    return [f"leaves the vertical's neighbourhood by rounding at t ≈ {truth.leaves:.3g} s"]


def missed_already(raw: Raw) -> bool:
    """Whether the run itself says that it has miscounted."""
    return "events: " in raw.said


def missed_events(counted: dict[str, int], counts: Counts | None) -> str:
    """Say which events were counted otherwise than there are.

    Where a method knows no cusps, phidot may touch zero in each of them, in none, or only at the
    start, which is one.

    Examples
    --------
    >>> missed_events({"turning": 5}, {"turning": (6, 6)})
    '5 turning, not 6'
    """
    if counts is None or not counted:
        return ""
    cusps = counts.get("cusp", (0, 0)) if "cusp" not in counted else (0, 0)
    wrong = []
    for name, found in counted.items():
        least, most = counts[name]
        touched = name == "reversal" and cusps[0] > 0 and found in (1, *cusps)
        if not (least <= found <= most or touched):
            wrong.append(f"{found} {name}, not {least}")
    return "; ".join(wrong)
