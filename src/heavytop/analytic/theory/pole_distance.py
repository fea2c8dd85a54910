"""How far a nodding axis is from one pole, with the digits of the smallest distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heavytop.analytic.theory.nutation import Nutation
from heavytop.numbers.decimals import Number
from heavytop.numbers.pairs import Array


@dataclass(frozen=True, slots=True)
class PoleDistance:
    """√(1 ∓ u) = scale √(least² + swing² x²), with x = cn for the top and sn for the bottom.

    Parameters
    ----------
    square : float
        The least 1 ∓ u.
    scale, least, swing : float
        The largest √(1 ∓ u), the least one divided by it, and √(u₂ − u₁) divided by it.
    rate : float
        ½ P∓ divided by the largest 1 ∓ u [rad/s].
    passed : bool
        Whether the pole is passed exactly.
    """

    square: float
    scale: float
    least: float
    swing: float
    rate: float
    passed: bool

    @classmethod
    def top(cls, roots: Nutation) -> PoleDistance:
        """From θ = 0."""
        return cls._of(roots, roots.one_minus_u1, roots.one_minus_u2, roots.P_minus)

    @classmethod
    def bottom(cls, roots: Nutation) -> PoleDistance:
        """From θ = π."""
        return cls._of(roots, roots.one_plus_u2, roots.one_plus_u1, roots.P_plus)

    @classmethod
    def _of(cls, roots: Nutation, most: Number, least: Number, P: Number) -> PoleDistance:
        root = roots.ctx.sqrt
        return cls(
            square=float(least),
            scale=float(root(most)),
            least=float(root(least / most)),
            swing=float(root(roots.delta / most)),
            rate=float(P / (2 * most)),
            passed=not least,
        )

    def share(self, x: Array) -> Array:
        """√(1 ∓ u)/scale."""
        return np.hypot(self.least, self.swing * x) if self.least else abs(self.swing * x)

    def winding(self, share: Array) -> Array:
        """½ P∓/(1 ∓ u) [rad/s]; nothing where P∓ = 0, even on the pole."""
        return self.rate / share / share if self.rate else np.zeros_like(share)
