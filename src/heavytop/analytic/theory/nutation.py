"""Nutation: the roots u₁ ≤ u₂ ≤ u₃ of the cubic f(u), between the first two of which the axis nods.

With g ≥ 0 (a top with g < 0 is looked at from below) −1 ≤ u₁ ≤ u₂ ≤ 1 ≤ u₃. Near a pole and near
a double root the digits are in 1 + u₁, 1 − u₂, u₃ − 1 and u₂ − u₁, so these are what is kept.
From f(∓1) = −P±²,

    2g (1 + u₁)(1 + u₂)(1 + u₃) = P₊²,   2g (1 − u₁)(1 − u₂)(u₃ − 1) = P₋².
"""

from __future__ import annotations

from dataclasses import dataclass, field

from heavytop.analytic.theory.course import (
    NOTHING,
    Course,
    Proved,
    course,
    miss_of_bottom,
    miss_of_top,
    upright,
)
from heavytop.analytic.theory.cubic import inner, outer
from heavytop.analytic.theory.reduced import Reduced
from heavytop.analytic.theory.zeros import digits_lost, threshold
from heavytop.errors import NoClosedForm
from heavytop.numbers.decimals import Context, Number, context

MOST_DIGITS = 10_000
"""Digits beyond which no more are taken to tell two roots apart."""


class Unresolved(NoClosedForm):
    """Roots that the digits at hand do not tell apart."""

    def __init__(self, digits: int) -> None:
        super().__init__(f"{digits} digits do not tell the turning points apart")


@dataclass(frozen=True, slots=True)
class Nutation:
    """The nutation of a motion with g ≥ 0: its roots, kept where their digits are, m and w.

    Parameters
    ----------
    upright : Reduced
        The motion, seen from below when `mirrored`.
    mirrored : bool
        Whether gMR < 0, so that u here is −cos θ.
    P_plus, P_minus : Number
        a ± b [s⁻¹], exactly zero when they count as zero.
    delta : Number
        u₂ − u₁.
    down, up : Number
        u₀ − u₁ and u₂ − u₀.
    one_plus_u1, one_minus_u1, one_plus_u2, one_minus_u2, u3_minus_one : Number
        Distances of the roots from ±1; u₃ is infinite where gMR = 0.
    m, mc : Number
        Parameter (u₂ − u₁)/(u₃ − u₁) and its complement (u₃ − u₂)/(u₃ − u₁).
    w : Number
        √(g (u₃ − u₁)/2) [s⁻¹].
    """

    upright: Reduced = field(repr=False)
    mirrored: bool
    P_plus: Number
    P_minus: Number
    delta: Number
    down: Number
    up: Number
    one_plus_u1: Number
    one_minus_u1: Number
    one_plus_u2: Number
    one_minus_u2: Number
    u3_minus_one: Number
    m: Number
    mc: Number
    w: Number

    @classmethod
    def of(cls, reduced: Reduced, proved: Proved = NOTHING) -> Nutation:
        """The nutation of a reduced motion, at the precision of that motion.

        Parameters
        ----------
        reduced : Reduced
            The motion.
        proved : Proved
            What is known of it and is not left to a threshold.

        Raises
        ------
        NoClosedForm
            When nothing nutates: steady or asymptotic motions; and `Unresolved` where roots that
            differ come out equal.
        """
        if (kind := proved.course or course(reduced)) is not Course.NUTATING:
            raise NoClosedForm(f"a {kind} motion has no nutation")
        over = upright(reduced)
        P_plus, P_minus = _momenta(over, proved.mirrored() if reduced.g < 0 else proved)
        d1, d2 = inner(over)
        minus1, plus2 = over.one_minus_u0 - d1, over.one_plus_u0 + d2
        minus2, beyond, lead = outer(over, P_minus, d1, minus1)
        plus1 = P_plus**2 / (plus2 * (4 * over.g + lead))  # 2g(1 + u₃) = 4g + 2g(u₃ − 1)
        reach = lead + 2 * over.g * minus1  # 2g(u₃ − u₁)
        mc = (lead + 2 * over.g * minus2) / reach
        if not (d2 > d1 and mc > 0):
            raise Unresolved(over.ctx.dps)
        return cls(
            over, reduced.g < 0, P_plus, P_minus, d2 - d1, -d1, d2,
            plus1, minus1, plus2, minus2, beyond,
            2 * over.g * (d2 - d1) / reach, mc, over.ctx.sqrt(reach) / 2,
        )  # fmt: skip

    @property
    def ctx(self) -> Context:
        """The precision of the roots."""
        return self.upright.ctx

    @property
    def roots(self) -> tuple[Number, Number, Number]:
        """The three roots u of f, increasing; as cos θ, so seen from above even if g < 0."""
        u1, u2 = self.one_plus_u1 - 1, 1 - self.one_minus_u2
        if self.one_plus_u1 > 1:  # the digits are in the distance from the nearer pole
            u1 = 1 - self.one_minus_u1
        if self.one_minus_u2 > 1:
            u2 = self.one_plus_u2 - 1
        u3 = 1 + self.u3_minus_one
        return (-u3, -u2, -u1) if self.mirrored else (u1, u2, u3)

    @property
    def theta_lower(self) -> Number:
        """θ [rad] at u = u₁: the largest, or where gMR < 0 the smallest."""
        return self.tilt(self.one_minus_u1, self.one_plus_u1)

    @property
    def theta_upper(self) -> Number:
        """θ [rad] at u = u₂: the smallest, or where gMR < 0 the largest."""
        return self.tilt(self.one_minus_u2, self.one_plus_u2)

    @property
    def lost(self) -> int:
        """Decimal digits lost in the smallest of the distances that matter."""
        over, ctx = self.upright, self.ctx
        return max(
            digits_lost(ctx, self.delta, 1),
            digits_lost(ctx, self.mc, 1),
            digits_lost(ctx, miss_of_top(over), 1) if self.P_minus else 0,
            digits_lost(ctx, miss_of_bottom(over), 1) if self.P_plus else 0,
        )

    def tilt(self, one_minus_u: Number, one_plus_u: Number) -> Number:
        """θ [rad] from 1 ∓ u, seen from above: exact to its digits at both poles."""
        if self.mirrored:
            one_minus_u, one_plus_u = one_plus_u, one_minus_u
        ctx = self.ctx
        return 2 * ctx.atan2(ctx.sqrt(one_minus_u), ctx.sqrt(one_plus_u))


def nutation(reduced: Reduced, digits: int = 50, proved: Proved = NOTHING) -> Nutation:
    """The nutation with at least `digits` digits in every distance between its roots.

    Parameters
    ----------
    reduced : Reduced
        The motion, at any precision: it is computed again where more is needed.
    digits : int
        Decimal digits.
    proved : Proved
        What is known of it. The precision rises until the numbers look like that.

    Raises
    ------
    NoClosedForm
        When nothing nutates; `Unresolved` when 10 000 digits do not tell the roots apart.
    """
    dps = max(60, digits + 50)
    while dps <= max(MOST_DIGITS, 2 * digits + 100):
        try:
            seen = reduced.refined(context(dps))
            if not resolved(seen, proved):
                raise Unresolved(dps)
            found = Nutation.of(seen, proved)
        except Unresolved:
            dps *= 2
            continue
        if digits + 20 + found.lost <= dps:
            return found
        dps = digits + 30 + 2 * found.lost
    raise Unresolved(MOST_DIGITS)


def resolved(reduced: Reduced, proved: Proved) -> bool:
    """Whether what is proved not to be zero does not look like zero at this precision.

    Parameters
    ----------
    reduced : Reduced
        The motion.
    proved : Proved
        What is known of it.
    """
    zero = threshold(reduced.ctx)
    return (
        (proved.course is not Course.NUTATING or course(reduced) is Course.NUTATING)
        and (proved.zero_plus is not False or miss_of_bottom(reduced) > zero)
        and (proved.zero_minus is not False or miss_of_top(reduced) > zero)
    )


def _momenta(over: Reduced, proved: Proved) -> tuple[Number, Number]:
    """P₊ and P₋, exactly zero where they are proved to be, or else count as zero."""
    zero = threshold(over.ctx)
    no_plus, no_minus = proved.zero_plus, proved.zero_minus
    if no_plus is None:
        no_plus = miss_of_bottom(over) <= zero
    if no_minus is None:
        no_minus = miss_of_top(over) <= zero
    return (
        over.ctx.zero if no_plus else over.P_plus,
        over.ctx.zero if no_minus else over.P_minus,
    )
