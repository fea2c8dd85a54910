"""The rates φ̇ and ψ̇ over the nutation: their extremes, where they turn, where they vanish.

Both are offset + ½ [P/(1 + u) + Q/(1 − u)]: φ̇ with P₊, P₋ and no offset, ψ̇ with P₊, −P₋ and κ.
Where P and Q are of one sign the terms add up, and between the poles the rate has one extreme,

    tan²(θ/2) = √(Q/P),   offset ± ¼ (√|P| + √|Q|)²;

where they are not, it is monotonic in θ, and vanishes at most once: the other root
x = tan²(θ/2) of P x² + (4 offset + P + Q) x + Q = 0 is negative. So of φ̇ and ψ̇ only one can have
an extreme between the turning points, φ̇ where |p_φ| > |p_ψ| and ψ̇ where |p_φ| < |p_ψ|, and the
other alone can vanish there. (That ψ̇ has no zeros besides its extreme is C ≤ 2A.)
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from heavytop.analytic.theory.closed_form import Asymptotic, Nodding, Steady
from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Context, Number, vanishes

Path: TypeAlias = "Nodding | Asymptotic | Steady"


class Tilt(NamedTuple):
    """A tilt by 1 − u and 1 + u, each to its own digits."""

    above: Number
    below: Number


class Extreme(NamedTuple):
    """An extreme value [rad/s], and the θ [rad] where it is taken; None where it is everywhere."""

    value: Number
    theta: Number | None


@dataclass(frozen=True, slots=True)
class Rate:
    """One of the rates φ̇ and ψ̇ [rad/s], as a function of the tilt between two tilts.

    Parameters
    ----------
    ctx : Context
        The precision.
    offset, plus, minus : Number
        0 and P±, or κ and ±P± [s⁻¹].
    lower, upper : Tilt
        The tilts between which θ moves, the smaller θ first.
    """

    ctx: Context = field(repr=False)
    offset: Number
    plus: Number
    minus: Number
    lower: Tilt
    upper: Tilt

    def __call__(self, tilt: Tilt) -> Number:
        """The rate at one tilt; at a pole that is passed its limit, which both sides share."""
        rise = self.plus / (2 * tilt.below) if self.plus else self.ctx.zero
        fall = self.minus / (2 * tilt.above) if self.minus else self.ctx.zero
        return settled(self.ctx, self.offset, rise, fall)

    @property
    def constant(self) -> bool:
        """Whether it is the same at all times."""
        return self.lower == self.upper or not (self.plus or self.minus)

    @property
    def turning(self) -> Tilt | None:
        """Where it has an extreme between the two tilts; None where it is monotonic."""
        if self.constant or not self.plus * self.minus > 0:
            return None
        p, q = self.ctx.sqrt(abs(self.plus)), self.ctx.sqrt(abs(self.minus))
        here = Tilt(2 * q / (p + q), 2 * p / (p + q))
        inside = _higher(self.lower, here) and _higher(here, self.upper)
        return here if inside else None

    @property
    def extremes(self) -> tuple[Extreme, Extreme]:
        """The least and the greatest value; where one is taken twice, its smaller θ."""
        if self.constant:
            return (Extreme(self(self.lower), None),) * 2
        tilts = (self.lower, self.turning, self.upper)
        values = [(self(tilt), tilt) for tilt in tilts if tilt is not None]
        least = min(values, key=lambda each: each[0])
        greatest = max(values, key=lambda each: each[0])
        return self._extreme(*least), self._extreme(*greatest)

    @property
    def reversal(self) -> Number | None:
        """The θ [rad] at which it changes its sign; None where it keeps it, cusps included."""
        P, Q = self.plus, self.minus
        if not self(self.lower) * self(self.upper) < 0:
            return None
        half = (4 * self.offset + P + Q) / 2
        root = self.ctx.sqrt(half**2 - P * Q)  # P Q ≤ 0: nothing cancels
        larger = -half - (root if half > 0 else -root)
        x = Q / larger if Q * larger > 0 else larger / P
        return 2 * self.ctx.atan(self.ctx.sqrt(x))

    def _extreme(self, value: Number, tilt: Tilt) -> Extreme:
        above, below = self.ctx.sqrt(tilt.above), self.ctx.sqrt(tilt.below)
        return Extreme(value, 2 * self.ctx.atan2(above, below))


class Rates(NamedTuple):
    """Both rates of one motion."""

    phidot: Rate
    psidot: Rate


def rates(path: Path, motion: Reduced) -> Rates | None:
    """Both rates over the course of the axis; None on the vertical, which tells no φ from ψ.

    On a motion that tends to the vertical they tend to what they are there, as to a bound.

    Parameters
    ----------
    path : Nodding, Asymptotic or Steady
        The course of the axis, `closed_form.orbit` of the motion.
    motion : Reduced
        The motion, at any precision.

    Examples
    --------
    >>> from heavytop.analytic.theory.closed_form import orbit
    >>> from heavytop.numbers.decimals import context
    >>> dropped = Reduced.from_angles(context(60), "3.28e-4", "6.6e-5", "0.0456", "0.1", 0, 0,
    ...                               0, 0, 140)
    >>> both = rates(orbit(dropped, 30), dropped)
    >>> [round(float(each.value), 12) for each in both.phidot.extremes]
    [0.0, 9.87012987013]
    >>> [round(float(each.value), 9) for each in both.psidot.extremes]
    [130.291539463, 140.0]
    """
    if isinstance(path, Steady) and not path.over.sin2:
        return None
    lower, upper = _tilts(path, motion)
    plus, minus = path.P_plus, path.P_minus
    if motion.g < 0:  # P± are those of the motion seen from below
        plus, minus = minus, plus
    ctx, kappa = path.ctx, motion.refined(path.ctx).kappa
    return Rates(
        Rate(ctx, ctx.zero, plus, minus, lower, upper),
        Rate(ctx, kappa, plus, -minus, lower, upper),
    )


def means(path: Nodding, motion: Reduced) -> tuple[Number, Number]:
    """Δφ/T and Δψ/T [rad/s], the jumps by π at an exact pass through a pole included.

    Parameters
    ----------
    path : Nodding
        The course of the axis.
    motion : Reduced
        The motion, at any precision.
    """
    ctx, side = path.ctx, -1 if motion.g < 0 else 1
    plus, minus = path.turn_plus / path.T, path.turn_minus / path.T
    kappa = motion.refined(ctx).kappa
    return settled(ctx, plus, minus), settled(ctx, kappa, side * plus, -side * minus)


def settled(ctx: Context, *terms: Number) -> Number:
    """A sum, exactly zero where it is no more than rounding beside its terms."""
    total = sum(terms, ctx.zero)
    return ctx.zero if vanishes(ctx, total, *terms) else total


def _tilts(path: Path, motion: Reduced) -> tuple[Tilt, Tilt]:
    """The tilts between which θ moves, the smaller θ first, as they are seen from above."""
    (above1, below1), (above2, below2) = path.turnings
    if motion.g < 0:
        return Tilt(below1, above1), Tilt(below2, above2)
    return Tilt(above2, below2), Tilt(above1, below1)


def _higher(one: Tilt, other: Tilt) -> bool:
    """Whether the axis is nearer to θ = 0 in the first tilt, told by digits good at both poles."""
    return bool(one.above * other.below < other.above * one.below)
