"""Time by plain quadrature of the reduced equation u̇² = f(u), without elliptic functions.

With u = ½ (u₁ + u₂) − ½ (u₂ − u₁) cos α the roots of f at the turning points cancel, and

    t = ∫ dα / √(2g (u₃ − u)),   T = the same over a whole turn of α,

a smooth integrand: the trapezoid rule over the turn converges geometrically. It shares the roots
with the closed form and nothing else, and so checks its periods and times.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.analytic.theory.nutation import Nutation
from heavytop.errors import NoClosedForm
from heavytop.numbers.decimals import Number

Array: TypeAlias = npt.NDArray[np.float64]

MOST_NODES = 4096
"""Trapezoid nodes beyond which it gives up: the motion is too near a separatrix."""

MOST_GAUSS = 512
"""Gauss–Legendre nodes beyond which it gives up; finding more costs as much as their cube."""


def period(roots: Nutation) -> Number:
    """The period T of the nutation [s], by the trapezoid rule, at the precision of the roots.

    Parameters
    ----------
    roots : Nutation
        The turning points.

    Raises
    ------
    NoClosedForm
        When 4096 nodes are not enough, within about 1e-6 of a separatrix.
    """
    ctx, nodes = roots.ctx, 8
    coarse = ctx.inf
    while nodes <= MOST_NODES:
        step = 2 * ctx.pi / nodes
        fine = step * sum(_slowness(roots, ctx.cos(step * k / 2)) for k in range(nodes))
        if abs(fine - coarse) <= abs(fine) * ctx.sqrt(ctx.eps):
            return fine  # geometric convergence: the finer one has twice the digits
        nodes, coarse = 2 * nodes, fine
    raise NoClosedForm("too near a separatrix for plain quadrature")


def _slowness(roots: Nutation, cosine: Number) -> Number:
    """1/√(2g (u₃ − u)) at cos ½α; 2g (u₃ − u₁) = 4w²."""
    return 1 / (2 * roots.w * roots.ctx.sqrt(roots.mc + roots.m * cosine**2))


def elapsed(roots: Nutation, theta: npt.ArrayLike) -> Array:
    """Time t(θ) [s] from the turning point u₁ to the angles θ, in doubles.

    Parameters
    ----------
    roots : Nutation
        The turning points.
    theta : array_like
        Angles between the turning points [rad].

    Raises
    ------
    NoClosedForm
        When 512 nodes are not enough, near a separatrix.
    """
    alpha = _alpha(roots, np.asarray(theta, dtype=np.float64))
    nodes, coarse = 32, np.full_like(alpha, np.inf)
    while nodes <= MOST_GAUSS:
        fine = _elapsed_at(roots, alpha, nodes)
        if np.all(abs(fine - coarse) <= 1e-13 * np.max(fine)):
            return fine
        nodes, coarse = 2 * nodes, fine
    raise NoClosedForm("too near a separatrix for plain quadrature")


def _elapsed_at(roots: Nutation, alpha: Array, nodes: int) -> Array:
    """Gauss–Legendre over [0, α] with so many nodes."""
    x, weight = _gauss(nodes)
    cosine = np.cos(np.multiply.outer(alpha, (1 + x) / 4))
    slowness = 1 / np.sqrt(float(roots.mc) + float(roots.m) * cosine**2)
    return alpha * np.asarray(slowness @ weight, dtype=np.float64) / (4 * float(roots.w))


@lru_cache(maxsize=16)
def _gauss(nodes: int) -> tuple[Array, Array]:
    x, weight = np.polynomial.legendre.leggauss(nodes)
    return np.asarray(x, dtype=np.float64), np.asarray(weight, dtype=np.float64)


def _alpha(roots: Nutation, theta: Array) -> Array:
    """α of the angles θ: tan²½α = (u − u₁)/(u₂ − u), differences of cosines as products of sines.

    Differences of θ lose digits near a turning point, as t(θ) itself does.
    """
    lower, upper = float(roots.theta_lower), float(roots.theta_upper)
    rise = np.sin((lower + theta) / 2) * np.sin((lower - theta) / 2)
    left = np.sin((theta + upper) / 2) * np.sin((theta - upper) / 2)
    half = np.arctan2(np.sqrt(abs(rise)), np.sqrt(abs(left)))
    return np.asarray(2 * half, dtype=np.float64)


def elapsed_exact(roots: Nutation, theta: Number) -> Number:
    """Time t(θ) [s] from the turning point u₁ to the angle θ, at the precision of the roots.

    Parameters
    ----------
    roots : Nutation
        The turning points.
    theta : Number
        An angle between the turning points [rad].
    """
    ctx = roots.ctx
    lower, upper = roots.theta_lower, roots.theta_upper
    rise = ctx.sin((lower + theta) / 2) * ctx.sin((lower - theta) / 2)
    left = ctx.sin((theta + upper) / 2) * ctx.sin((theta - upper) / 2)
    alpha = 2 * ctx.atan2(ctx.sqrt(abs(rise)), ctx.sqrt(abs(left)))
    return ctx.quad(lambda x: _slowness(roots, ctx.cos(x / 2)), ctx.linspace(0, alpha, 5))
