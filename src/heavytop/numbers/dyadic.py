"""Binary numbers m 2ᵉ as pairs of integers, on their way to doubles and to other libraries."""

from __future__ import annotations

from fractions import Fraction


def cut(q: Fraction, bits: int) -> tuple[int, int]:
    """Mantissa and exponent of q cut after `bits` bits or more.

    Its last bit is 1 where something is lost, so that with two bits to spare it rounds to nearest
    as q itself does, ties included.
    """
    p, d = q.numerator, q.denominator
    shift = max(bits - p.bit_length() + d.bit_length(), 0)
    whole, rest = divmod(p << shift, d)
    return 2 * whole + (rest > 0), -shift - 1


def double(man: int, exponent: int) -> float:
    """The double nearest man 2ᵉ.

    Raises
    ------
    OverflowError
        The number is larger than any double.
    """
    return man / (1 << -exponent) if exponent < 0 else float(man << exponent)
