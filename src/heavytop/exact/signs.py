"""The sign of a form: at sight where a few digits of π decide it, else by evaluation."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor
from typing import Final, Literal

from heavytop.exact.forms import Form

_PI: Final = (Fraction("3.14159265358979323846"), Fraction("3.14159265358979323847"))
_MAX_POWER: Final = 64  # of π that is worth building for it


def sign(x: Form) -> Literal[-1, 0, 1] | None:
    """−1, 0 or 1, or None where 2000 bits cannot tell x from an unproved zero."""
    if not x:
        return 0
    low, high = _bounds(x) or (Fraction(-1), Fraction(1))
    if low > 0 or high < 0:
        return 1 if low > 0 else -1
    from heavytop.exact import enclosure

    return enclosure.decide(x, enclosure.sign, 0)


def _bounds(x: Form) -> tuple[Fraction, Fraction] | None:
    """Rational bounds on sums of roots and powers of π: aᵉ lies between a^⌊e⌋ and a^⌈e⌉."""
    low = high = Fraction(0)
    for monomial, c in x:
        least = most = Fraction(1)
        for atom, e in monomial:
            if not isinstance(atom, (Fraction, str)) or abs(e) > _MAX_POWER:
                return None
            ends = _PI if isinstance(atom, str) else (atom,)
            powers = [end**k for end in ends for k in (floor(e), ceil(e))]
            least, most = least * min(powers), most * max(powers)
        low, high = low + min(c * least, c * most), high + max(c * least, c * most)
    return low, high
