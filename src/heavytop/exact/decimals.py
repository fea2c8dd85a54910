"""Numbers of any precision: mpmath contexts by digits, and the bits of the numbers of runs."""

from __future__ import annotations

import math
from decimal import Decimal
from functools import lru_cache
from typing import Any, Final, TypeAlias

from mpmath.ctx_mp import MPContext
from mpmath.libmp import from_man_exp

from heavytop.exact.number import Exact, rational_value

Context: TypeAlias = Any
"""An mpmath context with its own precision (mpmath has no types)."""

Number: TypeAlias = Any
"""A real number of such a context (an ``mpf``)."""


@lru_cache(maxsize=64)
def context(dps: int) -> Context:
    """The mpmath context of `dps` decimal digits, one per precision, never mpmath's global one.

    Parameters
    ----------
    dps : int
        Decimal digits.

    Examples
    --------
    >>> context(30).dps, f"{context(30).mpf(1) / 3:.4f}"
    (30, '0.3333')
    """
    own = _Context()
    own.dps = dps
    own.mpf.__reduce__ = own.constant.__reduce__ = lambda value: (_unpickle, (dps, value._mpf_))
    own.mpf.__format__ = _format_number  # mpmath has none before 1.4
    return own


class _Context(MPContext):  # type: ignore[misc]
    """A context that a copy of its numbers shares, in this process or another."""

    def __reduce__(self) -> tuple[Any, ...]:
        return context, (self.dps,)


def _unpickle(dps: int, parts: tuple[int, ...]) -> Number:
    """The number of a context that was copied or pickled."""
    return context(dps).make_mpf(parts)


def _format_number(value: Number, spec: str) -> str:
    """The text of a number in an f-string, with more digits than a double has."""
    if not spec:
        return str(value)
    return format(Decimal(value.context.nstr(value, value.context.dps + 3)), spec)


def number(ctx: Context, value: Any) -> Number:
    """`value` as a number of `ctx`: exact numbers are evaluated there, binary ones kept exactly.

    Parameters
    ----------
    ctx : Context
        The context of the result.
    value : object
        Anything with a method ``mpf(ctx)``, a number of another context, int, float, Fraction,
        Decimal, or text that `Exact.of` reads. A float means its binary value.

    Raises
    ------
    NotANumber
        The value is none of these, or not finite.

    Examples
    --------
    >>> number(context(20), "1/3")
    mpf('0.33333333333333333333347')
    """
    if isinstance(value, str | Decimal):  # its exponent may be too large
        value = Exact.of(value)
    if hasattr(value, "mpf"):
        value = value.mpf(ctx)
    if hasattr(value, "_mpf_") and ctx.isfinite(value):
        return ctx.make_mpf(value._mpf_)
    q = rational_value(value)
    return ctx.mpf(q.numerator) / q.denominator


def binary(ctx: Context, man: Any, exp: Any) -> Number:
    """The number man 2ᵉˣᵖ, rounded to the context."""
    return ctx.make_mpf(from_man_exp(int(man), int(exp), ctx.prec, "n"))


# --- the bits and the digits of the numbers of a run ---------------------------------------------


DOUBLE: Final = 53
TEXT_SPARE_DIGITS: Final = 12
WORD: Final = 64  # MPFR computes in whole words


def digits_of(bits: int) -> int:
    """Return the decimal digits of texts that are to be rounded to numbers of so many bits.

    Examples
    --------
    >>> digits_of(53)
    27
    """
    return int(bits * math.log10(2)) + TEXT_SPARE_DIGITS


def least_bits(needed: float) -> int:
    """Return the bits of the smallest type of number, double or MPFR, with at least so many.

    Examples
    --------
    >>> least_bits(50), least_bits(60), least_bits(200), least_bits(3300.1)
    (53, 64, 256, 3328)
    """
    return DOUBLE if needed <= DOUBLE else WORD * math.ceil(needed / WORD)


def precision(x: Any) -> int:
    """Return the bits of a number: a double, or one of heyoka's reals."""
    return int(getattr(x, "prec", DOUBLE))


def named(bits: int) -> str:
    """Return the name of numbers with so many bits.

    Examples
    --------
    >>> named(53), named(256)
    ('double', '256 bits')
    """
    return "double" if bits == DOUBLE else f"{bits} bits"


def bits_of(name: str) -> int:
    """Return the bits of numbers by their name, the inverse of `named`.

    Examples
    --------
    >>> bits_of("double"), bits_of("256 bits")
    (53, 256)
    """
    return DOUBLE if name == "double" else int(name.split()[0])
