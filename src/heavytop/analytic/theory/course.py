"""The course of θ: steady, tending to the vertical, or nodding; and how near a motion is to each.

Every number here is relative to the sizes it is made of, and counts as zero below the threshold
of its precision. That is evidence and no proof: what has been proved of a motion by other means
is handed over as `Proved`, and is then taken as given.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from heavytop.analytic.theory.reduced import Reduced
from heavytop.analytic.theory.zeros import relative, threshold
from heavytop.numbers.decimals import Number


class Course(StrEnum):
    """What θ does in the long run."""

    STEADY = "steady"
    ASYMPTOTIC = "asymptotic"
    NUTATING = "nutating"


@dataclass(frozen=True, slots=True)
class Proved:
    """What has been proved of a motion from its exact numbers; None where nothing has.

    Parameters
    ----------
    course : Course, optional
        The course of θ.
    zero_plus, zero_minus : bool, optional
        Whether P₊ = (p_φ + p_ψ)/A and P₋ = (p_φ − p_ψ)/A are zero: only then can the axis pass
        exactly through θ = π, and through θ = 0.

    Examples
    --------
    >>> Proved(Course.NUTATING, zero_plus=False, zero_minus=True).mirrored().zero_plus
    True
    """

    course: Course | None = None
    zero_plus: bool | None = None
    zero_minus: bool | None = None

    def mirrored(self) -> Proved:
        """The same of the motion seen from below, θ → π − θ: P₊ and P₋ change places."""
        return Proved(self.course, self.zero_minus, self.zero_plus)


NOTHING = Proved()


def upright(reduced: Reduced) -> Reduced:
    """The motion with g ≥ 0: itself, or itself seen from below."""
    return reduced.mirrored() if reduced.g < 0 else reduced


def miss_of_top(reduced: Reduced) -> Number:
    """P₋, by which the axis misses θ = 0, relative to the momenta that there are."""
    r, ctx = reduced, reduced.ctx
    fall = ctx.sqrt(abs(r.g) + 2 * r.kinetic0) * r.one_minus_u0
    across = ctx.sqrt(2 * r.kinetic0 * r.sin2)
    return relative(r.P_minus, r.drift0, r.b * r.one_minus_u0, fall, across)


def miss_of_bottom(reduced: Reduced) -> Number:
    """P₊, by which the axis misses θ = π, relative to the momenta that there are."""
    return miss_of_top(reduced.mirrored())


def unsteadiness(reduced: Reduced) -> Number:
    """How far θ is from staying what it is: the larger of u̇₀ and f'(u₀), relative.

    On the vertical both are zero, and the speed itself decides.
    """
    ctx, k, s, j = reduced.ctx, reduced.kinetic0, reduced.sin2, reduced.drift0
    rate = ctx.sqrt(relative(k, reduced.g, reduced.b**2, k))
    if max(rate, ctx.sqrt(s)) <= threshold(ctx):
        return ctx.zero
    speed = ctx.sqrt(relative(reduced.udot0**2, 2 * k * s, j**2))
    pull = (2 * reduced.g * s, 4 * k * reduced.u0, 2 * j * reduced.b)
    return max(speed, relative(reduced.taylor[1], *pull))


def distance_from_asymptote(reduced: Reduced) -> Number:
    """How far θ is from tending to the vertical where V is highest: P₋ and h − g, relative."""
    over = upright(reduced)
    lift = over.g * over.one_minus_u0
    surplus = relative(over.kinetic0 - lift, over.kinetic0, lift)
    return max(miss_of_top(over), surplus)


def course(reduced: Reduced) -> Course:
    """Whether θ is steady, tends to the vertical, or nods between two turning points."""
    zero = threshold(reduced.ctx)
    if unsteadiness(reduced) <= zero:
        return Course.STEADY
    return Course.ASYMPTOTIC if distance_from_asymptote(reduced) <= zero else Course.NUTATING
