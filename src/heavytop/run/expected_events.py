"""How many events a motion has in a span of time, and when, from its closed form.

Where a nutation is smaller than the rounding of doubles, what an integrator counts is noise. What
the exact numbers say is counted here, without one: turning points are half a period apart, a
reversal lies in every half nutation of a motion with loops, a cusp in every whole one with cusps.
An axis that tends to the vertical turns once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Final

from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.numbers.decimals import Number
from heavytop.run.events import EVENTS

EDGE: Final = 1e-9  # of a period, for each period: so near the end an event may be on either side
AT_START: Final = 1e-40  # of a period: an event there is the start itself, and counts
KINDS_OF: Final[Mapping[str, frozenset[str]]] = {
    "turning": frozenset({"theta_min", "theta_max", "cusp"}),
    "reversal": frozenset({"reversal"}),
    "cusp": frozenset({"cusp"}),
}

Counts = Mapping[str, tuple[int, int]]


def tally(motion: Motion, end: float, asked: Collection[str] = EVENTS) -> Counts | None:
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
        None where theta is constant, or the kind is not decided.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-dropped")
    >>> tally(Motion(scene.top, scene.start), 2.0)
    {'turning': (10, 10), 'reversal': (0, 0), 'cusp': (5, 5)}
    """
    form = motion.exact
    if not asked or form.lower_turning is None or motion.kind is Kind.UNDECIDED:
        return None
    at_start, edge = AT_START * _scale(form), EDGE * (abs(end) + _scale(form))
    surely, perhaps = (
        [(kind, len(numbers)) for kind, _, numbers in _within(motion, form, end, at_start, slack)]
        for slack in (-edge, edge)
    )

    def count(name: str, found: list[tuple[str, int]]) -> int:
        return sum(many for kind, many in found if kind in KINDS_OF[name])

    return {name: (count(name, surely), count(name, perhaps)) for name in KINDS_OF if name in asked}


def schedule(
    motion: Motion, end: Number, asked: Collection[str], digits: int
) -> list[tuple[str, Number]]:
    """The kinds and the times of the events from 0 to a time, for a run to be asked near them.

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
    form = motion.form(digits)
    wanted = {kind for name in asked for kind in KINDS_OF[name]}
    blur = form.ctx.mpf(10) ** -digits
    at_start, slack = blur * _scale(form), blur * (abs(end) + _scale(form))
    times = (
        (kind, first + n * (form.period or 0))
        for kind, first, numbers in _within(motion, form, end, at_start, slack)
        if kind in wanted
        for n in numbers
    )
    found = [(kind, t if abs(t) > at_start else form.ctx.zero) for kind, t in times]
    return sorted(found, key=lambda event: abs(event[1]))


def differences(expected: Counts, counted: Mapping[str, int | None]) -> Iterator[str]:
    """What was counted differently, in words; what was not asked for is not held."""
    for name, (least, most) in expected.items():
        found = counted.get(name)
        if found is not None and not least <= found <= most:
            there = f"{least}" if least == most else f"{least} to {most}"
            yield f"{found} {name} where there are {there}"


def _within(
    motion: Motion, form: ClosedForm, end: Number, at_start: Number, slack: Number
) -> Iterator[tuple[str, Number, range]]:
    """Each kind of event, the time of one, and how many periods later there are others in a span.

    The span is from just before the start to about its end.
    """
    reach = max(abs(end) + slack, 0)
    low, high = (-at_start, reach) if end >= 0 else (-reach, at_start)
    for kind, first in _rows(motion, form):
        if form.period is None:
            yield kind, first, range(int(low < first <= high))
        else:
            before, last = (int(form.ctx.floor((t - first) / form.period)) for t in (low, high))
            yield kind, first, range(before + 1, last + 1)


def _rows(motion: Motion, form: ClosedForm) -> list[tuple[str, Number]]:
    """The kinds of event with the time of one [s]; others of it are whole periods apart."""
    if (first := form.lower_turning) is None:
        return []
    below, above = ("theta_max", "theta_min")[:: -1 if motion.rising.regime.mirrored else 1]
    if form.period is None:
        return [(below, first)]
    kind, half, later = motion.kind, form.period / 2, None
    if kind is Kind.LOOPS:
        later = form.reversal or half  # so near a cusp that no digits tell the two apart
    elif kind is Kind.FORCE_FREE:  # which may loop too
        later = form.reversal
    above = "cusp" if kind in (Kind.CUSPS, Kind.UNDECIDED) else above
    reversals = [("reversal", first + side * later) for side in (-1, 1) if later]
    return [(below, first), (above, first + half), *reversals]


def _scale(form: ClosedForm) -> Number:
    """The period [s], or a time that is not zero where there is none."""
    return form.period or abs(form.lower_turning or 0) or 1
