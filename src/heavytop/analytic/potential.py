"""The effective potential of the tilt.

In units A = 1, without the constant energy p_ψ²/2C of the spin,

    V(θ) = ⅛ [P₊ tan(θ/2) + P₋ cot(θ/2)]² + g cos θ,     ½ θ̇² + V(θ) = h.

Written so, nothing cancels near the poles, and a pole that the axis can reach is a point like any
other.
"""

from __future__ import annotations

from math import acos, pi

import numpy as np
import numpy.typing as npt

from heavytop.analytic.motion import ClosedForm


class Potential:
    """V(θ) at the momenta of one motion.

    Attributes
    ----------
    g : float
        gMR/A [1/s²].
    momenta : tuple of 2 float
        P₊ and P₋ [1/s], exactly 0 where the axis passes through that pole, or where they are too
        small for doubles.

    Examples
    --------
    >>> from heavytop.analytic.motion import Motion
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> float(Potential(Motion(Top(1, 1, 3), State("pi/2", phidot=2)))(np.pi / 2).round(12))
    2.0
    """

    def __init__(self, motion: ClosedForm) -> None:
        start, regime = motion.reduced, motion.regime
        misses = (regime.misses_bottom, regime.misses_top)[:: -1 if regime.mirrored else 1]
        self.g = float(start.g)
        momenta = zip(misses, (start.P_plus, start.P_minus), strict=True)
        self.momenta = tuple(float(P) if missed else 0.0 for missed, P in momenta)

    def __call__(self, theta: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """V [1/s²] at the tilts θ [rad]; vast or infinite at a pole that no energy reaches."""
        tilt = np.asarray(theta, dtype=np.float64)
        s, c = np.sin(tilt / 2), np.cos(tilt / 2)
        plus, minus = self.momenta
        with np.errstate(divide="ignore"):
            across = (s / c * plus if plus else 0.0) + (c / s * minus if minus else 0.0)
        return np.asarray(across**2 / 8 + self.g * (c - s) * (c + s))

    @property
    def separatrix(self) -> tuple[float, float] | None:
        """The tilts [rad] between which axes move that tend to the vertical; None if none do."""
        missed, b2 = self.momenta[self.g > 0], (self.momenta[0] - self.momenta[1]) ** 2 / 4
        if missed or b2 >= 4 * abs(self.g):
            return None
        turn = acos(b2 / (2 * abs(self.g)) - 1)  # where V = |g|; of a pendulum the other pole
        return (0.0, turn) if self.g > 0 else (pi - turn, pi)
