"""Where the axis is at many times, in doubles: what every course of it has to say."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from heavytop.numbers.decimals import Number
from heavytop.numbers.pairs import Array, Doubles, Pairs


class DoublePlace(NamedTuple):
    """The axis, seen upright, at many times.

    Parameters
    ----------
    from_top, from_bottom : array
        √(1 − u) and √(1 + u): √2 sin(θ/2) and √2 cos(θ/2).
    one_minus_u, one_plus_u, rise, uddot : array
        Their squares, −θ̇ and ü.
    phidot, spin : array
        φ̇, and ψ̇ − κ [rad/s].
    plus, minus : array
        Φ± since a turning point, without what is proportional to time for all time.
    turning, n : array
        That turning point, and the period.
    """

    from_top: Array
    from_bottom: Array
    one_minus_u: Array
    one_plus_u: Array
    rise: Array
    uddot: Array
    phidot: Array
    spin: Array
    plus: Array
    minus: Array
    turning: Array
    n: Array


class DoubleCourse(Protocol):
    """One course of the axis in doubles.

    Attributes
    ----------
    turns, offsets, rates : tuple of 2 Number
        Of Φ₊ and Φ₋: from one turning point to the next, at the start, and per time.
    size : float
        What Φ± is made of besides what they come out as [rad].
    """

    turns: tuple[Number, Number]
    offsets: tuple[Number, Number]
    rates: tuple[Number, Number]
    size: float

    def chords(self, t: Array, t_lo: Doubles) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u) at the times t + t_lo."""

    def place(self, t: Array, t_lo: Doubles) -> DoublePlace:
        """The place at the times t + t_lo."""

    def phases(self, t: Array, t_lo: Doubles) -> tuple[Pairs, Pairs]:
        """Φ± as in the place, with twice the digits."""
