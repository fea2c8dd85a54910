"""Constant tilt: the rates of steady precession, and sleeping, of a top and its spin.

With p_ψ = C ω3, θ̈ = 0 at θ̇ = 0 (or: torque = rate of change of the angular momentum) is

    A cosθ Ω² − p_ψ Ω + gMR = 0,   Ω = [p_ψ ± √(p_ψ² − 4 A gMR cosθ)] / 2A cosθ.

On the vertical these are the rates of the smallest cones about it. Where V is highest there, a
small motion ζ = θ e^{iφ} obeys ζ̈ − i (p_ψ/A) ζ̇ − (|gMR|/A) ζ = 0: in the frame that turns with
p_ψ/2A,

    ζ̈ = ¼ (4 A |gMR| − p_ψ²)/A² ζ,

so it grows when p_ψ² < 4 A |gMR|, and oscillates when p_ψ² > 4 A |gMR|; θ = |ζ| then nods with
twice that frequency.

Steady rates are in doubles, over arrays of spins (`State.steady` is the exact start); sleeping is
decided by exact numbers.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.errors import ImpossibleStart
from heavytop.numbers import Exact, Number, cos, sin, sqrt
from heavytop.scene.top import Top

Array: TypeAlias = npt.NDArray[np.float64]


def steady_rates(
    A: float, gMR: float, p_psi: npt.ArrayLike, u: npt.ArrayLike
) -> tuple[Array, Array]:
    """The slow and the fast root Ω [rad/s] of A u Ω² − p_ψ Ω + gMR = 0, u = cosθ.

    Nan where there is none, and infinite where A u = 0 leaves one only. The root of smaller
    magnitude is taken from its partner: no digits are lost for a fast top.
    """
    spin, product = np.asarray(p_psi, dtype=np.float64), A * gMR * np.asarray(u, dtype=np.float64)
    pull = 2 * np.sqrt(abs(product))
    with np.errstate(invalid="ignore", divide="ignore"):
        real = np.sqrt((abs(spin) - pull) * (abs(spin) + pull))
        larger = spin + np.copysign(np.where(product > 0, real, np.hypot(spin, pull)), spin)
        return np.asarray(2 * gMR / larger), np.asarray(larger / (2 * A * np.asarray(u)))


def slow(top: Top, theta: Number, omega3: npt.ArrayLike) -> Array:
    """The slow rate Ω [rad/s] of steady precession at θ, the one of smaller magnitude.

    Raises
    ------
    ImpossibleStart
        Some spin is below `least_spin`, or nothing holds the top up at θ = π/2.

    Examples
    --------
    >>> print(slow(Top("6.375e-3", "7.5e-4", "0.73575"), "pi/3", 140.6))
    10.0
    """
    found, _ = _real_rates(top, theta, omega3)
    if not float(top.gMR):
        return 0 * _momentum(top, omega3)
    if np.any(np.isinf(found)):
        raise ImpossibleStart([("omega3", "not 0 at this theta")])
    return found[()]


def fast(top: Top, theta: Number, omega3: npt.ArrayLike) -> Array:
    """The fast rate Ω [rad/s] of steady precession at θ, the one of larger magnitude.

    Raises
    ------
    ImpossibleStart
        Some spin is below `least_spin`, or θ = π/2, where there is no fast rate.

    Examples
    --------
    >>> print(fast(Top("6.375e-3", "7.5e-4", "0.73575"), "pi/3", 140.6).round(12))
    23.082352941176
    """
    _, found = _real_rates(top, theta, omega3)
    if not _cosine(theta):
        raise ImpossibleStart([("steady", '"slow" at theta = pi/2: there is no fast rate')])
    return found[()]


def slow_limit(top: Top, omega3: npt.ArrayLike) -> Array:
    """gMR/p_ψ [rad/s], to which the slow rate tends for a fast spin.

    It is too low by the factor 1 + x + 2x² + …, x = A gMR cosθ/p_ψ².
    """
    return float(top.gMR) / _momentum(top, omega3)


def fast_limit(top: Top, theta: Number, omega3: npt.ArrayLike) -> Array:
    """p_ψ/(A cosθ) [rad/s], to which the fast rate tends for a fast spin: gravity is not felt."""
    return _momentum(top, omega3) / (float(top.A) * _cosine(theta))


def least_spin(top: Top, theta: Number) -> float:
    """The least |ω3| of a steady precession, 2 √(A gMR cosθ)/C [rad/s]; 0 where any spin will do.

    Examples
    --------
    >>> round(least_spin(Top("3.28e-4", "6.6e-5", "0.0456"), 0), 9)
    117.194006936
    """
    product = float(top.A) * float(top.gMR) * _cosine(theta)
    return 2 * math.sqrt(max(product, 0.0)) / float(top.C)


def nutation_frequency(top: Top, theta: Number, precession: npt.ArrayLike) -> Array:
    """The frequency ω [rad/s] of small nodding about the steady precession Ω at θ.

    ω² = Ω² + (gMR/AΩ)² − 2 (gMR/A) cosθ, taken as a sum of squares: where the two rates meet near
    the vertical it would cancel. Ω is one of the two rates, and not 0.

    Examples
    --------
    >>> print(nutation_frequency(Top("6.375e-3", "7.5e-4", "0.73575"), "pi/3", 10).round(12))
    10.852971464967
    """
    rate, half = np.asarray(precession, dtype=np.float64), Exact.of(theta) / 2
    g = float(top.gMR / top.A)
    from_highest = 2 * float(sin(half) if g > 0 else cos(half)) ** 2  # 1 ∓ cosθ
    return np.sqrt((rate - abs(g) / rate) ** 2 + 2 * abs(g) * from_highest)


def _real_rates(top: Top, theta: Number, omega3: npt.ArrayLike) -> tuple[Array, Array]:
    u, A, gMR = _cosine(theta), float(top.A), float(top.gMR)
    found = steady_rates(A, gMR, _momentum(top, omega3), u)
    if np.any(np.isnan(found[0])):
        least = f"at least {least_spin(top, theta):.17g} in magnitude at this theta"
        raise ImpossibleStart([("omega3", least)])
    return found


def _cosine(theta: Number) -> float:
    return float(cos(Exact.of(theta)))


def _momentum(top: Top, omega3: npt.ArrayLike) -> Array:
    """p_ψ = C ω3 [kg m² s⁻¹]; a scalar for a scalar."""
    p_psi: Array = float(top.C) * np.asarray(omega3, dtype=np.float64)[()]
    return p_psi


def sleeping_threshold(top: Top) -> float | None:
    """The least |ω3| at which sleeping is stable, 2 √(A |gMR|)/C [rad/s].

    None without gravity, when no vertical is higher than the other.

    Examples
    --------
    >>> sleeping_threshold(Top("3.28e-4", "6.6e-5", "0.0456"))
    117.19400693596917
    """
    return float(2 * sqrt(top.A * _weight(top)) / top.C) if top.gMR.sign() else None


def sleeping_growth_rate(top: Top, omega3: Number) -> float | None:
    """The rate √(4 A |gMR| − p_ψ²)/2A [1/s] at which θ grows; None where sleeping is stable.

    Examples
    --------
    >>> sleeping_growth_rate(Top(1, 1, 1), 1), sleeping_growth_rate(Top(1, 1, 1), 2)
    (0.8660254037844386, None)
    """
    square = _stiffness(top, omega3)
    return float(sqrt(-square) / 2) if square.sign() == -1 else None


def sleeping_nutation_frequency(top: Top, omega3: Number) -> float | None:
    """The frequency √(p_ψ² − 4 A |gMR|)/A [rad/s] at which a small θ nods; None where it grows.

    It is the difference of the two rates at which small cones are gone round.

    Examples
    --------
    >>> sleeping_nutation_frequency(Top(1, 1, 1), "sqrt(5)")
    1.0
    """
    square = _stiffness(top, omega3)
    return None if square.sign() == -1 else float(sqrt(square))


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


def _weight(top: Top) -> Exact:
    return top.gMR if top.gMR.sign() == 1 else -top.gMR


def _stiffness(top: Top, omega3: Number) -> Exact:
    """(p_ψ² − 4 A |gMR|)/A²."""
    return (top.C * Exact.of(omega3) / top.A) ** 2 - 4 * _weight(top) / top.A
