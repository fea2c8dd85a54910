"""The kinds of motion, the verdict on one motion, and the table of rules that distinguish them.

The rules are conditions on signs of numbers. Each is a sum of products of the constants of a
`Reduced` motion, in units A = 1, in any arithmetic: `classify` evaluates them in balls and exact
numbers, `filter` in arrays of doubles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from functools import reduce
from operator import and_, eq, or_
from typing import Any, ClassVar, Final, NamedTuple

from heavytop.classification.reduced import Real, Reduced
from heavytop.text import Shown


class Kind(StrEnum):
    """The kinds of motion, in the order of the rules; `so` is a sentence about each."""

    AT_REST = "at-rest", "nothing moves, and no torque acts"
    FORCE_FREE = "force-free", "no torque acts"
    SLEEPING = "sleeping", "the axis stays on the vertical, where V is highest"
    HANGING = "hanging", "the axis stays on the vertical, where V is lowest"
    PLANAR_PENDULUM = "planar-pendulum", "the axis moves in a plane"
    SEPARATRIX = (
        "separatrix",
        "the axis tends to the vertical, where V is highest, and never arrives",
    )
    THROUGH_TOP = "through-top", "the axis passes through the upward vertical"
    THROUGH_BOTTOM = "through-bottom", "the axis passes through the downward vertical"
    UNIFORM_PRECESSION = "uniform-precession", "θ is constant"
    LOOPS = "loops", "φ̇ changes its sign"
    CUSPS = "cusps", "φ̇ vanishes at a turning point"
    WAVES = "waves", "φ̇ keeps its sign"
    UNDECIDED = "undecided"

    so: str

    def __new__(cls, name: str, so: str = "") -> Kind:
        """Make a kind with its name and its sentence."""
        kind = str.__new__(cls, name)
        kind._value_, kind.so = name, so
        return kind


@dataclass(frozen=True, slots=True)
class Verdict(Shown):
    """The kind of a motion, its tags, and why.

    Parameters
    ----------
    kind : Kind
        The first kind that fits; `Kind.UNDECIDED` where a sign is not decided.
    tags : tuple of str
        Proved properties of the motion; the first distinguishes motions of one kind.
    open_tags : tuple of str
        Tags that could be neither proved nor disproved.
    certified : bool
        Whether the kind is proved: by balls and identities on the exact numbers of top and start.
    why : str
        The condition that decided, with its numbers; where it is undecided, which sign is open.
    bound : str or None
        Where it is undecided: a proved bound of the undecided number, in units A = 1, as decimal
        text (it may be smaller than any double).
    """

    kind: Kind
    tags: tuple[str, ...]
    open_tags: tuple[str, ...]
    certified: bool
    why: str
    bound: str | None = None


# --- numbers ------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False, slots=True)
class Criterion:
    """A number in units A = 1 whose sign distinguishes kinds, and how it is shown.

    `shown` gives the number with this symbol and unit as a function of the value, the motion and
    A; by default it is A times the value.
    """

    symbol: str
    value: Callable[[Reduced], Real]
    unit: str = ""
    shown: Callable[[Real, Reduced, Real], Real] = lambda value, _, A: A * value


KINETIC: Final = Criterion("θ̇² + φ̇² sin² θ", lambda x: x.kinetic0)
THETA_RATE: Final = Criterion("θ̇", lambda x: x.udot0)
ACROSS_RATE: Final = Criterion("φ̇ sin θ", lambda x: x.drift0)
SPIN_MOMENTUM: Final = Criterion("p_ψ", lambda x: x.b)
WEIGHT: Final = Criterion("gMR", lambda x: x.g)
INVERTED: Final = Criterion("−gMR", lambda x: -x.g)
SINE: Final = Criterion("sin θ", lambda x: x.sin2)
HIGH: Final = Criterion("gMR cos θ", lambda x: x.g * x.u0, "J")
"""Positive where the axis is on the pole where V is highest."""

PASS_TOP: Final = Criterion("p_φ − p_ψ", lambda x: x.P_minus)
PASS_BOTTOM: Final = Criterion("p_φ + p_ψ", lambda x: x.P_plus)
"""Not zero where the axis can never pass θ = 0, θ = π."""

OVER_TOP: Final = Criterion("E′ − gMR", lambda x: x.over_top, "J")
OVER_BOTTOM: Final = Criterion("E′ + gMR", lambda x: x.over_bottom, "J")
"""The kinetic energy left at the top, and at the bottom."""

PULL: Final = Criterion("A cos θ φ̇² − p_ψ φ̇ + gMR", lambda x: x.slope0)
"""θ̈ sinθ: zero, with θ̇ = 0, where θ is constant."""

LOOPING: Final = Criterion(
    "E′ − gMR p_φ/p_ψ", lambda x: x.cusp_number, "J", lambda value, x, A: A * value / x.b
)
"""The number has the sign of p_ψ in loops, and is 0 in cusps. Both its terms vanish at rest."""

SLEEPING: Final = Criterion(
    "p_ψ² − 4A |gMR|", lambda x: x.b * x.b - 4 * x.g * x.u0, "kg² m⁴/s²", lambda y, _, A: A * A * y
)
"""Not negative where sleeping is stable."""

FASTER: Final = Criterion("A φ̇² cos² θ − gMR cos θ", lambda x: _steady(x, -x.g))
SLOWER: Final = Criterion("A φ̇² cos² θ + gMR cos θ", lambda x: _steady(x, x.g))
"""The two rates of steady precession have the product gMR/A cosθ; where cosθ = 0 there is one."""

SPIN_STOPS: Final = Criterion("ψ̇ sin² θ", lambda x: (x.kappa + x.b) * x.sin2 - x.drift0 * x.u0)
FLATTER: Final = Criterion("C² − 4A²", lambda x: x.b * x.b - 4 * (x.kappa + x.b) * (x.kappa + x.b))
"""The number has p_ψ² in place of C², and so is 0 too where nothing spins."""


def _steady(x: Reduced, g: Real) -> Real:
    """cosθ (φ̇² cosθ + g) sin⁴θ."""
    return x.u0 * (x.drift0 * x.drift0 * x.u0 + g * x.sin2 * x.sin2)


# --- numbers that are only shown, with the sign of a product that decided -------------------------

MOMENTA: Final = Criterion(
    "|p_φ| − |p_ψ|", lambda x: x.P_minus * x.P_plus / (abs(x.a) + abs(x.b)), "kg m²/s"
)
SPARE_ENERGY: Final = Criterion("E′ − |gMR|", lambda x: x.h - abs(x.g), "J")
RATIO: Final = Criterion(
    "|cos θ| (A φ̇² |cos θ| − |gMR|)",
    lambda x: (x.drift0 / x.sin2 * x.u0) ** 2 - abs(x.g * x.u0),
    "J",
)


# --- the kinds, in their order, and the tags -----------------------------------------------------


class Rule(NamedTuple):
    """A kind fits where all `zeros` are zero and the product of `positive` is positive.

    `shown` are the numbers of its reason, with their signs.
    """

    kind: Kind
    zeros: tuple[Criterion, ...] = ()
    positive: tuple[Criterion, ...] = ()
    shown: tuple[tuple[Criterion, int], ...] = ()


RULES: Final = (
    Rule(Kind.AT_REST, (WEIGHT, KINETIC, SPIN_MOMENTUM)),
    Rule(Kind.AT_REST, (SINE, KINETIC, SPIN_MOMENTUM)),
    Rule(Kind.FORCE_FREE, (WEIGHT,)),
    Rule(Kind.SLEEPING, (SINE, KINETIC), (HIGH,), ((HIGH, 1),)),
    Rule(Kind.HANGING, (SINE, KINETIC), (), ((HIGH, -1),)),
    Rule(Kind.PLANAR_PENDULUM, (SPIN_MOMENTUM, ACROSS_RATE)),
    Rule(Kind.SEPARATRIX, (PASS_TOP, OVER_TOP)),
    Rule(Kind.SEPARATRIX, (PASS_BOTTOM, OVER_BOTTOM)),
    Rule(Kind.THROUGH_TOP, (PASS_TOP,), (OVER_TOP,), ((OVER_TOP, 1),)),
    Rule(Kind.THROUGH_BOTTOM, (PASS_BOTTOM,), (OVER_BOTTOM,), ((OVER_BOTTOM, 1),)),
    Rule(Kind.UNIFORM_PRECESSION, (THETA_RATE, PULL)),
    Rule(Kind.WAVES, (), (PASS_TOP, PASS_BOTTOM), ((MOMENTA, 1),)),
    Rule(Kind.CUSPS, (LOOPING,), (), ((MOMENTA, -1),)),
    # here P₊ has the sign of p_ψ
    Rule(Kind.LOOPS, (), (LOOPING, PASS_BOTTOM), ((MOMENTA, -1), (LOOPING, 1))),
    Rule(Kind.WAVES, (), (), ((LOOPING, -1),)),
)
"""The first rule that fits gives the kind. A separatrix leads to the pole where V is highest: at
the other one the kinetic energy is zero only at rest."""


class Detail(NamedTuple):
    """The names of motions of one kind where a product is zero, positive and negative.

    `shown` is a number with the sign of the product.
    """

    names: tuple[str, str, str]
    product: tuple[Criterion, ...]
    shown: Criterion


_NODS: Final = ("asymptotic", "rotating", "swinging")
_STEADY_RATES: Final = ("single", "fast", "slow")
_SLEEP: Final = ("marginal", "stable", "unstable")

KIND_DETAILS: Final = {  # a pendulum always reaches the lower pole
    Kind.SLEEPING: Detail(_SLEEP, (SLEEPING,), SLEEPING),
    Kind.PLANAR_PENDULUM: Detail(_NODS, (OVER_TOP, OVER_BOTTOM), SPARE_ENERGY),
    Kind.UNIFORM_PRECESSION: Detail(_STEADY_RATES, (FASTER, SLOWER), RATIO),
}


class Tag(NamedTuple):
    """The kinds that may have a tag, and its conditions, as of a rule; some have further ones."""

    kinds: frozenset[Kind]
    zeros: tuple[Criterion, ...] = ()
    positive: tuple[Criterion, ...] = ()


_EVERY: Final = frozenset(Kind)
_STILL: Final = frozenset({Kind.AT_REST, Kind.SLEEPING, Kind.HANGING})
_FREE, _PLANAR, _STEADY = Kind.FORCE_FREE, Kind.PLANAR_PENDULUM, Kind.UNIFORM_PRECESSION

TAGS: Final = {
    "spherical-pendulum": Tag(_EVERY - {Kind.AT_REST, _PLANAR}, (SPIN_MOMENTUM,)),
    "spherical-top": Tag(_EVERY),
    "spin-reversal": Tag(_EVERY - _STILL - {_PLANAR, _STEADY}),
    "closed-orbit": Tag(frozenset({_FREE, _PLANAR, _STEADY})),
    "near-separatrix": Tag(_EVERY - _STILL - {_FREE, Kind.SEPARATRIX, _STEADY}),
    "inverted-gravity": Tag(_EVERY, (), (INVERTED,)),
    "start-at-rest": Tag(_EVERY - _STILL, (KINETIC,)),
}


# --- whether rules fit, by signs: bools for one motion, masks for arrays -------------------------


class Sign(NamedTuple):
    """A number, whether it is positive, whether that is certain, and whether it is exactly 0."""

    number: Any
    positive: Any
    certain: Any
    zero: Any


class Tristate(NamedTuple):
    """Where a statement is certainly true, and where certainly false; elsewhere it is open."""

    yes: Any
    no: Any

    def __and__(self, other: Tristate) -> Tristate:
        return Tristate(self.yes & other.yes, self.no | other.no)


CERTAINLY_NOT: Final = Tristate(yes=False, no=True)


class Signs:
    """The signs of criteria, and whether rules fit by them; subclasses compute `sign`."""

    always = Tristate(True, False)
    everywhere: ClassVar[Any] = bool

    def sign(self, number: Criterion) -> Sign:
        """The sign of one number."""
        raise NotImplementedError

    def vanish(self, numbers: Iterable[Criterion]) -> Tristate:
        """Whether all of some criteria are 0; evaluation ends where they certainly are not."""
        yes, no = self.always
        for number in numbers:
            _, _, certain, zero = self.sign(number)
            yes, no = yes & zero, no | certain
            if self.everywhere(no):
                break
        return Tristate(yes, no)

    def positive(self, numbers: Iterable[Criterion]) -> Tristate:
        """Whether a product is positive; where a factor is exactly 0, it is not."""
        _, positive, certain, zeros = zip(*map(self.sign, numbers), strict=True)
        sure = reduce(and_, certain)
        yes = sure & reduce(eq, positive)
        return Tristate(yes, reduce(or_, zeros, sure ^ yes))

    def fit(self, rule: Rule | Tag) -> Tristate:
        """Whether a rule fits: all its zeros are zero, and its product is positive."""
        found = self.vanish(rule.zeros)
        if self.everywhere(found.no) or not rule.positive:
            return found
        return found & self.positive(rule.positive)


# --- spin reversal -------------------------------------------------------------------------------


def spin_rate(x: Reduced) -> tuple[Real, Real, Real]:
    """Coefficients of q(u) = ψ̇ (1 − u²), constant first.

    q(∓1) = b ± a: there is one zero between the poles where |p_φ| > |p_ψ|; elsewhere two or
    none, and none where C ≤ 2A. The spin reverses where f is positive at a zero.
    """
    return x.kappa + x.b, -x.a, -x.kappa


def speed_at(x: Reduced, u: Real) -> Real:
    """f(u) = u̇², negative at heights that the axis never reaches."""
    drop = x.a - x.b * u
    return 2 * (x.kinetic0 + x.g * (x.u0 - u)) * (1 - u * u) - drop * drop


# --- near the separatrix: 1 − m from the cubic's invariants, without its roots -----------------

NEAR_SEPARATRIX: Final = Fraction(1, 10**6)
"""1 − m below which a motion is near-separatrix: T is then the logarithm to 6 digits."""

FAR_RATIO: Final = 10**5
"""1 − m is not that small where FAR |2 (h − g)| > g, nor where FAR² P₋² > 10 g.

With e = 1 − u₂ and d = u₃ − 1, e + d < (2 + d) 1e-6. So P₋² = −f(1) = 2g (1 − u₁) e d is
below 4.1e-12 g, f′(1) within ±8.1e-6 g, b² below 4.1 g by the sum of the roots, and 2 (h − g) =
b P₋ − f′(1)/2 within ±8.2e-6 g. With g < 0, so at the bottom.
"""

_SQUARED: Final = NEAR_SEPARATRIX * (1 - NEAR_SEPARATRIX)
_NEAR: Final = _SQUARED**2 / (1 - _SQUARED) ** 3  # m′²m²/(1 − m′m)³ where 1 − m = NEAR_SEPARATRIX


def _away_from_one(x: Reduced) -> Real:
    """Negative where m′²m²/(1 − m′m)³ = disc a₃²/(a₂² − 3a₃a₁)³ is below its value at 1 − m = 1e-6.

    The roots' differences are d = u₃ − u₁, m d and m′ d, so that the discriminant is
    d⁶ (m m′)² and the sum of squares of the differences 2 d² (1 − m m′).
    """
    a3, a2, a1, a0 = x.cubic
    inner, outer, a2_squared = a1 * a2, a0 * a3, a2 * a2
    discriminant = (
        inner * inner + 18 * inner * outer - 27 * outer * outer
        - 4 * (a2_squared * a2 * a0 + a1 * a1 * a1 * a3)
    )  # fmt: skip
    spread = a2_squared - 3 * a3 * a1
    least = _NEAR.numerator * (spread * spread * spread)
    return _NEAR.denominator * (discriminant * a3 * a3) - least


def _upper_roots_nearer(x: Reduced) -> Real:
    """A number with the sign of 2u₂ − u₁ − u₃, seen with g ≥ 0: positive where 1 − m < ½."""
    a3, a2, a1, a0 = x.cubic
    return 2 * a2 * a2 * a2 - 9 * a3 * a2 * a1 + 27 * a3 * a3 * a0


AWAY_FROM_ONE: Final = Criterion("1 − m − 1e-6", _away_from_one)
UPPER_ROOTS_NEARER: Final = Criterion("2u₂ − u₁ − u₃", _upper_roots_nearer)
