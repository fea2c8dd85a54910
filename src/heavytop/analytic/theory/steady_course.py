"""An axis of constant tilt: steady precession, or a top that stays on the vertical.

φ̇ = (a − b u₀)/sin²θ₀ is constant. On the vertical φ and ψ are not defined apart: there φ keeps its
value and ψ takes the whole spin. Being a double root of f, the tilt is the start's own: no root is
looked for, and none of its digits are lost.
"""

from __future__ import annotations

from heavytop.analytic.theory.place import Place
from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Number


class Steady:
    """An axis of constant tilt.

    Parameters
    ----------
    over : Reduced
        The motion, with g ≥ 0.
    """

    def __init__(self, over: Reduced) -> None:
        self.ctx, self.over = over.ctx, over
        self.P_plus, self.P_minus = over.P_plus, over.P_minus
        if over.sin2:
            self.plus_rate = over.P_plus / (2 * over.one_plus_u0)
            self.minus_rate = over.P_minus / (2 * over.one_minus_u0)
        else:
            self.plus_rate, self.minus_rate = over.b / 2, -over.b / 2

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """The rates of Φ± [rad/s]."""
        return self.plus_rate, self.minus_rate

    @property
    def turnings(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """1 ∓ u, which stay what they are."""
        here = self.over.one_minus_u0, self.over.one_plus_u0
        return here, here

    def place(self, t: Number) -> Place:
        """The place at time t."""
        over, zero = self.over, self.ctx.zero
        plus, minus = self.plus_rate * t, self.minus_rate * t
        return Place(over.one_minus_u0, over.one_plus_u0, zero, plus, minus, 0)
