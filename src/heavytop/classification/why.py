"""The reason for a kind: the inequality that decided, with its numbers, each to its digits."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Final

from flint import arb

from heavytop.classification.kinds import DETAILS, SO, Criterion, Rule
from heavytop.classification.reduced import MOST_BITS
from heavytop.classification.signs import SIGN_BITS, SceneSigns
from heavytop.exact.balls import working

_BITS: Final = (SIGN_BITS, 256, 1024, MOST_BITS)
_GOOD_BITS: Final = 20  # of a number of 4 digits
_RELATIONS: Final = {1: "> 0", -1: "< 0", 0: "= 0 (proved)"}


def reason(signs: SceneSigns, rule: Rule, side: int | None) -> str:
    """Why a rule fits, and what distinguishes the motion from others of its kind.

    `side` is the sign of the product that does, None where there is none or it is undecided.
    """
    decided = " and ".join(_conditions(signs, rule))
    text = f"{decided}: {SO[rule.kind]}"
    if side is None:
        return text
    names, _, shown, beside = DETAILS[rule.kind]
    beside_it = (f"{each.symbol} {value}" for each in beside if (value := _value(signs, each)))
    return f"{text}; {_inequality(signs, shown, side)}: {', '.join((names[side], *beside_it))}"


def general_reason(rule: Rule) -> str:
    """Why a rule fits, without numbers."""
    zeros = [f"{number.symbol} = 0" for number in rule.zeros]
    shown = [f"{number.symbol} {_RELATIONS[side]}" for number, side in rule.shown]
    return f"{' and '.join((*zeros, *shown))}: {SO[rule.kind]}"


def _conditions(signs: SceneSigns, rule: Rule) -> Iterator[str]:
    if rule.zeros:
        yield " = 0, ".join(number.symbol for number in rule.zeros) + " = 0 (proved)"
    for number, side in rule.shown:
        yield _inequality(signs, number, side)


def _inequality(signs: SceneSigns, number: Criterion, side: int) -> str:
    value = _value(signs, number) if side else None
    return " ".join(filter(None, (number.symbol, value, _RELATIONS[side])))


def _value(signs: SceneSigns, number: Criterion) -> str | None:
    """A number to 4 digits, with its unit; None where it is infinite, or as small as no scene's."""
    for bits in _BITS:
        with working(bits):
            ball = signs.shown(number, bits)
            if ball.is_finite() and ball.rel_accuracy_bits() >= _GOOD_BITS:
                return f"= {_digits(ball)} {number.unit}"
    return None


def _digits(ball: arb) -> str:
    size = float(abs(ball.mid()))
    text = f"{size:.4g}" if size > 0 and isfinite(size) else abs(ball).str(4, radius=False)
    return f"{'−' * bool(ball < 0)}{text}"
