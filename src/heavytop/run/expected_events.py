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

EDGE: Final = 1e-9  # of a period, for each period: so near the end an event may be on either side
AT_START: Final = 1e-40  # of a period: an event there is the start itself, and counts
KINDS_OF: Final[Mapping[str, frozenset[str]]] = {
    "turning": frozenset({"theta_min", "theta_max", "cusp"}),
    "reversal": frozenset({"reversal"}),
    "cusp": frozenset({"cusp"}),
}

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
        None where theta is constant, or the kind is not decided.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-dropped")
    >>> tally(Motion(scene.top, scene.start), 2.0)
    {'turning': (10, 10), 'reversal': (0, 0), 'cusp': (5, 5)}
    """
    form, rows = motion.exact, _rows(motion, motion.exact)
    if not rows or motion.kind is Kind.UNDECIDED:
        return None
    at_start, edge = AT_START * _scale(form), EDGE * (abs(end) + _scale(form))
    spans = [_span(form.ctx.mpf(end), at_start, side * edge) for side in (-1, 1)]
    counted = {
        name: [
            sum(len(_within(one, form.period, *span)) for kind, one in rows if kind in kinds)
            for span in spans
        ]
        for name, kinds in KINDS_OF.items()
        if name in asked
    }
    return {name: (least, most) for name, (least, most) in counted.items()}


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
    ctx, wanted = form.ctx, frozenset().union(*(KINDS_OF[name] for name in asked))
    blur = ctx.mpf(10) ** -digits
    span = _span(ctx.mpf(end), blur * _scale(form), blur * (abs(end) + _scale(form)))
    found = [
        (kind, one + n * form.period if form.period else one)
        for kind, one in _rows(motion, form)
        if kind in wanted
        for n in _within(one, form.period, *span)
    ]
    at_start = blur * _scale(form)
    begun = [(kind, t if abs(t) > at_start else ctx.zero) for kind, t in found]
    return sorted(begun, key=lambda event: abs(event[1]))


def differences(expected: Counts, counted: Mapping[str, int | None]) -> Iterator[str]:
    """What was counted differently, in words; what was not asked for is not held."""
    for name, (least, most) in expected.items():
        found = counted.get(name)
        if found is not None and not least <= found <= most:
            there = f"{least}" if least == most else f"{least} to {most}"
            yield f"{found} {name} where there are {there}"


def _rows(motion: Motion, form: ClosedForm) -> list[tuple[str, Number]]:
    """The kinds of event with the time of one [s]; others of it are whole periods apart."""
    if (first := form.lower_turning) is None:
        return []
    below, above = "theta_max", "theta_min"
    if (motion.top.gMR.sign() or 0) < 0:
        below, above = above, below
    if form.period is None:
        return [(below, first)]
    sharp, half = motion.kind in (Kind.CUSPS, Kind.UNDECIDED), form.period / 2
    rows = [(below, first), ("cusp" if sharp else above, first + half)]
    if motion.kind is Kind.LOOPS:
        later = form.reversal or half  # so near a cusp that no digits tell the two apart
    else:  # a free top may loop too
        later = form.reversal if motion.kind is Kind.FORCE_FREE else None
    return rows + [("reversal", first + side * later) for side in (-1, 1) if later]


def _scale(form: ClosedForm) -> Number:
    """The period [s], or a time that is not zero where there is none."""
    return form.period or abs(form.lower_turning or 0) or 1


def _span(end: Number, at_start: Number, slack: Number) -> tuple[Number, Number]:
    """The earlier and the later end of a span from just before the start to about its end [s]."""
    reach = max(abs(end) + slack, 0)
    return (-at_start, reach) if end >= 0 else (-reach, at_start)


def _within(first: Number, step: Number | None, low: Number, high: Number) -> range:
    """For which n the time first + n step is from low to high; without a step, for 0 or none."""
    if step is None:
        return range(int(low < first <= high))
    begin, end = (int(first.context.floor((t - first) / step)) for t in (low, high))
    return range(begin + 1, end + 1)
