"""An angle that has turned many times, without loss of the digits of the part that counts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from heavytop.numbers.decimals import Context, Number
from heavytop.numbers.pairs import Array, Doubles, two_product, two_sum

PART_BITS = 21
"""Bits of the parts of a number that is multiplied by a count below 2³²: each product is exact."""


class Double2(NamedTuple):
    """A number as the unevaluated sum of two doubles."""

    hi: float
    lo: float

    @classmethod
    def of(cls, value: Number) -> Double2:
        """A number of an mpmath context."""
        hi = float(value)
        return cls(hi, float(value - hi))


def parts(ctx: Context, value: Number) -> tuple[float, ...]:
    """`value` cut into three parts of 21 bits and a rest (Cody & Waite).

    Parameters
    ----------
    ctx : Context
        The precision of the value.
    value : Number
        What is cut.
    """
    found = []
    for _ in range(3):
        shift = PART_BITS - ctx.mag(value) if value else 0
        part = ctx.ldexp(ctx.nint(ctx.ldexp(value, shift)), -shift)
        found.append(float(part))
        value = value - part
    return (*found, float(value))


class Angle:
    """An angle start + n turn + rate t + local, whole or modulo 2π.

    Parameters
    ----------
    ctx : Context
        The precision of the numbers that follow.
    start, turn, rate : Number
        Its constants [rad, rad, rad/s].
    """

    def __init__(self, ctx: Context, start: Number, turn: Number, rate: Number) -> None:
        circle = 2 * ctx.pi
        self._whole = Double2.of(start), parts(ctx, turn), Double2.of(rate)
        turns = turn / circle
        self._turns = (
            Double2.of(start / circle - ctx.nint(start / circle)),
            parts(ctx, turns - ctx.nint(turns)),
            Double2.of(rate / circle),
        )

    def whole(
        self, n: Array, t: Array, t_lo: Doubles, local: Doubles, local_lo: Doubles = 0.0
    ) -> Array:
        """The angle [rad], continuous: rounded once, when everything has been added up.

        Parameters
        ----------
        n, t, t_lo : array
            Count and time t + t_lo [s].
        local, local_lo : array
            What is added [rad], as a sum of two doubles.
        """
        start, turn, rate = self._whole
        total, rest = two_product(t, rate.hi)
        rest = rest + (rate.lo * t + rate.hi * t_lo + start.lo + n * turn[3] + local_lo)
        for term in (n * turn[0], n * turn[1], n * turn[2], start.hi, local):
            total, error = two_sum(total, term)
            rest = rest + error
        return np.asarray(total + rest)

    def modulo(self, n: Array, t: Array, t_lo: Doubles, local: Array) -> Array:
        """The angle [rad] in [0, 2π): whole turns are dropped before anything is rounded.

        Parameters
        ----------
        n, t, t_lo, local : array
            As for `whole`.
        """
        start, turn, rate = self._turns
        total, rest = two_product(t, rate.hi)
        total = total - np.rint(total)
        rest = rest + (rate.lo * t + rate.hi * t_lo + start.lo + n * turn[3])
        for part in turn[:3]:
            total, error = two_sum(total, n * part - np.rint(n * part))
            rest = rest + error
        total = total + start.hi + rest
        circle = 2 * np.pi
        angle = np.mod(circle * (total - np.rint(total)) + local, circle)
        return np.where(angle >= circle, 0.0, angle)
