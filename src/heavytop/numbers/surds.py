"""Roots of rational numbers, brought to one form so that equal roots are seen to be equal."""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction
from typing import Final

_SMALL_PRIMES: Final = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47)
_MAX_BITS: Final = 8192  # above this a root is kept as written: correct still, only less merged


def surd(base: Fraction, exponent: Fraction) -> tuple[Fraction, Fraction, Fraction]:
    """Write baseᵉ as (c, n, f) with baseᵉ = c nᶠ, 0 ≤ f < 1, n as small as is cheap to see.

    Raises
    ------
    ZeroDivisionError
        A negative power of zero.
    ValueError
        A root of a negative number.

    Examples
    --------
    >>> surd(Fraction(8, 3), Fraction(1, 2))
    (Fraction(2, 3), Fraction(6, 1), Fraction(1, 2))
    """
    whole = exponent.__floor__()
    outer, part = Fraction(base) ** whole, exponent - whole
    if part == 0 or base == 0:
        return outer if part == 0 else Fraction(0), Fraction(1), Fraction(0)
    if base < 0:
        raise ValueError("a root of a negative number is not real")
    p, q = part.numerator, part.denominator
    a, b = base.numerator, base.denominator
    if a.bit_length() * p + b.bit_length() * (q - p) > _MAX_BITS:
        return outer, base, part
    # (a/b)^(p/q) = (a^p b^(q-p))^(1/q) / b
    factor, radicand, index = _extract(a**p * b ** (q - p), q)
    power = Fraction(1, index) if radicand > 1 else Fraction(0)
    return outer * factor / b, Fraction(radicand), power


def _extract(n: int, q: int) -> tuple[int, int, int]:
    """Write the q-th root of n as factor · radicand^(1/index)."""
    factor = 1
    for prime in _SMALL_PRIMES:
        while n % prime**q == 0:
            n, factor = n // prime**q, factor * prime
    for k in range(q, 1, -1):  # what is left may be a perfect power as a whole
        if q % k == 0 and (r := integer_root(n, k)) ** k == n:
            n, q = r, q // k
    return (factor * n, 1, 1) if q == 1 else (factor, n, q)


def coprime_base(numbers: Iterable[int], index: int) -> tuple[int, ...]:
    """Coprime integers of whose powers the positive `numbers` are products.

    None of them is itself a power of an order that divides `index`, so that products of their
    roots of that order are linearly independent over the rationals.

    Examples
    --------
    >>> coprime_base([12, 18, 49], 2)
    (2, 3, 7)
    """
    base: list[int] = []
    pending = list(numbers)
    while pending:
        n = pending.pop()
        shared = next((b for b in base if math.gcd(b, n) > 1), None)
        if shared is not None:
            base.remove(shared)
            common = math.gcd(shared, n)
            pending += [common, shared // common, n // common]
        elif n > 1:
            base.append(_least_base(n, index))
    return tuple(sorted(base))


def _least_base(n: int, index: int) -> int:
    for k in range(2, index + 1):
        while index % k == 0 and (r := integer_root(n, k)) ** k == n:
            n = r
    return n


def integer_root(n: int, k: int) -> int:
    """The largest integer r with rᵏ ≤ n, by Newton's iteration from above."""
    if n < 2:
        return n
    r = 1 << -(-n.bit_length() // k)
    while True:
        lower = ((k - 1) * r + n // r ** (k - 1)) // k
        if lower >= r:
            return r
        r = lower
