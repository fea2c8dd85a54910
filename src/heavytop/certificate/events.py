"""Events of a run held against all that the exact motion has: none missed, none doubled.

Zeros of event functions come back after every period. So those within one, as balls, are all that
is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from flint import arb
from numpy.typing import NDArray

from heavytop.certificate.balls import TooCoarse, pair, up
from heavytop.certificate.flow import Flow
from heavytop.certificate.steps import UP
from heavytop.exact.balls import working
from heavytop.exact.pairs import UNIT, add, two_product

Array = NDArray[np.float64]
Words = tuple[Array, Array]

EVENT_DISTANCE = 1e-6  # of the distance between two events: an event is told from its neighbours


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


def match_events(flow: Flow, event: str, t: Words, end: float) -> Proof:
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
        exact, width = _exact_times(flow, event, end)
    except TooCoarse:
        return Proof(None, 0.0, f"{event}: its zeros cannot be told apart")
    if not exact[0].size:
        none = t[0].size == 0
        return Proof(none, 0.0, "" if none else f"{event}: the exact motion has none")
    middles = (exact[0][1:] + exact[0][:-1]) / 2
    forward = 1.0 if end >= 0 else -1.0
    number = np.searchsorted(middles, forward * t[0])
    apart = add((forward * t[0], forward * t[1]), (-exact[0][number], -exact[1][number]))
    largest = float(np.max(np.abs(apart[0] + apart[1]), initial=0.0))
    bound = UP * largest * (1 + 4 * UNIT) + width + 32 * UNIT**2 * abs(end)
    close = EVENT_DISTANCE * float(np.diff(exact[0]).min() if middles.size else abs(end))
    if not largest < close:
        return Proof(False, bound, f"{event}: an event is {largest:.1e} off")
    inside = np.nonzero((exact[0] > close) & (exact[0] < abs(end) - close))[0]
    if not np.all(np.diff(number) == 1):
        return Proof(False, bound, f"{event}: one is missed, or found twice")
    if not set(inside[[0, -1]] if inside.size else ()) <= set(number):
        return Proof(False, bound, f"{event}: one at an end is missed")
    return Proof(True, bound)


def _exact_times(flow: Flow, event: str, end: float) -> tuple[Words, float]:
    """Return when the exact motion has zeros, in the order of a run, and how far these are off.

    A few more are among them, before the start and after the end.
    """
    zeros = flow.zeros(event)
    with working(flow.bits):
        high, low = np.array([pair(zero) for zero in zeros]).reshape(-1, 2).T
    width = max((up(arb(zero.rad())) for zero in zeros), default=0.0)
    if flow.period:
        last = np.floor(end / flow.period[0])
        n = np.arange(min(last, 0.0) - 1, max(last, 0.0) + 2)[:, None]
        whole = two_product(n, flow.period[0])
        high, low = map(np.ravel, add((high, low), (whole[0], whole[1] + n * flow.period[1])))
        width += float(np.abs(n).max()) * flow.off_a_period
    return ((high, low) if end >= 0 else (-high[::-1], -low[::-1])), width
