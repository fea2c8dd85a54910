"""How many events a motion has in a span of time, from its closed form.

Where a nutation is smaller than the rounding of doubles, what an integrator counts is noise. What
the exact numbers say is counted here, without one: turning points are half a period apart, a
reversal lies in every half nutation of a motion with loops, a cusp in every whole one with cusps.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from typing import Final

from heavytop.kinds import Kind
from heavytop.motion import Motion
from heavytop.theory.precision import Number

EDGE: Final = 1e-9  # of a period, for each period: so near the end an event may be on either side
AT_START: Final = 1e-40  # of a period: an event there is the start itself, and counts

Counts = Mapping[str, tuple[int, int]]


def tally(
    motion: Motion, end: float, asked: Collection[str] = ("turning", "reversal", "cusp")
) -> Counts | None:
    """The least and the greatest number of turning points, reversals and cusps from 0 to a time.

    They differ where one lies within a billionth of the span and of a period of its end.

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
        None where nothing nutates, or the kind is not decided.

    Examples
    --------
    >>> from heavytop.scene import load_scene
    >>> scene = load_scene("sicm-dropped")
    >>> tally(Motion(scene.top, scene.start), 2.0)
    {'turning': (10, 10), 'reversal': (0, 0), 'cusp': (5, 5)}
    """
    form = motion.exact
    if form.period is None or form.lower_turning is None or motion.kind is Kind.UNDECIDED:
        return None
    ctx, half = form.ctx, form.period / 2
    sign = 1 if end >= 0 else -1
    edge = EDGE * (abs(end) + form.period)
    ends = (ctx.mpf(end) + side * sign * edge for side in (-1, 1))
    spans = [sorted((-sign * AT_START * form.period, late)) for late in ends]
    loops, cusps = _loops(motion), motion.kind is Kind.CUSPS
    ways: dict[str, Callable[[Number, Number], int]] = {
        "turning": partial(_between, form.lower_turning, half),
        "reversal": partial(_crossings, motion) if loops else _none,
        "cusp": partial(_between, _highest(motion), form.period) if cusps else _none,
    }
    return {name: _pair([ways[name](*span) for span in spans]) for name in ways if name in asked}


def differences(expected: Counts, counted: Mapping[str, int | None]) -> Iterator[str]:
    """What was counted differently, in words; what was not asked for is not held."""
    for name, (least, most) in expected.items():
        found = counted.get(name)
        if found is not None and not least <= found <= most:
            there = f"{least}" if least == most else f"{least} to {most}"
            yield f"{found} {name} where there are {there}"


def _loops(motion: Motion) -> bool:
    """Whether phidot changes its sign in every half nutation; a free top may do that too."""
    if motion.kind is not Kind.FORCE_FREE:
        return motion.kind is Kind.LOOPS
    turning: Number = motion.exact.lower_turning
    return _ahead(motion, turning) != _ahead(motion, turning + _half(motion))


def _none(_low: Number, _high: Number) -> int:
    return 0


def _pair(counts: list[int]) -> tuple[int, int]:
    least, most = counts
    return min(max(least, 0), most), most


def _highest(motion: Motion) -> Number:
    """The time of a turning point where V is highest, at which a cusp can be [s]."""
    first: Number = motion.exact.lower_turning
    return first + _half(motion)  # the other one, for either sign of gMR


def _half(motion: Motion) -> Number:
    period: Number = motion.exact.period
    return period / 2


def _between(first: Number, step: Number, low: Number, high: Number) -> int:
    """How many of the times first + k step lie from low to high."""
    return _index(first, step, high) - _index(first, step, low)


def _index(first: Number, step: Number, t: Number) -> int:
    return int(first.context.floor((t - first) / step))


def _crossings(motion: Motion, low: Number, high: Number) -> int:
    """How often u = p_φ/p_ψ is crossed from low to high: once between any two turning points."""
    half, first = _half(motion), motion.exact.lower_turning
    begin, end = (_index(first, half, t) for t in (low, high))
    later, behind = first + (begin + 1) * half, first + end * half
    if begin == end:
        return int(_ahead(motion, low) != _ahead(motion, high))
    inside = end - begin - 1
    opened = _ahead(motion, low) != _ahead(motion, later)
    return inside + int(opened) + int(_ahead(motion, behind) != _ahead(motion, high))


def _ahead(motion: Motion, t: Number) -> bool:
    """Whether φ̇ is positive."""
    return bool(motion.exact(t).phidot > 0)
