"""`asymptotic` in doubles."""

from __future__ import annotations

import numpy as np

from heavytop.analytic.theory.asymptotic import Asymptotic
from heavytop.analytic.theory.double_place import DoublePlace
from heavytop.numbers.angle import Double2
from heavytop.numbers.pairs import (
    QUARTER_TURN,
    Array,
    Doubles,
    Pairs,
    arctangent,
    sinh_cosh,
    two_product,
    two_sum,
)

FAR = 300.0
"""x = w t beyond which tanh x is ±1 to any digits."""


class AsymptoticDouble:
    """An axis that tends to the vertical, at arrays of times.

    Parameters
    ----------
    path : Asymptotic
        Its constants.
    """

    size = 0.0

    def __init__(self, path: Asymptotic) -> None:
        ctx, zero = path.ctx, path.ctx.zero
        reach, floor = ctx.sqrt(path.one_minus_u1), ctx.sqrt(path.one_plus_u1)
        self.turns, self.rates = (zero, zero), (path.P_plus / 4, zero)
        self.offsets = path.plus0 - path.P_plus * path.x0 / (4 * path.w), zero
        self._planar, self._P_plus = not path.P_plus, float(path.P_plus)
        lead = zero if self._planar else path.P_plus * reach / (4 * path.w * floor)
        self._lead, self._reach, self._floor = Pairs.of(lead), Pairs.of(reach), Pairs.of(floor)
        self._depth, self._height = float(path.one_minus_u1), float(path.one_plus_u1)
        self._w, self._x0 = Double2.of(path.w), Double2.of(path.x0)

    def chords(self, t: Array, t_lo: Doubles) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u) at the times t + t_lo."""
        c, s = _sech_tanh(self._argument(t, t_lo))
        return self._reach.hi * c, np.hypot(self._floor.hi, self._reach.hi * s)

    def place(self, t: Array, t_lo: Doubles) -> DoublePlace:
        """The place at the times t + t_lo."""
        x, zero = self._argument(t, t_lo), np.zeros_like(t)
        c, s = _sech_tanh(x)
        from_top, from_bottom = self._reach.hi * c, np.hypot(self._floor.hi, self._reach.hi * s)
        above, below = self._depth * (c * c), self._height + self._depth * (s * s)
        step = np.where(np.asarray(x.hi) >= 0, 1.0, -1.0)
        rise = 2 * self._w.hi * c * (step if self._planar else self._reach.hi * s / from_bottom)
        uddot = 2 * self._w.hi**2 * above * (c * c - 2 * s * s)
        rate = zero if self._planar else self._P_plus / (2 * below)
        plus = step * QUARTER_TURN.hi
        if not self._planar:
            plus = self._lead.hi * np.arctan2(self._reach.hi * s, self._floor.hi)
        return DoublePlace(
            from_top, from_bottom, above, below, rise, uddot, rate, rate, plus, zero, zero, zero
        )

    def phases(self, t: Array, t_lo: Doubles) -> tuple[Pairs, Pairs]:
        """Φ± without what is proportional to time, with twice the digits."""
        x = self._argument(t, t_lo)
        near = np.clip(x.hi, -FAR, FAR)
        S, C = sinh_cosh(Pairs(near, np.where(near == x.hi, x.lo, 0.0)))
        nothing = Pairs(0.0 * near, 0.0 * near)
        if self._planar:
            sign = np.where(near >= 0, 1.0, -1.0)
            return Pairs(sign * QUARTER_TURN.hi, sign * QUARTER_TURN.lo), nothing
        return self._lead * arctangent(self._reach * S, self._floor * C), nothing

    def _argument(self, t: Array, t_lo: Doubles) -> Pairs:
        """X = w t + x₀."""
        x, rest = two_product(t, self._w.hi)
        x, error = two_sum(x, self._x0.hi)
        rest = rest + (error + self._x0.lo + self._w.lo * t + self._w.hi * t_lo)
        return Pairs(*two_sum(x, rest))


def _sech_tanh(x: Pairs) -> tuple[Array, Array]:
    """The functions sech x and tanh x, without the overflow of cosh."""
    decay = np.exp(-np.abs(x.hi)) * (1 - np.copysign(1.0, x.hi) * x.lo)
    return 2 * decay / (1 + decay * decay), np.tanh(x.hi)
