"""The fast top of the textbooks, and how wrong its formulas are for a top that is not so fast.

For p_ψ² ≫ 4 A gMR, with g = gMR/A and b = p_ψ/A,

    precession      gMR/p_ψ = g/b              of the mean, or of the slow steady rate
                    p_ψ/(A cosθ) = b/cosθ      of the fast steady rate, which feels no weight
    nutation        2π A/p_ψ = 2π/b            the period
                    2 A gMR sin²θ₀/p_ψ²        u₂ − u₁ of a top let go from rest at θ₀

(Goldstein, Classical Mechanics, section 5.7). An estimate comes with its error against the closed
form, and none should be quoted without the ratio p_ψ²/(4 A gMR) beside it: sleeping is stable
from 1 on, and at 6.25 the amplitude is still 15 % too small.
"""

from __future__ import annotations

from typing import NamedTuple

from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Number


class Estimate(NamedTuple):
    """What a formula of the fast top gives, and how far off it is.

    Attributes
    ----------
    value : Number
        The estimate, in the unit of what is estimated.
    error : Number or None
        estimate/truth − 1, negative where it is too small in magnitude; None where the truth is 0.
    """

    value: Number
    error: Number | None


def ratio(motion: Reduced) -> Number | None:
    """How fast the top is: p_ψ²/(4 A |gMR|), which is 1 where sleeping begins to be stable.

    Without gravity there is no such number, and None is returned.

    Parameters
    ----------
    motion : Reduced

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> start = Reduced.from_angles(context(30), 5, 1, 20, "0.3", 0, 0, 0, 0, omega3=50)
    >>> float(ratio(start))
    6.25
    """
    return motion.b**2 / (4 * abs(motion.g)) if motion.g else None


def precession(motion: Reduced, true: Number) -> Estimate | None:
    """The mean rate gMR/p_ψ [rad/s]; None where p_ψ = 0 or nothing is heavy.

    Parameters
    ----------
    motion : Reduced
    true : Number
        The rate it estimates [rad/s].
    """
    return _estimate(motion.g / motion.b, true) if _spins(motion) else None


def free_precession(motion: Reduced, true: Number) -> Estimate | None:
    """The fast steady rate p_ψ/(A cosθ) [rad/s]; None where p_ψ = 0 or nothing is heavy.

    Parameters
    ----------
    motion : Reduced
    true : Number
        The rate it estimates [rad/s].
    """
    return _estimate(motion.b / motion.u0, true) if _spins(motion) else None


def period(motion: Reduced, true: Number) -> Estimate | None:
    """The period 2π A/|p_ψ| [s] of nutation; None where p_ψ = 0 or nothing is heavy.

    Parameters
    ----------
    motion : Reduced
    true : Number
        The period it estimates [s].
    """
    return _estimate(2 * motion.ctx.pi / abs(motion.b), true) if _spins(motion) else None


def amplitude(motion: Reduced, sin2: Number, true: Number) -> Estimate | None:
    """The range 2 A |gMR| sin²θ₀/p_ψ² of cosθ when let go at θ₀; None where p_ψ = 0.

    Parameters
    ----------
    motion : Reduced
    sin2 : Number
        sin²θ₀, θ₀ the tilt at which the axis is at rest.
    true : Number
        The range it estimates.
    """
    return _estimate(2 * abs(motion.g) * sin2 / motion.b**2, true) if _spins(motion) else None


def _spins(motion: Reduced) -> bool:
    """Whether there is a spin to be fast, and a weight for it to be fast against."""
    return bool(motion.b and motion.g)


def _estimate(value: Number, true: Number) -> Estimate:
    return Estimate(value, value / true - 1 if true else None)
