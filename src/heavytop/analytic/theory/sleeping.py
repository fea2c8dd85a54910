"""Sleeping: the top that spins about the vertical where V is highest, and what disturbs it.

A small motion of the axis about that vertical obeys ζ̈ − i (p_ψ/A) ζ̇ − (|gMR|/A) ζ = 0 for
ζ = θ e^{iφ}: in the frame that turns with p_ψ/2A,

    ζ̈ = ¼ (4 A |gMR| − p_ψ²)/A² ζ,

so it grows when p_ψ² < 4 A |gMR|, and oscillates when p_ψ² > 4 A |gMR|; θ = |ζ| then nods with
twice that frequency.

Everything here is computed at 60 digits from exact numbers and returned as floats.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from heavytop.numbers.decimals import STANDARD_DIGITS, Number, context, number, vanishes

if TYPE_CHECKING:
    from heavytop import numbers as exact
    from heavytop.scene.top import Top


def threshold(top: Top) -> float | None:
    """The least |ω3| at which sleeping is stable, 2 √(A |gMR|)/C [rad/s].

    None without gravity, when no vertical is higher than the other.

    Parameters
    ----------
    top : Top

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> threshold(Top("3.28e-4", "6.6e-5", "0.0456"))
    117.19400693596917
    """
    ctx = context(STANDARD_DIGITS)
    A, C, gMR = (number(ctx, value) for value in (top.A, top.C, top.gMR))
    return float(2 * ctx.sqrt(A * abs(gMR)) / C) if gMR else None


def growth_rate(top: Top, omega3: exact.Number) -> float | None:
    """The rate √(4 A |gMR| − p_ψ²)/2A [1/s] at which θ grows; None where sleeping is stable.

    Parameters
    ----------
    top : Top
    omega3 : number
        The spin ω3 [rad/s].

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> growth_rate(Top(1, 1, 1), 1), growth_rate(Top(1, 1, 1), 2)
    (0.8660254037844386, None)
    """
    square = _stiffness(top, omega3)
    return float(square.context.sqrt(-square) / 2) if square < 0 else None


def nutation_frequency(top: Top, omega3: exact.Number) -> float | None:
    """The frequency √(p_ψ² − 4 A |gMR|)/A [rad/s] at which a small θ nods; None where it grows.

    It is the difference of the two rates at which small cones are gone round, `steady.pair`.

    Parameters
    ----------
    top : Top
    omega3 : number
        The spin ω3 [rad/s].

    Examples
    --------
    >>> from heavytop.scene.top import Top
    >>> nutation_frequency(Top(1, 1, 1), "sqrt(5)")
    1.0
    """
    square = _stiffness(top, omega3)
    return float(square.context.sqrt(square)) if square >= 0 else None


def tilt_at_threshold(delta: float) -> float:
    """How far a push tilts the top that sleeps with just the spin it needs [rad].

    At p_ψ² = 4 A |gMR| the axis, set off at θ̇ = δ √(|gMR|/A), turns back where

        1 − cosθ = 4 |δ|/(|δ| + √(16 + δ²)),

    the positive root of f(u) = 0. For a small push that is θ = √(2δ): stable, but barely.

    Parameters
    ----------
    delta : float
        The push δ = θ̇ √(A/|gMR|) at θ = 0.

    Examples
    --------
    >>> round(tilt_at_threshold(1e-6), 8), round(2e-6 ** 0.5, 8)
    (0.00141421, 0.00141421)
    """
    ctx = context(STANDARD_DIGITS)
    push = abs(number(ctx, delta))
    versine = 4 * push / (push + ctx.sqrt(16 + push**2))
    return float(2 * ctx.asin(ctx.sqrt(versine / 2)))


def _stiffness(top: Top, omega3: exact.Number) -> Number:
    """(p_ψ² − 4 A |gMR|)/A², exactly zero where it is no more than rounding."""
    ctx = context(STANDARD_DIGITS)
    A, C, gMR, spin = (number(ctx, value) for value in (top.A, top.C, top.gMR, omega3))
    hold, fall = (C * spin / A) ** 2, 4 * abs(gMR) / A
    return ctx.zero if vanishes(ctx, hold - fall, hold, fall) else hold - fall
