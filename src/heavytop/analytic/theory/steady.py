"""Steady precession: the rates Ω at which θ stays constant, and the nodding about them.

With p_ψ = C ω3, θ̈ = 0 at θ̇ = 0 (or: torque = rate of change of the angular momentum) is

    A cosθ Ω² − p_ψ Ω + gMR = 0,

which has the roots Ω = [p_ψ ± √(p_ψ² − 4 A gMR cosθ)] / 2A cosθ wherever p_ψ² ≥ 4 A gMR cosθ. The
root of smaller magnitude is taken from its partner, 2 gMR / [p_ψ ± √(…)] with the sign that does
not cancel: no digits are lost for a fast top, and none at θ = π/2, where it is gMR/p_ψ.

What takes a `Top` is in doubles and over arrays of spins; `pair` and `nodding` take one motion, at
its own precision, on the vertical too: there the rates are those of the smallest cones, with which
a small motion of the upright or hanging axis goes round. `State.steady` is the exact start.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.analytic.theory.reduced import Reduced
from heavytop.errors import ImpossibleStart
from heavytop.numbers import Exact, cos, sin
from heavytop.numbers import decimals as precision
from heavytop.numbers.decimals import vanishes

if TYPE_CHECKING:
    from heavytop.numbers import Number
    from heavytop.scene.top import Top

Array: TypeAlias = npt.NDArray[np.float64]
Rate: TypeAlias = "np.float64 | Array"


def slow(top: Top, theta: Number, omega3: npt.ArrayLike) -> Rate:
    """The slow rate Ω of steady precession, the one of smaller magnitude.

    Parameters
    ----------
    top : Top
    theta : number
        Tilt θ [rad]; "pi/2" is exact.
    omega3 : array_like
        ω3 = ψ̇ + φ̇ cosθ [rad/s].

    Returns
    -------
    float or array of the shape of omega3
        Ω [rad/s].

    Raises
    ------
    ImpossibleStart
        Some spin is below `least_spin`, or nothing holds the top up at θ = π/2.

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> print(slow(Top("6.375e-3", "7.5e-4", "0.73575"), "pi/3", 140.6))
    10.0
    """
    larger = _larger(top, theta, omega3)
    weight = float(top.gMR)
    if weight and np.any(larger == 0):
        raise ImpossibleStart([("omega3", "not 0 at this theta")])
    return _rate(2 * weight / larger) if weight else _rate(0 * larger)


def fast(top: Top, theta: Number, omega3: npt.ArrayLike) -> Rate:
    """The fast rate Ω of steady precession, the one of larger magnitude.

    Parameters
    ----------
    top : Top
    theta : number
        Tilt θ [rad].
    omega3 : array_like
        ω3 [rad/s].

    Returns
    -------
    float or array of the shape of omega3
        Ω [rad/s].

    Raises
    ------
    ImpossibleStart
        Some spin is below `least_spin`, or θ = π/2, where there is no fast rate.

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> print(fast(Top("6.375e-3", "7.5e-4", "0.73575"), "pi/3", 140.6).round(12))
    23.082352941176
    """
    larger = _larger(top, theta, omega3)
    u = _cosine(theta)
    if u == 0:
        raise ImpossibleStart([("steady", '"slow" at theta = pi/2: there is no fast rate')])
    return _rate(larger / (2 * float(top.A) * u))


def slow_limit(top: Top, omega3: npt.ArrayLike) -> Rate:
    """gMR/p_ψ [rad/s], to which the slow rate tends for a fast spin.

    It is too low by the factor 1 + x + 2x² + …, x = A gMR cosθ/p_ψ².

    Parameters
    ----------
    top : Top
    omega3 : array_like
        ω3 [rad/s].
    """
    return _rate(float(top.gMR) / _momentum(top, omega3))


def fast_limit(top: Top, theta: Number, omega3: npt.ArrayLike) -> Rate:
    """p_ψ/(A cosθ) [rad/s], to which the fast rate tends for a fast spin: gravity is not felt.

    Parameters
    ----------
    top : Top
    theta : number
        Tilt θ [rad], not π/2.
    omega3 : array_like
        ω3 [rad/s].
    """
    return _rate(_momentum(top, omega3) / (float(top.A) * _cosine(theta)))


def least_spin(top: Top, theta: Number) -> float:
    """The least |ω3| of a steady precession, 2 √(A gMR cosθ)/C [rad/s]; 0 where any spin will do.

    Parameters
    ----------
    top : Top
    theta : number
        Tilt θ [rad].

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> round(least_spin(Top("3.28e-4", "6.6e-5", "0.0456"), 0), 9)
    117.194006936
    """
    pull, hangs = _pull(top, theta)
    return 0.0 if hangs else pull / float(top.C)


def nutation_frequency(top: Top, theta: Number, precession: npt.ArrayLike) -> Rate:
    """The frequency ω [rad/s] of small nodding about the steady precession Ω at θ.

    ω² = Ω² + (gMR/AΩ)² − 2 (gMR/A) cosθ, taken as a sum of squares: where the two rates meet near
    the vertical it would cancel.

    Parameters
    ----------
    top : Top
    theta : number
        Tilt θ [rad].
    precession : array_like
        Ω [rad/s], one of the two rates, not 0.

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> top = Top("6.375e-3", "7.5e-4", "0.73575")
    >>> print(nutation_frequency(top, "pi/3", 10).round(12))
    10.852971464967
    """
    rate, half = np.asarray(precession, dtype=np.float64), Exact.of(theta) / 2
    g = float(top.gMR / top.A)
    from_highest = 2 * float(sin(half) if g > 0 else cos(half)) ** 2  # 1 ∓ cosθ
    return _rate(np.sqrt((rate - abs(g) / rate) ** 2 + 2 * abs(g) * from_highest))


def pair(motion: Reduced) -> tuple[precision.Number | None, precision.Number | None]:
    """The slow and the fast rate Ω [rad/s] at the tilt and the p_ψ of a motion.

    Parameters
    ----------
    motion : Reduced
        The motion; of its start only θ and p_ψ matter.

    Returns
    -------
    tuple of 2 (Number or None)
        Both None where p_ψ² < 4 A gMR cosθ; one rate and None where there is one only, at
        θ = π/2 or where both are the same. At p_ψ = 0 they are equal and opposite.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> steady = Reduced.from_angles(context(60), "6.375e-3", "7.5e-4", "0.73575", "pi/3", 0, 0,
    ...                              0, 10, omega3="140.6")
    >>> print(*map(float, pair(steady)))
    10.0 23.08235294117647
    """
    ctx, b, g = motion.ctx, motion.b, motion.g
    u = motion.u0 if not vanishes(ctx, motion.u0, 1) else ctx.zero
    square = b**2 - 4 * g * u
    if vanishes(ctx, square, b**2, 4 * g * u):
        square = ctx.zero
    if square < 0:
        return None, None
    larger = b + (ctx.sqrt(square) if b >= 0 else -ctx.sqrt(square))
    if not larger:
        return None, None
    return 2 * g / larger, larger / (2 * u) if square and u else None


def nodding(motion: Reduced, rate: precision.Number) -> precision.Number:
    """The frequency ω [rad/s] of small nodding about a steady precession, or about the vertical.

    ω² = Ω² + r² − 2 (gMR/A) cosθ as a sum of squares, with r = gMR/AΩ taken from the steady
    equation as p_ψ/A − Ω cosθ, which serves without gravity and without precession as well.

    Parameters
    ----------
    motion : Reduced
        The motion; of its start only θ and p_ψ matter.
    rate : Number
        Ω [rad/s], one of the two rates.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> steady = Reduced.from_angles(context(60), "6.375e-3", "7.5e-4", "0.73575", "pi/3", 0, 0,
    ...                              0, 10, omega3="140.6")
    >>> print(float(nodding(steady, 10)))
    10.852971464966503
    """
    pull = motion.b - rate * motion.u0
    product = rate * pull  # gMR/A
    from_highest = motion.one_minus_u0 if product >= 0 else motion.one_plus_u0
    return motion.ctx.sqrt((abs(rate) - abs(pull)) ** 2 + 2 * abs(product) * from_highest)


def _larger(top: Top, theta: Number, omega3: npt.ArrayLike) -> Array:
    """p_ψ ± √(p_ψ² − 4 A gMR cosθ), with the sign of p_ψ."""
    p_psi = _momentum(top, omega3)
    pull, hangs = _pull(top, theta)
    if hangs:
        root = np.hypot(p_psi, pull)
    elif np.any(abs(p_psi) < pull):
        least = f"at least {pull / float(top.C):.17g} in magnitude at this theta"
        raise ImpossibleStart([("omega3", least)])
    else:
        root = np.sqrt((abs(p_psi) - pull) * (abs(p_psi) + pull))
    return np.asarray(p_psi + np.copysign(root, p_psi))


def _pull(top: Top, theta: Number) -> tuple[float, bool]:
    """2 √|A gMR cosθ|, and whether gMR cosθ ≤ 0: the top hangs, and needs no spin."""
    product = float(top.A) * float(top.gMR) * _cosine(theta)
    return 2 * float(np.sqrt(abs(product))), product <= 0


def _cosine(theta: Number) -> float:
    return float(cos(Exact.of(theta)))


def _momentum(top: Top, omega3: npt.ArrayLike) -> Array:
    """p_ψ = C ω3 [kg m² s⁻¹]."""
    return np.asarray(float(top.C) * np.asarray(omega3, dtype=np.float64))


def _rate(values: Any) -> Rate:
    """A scalar for a scalar."""
    scalar_or_array: Rate = np.asarray(values, dtype=np.float64)[()]
    return scalar_or_array
