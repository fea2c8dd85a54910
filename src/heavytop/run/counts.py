"""Numbers and times of turning points, reversals and cusps, by the closed form.

No integrator takes part: where a nutation is smaller than the rounding of doubles, its counts are
noise. Turning points are half a period apart; motions with loops have a reversal in every half
nutation, motions with cusps a cusp in every whole one. An axis that tends to the vertical turns
once.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from fractions import Fraction
from typing import Any, Final

from heavytop.analytic.events import COUNT_EDGE
from heavytop.analytic.form import to_mpf
from heavytop.analytic.motion import Motion
from heavytop.exact.decimals import Number
from heavytop.exact.number import rational_value
from heavytop.scene.scene_file import EVENTS

TURNING: Final = ("theta_min", "theta_max", "cusp")
KINDS_OF: Final = {"turning": TURNING, "reversal": ("reversal",), "cusp": ("cusp",)}
AT_END: Final = 1e-20  # of a period: an event so near an exact end is there

Counts = Mapping[str, tuple[int, int]]


def count_events(motion: Motion, end: float, asked: Collection[str] = EVENTS) -> Counts | None:
    """The least and the greatest number of turning points, reversals and cusps from 0 to a time.

    They differ where an event is within a billionth of the span and of a period from the end.

    Parameters
    ----------
    motion : Motion
    end : float
        The end of the span [s], of either sign.
    asked : collection of str
        Those of the three that are to be counted.

    Returns
    -------
    mapping from str to (int, int), or None
        None where theta is constant, or the kind is not decided.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-dropped")
    >>> count_events(Motion(scene.top, scene.start), 2.0)
    {'turning': (10, 10), 'reversal': (0, 0), 'cusp': (5, 5)}
    """
    if not asked or motion.regime.steady or _is_doubtful(motion):
        return None
    edge = COUNT_EDGE * (abs(end) + _scale(motion))
    if motion.period is None:
        least, most = (_counts(motion, end, slack, asked) for slack in (-edge, edge))
        return {name: (least[name], most[name]) for name in least}
    ends = [(abs(end) + slack) / motion.period for slack in (-edge, edge)]
    found = {}
    for name in (name for name in KINDS_OF if name in asked):
        ahead = motion.events(name).fractions
        if end < 0:
            ahead = [1 - x if x else x for x in ahead]
        low, high = (sum(math.floor(max(t, 0.0) - x) + 1 for x in ahead) for t in ends)
        found[name] = (low, high)
    return found


def count_exactly(motion: Motion, end: Number, asked: Collection[str]) -> dict[str, int]:
    """How many turning points, reversals and cusps there are from 0 to a time, both included.

    An event less than `AT_END` of a period from the end counts as at it. The mapping is empty where
    the kind of motion is not decided.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-dropped")
    >>> motion = Motion(scene.top, scene.start)
    >>> count_exactly(motion, 10**9 * motion.mpf("period", 60), ("turning", "cusp"))
    {'turning': 2000000001, 'cusp': 1000000001}
    """
    if _is_doubtful(motion):
        return {}
    return _counts(motion, end, AT_END * _scale(motion), asked)


def schedule(
    motion: Motion, end: Number, asked: Collection[str], digits: int
) -> list[tuple[str, Number]]:
    """The kinds and times of the events from 0 to a time, where a run looks for its own.

    Parameters
    ----------
    motion : Motion
    end : Number
        The end of the span [s], of either sign; an event at it belongs to it.
    asked : collection of str
        Of turning, reversal and cusp.
    digits : int
        Of the times.

    Returns
    -------
    list of (str, Number)
        ``theta_min``, ``theta_max``, ``reversal`` or ``cusp`` (where that is undecided perhaps
        none), and the time [s], exactly zero at the start.
    """
    slack = (abs(rational_value(end)) + rational_value(_scale(motion))) / 10**digits
    times = (
        (kind, to_mpf(t, digits))
        for kind in dict.fromkeys(kind for name in asked for kind in KINDS_OF[name])
        for t in motion.events(kind).times(*_span(end, slack), digits)
    )
    return sorted(times, key=lambda event: abs(event[1]))


def differences(expected: Counts, counted: Mapping[str, int | None]) -> Iterator[str]:
    """Yield in words which counts differ from the expected ones; None is not compared."""
    for name, (least, most) in expected.items():
        found = counted.get(name)
        if found is not None and not least <= found <= most:
            there = f"{least}" if least == most else f"{least} to {most}"
            yield f"{found} {name} where there are {there}"


def _counts(motion: Motion, end: Any, slack: Any, asked: Collection[str]) -> dict[str, int]:
    """The number of events from the start to an end that is moved outwards by a slack, by name."""
    span = _span(end, slack)
    return {name: motion.events(name).count(*span) for name in KINDS_OF if name in asked}


def _span(end: Any, slack: Any) -> tuple[Fraction, Fraction]:
    """The exact limits of a span: 0, where an event at the start is, and the end moved outwards."""
    start, reach = Fraction(0), max(abs(rational_value(end)) + rational_value(slack), Fraction(0))
    return (start, reach) if end >= 0 else (-reach, start)


def _is_doubtful(motion: Motion) -> bool:
    """Tell whether the kind of motion, or whether it has cusps, is not proved."""
    _ = motion.cusps  # reading it may add a doubt
    return motion.doubt is not None


def _scale(motion: Motion) -> float:
    """The period [s], or a time that is not zero where there is none."""
    return motion.period or abs(motion.lower_turning or 0.0) or 1.0
