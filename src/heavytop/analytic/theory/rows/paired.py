"""What the reduced motion is made of, with twice the digits of a double, and what it is wrong by.

Every error here is a bound on that of sums of pairs, beside the sizes of their terms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from heavytop.numbers.pairs import QUARTER_TURN, Array, Doubles, Pairs, sin_cos, two_sum

Mask = npt.NDArray[np.bool_]

PAIRED = 2.0**-98
"""What a sum of a few products of pairs is wrong by at most, beside the sizes of its terms."""

_ONE = Pairs(1.0, 0.0)
_QUARTER_REST = -1.4973849048591833e-33  # of ½π, beyond the pair


@dataclass(frozen=True)
class Paired:
    """Motions with g ≥ 0, in units A = 1.

    Parameters
    ----------
    g, b : Pairs
        |gMR|/A [s⁻²] and p_ψ/A [s⁻¹], as they are seen.
    above, below : Pairs
        1 − u₀ and 1 + u₀.
    turning, falling : Pairs
        φ̇ [rad/s] and θ̇² [s⁻²].
    size_b : Array
        The sizes of the terms of b [s⁻¹].
    """

    g: Pairs
    b: Pairs
    above: Pairs
    below: Pairs
    turning: Pairs
    falling: Pairs
    size_b: Array

    @cached_property
    def sin2(self) -> Pairs:
        """sin²θ₀."""
        return self.above * self.below

    @cached_property
    def drift(self) -> Pairs:
        """The turning left at the start, a − b u₀ = φ̇ sin²θ₀ [s⁻¹]."""
        return self.turning * self.sin2

    @cached_property
    def speed2(self) -> Pairs:
        """θ̇² + φ̇² sin²θ₀ = 2 (h − g u₀) [s⁻²]."""
        return self.falling + self.turning * self.drift

    @cached_property
    def P_plus(self) -> Pairs:
        """P₊ [s⁻¹]."""
        return self.below * (self.turning * self.above + self.b)

    @cached_property
    def P_minus(self) -> Pairs:
        """P₋ [s⁻¹]."""
        return self.above * (self.turning * self.below - self.b)

    @property
    def vague_P(self) -> tuple[Array, Array]:
        """Errors of P₊ and P₋ [s⁻¹]."""
        turning, above, below = map(size, (self.turning, self.above, self.below))
        plus, minus = (
            below * (turning * above + self.size_b),
            above * (turning * below + self.size_b),
        )
        return PAIRED * plus, PAIRED * minus

    @property
    def f0(self) -> Pairs:
        """f(u₀) = sin²θ₀ θ̇² [s⁻²]."""
        return self.sin2 * self.falling

    @property
    def f1(self) -> Pairs:
        """f'(u₀) = 2 (b φ̇ sin²θ₀ − g sin²θ₀ − 2 (h − g u₀) u₀) [s⁻²]."""
        u0 = _ONE - self.above
        return doubled(self.b * self.drift - self.g * self.sin2 - self.speed2 * u0)

    @property
    def vague_f1(self) -> Array:
        """Its error [s⁻²]."""
        pull = self.size_b * size(self.drift) + size(self.g) * size(self.sin2)
        return 2 * PAIRED * (pull + size(self.speed2))

    @property
    def f2(self) -> Pairs:
        """½ f''(u₀) = 4 g u₀ − 2 (h − g u₀) − b² [s⁻²]."""
        lift = doubled(doubled(self.g * (_ONE - self.above)))
        return lift - self.speed2 - self.b * self.b

    @property
    def surplus(self) -> Pairs:
        """−f'(1) = 4 (h − g) − 2 b P₋ [s⁻²]."""
        return doubled(self.speed2 - doubled(self.g * self.above) - self.b * self.P_minus)

    @property
    def vague_surplus(self) -> Array:
        """Its error [s⁻²]."""
        lift = size(self.speed2) + 2 * size(self.g) * size(self.above)
        return 2 * PAIRED * lift + 2 * self.size_b * self.vague_P[1]


def heights(theta: Array) -> tuple[Pairs, Pairs]:
    """1 − cos θ and 1 + cos θ for θ in [0, π], each with its own digits.

    They are twice the squares of the sine and the cosine of θ/2, an angle up to π/4 or what such
    an angle lacks of ½π.
    """
    half, late = theta / 2, late_half(theta)
    rest, low = two_sum(QUARTER_TURN.hi - half, QUARTER_TURN.lo)
    near = np.where(late, rest, half), np.where(late, low + _QUARTER_REST, 0.0)
    sine, cosine = sin_cos(Pairs(*two_sum(*near)))
    one, other = doubled(sine * sine), doubled(cosine * cosine)
    return chosen(late, other, one), chosen(late, one, other)


def late_half(theta: Array) -> Mask:
    """Where the axis points down."""
    return np.asarray(theta > QUARTER_TURN.hi)


def spin_about_axis(
    spin: Array, phidot: Array, theta: Array, above: Pairs, below: Pairs
) -> tuple[Pairs, Array]:
    """ω3 = ψ̇ + φ̇ cos θ [rad/s], and the size of its terms.

    Beside a pole, ψ̇ ± φ̇ may nearly vanish: that sum is exact, and the rest of its own digits.
    """
    late = late_half(theta)
    side = np.where(late, -phidot, phidot)
    near = chosen(late, below, above)
    together = Pairs(*two_sum(spin, side))
    return together - plain(side) * near, abs(side) * size(near) + size(together)


def plain(value: Array) -> Pairs:
    """Doubles as they are."""
    return Pairs(value, 0.0 * value)


def size(pairs: Pairs) -> Array:
    """Absolute values, as doubles."""
    return np.asarray(abs(pairs.hi))


def doubled(pairs: Pairs) -> Pairs:
    """Twice the numbers, exactly."""
    return Pairs(2 * pairs.hi, 2 * pairs.lo)


def chosen(where: Mask, one: Pairs, other: Pairs) -> Pairs:
    """The first where the mask is set, else the other."""
    return Pairs(np.where(where, one.hi, other.hi), np.where(where, one.lo, other.lo))


def quotient(over: Doubles, under: Doubles) -> Pairs:
    """A quotient of doubles: the nearest double, and what it leaves, divided again."""
    near = np.asarray(over / under)
    rest = plain(np.asarray(over)) - plain(near) * plain(np.asarray(under))
    return Pairs(*two_sum(near, rest.hi / under))
