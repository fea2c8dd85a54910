"""Nutation: the roots u₁ ≤ u₂ ≤ u₃ of the cubic f(u), between the first two of which the axis nods.

With g ≥ 0 (a top with g < 0 is looked at from below) −1 ≤ u₁ ≤ u₂ ≤ 1 ≤ u₃. Near a pole and near
a double root the digits are in 1 + u₁, 1 − u₂, u₃ − 1 and u₂ − u₁, so these are what is kept.
From f(∓1) = −P±²,

    2g (1 + u₁)(1 + u₂)(1 + u₃) = P₊²,   2g (1 − u₁)(1 − u₂)(u₃ − 1) = P₋².
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

from heavytop.errors import NoClosedForm
from heavytop.theory.precision import (
    Context,
    Number,
    context,
    digits_lost,
    relative,
    threshold,
)
from heavytop.theory.reduced import Reduced


class Course(StrEnum):
    """What θ does in the long run."""

    STEADY = "steady"
    ASYMPTOTIC = "asymptotic"
    NUTATING = "nutating"


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
    def of(cls, reduced: Reduced) -> Nutation:
        """The nutation of a reduced motion, at the precision of that motion.

        Raises
        ------
        NoClosedForm
            When nothing nutates: steady or asymptotic motions.
        """
        if (kind := course(reduced)) is not Course.NUTATING:
            raise NoClosedForm(f"a {kind} motion has no nutation")
        over = upright(reduced)
        ctx = over.ctx
        zero = threshold(ctx)
        P_plus = over.P_plus if miss_of_bottom(over) > zero else ctx.zero
        P_minus = over.P_minus if miss_of_top(over) > zero else ctx.zero
        d1, d2 = _inner(over)
        minus1, plus2 = over.one_minus_u0 - d1, over.one_plus_u0 + d2
        minus2, beyond, lead = _outer(over, P_minus, d1, minus1)
        plus1 = P_plus**2 / (plus2 * (4 * over.g + lead))  # 2g(1 + u₃) = 4g + 2g(u₃ − 1)
        reach = lead + 2 * over.g * minus1  # 2g(u₃ − u₁)
        return cls(
            over, reduced.g < 0, P_plus, P_minus, d2 - d1, -d1, d2,
            plus1, minus1, plus2, minus2, beyond,
            2 * over.g * (d2 - d1) / reach, (lead + 2 * over.g * minus2) / reach,
            ctx.sqrt(reach) / 2,
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
        if self.mc <= 0 or self.delta <= 0:
            return int(ctx.dps)
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


def nutation(reduced: Reduced, digits: int = 50) -> Nutation:
    """The nutation with at least `digits` digits in every distance between its roots.

    Parameters
    ----------
    reduced : Reduced
        The motion, at any precision: it is computed again where more is needed.
    digits : int
        Decimal digits.

    Raises
    ------
    NoClosedForm
        When nothing nutates.
    """
    dps = max(60, digits + 50)
    found = Nutation.of(reduced.refined(context(dps)))
    if digits + 20 + found.lost > dps:
        found = Nutation.of(reduced.refined(context(digits + 30 + 2 * found.lost)))
    return found


def _inner(over: Reduced) -> tuple[Number, Number]:
    """d₁ = u₁ − u₀ ≤ 0 and d₂ = u₂ − u₀ ≥ 0; exactly 0 when the start is a turning point."""
    ctx = over.ctx
    f0, f1, f2, f3 = over.taylor
    if not f3:
        return _quadratic(ctx, f0, f1, f2)
    d1, d2, d3 = _cubic(over)
    if f0:
        near = min(d1, d2, key=abs)
        far = d2 if near is d1 else d1
        near = -f0 / (f3 * far * d3)
    else:
        near, far = ctx.zero, (d2 if f1 > 0 else d1)
    return (near, far) if far > 0 else (far, near)


def _quadratic(ctx: Context, f0: Number, f1: Number, f2: Number) -> tuple[Number, Number]:
    """Both roots of f₀ + f₁ d + f₂ d² with f₂ < 0 ≤ f₀, without cancellation."""
    far = -(f1 + (1 if f1 >= 0 else -1) * ctx.sqrt(f1**2 - 4 * f0 * f2)) / 2
    one, other = far / f2, f0 / far
    return (one, other) if one < other else (other, one)


def _cubic(over: Reduced) -> tuple[Number, Number, Number]:
    """All roots d of f(u₀ + d), increasing, by Viète's cosine.

    The cosine loses half of the digits of a near-double root, and the shift loses those by which
    u₃ exceeds u₂, so the algebra runs at twice the precision, and more where g is small.
    """
    small = max(0, over.ctx.mag(over.taylor[2]) - over.ctx.mag(over.g))
    ctx = context(2 * over.ctx.dps + 20 + small)
    f0, f1, f2, f3 = (ctx.make_mpf(value._mpf_) for value in over.taylor)
    p = (3 * f3 * f1 - f2**2) / (3 * f3**2)
    q = (2 * f2**3 - 9 * f3 * f2 * f1 + 27 * f3**2 * f0) / (27 * f3**3)
    size = 2 * ctx.sqrt(-p / 3)
    angle = ctx.acos(max(-ctx.one, min(ctx.one, 3 * q / (p * size)))) / 3
    third, shift = 2 * ctx.pi / 3, f2 / (3 * f3)
    roots = sorted(size * ctx.cos(angle - third * k) - shift for k in range(3))
    d1, d2, d3 = (over.ctx.make_mpf(root._mpf_) for root in roots)
    return d1, d2, d3


def _outer(
    over: Reduced, P_minus: Number, d1: Number, minus1: Number
) -> tuple[Number, Number, Number]:
    """1 − u₂, u₃ − 1 and 2g (u₃ − 1), from their product and their difference."""
    ctx, g = over.ctx, over.g
    energy = 2 * over.kinetic0 + over.b**2
    if not g:
        return P_minus**2 / (energy * minus1), ctx.inf, energy
    product = P_minus**2 / (2 * g * minus1)
    gap = energy / (2 * g) - d1 - 2  # (u₃ − 1) − (1 − u₂), from the sum of the roots
    larger = (abs(gap) + ctx.sqrt(gap**2 + 4 * product)) / 2
    smaller = product / larger if larger else larger
    minus2, beyond = (smaller, larger) if gap >= 0 else (larger, smaller)
    return minus2, beyond, 2 * g * beyond
