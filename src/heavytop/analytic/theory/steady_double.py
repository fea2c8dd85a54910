"""`steady_course` in doubles."""

from __future__ import annotations

import numpy as np

from heavytop.analytic.theory.double_place import DoublePlace
from heavytop.analytic.theory.steady_course import Steady
from heavytop.numbers.pairs import Array, Doubles, Pairs


class SteadyDouble:
    """An axis of constant tilt, at arrays of times: what turns, turns at constant rates.

    Parameters
    ----------
    path : Steady
        Its constants.
    """

    size = 0.0

    def __init__(self, path: Steady) -> None:
        ctx, zero = path.ctx, path.ctx.zero
        self.turns = self.offsets = zero, zero
        self.rates = path.plus_rate, path.minus_rate
        self._phidot = float(path.plus_rate + path.minus_rate)
        self._spin = float(path.plus_rate - path.minus_rate)
        self._distances = float(path.over.one_minus_u0), float(path.over.one_plus_u0)
        self._chords = (
            float(ctx.sqrt(path.over.one_minus_u0)), float(ctx.sqrt(path.over.one_plus_u0))
        )  # fmt: skip

    def chords(self, t: Array, t_lo: Doubles) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u), the same at all times t."""
        from_top, from_bottom = self._chords
        return np.full_like(t, from_top), np.full_like(t, from_bottom)

    def place(self, t: Array, t_lo: Doubles) -> DoublePlace:
        """The place at the times t."""
        zero = np.zeros_like(t)
        above, below = self._distances
        return DoublePlace(
            *self.chords(t, t_lo), zero + above, zero + below, zero, zero,
            zero + self._phidot, zero + self._spin, zero, zero, zero, zero,
        )  # fmt: skip

    def phases(self, t: Array, t_lo: Doubles) -> tuple[Pairs, Pairs]:
        """Nothing: all of Φ± is proportional to time."""
        nothing = Pairs(np.zeros_like(t), np.zeros_like(t))
        return nothing, nothing
