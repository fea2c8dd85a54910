"""Certified classification of one motion: its kind, its tags and the reason, each proved.

Balls of 106 bits decide nearly all signs. The others are decided in exact numbers, by balls of more
bits or by a proof that the number is 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from math import isfinite, prod
from typing import Final

from flint import arb

from heavytop.classification import kinds, reduced
from heavytop.classification.kinds import KIND_DETAILS, TAGS, Criterion, Kind, Rule, Verdict
from heavytop.classification.reduced import MOST_SIGN_BITS, Real, Reduced, ball_sign, root_of
from heavytop.exact import Exact
from heavytop.exact.balls import ball_of, bound_of, working
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top

SIGN_BITS: Final = 106
_REASON_BITS: Final = (SIGN_BITS, 256, 1024, MOST_SIGN_BITS)
_GOOD_BITS: Final = 20  # of a number of 4 digits
_RELATIONS: Final = {1: "> 0", -1: "< 0", 0: "= 0 (proved)"}


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
        fitting = ((rule, signs.fit(rule)) for rule in kinds.RULES)
        rule, fits = next((rule, fits) for rule, fits in fitting if not fits.no)
        if not fits.yes:
            unknown = signs.undecided(*rule.zeros, *rule.positive)
            return Verdict(Kind.UNDECIDED, (), (), False, str(unknown), unknown.bound)
        side, details, open_details = _detail(signs, rule.kind)
        tags, open_tags = _tags(signs, rule.kind)
        why = reason(signs, rule, side)
    return Verdict(rule.kind, (*details, *tags), (*open_details, *open_tags), True, why)


def _detail(signs: SceneSigns, kind: Kind) -> tuple[int | None, tuple[str, ...], tuple[str, ...]]:
    """The sign that distinguishes motions of one kind, its name, and the name of what is open."""
    if kind not in KIND_DETAILS:
        return None, (), ()
    names, product, _ = KIND_DETAILS[kind]
    try:
        side = signs.product(*product)
    except UndecidedError:
        return None, (), (names[0],)
    return side, (names[side],), ()


# --- tags --------------------------------------------------------------------------------------


def _tags(signs: SceneSigns, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The tags that hold, and those that could be neither proved nor disproved."""
    holding, unknown = list[str](), list[str]()
    for name, tag in TAGS.items():
        fits = signs.fit(tag) if kind in tag.kinds else kinds.CERTAINLY_NOT
        try:
            if name in _FURTHER and not fits.no and not _FURTHER[name](signs, kind):
                fits = kinds.CERTAINLY_NOT
        except UndecidedError:
            fits = kinds.Tristate(False, False)
        if not fits.no:
            (holding if fits.yes else unknown).append(name)
    return tuple(holding), tuple(unknown)


def _spherical_top(signs: SceneSigns, _: Kind) -> bool:
    """Whether A = C."""
    return signs.top.A == signs.top.C or (signs.top.A - signs.top.C).sign() == 0


def _closed_orbit(signs: SceneSigns, kind: Kind) -> bool:
    """Whether the axis is known to move on a closed curve: a circle, or an arc to and fro."""
    if kind is Kind.PLANAR_PENDULUM:
        return signs.product(*KIND_DETAILS[kind].product) != 0
    return any(signs.product(number) for number in TAGS["start-at-rest"].zeros)


def _near_separatrix(signs: SceneSigns, kind: Kind) -> bool:
    """Whether 1 − m < `NEAR_SEPARATRIX`."""
    over = kinds.OVER_BOTTOM if signs.product(kinds.INVERTED) > 0 else kinds.OVER_TOP
    if 2 * kinds.FAR_RATIO * abs(over.value(signs.balls)) > abs(signs.balls.g):
        return False
    if kind is Kind.PLANAR_PENDULUM and signs.product(over) == 0:
        return False
    return signs.product(kinds.AWAY_FROM_ONE) < 0 and signs.product(kinds.UPPER_ROOTS_NEARER) > 0


def _reverses(signs: SceneSigns, _: Kind) -> bool:
    """Whether f is positive at a zero of ψ̇; at a turning point with ψ̇ = 0 it is not."""
    one = signs.product(kinds.PASS_TOP, kinds.PASS_BOTTOM) > 0
    if not one and signs.product(kinds.FLATTER) <= 0:
        return False
    if one and not (signs.product(kinds.THETA_RATE) or signs.product(kinds.SPIN_STOPS)):
        return False
    try:
        return _rises_at_a_zero(signs.balls, one)
    except UndecidedError:
        return _rises_at_a_zero(signs.source.exact, one)


def _rises_at_a_zero(x: Reduced, one: bool) -> bool:
    """Whether f is positive at a zero of q between the poles, found without cancellation."""
    free, linear, square = kinds.spin_rate(x)
    inside = linear * linear - 4 * free * square
    if not one and (_sign(inside) != 1 or _sign(4 * square * square - linear * linear) != 1):
        return False
    larger = _sign(-linear) * root_of(inside) - linear
    zeros = [2 * free / larger] if one else [2 * free / larger, larger / (2 * square)]
    return any(_sign(kinds.speed_at(x, u)) > 0 for u in zeros)


def _sign(value: Real) -> int:
    """The sign of a ball or of an exact number; `UndecidedError` where it is open."""
    side = value.sign() if isinstance(value, Exact) else ball_sign(value)
    if side is None:
        raise UndecidedError("ψ̇", value.ball(MOST_SIGN_BITS) if isinstance(value, Exact) else value)
    return side


_FURTHER: Final[dict[str, Callable[[SceneSigns, Kind], bool]]] = {
    "spherical-top": _spherical_top,
    "spin-reversal": _reverses,
    "closed-orbit": _closed_orbit,
    "near-separatrix": _near_separatrix,
}


# --- signs ---------------------------------------------------------------------------------------


class UndecidedError(Exception):
    """A number that is neither separated from zero nor proved to be zero."""

    def __init__(self, symbol: str, ball: arb) -> None:
        self.bound, _ = bound_of(ball)
        size = f"in units A = 1 its size is at most {self.bound}"
        super().__init__(f"the sign of {symbol} is open: {size}")


_SIGNS: Final = {x: kinds.Sign(x, x == 1, x in (1, -1), x == 0) for x in (1, 0, -1, None)}


class SceneSigns(kinds.Signs):
    """The signs of criteria for one top and one start, each computed when it is first needed.

    They have to be read at the working precision of 106 bits.
    """

    def __init__(self, top: Top, start: State) -> None:
        self.top, self.source = top, reduced.StartMotion(top, start)
        self._found: dict[Criterion, kinds.Sign] = {}

    @cached_property
    def balls(self) -> Reduced:
        """The motion in balls of 106 bits."""
        return self.source.reduced(SIGN_BITS)

    def sign(self, number: Criterion) -> kinds.Sign:
        """The sign of a number: 1, -1, 0 where that is proved, or None."""
        if (found := self._found.get(number)) is None:
            found = self._found[number] = _SIGNS[self.source.sign(number.value, self.balls)]
        return found

    def product(self, *numbers: Criterion) -> int:
        """The sign of a product; `UndecidedError` where the sign of a factor is open."""
        sides = [self.sign(number).number for number in numbers]
        if None in sides:
            raise self.undecided(*numbers)
        return prod(sides)

    def undecided(self, *numbers: Criterion) -> UndecidedError:
        """The error for the first of some numbers whose sign is open."""
        number = next(each for each in numbers if self.sign(each).number is None)
        with working(MOST_SIGN_BITS):
            return UndecidedError(number.symbol, number.value(self.source.reduced(MOST_SIGN_BITS)))


# --- the reason ----------------------------------------------------------------------------------


def reason(signs: SceneSigns, rule: Rule, side: int | None) -> str:
    """The conditions of a rule with their numbers, and the detail that distinguishes the motion.

    `side` is the sign of the product of the detail, None where there is none or it is undecided.
    """
    text = f"{' and '.join(_conditions(signs, rule))}: {rule.kind.so}"
    if side is None:
        return text
    names, _, shown = KIND_DETAILS[rule.kind]
    return f"{text}; {_inequality(signs, shown, side)}: {names[side]}"


def general_reason(rule: Rule) -> str:
    """The conditions of a rule, without numbers."""
    zeros = [f"{number.symbol} = 0" for number in rule.zeros]
    shown = [f"{number.symbol} {_RELATIONS[side]}" for number, side in rule.shown]
    return f"{' and '.join((*zeros, *shown))}: {rule.kind.so}"


def _conditions(signs: SceneSigns, rule: Rule) -> Iterator[str]:
    """Yield the conditions of a rule, with their numbers."""
    if rule.zeros:
        yield " = 0, ".join(number.symbol for number in rule.zeros) + " = 0 (proved)"
    for number, side in rule.shown:
        yield _inequality(signs, number, side)


def _inequality(signs: SceneSigns, number: Criterion, side: int) -> str:
    """A number with its symbol, value and relation to 0."""
    value = _value(signs, number) if side else None
    return " ".join(filter(None, (number.symbol, value, _RELATIONS[side])))


def _value(signs: SceneSigns, number: Criterion) -> str | None:
    """A number to 4 digits, with its unit; None where no bits give 4 digits."""
    for bits in _REASON_BITS:
        with working(bits):
            x = signs.balls if bits == SIGN_BITS else signs.source.reduced(bits)
            ball = number.shown(number.value(x), x, ball_of(signs.top.A))
            if ball.is_finite() and ball.rel_accuracy_bits() >= _GOOD_BITS:
                return f"= {_digits(ball)} {number.unit}"
    return None


def _digits(ball: arb) -> str:
    """The middle of a ball to 4 digits, also beyond the range of doubles."""
    size = float(abs(ball.mid()))
    text = f"{size:.4g}" if size > 0 and isfinite(size) else abs(ball).str(4, radius=False)
    return f"{'−' * bool(ball < 0)}{text}"
