"""The arithmetic of texts: that of forms, with every size bounded before it is built."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Final

from heavytop.errors import NotANumber
from heavytop.numbers import algebra
from heavytop.numbers.forms import Form, Monomial, fraction, rational

_LARGEST: Final = Fraction(10) ** 300
_LARGEST_LOG2: Final = 997
_LOG2_PI: Final = math.log2(math.pi)
_MAX_BITS: Final = 16384  # of any rational,
_MAX_POWER: Final = 64  # of an exponent as it is written, and
_MAX_BUILT_POWER: Final = 4096  # of one that results


def number(q: Fraction) -> Form:
    """The form of a rational number of reasonable size.

    Raises
    ------
    NotANumber
        It lies outside 1e-300 … 1e300 and is not 0.
    """
    near = abs(q.numerator.bit_length() - q.denominator.bit_length()) < _LARGEST_LOG2 - 2
    if q and not near and not 1 / _LARGEST <= abs(q) <= _LARGEST:
        raise out_of_range()
    return rational(q)


def add(a: Form, b: Form) -> Form:
    """Return a + b."""
    return _checked(algebra.add(a, b))


def multiply(a: Form, b: Form) -> Form:
    """Return a b."""
    return _checked(algebra.multiply(a, b))


def power(base: Form, exponent: Form) -> Form:
    """Return base to the exponent, which has to be a small rational."""
    e = fraction(exponent)
    if e is None or _span(e) > _MAX_POWER:
        raise NotANumber(f"an exponent is a rational p/q with |p|, q up to {_MAX_POWER}")
    if _bits(base) * abs(e.numerator) > _MAX_BITS:
        raise NotANumber("a power is too large to be held exactly")
    return _checked(algebra.power(base, e))


def _checked(x: Form) -> Form:
    exponents = [e for monomial, _ in x for _, e in monomial]
    if _bits(x) > _MAX_BITS or any(_span(e) > _MAX_BUILT_POWER for e in exponents):
        raise NotANumber("a number is too large to be held exactly")
    if (q := fraction(x)) is not None:
        return number(q)
    if abs(_log2(x)) > _LARGEST_LOG2:
        raise out_of_range()
    return x


def out_of_range() -> NotANumber:
    """The error of a number that is too large or too small."""
    return NotANumber("the magnitude of a number is 0 or within 1e-300 … 1e300")


def _span(q: Fraction) -> int:
    return max(abs(q.numerator), q.denominator)


def _bits(x: Form) -> int:
    rationals = [c for _, c in x]
    rationals += [atom for m, _ in x for atom, _ in m if isinstance(atom, Fraction)]
    return max((_span(q).bit_length() for q in rationals), default=0)


def _log2(x: Form) -> float:
    """The size of x ≠ 0: of its largest term, or of its value where sums are nested in it."""
    if all(isinstance(atom, (Fraction, str)) for monomial, _ in x for atom, _ in monomial):
        return max(_term_log2(monomial, c) for monomial, c in x)
    from heavytop.numbers import enclosure

    return enclosure.size(x)


def _term_log2(monomial: Monomial, c: Fraction) -> float:
    total = _rational_log2(abs(c))
    for atom, e in monomial:
        total += float(e) * (_rational_log2(atom) if isinstance(atom, Fraction) else _LOG2_PI)
    return total


def _rational_log2(q: Fraction) -> float:
    return math.log2(q.numerator) - math.log2(q.denominator)
