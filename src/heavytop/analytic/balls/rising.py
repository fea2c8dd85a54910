"""Rising precision: a ball computed with more and more bits until it is small enough."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final

from flint import arb

from heavytop.analytic.balls.roots import TooFewBits
from heavytop.errors import Unseparated
from heavytop.numbers.intervals import Interval, above, working

LIMIT: Final = 1 << 16
"""Bits at which an enclosure gives up."""

_SPARE: Final = 40  # bits beyond those of the digits, which most motions do not use up


def settled(
    name: str, value: Callable[[int], arb], digits: int, limit: int, *,
    absolute: bool = False, lost: int = 0,
) -> Interval:  # fmt: skip
    """The first ball that has the digits.

    Parameters
    ----------
    name : str
        What it is, for the message.
    value : callable
        The ball at so many bits, which are the working precision while it is called.
    digits : int
        Decimal digits, relative to max(1, |x|).
    limit : int
        Bits at which to give up.
    absolute : bool
        Whether the digits count from the decimal point instead.
    lost : int
        Bits known to be lost.

    Raises
    ------
    Unseparated
        No ball of up to `limit` bits has the digits.
    """
    reached = f"{name} is not bounded", math.inf
    for bits in _rungs(digits, lost, limit):
        with working(bits):
            try:
                found = value(bits)
            except TooFewBits as close:
                reached = _nearness(close)
                continue
        if found.is_finite():
            ball = Interval.of(found)
            if (ball.decimals if absolute else ball.digits) >= digits:
                return ball
            reached = f"{name} is known to {above(ball.radius)}", ball.radius
    what, bound = reached
    raise Unseparated(f"{what} with {limit} bits: more bits or fewer digits are needed", bound)


def _nearness(close: TooFewBits) -> tuple[str, float]:
    if not close.difference.is_finite():
        return f"{close.names} are not told apart", math.inf
    bound = Interval.of(abs(close.difference)).upper
    return f"{close.names} differ by less than {above(bound)}", bound


def _rungs(digits: int, lost: int, limit: int) -> Iterator[int]:
    bits = math.ceil(digits * math.log2(10)) + _SPARE + lost
    while bits < limit:
        yield bits
        bits *= 2
    yield limit
