"""Tops and starts as arrays of doubles, and what the criteria are made of in bounded arithmetic."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from heavytop.classification.bounded import Array, Bounded, Mask
from heavytop.classification.cosines import cosines
from heavytop.classification.criteria import Given

Held: TypeAlias = Literal["psidot", "omega3"]


class Starts(NamedTuple):
    """Tops and starts, each array of one shape (n,) or of one element.

    Parameters
    ----------
    A, C, gMR : ndarray of float
        The tops [kg m², kg m² s⁻²].
    theta, thetadot, phidot : ndarray of float
        Tilts [rad] and rates [rad/s].
    spin : ndarray of float
        ψ̇ or ω3 [rad/s].
    held : {"psidot", "omega3"}
        Which of the two it is.
    """

    A: Array
    C: Array
    gMR: Array
    theta: Array
    thetadot: Array
    phidot: Array
    spin: Array
    held: Held

    @property
    def arrays(self) -> tuple[Array, ...]:
        """A, C, gMR, theta, thetadot, phidot and spin."""
        return self[:-1]

    @property
    def pole(self) -> Mask:
        """Where the axis points up; of the doubles in [0, π] no other is a pole."""
        return np.equal(self.theta, 0)

    @property
    def still(self) -> Mask:
        """Where θ̇ = 0."""
        return np.equal(self.thetadot, 0)

    @property
    def level(self) -> Mask:
        """Where φ̇ sinθ = 0."""
        return self.pole | np.equal(self.phidot, 0)

    def given(self) -> Given:
        """What the criteria are made of."""
        cos, below, above = cosines(self.theta)
        phidot = Bounded.of(self.phidot)
        spin = Bounded.of(self.spin)
        omega3 = spin if self.held == "omega3" else spin + phidot * cos
        A, C = Bounded.of(self.A, positive=True), Bounded.of(self.C, positive=True)
        gMR, thetadot = Bounded.of(self.gMR), Bounded.of(self.thetadot)
        return Given(A, C, gMR, cos, below, above, thetadot, phidot, omega3)
