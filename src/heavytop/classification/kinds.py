"""The kinds of motion, the verdict on one motion, and the table of rules that tell them apart.

With everything multiplied out (A, C > 0), for a start θ, θ̇, φ̇, ω3 and p_ψ = C ω3, each number
that decides is a sum of products of what is given, so that any arithmetic can take it: balls, exact
numbers, arrays of doubles. The terms are kept apart, for a sum is small or large only beside them.
`classify` reads the table with proved signs, `filter` with arrays of doubles.

    P₋ = (p_φ − p_ψ)/A = (1 − cosθ) [A φ̇ (1 + cosθ) − p_ψ]/A          zero: may pass the top
    P₊ = (p_φ + p_ψ)/A = (1 + cosθ) [A φ̇ (1 − cosθ) + p_ψ]/A          zero: may pass the bottom
    2 (E' − gMR) = 2K − 2 gMR (1 − cosθ),   2K = A (θ̇² + φ̇² sin²θ)
    2 (E' + gMR) = 2K + 2 gMR (1 + cosθ)
    sinθ (…) = A θ̈,   (…) = A cosθ φ̇² − p_ψ φ̇ + gMR                   zero: steady
    2 (E' p_ψ − gMR p_φ) = p_ψ 2K − 2 gMR A φ̇ sin²θ                    loops, cusps or waves
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from functools import cached_property, reduce
from operator import add
from typing import Any, Final, NamedTuple, TypeAlias

from heavytop.display import Shown

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
class Verdict(Shown):
    """What kind of motion it is, and how that is known.

    Parameters
    ----------
    kind : Kind
        The first kind that fits; `Kind.UNDECIDED` where a sign could be neither told nor proved 0.
    tags : tuple of str
        What else holds, proved; first distinguishes motions of one kind.
    open_tags : tuple of str
        Tags that could be neither proved nor disproved.
    certified : bool
        Whether the kind is proved: by balls and identities on the exact numbers of top and start.
    margin : float
        How far the nearest other verdict is: the smallest relative size of a number that was found
        not to be zero on the way (0 … 1).
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
    Kind.UNDECIDED: "a sign could be neither determined nor proved to be zero",
}


# --- numbers ------------------------------------------------------------------------------------


@dataclass(eq=False)
class Given:
    """What the numbers are made of, in one arithmetic; `one_minus_cos` is 1 − cosθ."""

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
    def sine(self) -> Term:
        """sinθ."""
        return self.sin2**0.5

    @cached_property
    def kinetic(self) -> Term:
        """2K = A (θ̇² + φ̇² sin²θ), twice the kinetic energy without that of the spin."""
        across = self.phidot * self.phidot * self.sin2
        return self.A * (self.thetadot * self.thetadot + across)

    @cached_property
    def p_phi(self) -> Term:
        """Momentum about the vertical, A φ̇ sin²θ + p_ψ cosθ."""
        return self.A * self.phidot * self.sin2 + self.p_psi * self.cos

    @cached_property
    def swing(self) -> Term:
        """√(2A K), a momentum."""
        return (self.A * self.kinetic) ** 0.5

    @cached_property
    def unspun(self) -> Term:
        """√(2A K + A |gMR|), a momentum."""
        return (self.A * (self.kinetic + abs(self.gMR))) ** 0.5

    @cached_property
    def momentum(self) -> Term:
        """√(2A K + A |gMR| + p_ψ²), what momenta are small or large beside."""
        return (self.unspun * self.unspun + self.p_psi * self.p_psi) ** 0.5


@dataclass(frozen=True, eq=False, slots=True)
class Number:
    """A number that tells kinds apart: the sum of its terms, and what that is large beside.

    `beside` takes what is given and the sum of the sizes of the terms, which it is by default. A
    `factor` that is never negative is left out of the sum: where it is zero, the number is zero.
    """

    terms: Callable[[Given], Sum]
    beside: Callable[[Given, Term], Term] = lambda _, sizes: sizes
    factor: Callable[[Given], Term] | None = None

    def size(self, x: Given) -> Term:
        """How large it is beside that (0 … 1)."""
        terms = self.terms(x)
        return abs(sum_of(terms)) / self.beside(x, sum_of(tuple(map(abs, terms))))


def sum_of(terms: Sum) -> Term:
    """The sum of some terms."""
    return reduce(add, terms)


def _beside_momentum(x: Given, _: Term) -> Term:
    return x.momentum


def _pass(terms: Callable[[Given], Sum], height: Callable[[Given], Term]) -> Number:
    """P∓ beside its terms and a momentum; the height is that over the pole.

    An axis that starts beside a pole and moves fast passes it closely whatever the terms are.
    """
    return Number(
        terms, lambda x, sizes: sizes + x.unspun + x.swing * x.sine / height(x), factor=height
    )


THETA_RATE: Final = Number(lambda x: (x.A * x.thetadot,), _beside_momentum)
ACROSS: Final = Number(lambda x: (x.A * x.phidot * x.sin2,), lambda x, _: x.sine * x.momentum)
SPIN: Final = Number(lambda x: (x.p_psi,), _beside_momentum)
WEIGHT: Final = Number(
    lambda x: (x.A * x.gMR,), lambda x, _: (x.A * abs(x.gMR)) ** 0.5 * x.momentum
)
SINE: Final = Number(lambda x: (x.sin2,), lambda x, _: x.sine)

HIGH: Final = Number(lambda x: (x.gMR * x.one_plus_cos, -x.gMR * x.one_minus_cos))
"""2 gMR cosθ: positive on the pole where V is highest."""

INVERTED: Final = Number(lambda x: (-x.gMR,))
FLATNESS: Final = Number(lambda x: (x.A, -x.C))

PASS_TOP: Final = _pass(
    lambda x: (x.A * x.phidot * x.one_plus_cos, -x.p_psi), lambda x: x.one_minus_cos
)
"""A P₋: not zero where the axis can never pass θ = 0."""

PASS_BOTTOM: Final = _pass(
    lambda x: (x.A * x.phidot * x.one_minus_cos, x.p_psi), lambda x: x.one_plus_cos
)
"""A P₊: not zero where the axis can never pass θ = π."""

OVER_TOP: Final = Number(lambda x: (x.kinetic, -2 * x.gMR * x.one_minus_cos))
"""2 (E' − gMR), the energy to spare at the top."""

OVER_BOTTOM: Final = Number(lambda x: (x.kinetic, 2 * x.gMR * x.one_plus_cos))
"""2 (E' + gMR), the energy to spare at the bottom."""

STEADY: Final = Number(lambda x: (x.A * x.cos * x.phidot * x.phidot, -x.p_psi * x.phidot, x.gMR))
"""A θ̈/sinθ: zero, with θ̇ = 0, where θ is constant."""

LOOPING: Final = Number(
    lambda x: (x.p_psi * x.kinetic, -2 * x.gMR * x.A * x.phidot * x.sin2),
    lambda x, sizes: sizes + abs(x.p_psi) * (x.kinetic + 2 * abs(x.gMR) * x.sin2),
)
"""2 (E' p_ψ − gMR p_φ): of the sign of p_ψ in loops, zero in cusps. Both terms vanish at rest."""

SLEEPING: Final = Number(lambda x: (x.p_psi * x.p_psi, -4 * x.A * x.gMR * x.cos))
"""p_ψ² − 4A |gMR| of a sleeping top: not negative where that is stable."""

FASTER: Final = Number(lambda x: (x.cos * x.A * x.cos * x.phidot * x.phidot, -x.cos * x.gMR))
SLOWER: Final = Number(lambda x: (x.cos * x.A * x.cos * x.phidot * x.phidot, x.cos * x.gMR))
"""A φ̇² cosθ ∓ gMR, times cosθ: the two rates of steady precession have the product gMR/A cosθ;
where cosθ = 0 there is one."""


# --- the kinds, in their order, and the tags -----------------------------------------------------


class Rule(NamedTuple):
    """A kind fits where all `zeros` are zero and the product of `positive` is positive."""

    kind: Kind
    zeros: tuple[Number, ...] = ()
    positive: tuple[Number, ...] = ()


RULES: Final = (
    Rule(Kind.AT_REST, (WEIGHT, THETA_RATE, ACROSS, SPIN)),
    Rule(Kind.AT_REST, (SINE, THETA_RATE, ACROSS, SPIN)),
    Rule(Kind.FORCE_FREE, (WEIGHT,)),
    Rule(Kind.SLEEPING, (THETA_RATE, SINE), (HIGH,)),
    Rule(Kind.HANGING, (THETA_RATE, SINE)),
    Rule(Kind.PLANAR_PENDULUM, (SPIN, ACROSS)),
    Rule(Kind.SEPARATRIX, (PASS_TOP, OVER_TOP)),
    Rule(Kind.SEPARATRIX, (PASS_BOTTOM, OVER_BOTTOM)),
    Rule(Kind.THROUGH_TOP, (PASS_TOP,), (OVER_TOP,)),
    Rule(Kind.THROUGH_BOTTOM, (PASS_BOTTOM,), (OVER_BOTTOM,)),
    Rule(Kind.UNIFORM_PRECESSION, (THETA_RATE, STEADY)),
    Rule(Kind.WAVES, (), (PASS_TOP, PASS_BOTTOM)),
    Rule(Kind.CUSPS, (LOOPING,)),
    Rule(Kind.LOOPS, (), (LOOPING, PASS_BOTTOM)),  # P₊ is here of the sign of p_ψ
    Rule(Kind.WAVES),
)
"""The first that fits is taken. The separatrix leads to the pole where V is highest: at the other
one the energy to spare is zero only at rest."""


class Detail(NamedTuple):
    """What tells motions of one kind apart: where a product is zero, positive and negative."""

    names: tuple[str, str, str]
    product: tuple[Number, ...]


DETAILS: Final = {
    Kind.SLEEPING: Detail(("marginal", "stable", "unstable"), (SLEEPING,)),
    Kind.PLANAR_PENDULUM: Detail(  # at the lower pole there is always energy to spare
        ("asymptotic", "rotating", "swinging"), (OVER_TOP, OVER_BOTTOM)
    ),
    Kind.UNIFORM_PRECESSION: Detail(("single", "fast", "slow"), (FASTER, SLOWER)),
}


class Tag(NamedTuple):
    """What a tag asks for, as a rule does, and of which kinds; four ask for more."""

    kinds: frozenset[Kind]
    zeros: tuple[Number, ...] = ()
    positive: tuple[Number, ...] = ()


_EVERY: Final = frozenset(Kind)
_STILL: Final = frozenset({Kind.AT_REST, Kind.SLEEPING, Kind.HANGING})
_FREE, _PLANAR, _STEADY = Kind.FORCE_FREE, Kind.PLANAR_PENDULUM, Kind.UNIFORM_PRECESSION

TAGS: Final = {
    "spherical-pendulum": Tag(_EVERY - {Kind.AT_REST, _PLANAR}, (SPIN,)),
    "spherical-top": Tag(_EVERY),
    "spin-reversal": Tag(_EVERY - _STILL - {_PLANAR, _STEADY}),
    "closed-orbit": Tag(frozenset({_FREE, _PLANAR, _STEADY})),
    "near-separatrix": Tag(_EVERY - _STILL - {_FREE, Kind.SEPARATRIX, _STEADY}),
    "inverted-gravity": Tag(_EVERY, (), (INVERTED,)),
    "start-at-rest": Tag(_EVERY - _STILL, (THETA_RATE, ACROSS)),
}


# --- spin reversal -------------------------------------------------------------------------------


def spin_rate(x: Given) -> tuple[Term, Term, Term]:
    """Coefficients of q(u) = A ψ̇ (1 − u²), constant first.

    q(∓1) = p_ψ ± p_φ: there is one zero between the poles where |p_φ| > |p_ψ|; elsewhere two or
    none, and none where C ≤ 2A. The spin reverses where f is positive at a zero.
    """
    return x.A * x.omega3, -x.p_phi, (x.C - x.A) * x.omega3


def speed_at(x: Given, u: Term) -> Term:
    """A² f(u) = A² u̇², negative where the axis never is."""
    drop = x.p_phi - x.p_psi * u
    return (x.kinetic + 2 * x.gMR * (x.cos - u)) * (x.A - x.A * u * u) - drop * drop


# --- near the separatrix: 1 − m from the cubic's invariants, without its roots -----------------

NEAR_SEPARATRIX: Final = Fraction(1, 10**6)
"""1 − m below which a motion is near-separatrix: T is then the logarithm to 6 digits."""

FAR: Final = 10**5
"""1 − m is not that small where FAR |2 (E' − gMR)| > gMR, nor where FAR² (A P₋)² > 10 A gMR.

With e = 1 − u₂ and d = u₃ − 1, e + d < (2 + d) 1e-6. So P₋² = −f(1) = 2 (gMR/A) (1 − u₁) e d is
below 4.1e-12 gMR/A, f′(1) within ±8.1e-6 gMR/A, p_ψ²/A² below 4.1 gMR/A by the sum of the roots,
and 2 (E' − gMR)/A = p_ψ P₋/A − f′(1)/2 within ±8.2e-6 gMR/A. With gMR < 0, so at the bottom.
"""

_SQUARED: Final = NEAR_SEPARATRIX * (1 - NEAR_SEPARATRIX)
_NEAR: Final = _SQUARED**2 / (1 - _SQUARED) ** 3  # m′²m²/(1 − m′m)³ where 1 − m = NEAR_SEPARATRIX


def _cubic(x: Given) -> tuple[Term, Term, Term, Term]:
    """Coefficients of A² f(u), constant first; 2E' = 2K + 2 gMR cosθ."""
    energy = x.A * (x.kinetic + 2 * x.gMR * x.cos)
    about_vertical, pull = x.p_phi, x.A * x.gMR
    return (
        energy - about_vertical * about_vertical,
        2 * (about_vertical * x.p_psi - pull),
        -energy - x.p_psi * x.p_psi,
        2 * pull,
    )


def _away_from_one(x: Given) -> Sum:
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


def _upper_roots_nearer(x: Given) -> Sum:
    """Of the sign of 2u₂ − u₁ − u₃ in the upright top: positive where 1 − m < ½."""
    a0, a1, a2, a3 = _cubic(x)
    return 2 * a2 * a2 * a2, -9 * a3 * a2 * a1, 27 * a3 * a3 * a0


AWAY_FROM_ONE: Final = Number(_away_from_one)
UPPER_ROOTS_NEARER: Final = Number(_upper_roots_nearer)
