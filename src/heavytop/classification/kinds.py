"""The kinds of motion, the verdict on one motion, and the criteria that tell the kinds apart.

With everything multiplied out (A, C > 0), for a start θ, θ̇, φ̇, ω3 and p_ψ = C ω3, each criterion
is a sum of products of what is given, so that any arithmetic can take it: balls, exact numbers,
arrays of doubles. The terms are kept apart, for a sum is small or large only beside them.

    P₋ = (p_φ − p_ψ)/A = (1 − cosθ) [A φ̇ (1 + cosθ) − p_ψ]/A          zero: may pass the top
    P₊ = (p_φ + p_ψ)/A = (1 + cosθ) [A φ̇ (1 − cosθ) + p_ψ]/A          zero: may pass the bottom
    2 (E' − gMR) = 2K − 2 gMR (1 − cosθ),   2K = A (θ̇² + φ̇² sin²θ)
    2 (E' + gMR) = 2K + 2 gMR (1 + cosθ)
    sinθ (…) = A θ̈,   (…) = A cosθ φ̇² − p_ψ φ̇ + gMR                   zero: steady
    2 (E' p_ψ − gMR p_φ) = p_ψ 2K − 2 gMR A φ̇ sin²θ                    loops, cusps or waves
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from functools import cached_property
from typing import Any, Final, TypeAlias

Term: TypeAlias = Any
"""A number of any arithmetic that has +, − and ×."""

Sum: TypeAlias = "tuple[Term, ...]"


class Kind(StrEnum):
    """The kinds of motion, in the order in which the first that fits is taken."""

    AT_REST = "at-rest"
    FORCE_FREE = "force-free"
    SLEEPING = "sleeping"
    HANGING = "hanging"
    PLANAR_PENDULUM = "planar-pendulum"
    SEPARATRIX = "separatrix"
    THROUGH_TOP = "through-top"
    THROUGH_BOTTOM = "through-bottom"
    UNIFORM_PRECESSION = "uniform-precession"
    LOOPS = "loops"
    CUSPS = "cusps"
    WAVES = "waves"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What kind of motion it is, and how that is known.

    Parameters
    ----------
    kind : Kind
        The first kind that fits; `Kind.UNDECIDED` where a sign could be neither told nor proved 0.
    tags : tuple of str
        What else holds, proved; first what tells motions of one kind apart.
    open_tags : tuple of str
        Tags that could be neither proved nor disproved.
    certified : bool
        Whether the kind is proved: by balls and identities on the exact numbers of top and start.
    margin : float
        How far the nearest other verdict is: the smallest relative size of a number that was found
        not to be zero on the way (0 … 1).
    margin_enclosure : (float, float)
        Bounds that contain the margin.
    why : str
        The condition that decided.
    bound : str or None
        Where it is undecided: what the number in question, beside its terms, is proved not to
        exceed, as decimal text (it may be smaller than any double).
    """

    kind: Kind
    tags: tuple[str, ...]
    open_tags: tuple[str, ...]
    certified: bool
    margin: float
    margin_enclosure: tuple[float, float]
    why: str
    bound: str | None = None


WHY = {
    Kind.AT_REST: "no part of the top moves, and no torque acts",
    Kind.FORCE_FREE: "gMR = 0",
    Kind.SLEEPING: "the axis stays on the vertical, where V is highest",
    Kind.HANGING: "the axis stays on the vertical, where V is lowest",
    Kind.PLANAR_PENDULUM: "p_phi = p_psi = 0",
    Kind.SEPARATRIX: "the axis tends to the vertical, where V is highest, and never arrives",
    Kind.THROUGH_TOP: "p_phi = p_psi and E' > gMR: theta = 0 is reached",
    Kind.THROUGH_BOTTOM: "p_phi = -p_psi and E' > -gMR: theta = pi is reached",
    Kind.UNIFORM_PRECESSION: "thetadot = 0 and A cos(theta) phidot^2 - p_psi phidot + gMR = 0: "
    "theta is constant",
    Kind.LOOPS: "|p_phi| < |p_psi| and E' > gMR p_phi/p_psi: phidot changes sign",
    Kind.CUSPS: "|p_phi| < |p_psi| and E' = gMR p_phi/p_psi: phidot vanishes at a turning point",
    Kind.WAVES: "phidot keeps its sign",
    Kind.UNDECIDED: "a sign could be neither told nor proved to be zero",
}


DETAILS: Final = {
    Kind.SLEEPING: ("marginal", "stable", "unstable"),
    Kind.PLANAR_PENDULUM: ("asymptotic", "rotating", "swinging"),
    Kind.UNIFORM_PRECESSION: ("single", "fast", "slow"),
}
"""What tells motions of one kind apart: where a criterion is zero, positive and negative."""


# --- the criteria ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Given:
    """What the criteria are made of, in one arithmetic; `one_minus_cos` is 1 − cosθ."""

    A: Term
    C: Term
    gMR: Term
    cos: Term
    one_minus_cos: Term
    one_plus_cos: Term
    thetadot: Term
    phidot: Term
    omega3: Term

    @cached_property
    def p_psi(self) -> Term:
        """Momentum about the axis, C ω3."""
        return self.C * self.omega3

    @cached_property
    def sin2(self) -> Term:
        """sin²θ."""
        return self.one_minus_cos * self.one_plus_cos

    @cached_property
    def kinetic(self) -> Term:
        """2K = A (θ̇² + φ̇² sin²θ), twice the kinetic energy without that of the spin."""
        across = self.phidot * self.phidot * self.sin2
        return self.A * (self.thetadot * self.thetadot + across)

    @cached_property
    def unspun(self) -> Term:
        """2A K + A |gMR|, the square of a momentum."""
        return self.A * (self.kinetic + abs(self.gMR))

    @cached_property
    def momentum(self) -> Term:
        """√(2A K + A |gMR| + p_ψ²), what momenta are small or large beside."""
        return (self.unspun + self.p_psi * self.p_psi) ** 0.5


def p_minus(x: Given) -> Sum:
    """A P₋/(1 − cosθ): not zero where the axis can never pass θ = 0."""
    return x.A * x.phidot * x.one_plus_cos, -x.p_psi


def p_plus(x: Given) -> Sum:
    """A P₊/(1 + cosθ): not zero where the axis can never pass θ = π."""
    return x.A * x.phidot * x.one_minus_cos, x.p_psi


def over_top(x: Given) -> Sum:
    """2 (E' − gMR), the energy to spare at the top."""
    return x.kinetic, -2 * x.gMR * x.one_minus_cos


def over_bottom(x: Given) -> Sum:
    """2 (E' + gMR), the energy to spare at the bottom."""
    return x.kinetic, 2 * x.gMR * x.one_plus_cos


def steady_balance(x: Given) -> Sum:
    """A θ̈/sinθ: zero, with θ̇ = 0, where θ is constant."""
    return x.A * x.cos * x.phidot * x.phidot, -x.p_psi * x.phidot, x.gMR


def looping(x: Given) -> Sum:
    """2 (E' p_ψ − gMR p_φ): of the sign of p_ψ in loops, zero in cusps."""
    return x.p_psi * x.kinetic, -2 * x.gMR * x.A * x.phidot * x.sin2


def sleeping_discriminant(x: Given, highest: int = 1) -> Sum:
    """p_ψ² − 4A |gMR|, `highest` being the sign of gMR: not negative where sleeping is stable."""
    return x.p_psi * x.p_psi, -4 * highest * x.A * x.gMR


def fast_branch(x: Given, cos_sign: int, highest: int) -> Sum:
    """A φ̇² |cosθ| − |gMR|, with the signs of cosθ and gMR: positive for the faster precession.

    The two rates of steady precession at one tilt have the product gMR/A cosθ.
    """
    return cos_sign * x.A * x.phidot * x.phidot * x.cos, -highest * x.gMR


def flatness(x: Given) -> Sum:
    """A − C: zero for a spherical top."""
    return x.A, -x.C


def theta_rate(x: Given) -> Term:
    """A |θ̇| beside the momenta."""
    return x.A * abs(x.thetadot) / x.momentum


def across(x: Given) -> Term:
    """A |φ̇| sinθ beside the momenta."""
    return x.A * abs(x.phidot) * x.sin2**0.5 / x.momentum


def spin(x: Given) -> Term:
    """|p_ψ| beside the momenta."""
    return abs(x.p_psi) / x.momentum


def weight(x: Given) -> Term:
    """√(A |gMR|) beside the momenta."""
    return (x.A * abs(x.gMR)) ** 0.5 / x.momentum


def pole_scale(x: Given, pole: int) -> Term:
    """What P∓ is small or large beside, next to its own terms: a momentum.

    An axis that starts beside a pole and moves fast passes it closely whatever the terms are.
    """
    near, far = x.one_minus_cos, x.one_plus_cos
    if pole < 0:
        near, far = far, near
    return x.unspun**0.5 + (x.A * x.kinetic * far / near) ** 0.5


def looping_scale(x: Given) -> Term:
    """What `looping` is small or large beside, next to its terms, which vanish both at rest."""
    return abs(x.p_psi) * (x.kinetic + 2 * abs(x.gMR) * x.sin2)


# --- near the separatrix: 1 − m from the cubic's invariants, without its roots -----------------

NEAR_SEPARATRIX: Final = Fraction(1, 10**6)
"""1 − m below which a motion is near-separatrix: T is then the logarithm to 6 digits."""

_SQUARED: Final = NEAR_SEPARATRIX * (1 - NEAR_SEPARATRIX)
_NEAR: Final = _SQUARED**2 / (1 - _SQUARED) ** 3  # m′²m²/(1 − m′m)³ where 1 − m = NEAR_SEPARATRIX


def p_phi(x: Given) -> Term:
    """Momentum about the vertical, A φ̇ sin²θ + p_ψ cosθ."""
    return x.A * x.phidot * x.sin2 + x.p_psi * x.cos


def _cubic(x: Given) -> tuple[Term, Term, Term, Term]:
    """Coefficients of A² f(u), constant first; 2E' = 2K + 2 gMR cosθ."""
    energy = x.A * (x.kinetic + 2 * x.gMR * x.cos)
    about_vertical, pull = p_phi(x), x.A * x.gMR
    return (
        energy - about_vertical * about_vertical,
        2 * (about_vertical * x.p_psi - pull),
        -energy - x.p_psi * x.p_psi,
        2 * pull,
    )


def away_from_one(x: Given) -> Sum:
    """Negative where m′²m²/(1 − m′m)³ = disc a₃²/(a₂² − 3a₃a₁)³ is below its value at 1 − m = 1e-6.

    The roots' differences are d = u₃ − u₁, m d and m′ d, so that the discriminant is
    d⁶ (m m′)² and the sum of squares of the differences 2 d² (1 − m m′).
    """
    a0, a1, a2, a3 = _cubic(x)
    inner, outer, a2_squared = a1 * a2, a0 * a3, a2 * a2
    discriminant = (
        inner * inner + 18 * inner * outer - 27 * outer * outer
        - 4 * (a2_squared * a2 * a0 + a1 * a1 * a1 * a3)
    )  # fmt: skip
    spread = a2_squared - 3 * a3 * a1
    return (
        _NEAR.denominator * (discriminant * a3 * a3),
        -_NEAR.numerator * (spread * spread * spread),
    )


def upper_roots_nearer(x: Given) -> Sum:
    """Of the sign of 2u₂ − u₁ − u₃ in the upright top: positive where 1 − m < ½."""
    a0, a1, a2, a3 = _cubic(x)
    return 2 * a2 * a2 * a2, -9 * a3 * a2 * a1, 27 * a3 * a3 * a0
