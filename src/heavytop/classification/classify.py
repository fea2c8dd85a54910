"""Certified classification of one motion: its kind, its tags and its margin, each proved.

The kinds are asked for in their order. A special kind asks for several numbers to be zero; by the
largest of their relative sizes it is missed, and the margin is the least by which a kind is missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial, reduce
from typing import Any, Final, NamedTuple, TypeAlias

from flint import arb

from heavytop.classification import kinds
from heavytop.classification.kinds import WHY, Given, Kind, Verdict
from heavytop.classification.signs import (
    FEW_BITS,
    MOST_BITS,
    Ball,
    Criterion,
    SceneSigns,
    Sign,
    UndecidedError,
    ball_sign,
    relative_size,
    sign_of_exact,
)
from heavytop.numbers import sqrt
from heavytop.numbers.intervals import working
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top

_BITS: Final = (FEW_BITS, 256, 1024, MOST_BITS)  # of the balls that a margin is made of
_GOOD_BITS: Final = 54  # of a margin

Size: TypeAlias = Callable[[Given], Ball]


def classify(top: Top, start: State) -> Verdict:
    """The kind of motion of `top` from `start`, with tags, margin and the reason, proved.

    Parameters
    ----------
    top : Top
        What spins; its numbers are exact.
    start : State
        How it starts; its numbers are exact, floats mean their binary value.

    Returns
    -------
    Verdict
        Certified, unless some sign can be neither told with 4096 bits nor proved to be zero.

    Raises
    ------
    WrongType
        `top` is no Top, or `start` no State.

    Notes
    -----
    Every sign is decided by real balls or by an algebraic proof that the number is zero:
    no threshold enters.

    Accuracy: ``tests/property/test_verdicts.py`` holds verdicts over the whole space to the
    definitions at 300 digits, ``validation/11_certified_verdicts.py`` 1e5 of them to integrated
    motions.

    References
    ----------
    Landau & Lifshitz, *Mechanics*, section 35; Whittaker, *Analytical Dynamics*, sections 71 to 73,
    for the separatrix.

    Examples
    --------
    >>> top = Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    >>> verdict = classify(top, State(theta="0.1", psidot=140))
    >>> str(verdict.kind), verdict.certified, verdict.tags
    ('cusps', True, ('start-at-rest',))
    >>> str(classify(top, State(theta="0.1", phidot="1e-40", psidot=140)).kind)
    'waves'
    """
    expect("top", top, Top)
    expect("start", start, State)
    try:
        signs = SceneSigns(top, start)
        tree = _Tree(signs)
        kind = tree.kind()
    except UndecidedError as unknown:
        return _undecided(unknown.bound)
    details, open_details = tree.detail(kind)
    tags, open_tags = _tags(signs, kind)
    margin, enclosure = _bounds(tree.margin())
    return Verdict(
        kind, (*details, *tags), (*open_details, *open_tags), True, margin, enclosure, WHY[kind]
    )


def _undecided(bound: str) -> Verdict:
    why = f"{WHY[Kind.UNDECIDED]}: beside its terms it is at most {bound}"
    return Verdict(Kind.UNDECIDED, (), (), False, 0.0, (0.0, _above(float(bound))), why, bound)


def _bounds(margin: Ball) -> tuple[float, tuple[float, float]]:
    """The middle of a ball of positive numbers, and bounds rounded outward."""
    low = max(0.0, math.nextafter(float(margin.lower()), -math.inf))
    return float(margin.mid()), (low, _above(float(margin.upper())))


def _above(x: float) -> float:
    return math.nextafter(x, math.inf)


# --- the decision tree -------------------------------------------------------------------------


class _Number(NamedTuple):
    """A number that may be zero: its sign, and its size beside what it is part of."""

    sign: Callable[[SceneSigns], Sign]
    size: Size


_THETA_RATE: Final = _Number(lambda signs: signs.rate("thetadot"), kinds.theta_rate)
_ACROSS: Final = _Number(lambda signs: 0 if signs.pole else signs.rate("phidot"), kinds.across)
_SPIN: Final = _Number(lambda signs: signs.rate("omega3"), kinds.spin)
_WEIGHT: Final = _Number(lambda signs: signs.rate("gMR"), kinds.weight)
_SINE: Final = _Number(lambda signs: 0 if signs.pole else 1, lambda x: x.sin2**0.5)
_TORQUE: Final = _Number(
    lambda signs: 0 if signs.pole else signs.rate("gMR"),
    lambda x: kinds.weight(x).min(_SINE.size(x)),
)


def _size(criterion: Criterion, scale: Size = lambda _: arb(0)) -> Size:
    return lambda x: relative_size(criterion(x), scale(x))


def _number(name: str, criterion: Criterion, scale: Size = lambda _: arb(0)) -> _Number:
    return _Number(lambda signs: signs.sign_of(name), _size(criterion, scale))


_OVER: Final[dict[int, Criterion]] = {1: kinds.over_top, -1: kinds.over_bottom}
_ENERGY: Final = {
    1: _number("over_top", kinds.over_top),
    -1: _number("over_bottom", kinds.over_bottom),
}
_PASSES: Final = {
    1: _number("P_minus", kinds.p_minus, partial(kinds.pole_scale, pole=1)),
    -1: _number("P_plus", kinds.p_plus, partial(kinds.pole_scale, pole=-1)),
}
_STEADY: Final = _number("pull", kinds.steady_balance)


class _Tree:
    """Finds the kind of one motion, and by what each kind that it is not is missed."""

    def __init__(self, signs: SceneSigns) -> None:
        self.signs = signs
        self._missed: list[tuple[Size, ...]] = []
        self._few = signs.few
        signs.expect_told()

    def kind(self) -> Kind:
        """The first kind that fits; raises `UndecidedError` where a sign could not be told."""
        if self._vanish(_THETA_RATE, _ACROSS, _SPIN, _TORQUE):
            return Kind.AT_REST
        if self._vanish(_WEIGHT):
            return Kind.FORCE_FREE
        if self._vanish(_THETA_RATE, _SINE):
            up = self.signs.pole == self.signs.rate("gMR")
            return Kind.SLEEPING if up else Kind.HANGING
        if self._vanish(_SPIN, _ACROSS):
            return Kind.PLANAR_PENDULUM
        return self._reaching_a_pole()

    def _reaching_a_pole(self) -> Kind:
        highest = self.signs.rate("gMR")
        if self._vanish(_PASSES[highest], _ENERGY[highest]):
            return Kind.SEPARATRIX
        for pole, kind in ((1, Kind.THROUGH_TOP), (-1, Kind.THROUGH_BOTTOM)):
            if self._vanish(_PASSES[pole]) and self._side(_OVER[pole]) > 0:
                return kind
        if self._vanish(_THETA_RATE, _STEADY):
            return Kind.UNIFORM_PRECESSION
        return self._generic()

    def _generic(self) -> Kind:
        signs = self.signs
        if signs.sign(kinds.p_minus) * signs.sign(kinds.p_plus) > 0:
            return Kind.WAVES
        side = self._side(kinds.looping, kinds.looping_scale) * signs.rate("omega3")
        if side == 0:
            return Kind.CUSPS
        return Kind.LOOPS if side > 0 else Kind.WAVES

    def detail(self, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What tells motions of one kind apart; where that is undecided, what it may be."""
        if kind not in kinds.DETAILS:
            return (), ()
        names = kinds.DETAILS[kind]
        try:
            return (names[self._detail(kind)],), ()
        except UndecidedError:
            return (), (names[0],)

    def _detail(self, kind: Kind) -> Sign:
        highest = self.signs.rate("gMR")
        if kind is Kind.SLEEPING:
            return self._side(partial(kinds.sleeping_discriminant, highest=highest))
        if kind is Kind.PLANAR_PENDULUM:
            return self._side(_OVER[highest])
        if (cos_sign := self.signs.cos_sign) == 0:
            return 0
        return self._side(partial(kinds.fast_branch, cos_sign=cos_sign, highest=highest))

    def _vanish(self, *numbers: _Number) -> bool:
        """Whether all of them are zero; where not, by how much that is missed is remembered."""
        sizes, unknown = [], None
        for number in numbers:
            try:
                if number.sign(self.signs) != 0:
                    sizes.append(number.size)
            except UndecidedError as error:
                unknown = error
        if sizes:
            self._missed.append(tuple(sizes))
            return False
        if unknown is not None:
            raise unknown
        return True

    def _side(self, criterion: Criterion, scale: Size = lambda _: arb(0)) -> Sign:
        """The sign of a criterion, its size remembered."""
        if sign := self.signs.sign(criterion):
            self._missed.append((_size(criterion, scale),))
        return sign

    def margin(self) -> Ball:
        """The distance to the nearest of the kinds that were rejected."""
        for bits in _BITS:
            given = self._few if bits == FEW_BITS else self.signs.balls(bits)
            with working(bits):
                missed = {size: size(given) for sizes in self._missed for size in sizes}
                largest = (reduce(arb.max, (missed[size] for size in few)) for few in self._missed)
                least = reduce(arb.min, largest, arb(1))
            if least.rel_accuracy_bits() >= _GOOD_BITS:
                break
        return least


# --- tags --------------------------------------------------------------------------------------

_STILL = frozenset({Kind.AT_REST, Kind.SLEEPING, Kind.HANGING})
_NOT_NUTATING = _STILL | {Kind.SEPARATRIX, Kind.UNIFORM_PRECESSION}
_SPINLESS = frozenset({Kind.AT_REST, Kind.PLANAR_PENDULUM})


def _tags(signs: SceneSigns, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The tags that hold, and those that could be neither proved nor disproved."""
    holding, unknown = [], []
    for tag, holds in TAGS.items():
        try:
            if holds(signs, kind):
                holding.append(tag)
        except UndecidedError:
            unknown.append(tag)
    return tuple(holding), tuple(unknown)


def _spherical_pendulum(signs: SceneSigns, kind: Kind) -> bool:
    return kind not in _SPINLESS and signs.rate("omega3") == 0


def _spherical_top(signs: SceneSigns, _: Kind) -> bool:
    return signs.top.A == signs.top.C or signs.sign(kinds.flatness) == 0


def _spin_reversal(signs: SceneSigns, kind: Kind) -> bool:
    return kind not in (*_STILL, Kind.UNIFORM_PRECESSION) and _reverses(signs)


def _closed_orbit(signs: SceneSigns, kind: Kind) -> bool:
    """Whether the axis is known to run along a closed curve: a circle, or to and fro."""
    if kind is Kind.PLANAR_PENDULUM:
        return signs.sign(_OVER[signs.rate("gMR")]) != 0
    circle = kind in (Kind.FORCE_FREE, Kind.UNIFORM_PRECESSION)
    return circle and not _start_at_rest(signs, kind)


def _near_separatrix(signs: SceneSigns, kind: Kind) -> bool:
    highest = signs.rate("gMR")
    if kind in _NOT_NUTATING or highest == 0:
        return False
    if kind is Kind.PLANAR_PENDULUM and signs.sign(_OVER[highest]) == 0:
        return False
    return signs.sign(kinds.away_from_one) < 0 and signs.sign(kinds.upper_roots_nearer) > 0


def _inverted(signs: SceneSigns, _: Kind) -> bool:
    return signs.rate("gMR") < 0


def _start_at_rest(signs: SceneSigns, kind: Kind) -> bool:
    across = 0 if signs.pole else signs.rate("phidot")
    return kind not in _STILL and signs.rate("thetadot") == across == 0


TAGS: Final[dict[str, Callable[[SceneSigns, Kind], bool]]] = {
    "spherical-pendulum": _spherical_pendulum,
    "spherical-top": _spherical_top,
    "spin-reversal": _spin_reversal,
    "closed-orbit": _closed_orbit,
    "near-separatrix": _near_separatrix,
    "inverted-gravity": _inverted,
    "start-at-rest": _start_at_rest,
}


def _reverses(signs: SceneSigns) -> bool:
    """Whether q(u) = A ψ̇ (1 − u²) = ω3 A − p_φ u − ω3 (A − C) u² has a zero where f > 0.

    q(∓1) = p_ψ ± p_φ: there is one zero between the poles where |p_φ| > |p_ψ|, and elsewhere, as
    C ≤ 2A, none.
    """
    outside = signs.sign_of("P_minus") * signs.sign_of("P_plus") > 0
    if not outside or _turns_without_spin(signs):
        return False
    try:
        with working(FEW_BITS):
            return _f_at_zero(signs.few, _told, lambda x: x.sqrt()) > 0
    except UndecidedError:
        return _f_at_zero(signs.exact, sign_of_exact, sqrt) > 0


def _turns_without_spin(signs: SceneSigns) -> bool:
    """Whether the start is a turning point with ψ̇ = 0: the zero of q, and no inner one."""
    return signs.rate("thetadot") == 0 and sign_of_exact(signs.start.psidot) == 0


def _told(ball: Any) -> Sign:
    sign = ball_sign(ball)
    if sign is None:
        raise UndecidedError(ball)
    return sign


def _f_at_zero(x: Given, sign: Callable[[Any], Sign], root: Callable[[Any], Any]) -> Sign:
    """The sign of f at the zero of q between the poles, in the form that does not cancel."""
    about_vertical, free = kinds.p_phi(x), x.omega3 * x.A
    reach = root(about_vertical * about_vertical + 4 * free * x.omega3 * (x.A - x.C))
    u = 2 * free / (about_vertical + sign(about_vertical) * reach)
    drop = about_vertical - x.p_psi * u
    energy = x.kinetic + 2 * x.gMR * (x.cos - u)
    return sign(x.A * energy * (1 - u * u) - drop * drop)
