"""Events of a run held against all that the exact motion has: none missed, none doubled.

Turning points are half a period apart. Reversals of the precession come back after every period. So
the zeros within one period, as balls, are all that is needed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.certificate.balls import UNIT, TooCoarse, pair
from heavytop.certificate.flow import Flow
from heavytop.certificate.steps import UP
from heavytop.exact.balls import working
from heavytop.exact.pairs import add, two_product

Array = NDArray[np.float64]

CLOSE = 1e-6  # of the distance between two events: an event is told from its neighbours


class Proof(NamedTuple):
    """What is proved of the events of one kind.

    Attributes
    ----------
    proved : bool or None
        None is missed, and none doubled; None where zeros are too near each other to be told.
    off : float
        How far the largest error of a time can be, in the unit of the flow.
    why : str
        Why not, or empty.
    """

    proved: bool | None
    off: float
    why: str = ""


def held(flow: Flow, event: str, t: tuple[Array, Array], end: float) -> Proof:
    """Hold the zeros that a run found of an event function against those of the exact motion.

    Parameters
    ----------
    flow : Flow
    event : str
    t : pair of ndarrays, shape (k,)
        Their times as double-doubles, in the unit of the flow.
    end : float
        Where the run ends.
    """
    try:
        found = flow.zeros(event)
        with working(flow.bits):
            apart = flow.exact_period if flow.period else None
            bases = [pair(zero) for zero in found]
            spacing = None if apart is None else pair(apart)
            width = max((float(zero.rad()) for zero in found), default=0.0)
            wider = 0.0 if apart is None else float(apart.rad())
    except TooCoarse:
        return Proof(None, 0.0, f"{event}: its zeros cannot be told apart")
    if not bases:
        none = t[0].size == 0
        return Proof(none, 0.0, "" if none else f"{event}: the exact motion has none")
    return _matched(event, bases, spacing, t, end, (width, wider))


def _matched(
    event: str,
    bases: Sequence[tuple[float, float]],
    spacing: tuple[float, float] | None,
    t: tuple[Array, Array],
    end: float,
    widths: tuple[float, float],
) -> Proof:
    """Find the exact event of each that was found: their numbers must follow one another.

    `widths` are the radii of the zeros within one period, and that of the period.
    """
    forward = 1.0 if end >= 0 else -1.0
    size = len(bases)
    gaps = [b[0] - a[0] for a, b in pairwise(bases)]
    gaps += [spacing[0] + bases[0][0] - bases[-1][0]] if spacing else []
    close = CLOSE * min(map(abs, gaps), default=abs(end))
    errors, numbers = [], []
    for which, base in enumerate(bases):
        k = np.zeros_like(t[0])
        shifted = add(t, (np.full_like(k, -base[0]), np.full_like(k, -base[1])))
        if spacing:
            k = np.rint(shifted[0] / spacing[0])
            whole = two_product(k, spacing[0])
            shifted = add(shifted, (-whole[0], -(whole[1] + k * spacing[1])))
        errors.append(np.abs(shifted[0] + shifted[1]))
        numbers.append(size * k + which)
    nearest = np.argmin(errors, axis=0) if t[0].size else np.zeros(0, np.intp)
    off = np.array(errors)[nearest, np.arange(t[0].size)]
    number = np.array(numbers)[nearest, np.arange(t[0].size)]
    largest = float(off.max(initial=0.0))
    bound = (
        UP * largest
        + widths[0]
        + widths[1] * (1 + float(np.abs(number).max(initial=0.0)))
        + 32 * UNIT**2 * abs(end)
        + 4 * UNIT * largest
    )
    if not largest < close:
        return Proof(False, bound, f"{event}: an event is {largest:.1e} off")
    if not np.all(np.diff(number) == forward):
        return Proof(False, bound, f"{event}: one is missed, or found twice")

    def time(n: float) -> float:
        turns, which = divmod(n, size)
        if spacing is None:
            return bases[int(which)][0] if turns == 0 else forward * np.inf
        return bases[int(which)][0] + turns * spacing[0]

    def outside(n: float) -> bool:
        """Whether an event is before the start, or after the end, but for what is told apart."""
        at = forward * time(n)
        return not close < at < forward * end - close

    if number.size:
        complete = outside(number[0] - forward) and outside(number[-1] + forward)
    else:
        complete = all(outside(n) for n in range(-size, 2 * size + 1))
    return Proof(complete, bound, "" if complete else f"{event}: one at an end is missed")
