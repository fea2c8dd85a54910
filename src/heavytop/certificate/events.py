"""Proof that a run has all events of the exact motion: none missed, none doubled.

Zeros of event functions repeat after every period, so that those of one period, as balls, suffice.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import sympy as sp
from flint import arb, arb_poly

from heavytop.certificate.system import UP, TooCoarse, hull, pair, upper, upper_double
from heavytop.equations.lambdify import lambdify
from heavytop.exact.balls import working
from heavytop.exact.pairs import UNIT, Words, add, two_product

if TYPE_CHECKING:
    from heavytop.certificate.flow import Flow


BEFORE_START: Final = 1e-7  # of a piece: so far before time 0 an event may be
NEWTON_STEPS: Final = 20
EVENT_DISTANCE: Final = 1e-6  # of the distance between two events: the largest error of a match


class Proof(NamedTuple):
    """The proof for the events of one kind.

    Attributes
    ----------
    proved : bool or None
        Whether no event is missed or doubled; None where zeros are too close to be separated.
    off : float
        A bound of the errors of times, in the unit of the flow.
    why : str
        The reason why it is not proved, or empty.
    """

    proved: bool | None
    off: float
    why: str = ""


def match_events(flow: Flow, event: str, t: Words, end: float) -> Proof:
    """Compare the zeros that a run found of an event function with those of the exact motion.

    Parameters
    ----------
    flow : Flow
    event : str
    t : pair of ndarrays, shape (k,)
        Their times as double-doubles, in the unit of the flow.
    end : float
        The end of the run.
    """
    try:
        (high, low), width = _exact_times(flow, event, end)
    except TooCoarse:
        return Proof(None, 0.0, f"{event}: its zeros cannot be told apart")
    if not high.size:
        none = t[0].size == 0
        return Proof(none, 0.0, "" if none else f"{event}: the exact motion has none")
    forward = 1.0 if end >= 0 else -1.0
    number = np.searchsorted((high[1:] + high[:-1]) / 2, forward * t[0])
    errors = add((forward * t[0], forward * t[1]), (-high[number], -low[number]))
    largest = float(np.max(np.abs(errors[0] + errors[1]), initial=0.0))
    bound = UP * largest * (1 + 4 * UNIT) + width + 32 * UNIT**2 * abs(end)
    close = EVENT_DISTANCE * float(np.diff(high).min() if high.size > 1 else abs(end))
    inside = np.nonzero((high > close) & (high < abs(end) - close))[0]
    why = ""
    if not largest < close:
        why = f"{event}: an event is {largest:.1e} off"
    elif not (np.all(np.diff(number) == 1) and np.isin(inside, number).all()):
        why = f"{event}: one is missed, or found twice"
    return Proof(not why, bound, why)


def _exact_times(flow: Flow, event: str, end: float) -> tuple[Words, float]:
    """Return the times of zeros of the exact motion, in the order of a run, and a bound of errors.

    They include a few zeros before the start and after the end.
    """
    found = zeros(flow, event)
    with working(flow.bits):
        high, low = np.array([pair(zero) for zero in found]).reshape(-1, 2).T
    width = max((upper_double(arb(zero.rad())) for zero in found), default=0.0)
    if flow.period:
        last = np.floor(end / flow.period[0])
        n = np.arange(min(last, 0.0) - 1, max(last, 0.0) + 2)[:, None]
        whole = two_product(n, flow.period[0])
        high, low = map(np.ravel, add((high, low), (whole[0], whole[1] + n * flow.period[1])))
        width += float(np.abs(n).max()) * flow.off_a_period
    return ((high, low) if end >= 0 else (-high[::-1], -low[::-1])), width


def zeros(flow: Flow, event: str) -> list[arb]:
    """Return the zeros of an event function within a period, from time 0 or just before it.

    Without a period all of them are returned.

    Raises
    ------
    TooCoarse
        Two of them are too near to each other.
    """
    form, table, weights = flow.form, flow.table, flow.system.weights
    names, function = (*form.states, *flow.constants), form.events[event]
    slopes = [sp.diff(function, state) for state in form.states]
    found: list[arb] = []
    with working(flow.bits):
        value, gradient = (lambdify(x, names, arb, {}) for x in ([function], slopes))
        constants = [arb(x) for x in flow.constants.values()]
        # as polynomials: a power of a ball that contains 0 is not finite
        here = (arb_poly([arb(0, table.bounds.size / w)]) for w in weights)
        box = (arb_poly([0]) + x for x in gradient(*here, *constants))
        squares = ((upper(abs(x[0])) / w) ** 2 for x, w in zip(box, weights, strict=True))
        steepest = upper(sum(squares, arb(0)).sqrt())
        for place, piece in enumerate(table.pieces):
            [q] = value(*piece.p, *constants)
            least = arb(0) if place else -BEFORE_START * table.reach
            since = _zero(event, q, upper(steepest * piece.error), least, table.reach)
            if since is None:
                continue
            zero = place * arb(table.piece) + since
            # balls that overlap have the same zero: another zero is at least a piece away
            if found and flow.exact_period and not zero < found[0] + flow.exact_period:
                break
            if not found or zero > found[-1]:
                found.append(zero)
    return found


def _zero(event: str, q: arb_poly, off: arb, least: arb, reach: arb) -> arb | None:
    """Return the zero from `least` to `reach` of a function within `off` of a polynomial, or None.

    Raises
    ------
    TooCoarse
        Neither the function nor its slope has one sign in the piece.
    """
    if not q.coeffs() or not (hull(q, reach) + arb(0, off)).contains(0):
        return None
    slope = hull(q.derivative(), 2 * reach)
    if slope.contains(0):
        raise TooCoarse(f"a zero of {event}")
    at = reach / 2
    for _ in range(NEWTON_STEPS):
        at = arb((at - q(at) / q.derivative()(at)).mid())
    radius = upper((abs(q(at)) + off) / abs(slope))
    if not abs(at) + radius < 2 * reach:  # the slope is bounded up to there
        raise TooCoarse(f"a zero of {event}")
    inside = at + radius > least and at - radius < reach
    return at + arb(0, radius) if inside else None
