"""Constant tilt: the rates of steady precession, and the spin that they and sleeping need.

With p_ψ = C ω3, θ̈ = 0 at θ̇ = 0 (or: torque = rate of change of the angular momentum) is

    A cosθ Ω² − p_ψ Ω + gMR = 0,   Ω = [p_ψ ± √(p_ψ² − 4 A gMR cosθ)] / 2A cosθ.

On the vertical these are the rates of the smallest cones about it. Where V is highest there, a
small motion ζ = θ e^{iφ} obeys ζ̈ − i (p_ψ/A) ζ̇ − (|gMR|/A) ζ = 0: in the frame that turns with
p_ψ/2A,

    ζ̈ = ¼ (4 A |gMR| − p_ψ²)/A² ζ,

so it grows when p_ψ² < 4 A |gMR|, and oscillates when p_ψ² > 4 A |gMR|; θ = |ζ| then nods with
twice that frequency.

`State.steady` is the exact start of a steady precession, and `facts` says how it and a sleeping top
nod or fall.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

from heavytop.numbers import Exact, Number, cos, sqrt
from heavytop.scene.top import Top

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    Array: TypeAlias = npt.NDArray[np.float64]


def rates(top: Top, p_psi: npt.ArrayLike, u: npt.ArrayLike) -> tuple[Array, Array]:
    """The slow and the fast rate Ω [rad/s] of steady precession, over arrays of p_ψ and u = cosθ.

    Nan where there is none, and infinite where A u = 0 leaves one only. The root of smaller
    magnitude is taken from its partner: no digits are lost for a fast top.

    Examples
    --------
    >>> slow, fast = rates(Top("6.375e-3", "7.5e-4", "0.73575"), 7.5e-4 * 140.6, 0.5)
    >>> print(slow.round(12), fast.round(12))
    10.0 23.082352941176
    """
    A, gMR = float(top.A), float(top.gMR)
    import numpy as np  # the least spin of a verdict needs no arrays

    spin, cosine = np.asarray(p_psi, dtype=np.float64), np.asarray(u, dtype=np.float64)
    product = A * gMR * cosine
    pull = 2 * np.sqrt(abs(product))
    with np.errstate(invalid="ignore", divide="ignore"):
        real = np.sqrt((abs(spin) - pull) * (abs(spin) + pull))
        larger = spin + np.copysign(np.where(product > 0, real, np.hypot(spin, pull)), spin)
        return np.asarray(2 * gMR / larger), np.asarray(larger / (2 * A * cosine))


def least_spin(top: Top, theta: Number) -> float:
    """The least |ω3| of a steady precession, 2 √(A gMR cosθ)/C [rad/s]; 0 where any spin will do.

    Infinite for a point mass, C = 0, which no spin holds up.

    On the vertical where V is highest it is the least spin of a top that sleeps stably.

    Examples
    --------
    >>> least_spin(Top("3.28e-4", "6.6e-5", "0.0456"), 0)
    117.19400693596917
    """
    product = top.A * top.gMR * cos(Exact.of(theta))
    if product.sign() != 1:
        return 0.0
    return float(2 * sqrt(product) / top.C) if top.C != 0 else math.inf


def tilt_at_threshold(delta: float) -> float:
    """How far a push tilts the top that sleeps with just the spin it needs [rad].

    At p_ψ² = 4 A |gMR| the axis, set off at θ̇ = δ √(|gMR|/A), turns back where

        1 − cosθ = 4 |δ|/(|δ| + √(16 + δ²)),

    the positive root of f(u) = 0. For a small push that is θ = √(2δ): stable, but barely.

    Examples
    --------
    >>> round(tilt_at_threshold(1e-6), 8), round(2e-6 ** 0.5, 8)
    (0.00141421, 0.00141421)
    """
    push = abs(float(Exact.of(delta)))
    return 2 * math.atan(math.sqrt(push * (push + math.hypot(4, push)) / 8))
