"""The rule by which a number of so many digits counts as zero."""

from __future__ import annotations

from heavytop.numbers.decimals import Context, Number


def threshold(ctx: Context) -> Number:
    """The relative size below which a number of `ctx` counts as zero: two thirds of its digits.

    At 60 digits that is 1e-40, which leaves 20 good digits in whatever is larger.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
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
    >>> from heavytop.numbers.decimals import context
    >>> vanishes(context(60), 0, 1, 1), vanishes(context(60), 1e-30, 1, 1)
    (True, False)
    """
    return bool(relative(total, *terms) <= threshold(ctx))


def square_vanishes(ctx: Context, total: Number, *terms: Number) -> bool:
    """Whether a square is zero beside other squares: the threshold itself is squared.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> square_vanishes(context(60), 1e-60, 1), square_vanishes(context(60), 1e-81, 1)
    (False, True)
    """
    return bool(relative(total, *terms) <= threshold(ctx) ** 2)


def digits_lost(ctx: Context, total: Number, *terms: Number) -> int:
    """How many digits the sum `total` has lost against its terms; 0 when it is exactly zero.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> digits_lost(context(60), context(60).mpf("1e-17"), 1)
    17
    """
    size = relative(total, *terms)
    return max(0, int(ctx.ceil(-ctx.log10(size)))) if size else 0
