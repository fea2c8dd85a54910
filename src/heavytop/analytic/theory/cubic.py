"""The roots of f(u₀ + d), the cubic expanded about the start, and of what is left beyond them.

About the start the coefficients lose nothing where f has a double root near it; the two roots
beside the start and their distances from the poles come from products, not from differences.
"""

from __future__ import annotations

from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Context, Number, context


def inner(over: Reduced) -> tuple[Number, Number]:
    """d₁ = u₁ − u₀ ≤ 0 and d₂ = u₂ − u₀ ≥ 0; exactly 0 when the start is a turning point.

    Parameters
    ----------
    over : Reduced
        A motion with g ≥ 0 that nods.
    """
    ctx = over.ctx
    f0, f1, f2, f3 = over.taylor
    if not f3:
        return _quadratic(ctx, f0, f1, f2)
    d1, d2, d3 = _cubic(over)
    if f0:
        near = min(d1, d2, key=abs)
        far = d2 if near is d1 else d1
        near = -f0 / (f3 * far * d3)
    else:
        near, far = ctx.zero, (d2 if f1 > 0 else d1)
    return (near, far) if far > 0 else (far, near)


def outer(
    over: Reduced, P_minus: Number, d1: Number, minus1: Number
) -> tuple[Number, Number, Number]:
    """1 − u₂, u₃ − 1 and 2g (u₃ − 1), from their product and their difference.

    Parameters
    ----------
    over : Reduced
        A motion with g ≥ 0 that nods.
    P_minus, d1, minus1 : Number
        P₋, u₁ − u₀ and 1 − u₁.
    """
    ctx, g = over.ctx, over.g
    energy = 2 * over.kinetic0 + over.b**2
    if not g:
        return P_minus**2 / (energy * minus1), ctx.inf, energy
    product = P_minus**2 / (2 * g * minus1)
    gap = energy / (2 * g) - d1 - 2  # (u₃ − 1) − (1 − u₂), from the sum of the roots
    larger = (abs(gap) + ctx.sqrt(gap**2 + 4 * product)) / 2
    smaller = product / larger if larger else larger
    minus2, beyond = (smaller, larger) if gap >= 0 else (larger, smaller)
    return minus2, beyond, 2 * g * beyond


def _quadratic(ctx: Context, f0: Number, f1: Number, f2: Number) -> tuple[Number, Number]:
    """Both roots of f₀ + f₁ d + f₂ d² with f₂ < 0 ≤ f₀, without cancellation."""
    far = -(f1 + (1 if f1 >= 0 else -1) * ctx.sqrt(f1**2 - 4 * f0 * f2)) / 2
    one, other = far / f2, f0 / far
    return (one, other) if one < other else (other, one)


def _cubic(over: Reduced) -> tuple[Number, Number, Number]:
    """All roots d of f(u₀ + d), increasing, by Viète's cosine.

    The cosine loses half of the digits of a near-double root, and the shift loses those by which
    u₃ exceeds u₂, so the algebra runs at twice the precision, and more where g is small.
    """
    small = max(0, over.ctx.mag(over.taylor[2]) - over.ctx.mag(over.g))
    ctx = context(2 * over.ctx.dps + 20 + small)
    f0, f1, f2, f3 = (ctx.make_mpf(value._mpf_) for value in over.taylor)
    p = (3 * f3 * f1 - f2**2) / (3 * f3**2)
    q = (2 * f2**3 - 9 * f3 * f2 * f1 + 27 * f3**2 * f0) / (27 * f3**3)
    size = 2 * ctx.sqrt(-p / 3)
    angle = ctx.acos(max(-ctx.one, min(ctx.one, 3 * q / (p * size)))) / 3
    third, shift = 2 * ctx.pi / 3, f2 / (3 * f3)
    roots = sorted(size * ctx.cos(angle - third * k) - shift for k in range(3))
    d1, d2, d3 = (over.ctx.make_mpf(root._mpf_) for root in roots)
    return d1, d2, d3
