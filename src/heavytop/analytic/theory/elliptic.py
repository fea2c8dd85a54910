"""Elliptic integrals at any number of digits, by arithmetic–geometric means.

Each step of the mean doubles the digits, so that a thousand of them cost a dozen steps. The
complementary parameter mc = 1 − m is what is given, for its digits are the ones that matter near
a separatrix. The algorithms are Bulirsch's el1 and cel (Numer. Math. 7 (1965) 78–90 and 13 (1969)
305–315), whose terms are all of one sign here.
"""

from __future__ import annotations

from heavytop.numbers.decimals import Context, Number


def first(ctx: Context, tangent: Number, mc: Number) -> Number:
    """F(φ | 1 − mc) for tan φ = `tangent` ≥ 0.

    Parameters
    ----------
    ctx : Context
        The precision.
    tangent : Number
        tan φ.
    mc : Number
        1 − m ≥ 0.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> ctx = context(20)
    >>> print(first(ctx, ctx.one, ctx.mpf("0.5")))
    0.82601787624924518546
    """
    if not tangent:
        return ctx.zero
    if not mc:
        return ctx.asinh(tangent)
    y, a, b, turns = 1 / tangent, ctx.one, ctx.sqrt(mc), 0
    while True:
        product = a * b
        y = y - product / y or ctx.sqrt(product) * ctx.eps
        if abs(a - b) <= ctx.sqrt(ctx.eps) * a:
            return (ctx.atan((a + b) / y) + ctx.pi * (turns + (y < 0))) / (a + b)
        a, b, turns = a + b, 2 * ctx.sqrt(product), 2 * turns + (y < 0)


def complete_first(ctx: Context, mc: Number) -> Number:
    """K(1 − mc), for mc > 0.

    Parameters
    ----------
    ctx : Context
        The precision.
    mc : Number
        1 − m.
    """
    return ctx.pi / (2 * ctx.agm(1, ctx.sqrt(mc)))


def complete_third(ctx: Context, p: Number, mc: Number) -> Number:
    """∫ dφ / ((cos²φ + p sin²φ) √(cos²φ + mc sin²φ)) over 0 … π/2: Π(1 − p | 1 − mc).

    Parameters
    ----------
    ctx : Context
        The precision.
    p : Number
        1 − n > 0.
    mc : Number
        1 − m > 0.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> ctx = context(20)
    >>> print(complete_third(ctx, ctx.mpf(3), ctx.mpf("0.5")))
    1.0226975086065923912
    """
    p, k = ctx.sqrt(p), ctx.sqrt(mc)
    a, b, mean, product = ctx.one, 1 / p, ctx.one, k
    while True:
        a, b = a + b / p, 2 * (b + a * product / p)
        p, mean, last = p + product / p, mean + k, mean
        if abs(last - k) <= 8 * ctx.eps * last:
            return ctx.pi / 2 * (b + a * mean) / (mean * (mean + p))
        k = 2 * ctx.sqrt(product)
        product = k * mean
