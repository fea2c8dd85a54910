"""Certified classification of one motion: its kind, its tags and its margin, each proved.

The kinds are asked for in their order. A special kind asks for several numbers to be zero; by the
largest of their relative sizes it is missed, and the margin is the least by which a kind is missed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeAlias

from flint import arb

from heavytop.classification import kinds
from heavytop.classification.kinds import DETAILS, RULES, TAGS, WHY, Given, Kind, Number, Verdict
from heavytop.classification.signs import (
    FEW_BITS,
    MOST_BITS,
    Ball,
    SceneSigns,
    UndecidedError,
    ball_sign,
    unproved,
)
from heavytop.exact import sqrt
from heavytop.exact.balls import working
from heavytop.exact.number import Exact, Sign
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top

_MORE_BITS: Final = (256, 1024, MOST_BITS)  # of the balls that a margin is made of
_GOOD_BITS: Final = 54  # of a margin

Missed: TypeAlias = dict[tuple[Number, ...], None]
"""Conditions that were missed, in their order: of each the numbers that are not zero."""


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

    Accuracy: ``tests/classification/test_classify.py`` holds verdicts over the whole space to the
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
    signs = SceneSigns(top, start)
    with working(FEW_BITS):
        try:
            kind, missed = _kind(signs)
        except UndecidedError as unknown:
            return _undecided(unknown.bound)
        details, open_details = _detail(signs, kind, missed)
        tags, open_tags = _tags(signs, kind)
        least = _margin(signs.few, missed)
    for bits in _MORE_BITS:
        if least.rel_accuracy_bits() >= _GOOD_BITS:
            break
        with working(bits):
            least = _margin(signs.balls(bits), missed)
    return Verdict(
        kind, (*details, *tags), (*open_details, *open_tags), True, float(least.mid()), WHY[kind]
    )


def _undecided(bound: str) -> Verdict:
    why = f"{WHY[Kind.UNDECIDED]}: beside its terms it is at most {bound}"
    return Verdict(Kind.UNDECIDED, (), (), False, 0.0, why, bound)


# --- the kind and its margin ---------------------------------------------------------------------


def _kind(signs: SceneSigns) -> tuple[Kind, Missed]:
    """The first kind that fits, and of each condition that was missed what is not zero."""
    missed: Missed = {}
    signs.expect_told()
    for rule in RULES:
        if left := signs.nonzero(rule.zeros):
            missed[left] = None
        elif not rule.positive or _side(signs, rule.positive, missed) > 0:
            return rule.kind, missed
    raise AssertionError("the last rule fits always")


def _detail(
    signs: SceneSigns, kind: Kind, missed: Missed
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What tells motions of one kind apart; where that is undecided, what it may be."""
    if kind not in DETAILS:
        return (), ()
    names, product = DETAILS[kind]
    try:
        return (names[_side(signs, product, missed)],), ()
    except UndecidedError:
        return (), (names[0],)


def _side(signs: SceneSigns, numbers: tuple[Number, ...], missed: Missed) -> int:
    """The sign of a product, whose factors are remembered."""
    side = signs.product(numbers)
    missed.update(((number,), None) for number in numbers if signs.sign(number))
    return side


def _margin(given: Given, missed: Missed) -> Ball:
    """The least by which a condition was missed; each is by the largest of its numbers."""
    least = arb(1)
    for first, *others in sorted(missed, key=len):
        largest = first.size(given)
        for number in others:
            if largest > least:
                break
            largest = largest.max(number.size(given))
        least = least.min(largest)
    return least


# --- tags --------------------------------------------------------------------------------------


def _tags(signs: SceneSigns, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The tags that hold, and those that could be neither proved nor disproved."""
    holding, unknown = [], []
    for name, tag in TAGS.items():
        try:
            if (
                kind in tag.kinds
                and not signs.nonzero(tag.zeros)
                and signs.product(tag.positive) > 0
                and (name not in _FURTHER or _FURTHER[name](signs, kind))
            ):
                holding.append(name)
        except UndecidedError:
            unknown.append(name)
    return tuple(holding), tuple(unknown)


def _spherical_top(signs: SceneSigns, _: Kind) -> bool:
    return signs.top.A == signs.top.C or signs.sign(kinds.FLATNESS) == 0


def _closed_orbit(signs: SceneSigns, kind: Kind) -> bool:
    """Whether the axis is known to run along a closed curve: a circle, or to and fro."""
    if kind is Kind.PLANAR_PENDULUM:
        return signs.product(DETAILS[kind].product) != 0
    return bool(signs.nonzero(TAGS["start-at-rest"].zeros))


def _near_separatrix(signs: SceneSigns, kind: Kind) -> bool:
    over = kinds.OVER_BOTTOM if signs.sign(kinds.INVERTED) > 0 else kinds.OVER_TOP
    spare = kinds.sum_of(over.terms(signs.few))
    if kinds.FAR * abs(spare) > abs(signs.few.gMR):
        return False
    if kind is Kind.PLANAR_PENDULUM and signs.sign(over) == 0:
        return False
    return signs.sign(kinds.AWAY_FROM_ONE) < 0 and signs.sign(kinds.UPPER_ROOTS_NEARER) > 0


def _reverses(signs: SceneSigns, _: Kind) -> bool:
    """Whether f is positive at a zero of ψ̇; a turning point with ψ̇ = 0 is the zero itself."""
    one = signs.product((kinds.PASS_TOP, kinds.PASS_BOTTOM)) > 0
    if not one and (2 * signs.top.A - signs.top.C).sign() != -1:
        return False
    if one and not signs.nonzero((kinds.THETA_RATE,)) and _sign(signs.start.psidot) == 0:
        return False
    try:
        return _rises_at_a_zero(signs.few, lambda x: x.sqrt(), one)
    except UndecidedError:
        return _rises_at_a_zero(signs.exact, sqrt, one)


def _rises_at_a_zero(x: Given, root: Callable[[Any], Any], one: bool) -> bool:
    """Whether f is positive at a zero of q between the poles, in the form that does not cancel."""
    free, linear, square = kinds.spin_rate(x)
    inside = linear * linear - 4 * free * square
    if not one and (_sign(inside) != 1 or _sign(4 * square * square - linear * linear) != 1):
        return False
    larger = _sign(-linear) * root(inside) - linear
    zeros = [2 * free / larger] if one else [2 * free / larger, larger / (2 * square)]
    return any(_sign(kinds.speed_at(x, u)) > 0 for u in zeros)


def _sign(value: Ball | Exact) -> Sign:
    """The sign of a ball or of an exact number, or `UndecidedError`."""
    if isinstance(value, Exact):
        if (sign := value.sign()) is None:
            raise unproved(value)
    elif (sign := ball_sign(value)) is None:
        raise UndecidedError(value)
    return sign


_FURTHER: Final[dict[str, Callable[[SceneSigns, Kind], bool]]] = {
    "spherical-top": _spherical_top,
    "spin-reversal": _reverses,
    "closed-orbit": _closed_orbit,
    "near-separatrix": _near_separatrix,
}
