"""The sign of a form: at sight where it is easy, else by balls, and by proof where it is zero."""

from __future__ import annotations

from fractions import Fraction
from math import ceil, floor
from typing import Final, Literal, TypeAlias

from heavytop.numbers.forms import PI, Form

Sign: TypeAlias = Literal[-1, 0, 1]

_PI: Final = (Fraction("3.14159265358979323846"), Fraction("3.14159265358979323847"))
_PI_ALONE: Final = PI[0][0]  # the monomial
_FEW_BITS: Final = (64, 256)
_MANY_BITS: Final = (1024, 4096)
_MAX_POWER: Final = 64  # of π that is worth building for a sign at sight


def sign(x: Form) -> Sign | None:
    """−1, 0 or 1, or None where 4096 bits cannot tell x from a zero that is not proved."""
    if (known := _at_sight(x)) is not None:
        return known
    from heavytop.numbers import enclosure  # which are slow to import

    if known := enclosure.decide(x, enclosure.sign, _FEW_BITS):
        return known
    from heavytop.numbers.normal_form import proved_zero

    return 0 if proved_zero(x) else enclosure.decide(x, enclosure.sign, _MANY_BITS)


def _at_sight(x: Form) -> Sign | None:
    if not x:
        return 0
    if len(x) == 1 and not x[0][0]:
        return 1 if x[0][1] > 0 else -1
    if len(x) == 2 and not x[0][0] and x[1][0] == _PI_ALONE:
        return _beside_pi(x[0][1], x[1][1])
    low, high = _bounds(x) or (Fraction(-1), Fraction(1))
    return 1 if low > 0 else -1 if high < 0 else None


def _beside_pi(a: Fraction, b: Fraction) -> Sign | None:
    """The sign of a + bπ."""
    turn = -a / b
    larger = turn < _PI[0]
    if not larger and turn <= _PI[1]:
        return None
    return 1 if larger == (b > 0) else -1


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
