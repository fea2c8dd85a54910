"""Where the axis is at one time: what every course of it says, in mpmath numbers."""

from __future__ import annotations

from typing import NamedTuple

from heavytop.numbers.decimals import Number


class Place(NamedTuple):
    """Where the axis is at one time, seen upright: 1 ∓ u, −θ̇, Φ± since the start, the period."""

    one_minus_u: Number
    one_plus_u: Number
    rise: Number
    plus: Number
    minus: Number
    n: int
