"""Numbers at a stated number of digits, and the rule by which one of them counts as zero."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from functools import lru_cache
from numbers import Integral, Real
from typing import Any, TypeAlias

from mpmath.ctx_mp import MPContext
from mpmath.libmp import from_man_exp

from heavytop.errors import NotANumber
from heavytop.numbers import Exact

Context: TypeAlias = Any
"""An mpmath context of its own precision (mpmath has no types)."""

Number: TypeAlias = Any
"""A real number of such a context (an ``mpf``)."""

STANDARD_DIGITS = 60
"""The digits at which kinds are decided and constants given."""


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
    own.mpf.__reduce__ = own.constant.__reduce__ = lambda value: (_again, (dps, value._mpf_))
    if own.mpf.__format__ is object.__format__:  # before mpmath 1.4, which formats by itself
        own.mpf.__format__ = _formatted
    return own


class _Context(MPContext):  # type: ignore[misc]
    """A context that a copy of its numbers shares, in this process or another."""

    def __reduce__(self) -> tuple[Any, ...]:
        return context, (self.dps,)


def _again(dps: int, parts: tuple[int, ...]) -> Number:
    """The number of a context that was copied or pickled."""
    return context(dps).make_mpf(parts)


def _formatted(value: Number, spec: str) -> str:
    """A number as an f-string asks for it, with as many of its digits as that shows."""
    if not spec:
        return str(value)
    return format(Decimal(value.context.nstr(value, value.context.dps + 3)), spec)


def number(ctx: Context, value: Any) -> Number:
    """`value` as a number of `ctx`: exact numbers are evaluated there, binary ones kept exactly.

    Parameters
    ----------
    ctx : Context
        Where the number shall live.
    value : object
        Anything with a method ``mpf(ctx)``, a number of another context, int, float, Fraction,
        Decimal, or text that `Exact.of` reads. A float means its binary value.

    Raises
    ------
    NotANumber
        When the value is none of these, or not finite.

    Examples
    --------
    >>> number(context(20), Fraction(1, 3))
    mpf('0.33333333333333333333347')
    """
    if isinstance(value, str):
        value = Exact.of(value)
    if hasattr(value, "mpf"):
        value = value.mpf(ctx)
    if hasattr(value, "_mpf_"):
        return _finite(ctx, ctx.make_mpf(value._mpf_), value)
    if isinstance(value, Integral) and not isinstance(value, bool):
        return ctx.mpf(int(value))
    if isinstance(value, Fraction | Decimal):
        return _quotient(ctx, value)
    if isinstance(value, Real) and not isinstance(value, bool):
        return _finite(ctx, ctx.mpf(float(value)), value)
    raise NotANumber(f"{value!r} is not a real number")


def binary(ctx: Context, man: Any, exp: Any) -> Number:
    """The number man 2ᵉˣᵖ, rounded to the context."""
    return ctx.make_mpf(from_man_exp(int(man), int(exp), ctx.prec, "n"))


def _quotient(ctx: Context, value: Fraction | Decimal) -> Number:
    if isinstance(value, Decimal) and not value.is_finite():
        raise NotANumber(f"{value!r} is not finite")
    numerator, denominator = value.as_integer_ratio()
    return ctx.mpf(numerator) / denominator


def _finite(ctx: Context, converted: Number, value: Any) -> Number:
    if not ctx.isfinite(converted):
        raise NotANumber(f"{value!r} is not finite")
    return converted


def threshold(ctx: Context) -> Number:
    """The relative size below which a number of `ctx` counts as zero: two thirds of its digits.

    At 60 digits that is 1e-40, which leaves 20 good digits in whatever is larger.

    Examples
    --------
    >>> float(threshold(context(60)))
    1e-40
    """
    return ctx.mpf(10) ** (-((2 * ctx.dps) // 3))


def relative(total: Number, *terms: Number) -> Number:
    """The size of a sum beside the terms it was added up from: 0 … 1; 0 when all are zero.

    Examples
    --------
    >>> relative(-1, 2, -3)
    0.2
    """
    size = sum(abs(term) for term in terms)
    return abs(total) / size if size else size


def vanishes(ctx: Context, total: Number, *terms: Number) -> bool:
    """Whether a sum is zero beside the terms it was added up from.

    Examples
    --------
    >>> vanishes(context(60), 0, 1, 1), vanishes(context(60), 1e-30, 1, 1)
    (True, False)
    """
    return bool(relative(total, *terms) <= threshold(ctx))


def square_vanishes(ctx: Context, total: Number, *terms: Number) -> bool:
    """Whether a square is zero beside other squares: the threshold itself is squared.

    Examples
    --------
    >>> square_vanishes(context(60), 1e-60, 1), square_vanishes(context(60), 1e-81, 1)
    (False, True)
    """
    return bool(relative(total, *terms) <= threshold(ctx) ** 2)


def digits_lost(ctx: Context, total: Number, *terms: Number) -> int:
    """How many digits the sum `total` has lost against its terms; 0 when it is exactly zero.

    Examples
    --------
    >>> digits_lost(context(60), context(60).mpf("1e-17"), 1)
    17
    """
    size = relative(total, *terms)
    return max(0, int(ctx.ceil(-ctx.log10(size)))) if size else 0
