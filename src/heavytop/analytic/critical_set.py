"""The critical set of the energy–momentum map: steady precession, and what stays on the vertical.

In units A = 1, with a = p_φ/A, b = p_ψ/A, h = E'/A, g = gMR/A and u = cosθ, a steady precession of
rate Ω has the constants

    b = Ω u + g/Ω,   a = Ω + g u/Ω,   h = g u + ½ Ω² (1 − u²):

two sheets without folds, one for each sign of Ω, whose edges u = ±1 lie on the lines a = ±b,
h = ±g of the upright and the hanging equilibrium. At one b the sheets are where u = (bΩ − g)/Ω² is
a cosine, and there

    Ω⁴ − a Ω³ + g b Ω − g² = 0,   da/dΩ = 1 − u² + (2g/Ω − b)²/Ω² ≥ 0,   dh/da = Ω,

so that h is a convex function of a, the least energy there is at a. It has a corner at the hanging
equilibrium. At the upright one it has another if b² ≥ 4|g|; if not, that point lies above the
least energy, and is critical by itself.
"""

from __future__ import annotations

from math import copysign, sqrt
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
Span: TypeAlias = "tuple[float, float]"

_HALVINGS: Final = 64  # of a bracket no wider than a few of the rates themselves


def spans(g: float, b: float) -> tuple[Span, ...]:
    """The rates Ω that steady precessions of one p_ψ have, from the least up [s⁻¹].

    They end at the cones about the hanging axis and, where sleeping is stable, about the upright.

    Examples
    --------
    >>> spans(1.0, 0.0), spans(1.0, 2.5)[1:]
    (((-inf, -1.0), (1.0, inf)), ((0.3507810593582122, 0.5), (2.0, inf)))
    """
    weight, spin = abs(g), b if g >= 0 else -b
    if not weight:
        return (-np.inf, -abs(b)), (abs(b), np.inf)
    low, high = _roots(-spin, -weight)
    below: list[Span] = [(-np.inf, low)]
    above: list[Span] = [(high, np.inf)]
    if spin**2 >= 4 * weight:
        slow, fast = _roots(spin, weight)
        cut = above if spin > 0 else below
        cut[:] = [(cut[0][0], slow), (fast, cut[0][1])]
    return (*below, *above)


def least(g: float, b: float, a: npt.ArrayLike) -> tuple[Array, Array]:
    """The least h [s⁻²] at given a, and its slope, the rate Ω of that steady precession [s⁻¹].

    The rate is nan at a corner, where the axis stays on the vertical.

    Examples
    --------
    >>> h, rate = least(1.0, 1.0, [1.0, -1.0])
    >>> h, rate
    (array([ 0.5, -1. ]), array([ 1., nan]))
    """
    asked = np.asarray(a, dtype=np.float64)
    if not g:
        outside = abs(asked) > abs(b)
        h = np.where(outside, (asked - b) * (asked + b) / 2, 0.0)
        return h, np.where(outside, asked, 0.0)
    lowest, rate = np.full(asked.shape, np.nan), np.full(asked.shape, np.nan)
    for ends in spans(g, b):
        low, high = (_momentum(g, b, end) for end in ends)
        here = (asked > low) & (asked < high)
        rate[here] = _rate(g, b, asked[here], ends)
        lowest[here] = _energy(g, b, asked[here], rate[here])
    upright = copysign(b, b * g)
    corner = np.where(abs(asked - upright) < abs(asked + upright), abs(g), -abs(g))
    return np.where(np.isnan(lowest) & (abs(asked) == abs(b)), corner, lowest), rate


def cosines(g: float, b: float, a: npt.ArrayLike, rate: npt.ArrayLike) -> tuple[Array, Array]:
    """The numbers 1 ∓ u of steady precessions, by a ∓ b = (1 ∓ u)(Ω ∓ g/Ω): exact near poles."""
    omega, given = np.asarray(rate, dtype=np.float64), np.asarray(a, dtype=np.float64)
    across, along = omega - g / omega, omega + g / omega
    with np.errstate(divide="ignore", invalid="ignore"):
        minus, plus = (given - b) / across, (given + b) / along
    minus, plus = (
        np.where(abs(across) < abs(along) / 8, 2 - plus, minus),
        np.where(abs(along) < abs(across) / 8, 2 - minus, plus),
    )
    return np.maximum(minus, 0.0), np.maximum(plus, 0.0)


def passed(g: float, b: float, a: float, h: float) -> tuple[float, float]:
    """1 − u and 1 + u of a tilt that the motions with these constants pass.

    That is where V is least; in a corner, where V is least on the vertical, a tilt beside it.
    """
    lowest, rate = least(g, b, a)
    if rate and not np.isnan(rate):
        minus, plus = cosines(g, b, a, rate)
        return float(minus), float(plus)
    if not g and abs(a) < abs(b):  # at rest in any direction
        return 1 - a / b, 1 + a / b
    # where a = ±b, f(u) = x (2 (h − least ± …)(2 − x) − b² x), x from the pole, is positive here
    far = min(1.0, (h - float(lowest)) / (2 * abs(g) + b**2 or 1.0))
    upwards = (lowest > 0) == (g > 0) if g else a * b > 0
    return (far, 2 - far) if upwards else (2 - far, far)


def _roots(total: float, product: float) -> Span:
    """The roots of Ω² − total Ω + product = 0, increasing, without cancellation."""
    larger = (total + copysign(sqrt(total**2 - 4 * product), total)) / 2
    return min(larger, product / larger), max(larger, product / larger)


def _momentum(g: float, b: float, rate: float) -> float:
    """The a of a rate; at an end of a span the axis is on the vertical, and a is ±b."""
    if np.isinf(rate):
        return float(rate)
    return b if (b - g / rate) / rate > 0 else -b


def _rate(g: float, b: float, a: Array, ends: Span) -> Array:
    """The rate in a span at which a(Ω) = a, by halving: |Ω − a| = |g u/Ω| bounds it."""
    inner = min(map(abs, ends))
    reach = abs(g) / inner
    low = np.maximum(ends[0], a - reach) if np.isinf(ends[0]) else np.full(a.shape, ends[0])
    high = np.minimum(ends[1], a + reach) if np.isinf(ends[1]) else np.full(a.shape, ends[1])
    for _ in range(_HALVINGS):
        middle = low + (high - low) / 2
        more = middle + g * (b - g / middle) / middle**2 < a
        low, high = np.where(more, middle, low), np.where(more, high, middle)
    return np.asarray(low + (high - low) / 2)


def _energy(g: float, b: float, a: Array, rate: Array) -> Array:
    """The energy h at the rate; what halving left of a is made good by dh/da = Ω."""
    u = (b - g / rate) / rate
    found = rate + g * u / rate
    return np.asarray(g * u + rate**2 * (1 - u) * (1 + u) / 2 + rate * (a - found))
