"""The criteria: the few sums whose signs tell the kinds of motion apart.

With everything multiplied out (A, C > 0), for a start θ, θ̇, φ̇, ω3 and p_ψ = C ω3, each criterion
is a sum of products of what is given, so that any arithmetic can take it: balls, exact numbers,
arrays of doubles with bounds. The terms are kept apart, for a sum is small or large only beside
them.

    P₋ = (p_φ − p_ψ)/A = (1 − cosθ) [A φ̇ (1 + cosθ) − p_ψ]/A          zero: may pass the top
    P₊ = (p_φ + p_ψ)/A = (1 + cosθ) [A φ̇ (1 − cosθ) + p_ψ]/A          zero: may pass the bottom
    2 (E' − gMR) = 2K − 2 gMR (1 − cosθ),   2K = A (θ̇² + φ̇² sin²θ)
    2 (E' + gMR) = 2K + 2 gMR (1 + cosθ)
    sinθ (…) = A θ̈,   (…) = A cosθ φ̇² − p_ψ φ̇ + gMR                   zero: steady
    2 (E' p_ψ − gMR p_φ) = p_ψ 2K − 2 gMR A φ̇ sin²θ                    loops, cusps or waves
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

Term: TypeAlias = Any
"""A number of any arithmetic that has +, − and ×."""

Sum: TypeAlias = "tuple[Term, ...]"


@dataclass(frozen=True, slots=True)
class Given:
    """What the criteria are made of, in one arithmetic.

    Parameters
    ----------
    A, C, gMR : Term
        The top [kg m², kg m² s⁻²].
    cos, below, above : Term
        cosθ, 1 − cosθ and 1 + cosθ, the last two without cancellation where it matters.
    thetadot, phidot, omega3 : Term
        The start's rates [rad/s].
    """

    A: Term
    C: Term
    gMR: Term
    cos: Term
    below: Term
    above: Term
    thetadot: Term
    phidot: Term
    omega3: Term

    @property
    def p_psi(self) -> Term:
        """Momentum about the axis, C ω3."""
        return self.C * self.omega3

    @property
    def sin2(self) -> Term:
        """sin²θ."""
        return self.below * self.above

    @property
    def kinetic(self) -> Term:
        """2K = A (θ̇² + φ̇² sin²θ), twice the kinetic energy without that of the spin."""
        across = self.phidot * self.phidot * self.sin2
        return self.A * (self.thetadot * self.thetadot + across)


def miss_of_top(x: Given) -> Sum:
    """A P₋/(1 − cosθ): not zero where the axis can never pass θ = 0."""
    return x.A * x.phidot * x.above, -x.p_psi


def miss_of_bottom(x: Given) -> Sum:
    """A P₊/(1 + cosθ): not zero where the axis can never pass θ = π."""
    return x.A * x.phidot * x.below, x.p_psi


def momentum_beside(x: Given, pole: int) -> Term:
    """What a miss of a pole is small or large beside, next to its own terms: a momentum.

    An axis that starts beside a pole and moves fast passes it closely whatever the terms are.
    """
    near, far = (x.below, x.above) if pole > 0 else (x.above, x.below)
    pulled = x.A * (x.kinetic + abs(x.gMR))
    return pulled.sqrt() + (x.A * x.kinetic * far / near).sqrt()


def over_top(x: Given) -> Sum:
    """2 (E' − gMR)."""
    return x.kinetic, -2 * x.gMR * x.below


def over_bottom(x: Given) -> Sum:
    """2 (E' + gMR)."""
    return x.kinetic, 2 * x.gMR * x.above


def unsteadiness(x: Given) -> Sum:
    """A θ̈/sinθ: zero, with θ̇ = 0, where θ is constant."""
    return x.A * x.cos * x.phidot * x.phidot, -x.p_psi * x.phidot, x.gMR


def looping(x: Given) -> Sum:
    """2 (E' p_ψ − gMR p_φ): of the sign of p_ψ in loops, zero in cusps."""
    return x.p_psi * x.kinetic, -2 * x.gMR * x.A * x.phidot * x.sin2


def lift_beside(x: Given) -> Term:
    """What `looping` is small or large beside, next to its terms, which vanish both at rest."""
    return abs(x.p_psi) * (x.kinetic + 2 * abs(x.gMR) * x.sin2)


def stiffness(x: Given, highest: int = 1) -> Sum:
    """p_ψ² − 4A |gMR|, `highest` being the sign of gMR: not negative where sleeping is stable."""
    return x.p_psi * x.p_psi, -4 * highest * x.A * x.gMR


def haste(x: Given, over: int, highest: int) -> Sum:
    """A φ̇² |cosθ| − |gMR|, with the signs of cosθ and gMR: positive for the faster precession.

    The two rates of steady precession at one tilt have the product gMR/A cosθ.
    """
    return over * x.A * x.phidot * x.phidot * x.cos, -highest * x.gMR
