"""Certified classification of one motion: its kind, its tags and the reason, each proved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from heavytop.classification import kinds
from heavytop.classification.kinds import DETAILS, RULES, TAGS, Kind, Rule, Verdict
from heavytop.classification.reduced import MOST_BITS, Real, Reduced, ball_sign
from heavytop.classification.signs import SIGN_BITS, SceneSigns, UndecidedError
from heavytop.classification.why import reason
from heavytop.exact import sqrt
from heavytop.exact.balls import working
from heavytop.exact.number import Exact, Sign
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top


def classify(top: Top, start: State) -> Verdict:
    """The kind of motion of `top` from `start`, with tags and the reason, proved.

    Parameters
    ----------
    top : Top
        What spins; its numbers are exact.
    start : State
        How it starts; its numbers are exact, floats mean their binary value.

    Returns
    -------
    Verdict
        Certified, unless some sign is not decided by 4096 bits, and no proof shows that it is zero.

    Raises
    ------
    WrongType
        `top` is no Top, or `start` no State.

    Notes
    -----
    Every sign is decided by real balls or by an algebraic proof that the number is zero:
    no threshold enters.

    Accuracy: ``tests/classification/test_classify.py`` holds verdicts over the whole space to the
    definitions at 300 digits, ``validation/11_random_tops.py`` 1e5 of them to integrated
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
    with working(SIGN_BITS):
        try:
            rule = _rule(signs)
        except UndecidedError as unknown:
            return Verdict(Kind.UNDECIDED, (), (), False, str(unknown), unknown.bound)
        side, details, open_details = _detail(signs, rule.kind)
        tags, open_tags = _tags(signs, rule.kind)
        why = reason(signs, rule, side)
    return Verdict(rule.kind, (*details, *tags), (*open_details, *open_tags), True, why)


def _rule(signs: SceneSigns) -> Rule:
    """The first rule that fits."""
    return next(
        rule
        for rule in RULES
        if signs.vanish(rule.zeros) and (not rule.positive or signs.product(rule.positive) > 0)
    )


def _detail(signs: SceneSigns, kind: Kind) -> tuple[int | None, tuple[str, ...], tuple[str, ...]]:
    """What distinguishes motions of one kind: the sign, its name, and what is open."""
    if kind not in DETAILS:
        return None, (), ()
    names, product, *_ = DETAILS[kind]
    try:
        side = signs.product(product)
    except UndecidedError:
        return None, (), (names[0],)
    return side, (names[side],), ()


# --- tags --------------------------------------------------------------------------------------


def _tags(signs: SceneSigns, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The tags that hold, and those that could be neither proved nor disproved."""
    holding, unknown = [], []
    for name, tag in TAGS.items():
        try:
            if (
                kind in tag.kinds
                and signs.vanish(tag.zeros)
                and signs.product(tag.positive) > 0
                and (name not in _FURTHER or _FURTHER[name](signs, kind))
            ):
                holding.append(name)
        except UndecidedError:
            unknown.append(name)
    return tuple(holding), tuple(unknown)


def _spherical_top(signs: SceneSigns, _: Kind) -> bool:
    return signs.top.A == signs.top.C or (signs.top.A - signs.top.C).sign() == 0


def _closed_orbit(signs: SceneSigns, kind: Kind) -> bool:
    """Whether the axis is known to run along a closed curve: a circle, or to and fro."""
    if kind is Kind.PLANAR_PENDULUM:
        return signs.product(DETAILS[kind].product) != 0
    return not signs.vanish(TAGS["start-at-rest"].zeros)


def _near_separatrix(signs: SceneSigns, kind: Kind) -> bool:
    over = kinds.OVER_BOTTOM if signs.sign(kinds.INVERTED) > 0 else kinds.OVER_TOP
    if 2 * kinds.FAR * abs(over.value(signs.few)) > abs(signs.few.g):
        return False
    if kind is Kind.PLANAR_PENDULUM and signs.sign(over) == 0:
        return False
    return signs.sign(kinds.AWAY_FROM_ONE) < 0 and signs.sign(kinds.UPPER_ROOTS_NEARER) > 0


def _reverses(signs: SceneSigns, _: Kind) -> bool:
    """Whether f is positive at a zero of ψ̇; a turning point with ψ̇ = 0 is the zero itself."""
    one = signs.product((kinds.PASS_TOP, kinds.PASS_BOTTOM)) > 0
    if not one and signs.sign(kinds.FLATTER) <= 0:
        return False
    if one and signs.vanish((kinds.THETA_RATE, kinds.SPIN_STOPS)):
        return False
    try:
        return _rises_at_a_zero(signs.few, lambda x: x.sqrt(), one)
    except UndecidedError:
        return _rises_at_a_zero(signs.source.exact, sqrt, one)


def _rises_at_a_zero(x: Reduced, root: Callable[[Any], Any], one: bool) -> bool:
    """Whether f is positive at a zero of q between the poles, in the form that does not cancel."""
    free, linear, square = kinds.spin_rate(x)
    inside = linear * linear - 4 * free * square
    if not one and (_sign(inside) != 1 or _sign(4 * square * square - linear * linear) != 1):
        return False
    larger = _sign(-linear) * root(inside) - linear
    zeros = [2 * free / larger] if one else [2 * free / larger, larger / (2 * square)]
    return any(_sign(kinds.speed_at(x, u)) > 0 for u in zeros)


def _sign(value: Real) -> Sign:
    """The sign of a ball or of an exact number, or `UndecidedError`."""
    side = value.sign() if isinstance(value, Exact) else ball_sign(value)
    if side is None:
        raise UndecidedError("ψ̇", value.ball(MOST_BITS) if isinstance(value, Exact) else value)
    return side


_FURTHER: Final[dict[str, Callable[[SceneSigns, Kind], bool]]] = {
    "spherical-top": _spherical_top,
    "spin-reversal": _reverses,
    "closed-orbit": _closed_orbit,
    "near-separatrix": _near_separatrix,
}
