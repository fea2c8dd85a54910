"""The kinds of motion, the verdict on one motion, and the table of rules that tell them apart.

With everything multiplied out (A, C > 0), for a start θ, θ̇, φ̇, ω3 and p_ψ = C ω3, each number
that decides is a sum of products of what is given, so that any arithmetic can take it: balls, exact
numbers, arrays of doubles. The terms are kept apart, for a sum is small or large only beside them.
`classify` reads the table with proved signs, `filter` with arrays of doubles, `why` with numbers.

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
    why : str
        The condition that decided, with its numbers; where it is undecided, which sign is open.
    bound : str or None
        Where it is undecided: what the number in question, beside its terms, is proved not to
        exceed, as decimal text (it may be smaller than any double).
    """

    kind: Kind
    tags: tuple[str, ...]
    open_tags: tuple[str, ...]
    certified: bool
    why: str
    bound: str | None = None


# --- numbers ------------------------------------------------------------------------------------


@dataclass(eq=False)
class Given:
    """What the numbers are made of, in one arithmetic; u = cosθ."""

    A: Term
    C: Term
    gMR: Term
    u: Term
    one_minus_u: Term
    one_plus_u: Term
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
        return self.one_minus_u * self.one_plus_u

    @cached_property
    def kinetic(self) -> Term:
        """2K = A (θ̇² + φ̇² sin²θ), twice the kinetic energy without that of the spin."""
        across = self.phidot * self.phidot * self.sin2
        return self.A * (self.thetadot * self.thetadot + across)

    @cached_property
    def p_phi(self) -> Term:
        """Momentum about the vertical, A φ̇ sin²θ + p_ψ cosθ."""
        return self.A * self.phidot * self.sin2 + self.p_psi * self.u


@dataclass(frozen=True, eq=False, slots=True)
class Number:
    """A number that tells kinds apart, zero with the sum of its terms.

    It is that sum divided by what only scales it, and shown so by `why`. A `factor` that is never
    negative is left out of the sum: where it is zero, the number is zero.
    """

    symbol: str
    terms: Callable[[Given], Sum]
    unit: str = ""
    divisor: Callable[[Given], Term] = lambda _: 1
    factor: Callable[[Given], Term] | None = None

    def value(self, x: Given) -> Term:
        """The number that the symbol stands for, in its unit."""
        return sum_of(self.terms(x)) / self.divisor(x)


def sum_of(terms: Sum) -> Term:
    """The sum of some terms."""
    return reduce(add, terms)


def _two(_: Given) -> int:
    return 2


THETA_RATE: Final = Number("θ̇", lambda x: (x.A * x.thetadot,))
ACROSS: Final = Number("φ̇ sin θ", lambda x: (x.A * x.phidot * x.sin2,))
SPIN: Final = Number("p_ψ", lambda x: (x.p_psi,))
WEIGHT: Final = Number("gMR", lambda x: (x.A * x.gMR,))
SINE: Final = Number("sin θ", lambda x: (x.sin2,))
INVERTED: Final = Number("−gMR", lambda x: (-x.gMR,))
FLATNESS: Final = Number("A − C", lambda x: (x.A, -x.C))

HIGH: Final = Number("gMR cos θ", lambda x: (x.gMR * x.u,), "J")
"""Positive on the pole where V is highest."""

PASS_TOP: Final = Number(
    "p_φ − p_ψ", lambda x: (x.A * x.phidot * x.one_plus_u, -x.p_psi), factor=lambda x: x.one_minus_u
)
"""A P₋: not zero where the axis can never pass θ = 0."""

PASS_BOTTOM: Final = Number(
    "p_φ + p_ψ", lambda x: (x.A * x.phidot * x.one_minus_u, x.p_psi), factor=lambda x: x.one_plus_u
)
"""A P₊: not zero where the axis can never pass θ = π."""

OVER_TOP: Final = Number("E′ − gMR", lambda x: (x.kinetic, -2 * x.gMR * x.one_minus_u), "J", _two)
OVER_BOTTOM: Final = Number("E′ + gMR", lambda x: (x.kinetic, 2 * x.gMR * x.one_plus_u), "J", _two)
"""The energy to spare at the top, and at the bottom."""

STEADY: Final = Number(
    "A cos θ φ̇² − p_ψ φ̇ + gMR",
    lambda x: (x.A * x.u * x.phidot * x.phidot, -x.p_psi * x.phidot, x.gMR),
)
"""A θ̈/sinθ: zero, with θ̇ = 0, where θ is constant."""

LOOPING: Final = Number(
    "E′ − gMR p_φ/p_ψ",
    lambda x: (x.p_psi * x.kinetic, -2 * x.gMR * x.A * x.phidot * x.sin2),
    "J",
    lambda x: 2 * x.p_psi,
)
"""The sum is of the sign of p_ψ in loops, zero in cusps. Both terms vanish at rest."""

SLEEPING: Final = Number(
    "p_ψ² − 4A |gMR|", lambda x: (x.p_psi * x.p_psi, -4 * x.A * x.gMR * x.u), "kg² m⁴/s²"
)
"""Of a sleeping top: not negative where that is stable."""

FASTER: Final = Number(
    "(A φ̇² cos θ − gMR) cos θ",
    lambda x: (x.u * x.A * x.u * x.phidot * x.phidot, -x.u * x.gMR),
)
SLOWER: Final = Number(
    "(A φ̇² cos θ + gMR) cos θ",
    lambda x: (x.u * x.A * x.u * x.phidot * x.phidot, x.u * x.gMR),
)
"""The two rates of steady precession have the product gMR/A cosθ; where cosθ = 0 there is one."""

# --- shown only: of the sign of a product, or beside one that decided ----------------------------

MOMENTA: Final = Number(
    "|p_φ| − |p_ψ|",
    lambda x: (sum_of(PASS_TOP.terms(x)) * sum_of(PASS_BOTTOM.terms(x)) * x.sin2,),  # p_φ² − p_ψ²
    "kg m²/s",
    lambda x: abs(x.p_phi) + abs(x.p_psi),
)
SPARE: Final = Number(
    "E′ − |gMR|", lambda x: (x.kinetic, 2 * x.gMR * x.u, -2 * abs(x.gMR)), "J", _two
)
RATIO: Final = Number(
    "|cos θ| (A φ̇² |cos θ| − |gMR|)",
    lambda x: (x.A * (x.phidot * x.u) ** 2, -abs(x.gMR * x.u)),
    "J",
)
RATE: Final = Number("φ̇", lambda x: (x.phidot,), "rad/s")
OTHER_RATE: Final = Number(
    "the other steady rate", lambda x: (x.gMR,), "rad/s", lambda x: x.A * x.u * x.phidot
)
SPIN_RATE: Final = Number("|ω₃|", lambda x: (abs(x.omega3),), "rad/s")
LEAST_SPIN: Final = Number(
    "least stable |ω₃|", lambda x: (2 * abs(x.A * x.gMR) ** 0.5,), "rad/s", lambda x: x.C
)


# --- the kinds, in their order, and the tags -----------------------------------------------------


class Rule(NamedTuple):
    """A kind fits where all `zeros` are zero and the product of `positive` is positive.

    `shown` are the numbers that say so, with their signs.
    """

    kind: Kind
    zeros: tuple[Number, ...] = ()
    positive: tuple[Number, ...] = ()
    shown: tuple[tuple[Number, int], ...] = ()


RULES: Final = (
    Rule(Kind.AT_REST, (WEIGHT, THETA_RATE, ACROSS, SPIN)),
    Rule(Kind.AT_REST, (SINE, THETA_RATE, ACROSS, SPIN)),
    Rule(Kind.FORCE_FREE, (WEIGHT,)),
    Rule(Kind.SLEEPING, (THETA_RATE, SINE), (HIGH,), ((HIGH, 1),)),
    Rule(Kind.HANGING, (THETA_RATE, SINE), (), ((HIGH, -1),)),
    Rule(Kind.PLANAR_PENDULUM, (SPIN, ACROSS)),
    Rule(Kind.SEPARATRIX, (PASS_TOP, OVER_TOP)),
    Rule(Kind.SEPARATRIX, (PASS_BOTTOM, OVER_BOTTOM)),
    Rule(Kind.THROUGH_TOP, (PASS_TOP,), (OVER_TOP,), ((OVER_TOP, 1),)),
    Rule(Kind.THROUGH_BOTTOM, (PASS_BOTTOM,), (OVER_BOTTOM,), ((OVER_BOTTOM, 1),)),
    Rule(Kind.UNIFORM_PRECESSION, (THETA_RATE, STEADY)),
    Rule(Kind.WAVES, (), (PASS_TOP, PASS_BOTTOM), ((MOMENTA, 1),)),
    Rule(Kind.CUSPS, (LOOPING,), (), ((MOMENTA, -1),)),
    # P₊ is here of the sign of p_ψ
    Rule(Kind.LOOPS, (), (LOOPING, PASS_BOTTOM), ((MOMENTA, -1), (LOOPING, 1))),
    Rule(Kind.WAVES, (), (), ((LOOPING, -1),)),
)
"""The first that fits is taken. The separatrix leads to the pole where V is highest: at the other
one the energy to spare is zero only at rest."""

SO: Final = {
    Kind.AT_REST: "nothing moves, and no torque acts",
    Kind.FORCE_FREE: "no torque acts",
    Kind.SLEEPING: "the axis stays on the vertical, where V is highest",
    Kind.HANGING: "the axis stays on the vertical, where V is lowest",
    Kind.PLANAR_PENDULUM: "the axis moves in a plane",
    Kind.SEPARATRIX: "the axis tends to the vertical, where V is highest, and never arrives",
    Kind.THROUGH_TOP: "the axis passes through the upward vertical",
    Kind.THROUGH_BOTTOM: "the axis passes through the downward vertical",
    Kind.UNIFORM_PRECESSION: "θ is constant",
    Kind.LOOPS: "φ̇ changes its sign",
    Kind.CUSPS: "φ̇ vanishes at a turning point",
    Kind.WAVES: "φ̇ keeps its sign",
}
"""What follows where a rule fits."""


class Detail(NamedTuple):
    """What tells motions of one kind apart: where a product is zero, positive and negative.

    `shown` has the sign of the product; `beside` are numbers to compare it with.
    """

    names: tuple[str, str, str]
    product: tuple[Number, ...]
    shown: Number
    beside: tuple[Number, ...] = ()


_NODS: Final = ("asymptotic", "rotating", "swinging")
_RATES: Final = ("single", "fast", "slow")
_SLEEP: Final = ("marginal", "stable", "unstable")

DETAILS: Final = {  # a pendulum always has energy to spare at the lower pole
    Kind.SLEEPING: Detail(_SLEEP, (SLEEPING,), SLEEPING, (SPIN_RATE, LEAST_SPIN)),
    Kind.PLANAR_PENDULUM: Detail(_NODS, (OVER_TOP, OVER_BOTTOM), SPARE),
    Kind.UNIFORM_PRECESSION: Detail(_RATES, (FASTER, SLOWER), RATIO, (RATE, OTHER_RATE)),
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
    "spherical-top": Tag(_EVERY, (FLATNESS,)),
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
    return (x.kinetic + 2 * x.gMR * (x.u - u)) * (x.A - x.A * u * u) - drop * drop


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
    """Coefficients of A² f(u), constant first; 2E' = 2K + 2 gMR u."""
    energy = x.A * (x.kinetic + 2 * x.gMR * x.u)
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


AWAY_FROM_ONE: Final = Number("1 − m − 1e-6", _away_from_one)
UPPER_ROOTS_NEARER: Final = Number("2u₂ − u₁ − u₃", _upper_roots_nearer)
