"""An axis that comes from the vertical and returns to it, in elementary functions: m = 1.

    1 − u = (1 − u₁) sech² x,   x = w t + x₀,

P₋ = 0, and Φ₊ = (P₊/4w) (x + r arctan(r tanh x)), r² = (1 − u₁)/(1 + u₁). The top is never reached;
the bottom is, where P₊ = 0: a pendulum that swings up to stand on its head.
"""

from __future__ import annotations

from heavytop.analytic.theory.place import Place
from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Number


class Asymptotic:
    """An axis that comes from the vertical and returns to it.

    Parameters
    ----------
    over : Reduced
        The motion, with g > 0.
    planar : bool
        Whether P₊ is zero.
    """

    def __init__(self, over: Reduced, planar: bool) -> None:
        ctx = self.ctx = over.ctx
        self.P_plus, self.P_minus = ctx.zero if planar else over.P_plus, ctx.zero
        self.one_plus_u1 = self.P_plus**2 / (8 * over.g)  # b²/2g, from f'' = 0 at u₁
        self.one_minus_u1 = 2 - self.one_plus_u1
        self.w = ctx.sqrt(over.g * self.one_minus_u1 / 2)
        c0 = ctx.sqrt(over.one_minus_u0 / self.one_minus_u1)
        self.x0 = ctx.asinh(over.udot0 / (2 * self.w * self.one_minus_u1 * c0**3))
        self.plus0 = self.plus(self.x0)

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """Means of ½ P±/(1 ± u) [rad/s] over all time: those on the vertical."""
        return self.P_plus / 4, self.ctx.zero

    @property
    def turnings(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """1 ∓ u at u₁ and at the vertical."""
        return (self.one_minus_u1, self.one_plus_u1), (self.ctx.zero, 2 * self.ctx.one)

    def plus(self, x: Number) -> Number:
        """Φ₊ since the lowest point."""
        ctx = self.ctx
        if not self.P_plus:
            return ctx.pi / 2 if x >= 0 else -ctx.pi / 2
        r = ctx.sqrt(self.one_minus_u1 / self.one_plus_u1)
        return self.P_plus / (4 * self.w) * (x + r * ctx.atan(r * ctx.tanh(x)))

    def place(self, t: Number) -> Place:
        """The place at time t."""
        ctx = self.ctx
        x = self.w * t + self.x0
        c, s = ctx.sech(x), ctx.tanh(x)
        above = self.one_minus_u1 * c * c
        below = self.one_plus_u1 + self.one_minus_u1 * s * s
        under = s / ctx.sqrt(below) if below else 1 / ctx.sqrt(self.one_minus_u1)
        rise = 2 * self.w * c * under * ctx.sqrt(self.one_minus_u1)
        return Place(above, below, rise, self.plus(x) - self.plus0, ctx.zero, 0)
