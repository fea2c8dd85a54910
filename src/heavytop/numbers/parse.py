"""The small grammar of the numbers a scene may hold: text in, exact arithmetic out.

A scene is untrusted text, so nothing here evaluates Python: a tokenizer and a recursive descent
over ``sum > product > sign > power > atom``, with every size bounded before it is built.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from fractions import Fraction
from typing import Final

from heavytop.errors import NotANumber
from heavytop.numbers import bounded
from heavytop.numbers.algebra import HALF
from heavytop.numbers.forms import ONE, PI, Form, rational, scaled

MAX_TEXT: Final = 4000
MAX_DEPTH: Final = 50
MAX_NODES: Final = 500
MAX_DECIMAL_EXPONENT: Final = 400

ANGLES: Final = ("deg", "rad")
RATES: Final = ("rpm", "deg/s", "rad/s")
UNITS: Final = ANGLES + RATES
_UNIT_SIZES: Final = {
    "deg": scaled(PI, Fraction(1, 180)),
    "rad": ONE,
    "rpm": scaled(PI, Fraction(1, 30)),
    "deg/s": scaled(PI, Fraction(1, 180)),
    "rad/s": ONE,
}

RULE: Final = "a number may use digits, pi, sqrt( ), + - * / ** (or ^) and parentheses"

_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<word>[^\W\d]\w*)|(?P<mark>\*\*|[-+*/^()]))"
)
_PLAIN: Final = str.maketrans({"×": "*", "·": "*", "÷": "/", "−": "-", "π": " pi "})


class _Unexpected(NotANumber):
    """Something that no number holds, and that may have been meant as a unit."""


def read(text: str, units: Collection[str] = UNITS) -> Form:
    """Read the number `text`, with an optional trailing unit out of `units`.

    Angles come out in radians, rates in radians per second.

    Raises
    ------
    NotANumber
        `text` is not a number of the grammar, or is larger than the grammar allows.
    """
    if len(text) > MAX_TEXT:
        raise NotANumber(f"a number is at most {MAX_TEXT} characters long, not {len(text)}")
    body, unit = _split_unit(text.translate(_PLAIN))
    if unit and unit not in units:
        allowed = f"a unit here is {' or '.join(units)}" if units else "a number here has no unit"
        raise NotANumber(f"{allowed}, not {unit}")
    try:
        value = _Descent(_tokens(body)).whole()
    except _Unexpected as wrong:
        known = f"a unit: {', '.join(units)}" if units else "no unit here"
        raise NotANumber(f"{wrong}, and {known}") from None
    return value if unit is None else bounded.multiply(value, _UNIT_SIZES[unit])


def _split_unit(text: str) -> tuple[str, str | None]:
    text = text.rstrip()
    for unit in sorted(UNITS, key=len, reverse=True):
        body = text.removesuffix(unit)
        if body != text and not body[-1:].isalpha():
            return body, unit
    return text, None


def _tokens(text: str) -> list[str]:
    """Cut `text` into tokens, closed by an empty one."""
    tokens: list[str] = []
    place, text = 0, text.rstrip()
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise _unexpected_mark(text[place:].lstrip()[:1])
        tokens.append(match[0].strip())
        place = match.end()
    if sum(token not in "()" for token in tokens) > MAX_NODES:
        raise NotANumber(f"an expression holds at most {MAX_NODES} numbers and operators")
    return [*tokens, ""]


def _unexpected_mark(mark: str) -> NotANumber:
    if mark == ",":
        return NotANumber("unexpected ',': a decimal is written with a point")
    return _Unexpected(f"unexpected {mark!r}: {RULE}")


def _literal(token: str) -> Fraction:
    """The exact value of a decimal literal; its exponent is checked before it is built."""
    exponent = re.search(r"[eE](.*)", token)
    if exponent and abs(int(exponent[1])) > MAX_DECIMAL_EXPONENT:
        raise NotANumber(f"a decimal exponent lies within ±{MAX_DECIMAL_EXPONENT}")
    return Fraction(token)


class _Descent:
    """One reading of one list of tokens, one method per rule of the grammar."""

    def __init__(self, tokens: list[str]) -> None:
        self.tokens = tokens
        self.place = self.depth = 0

    def whole(self) -> Form:
        value = self.sum()
        if self.peek():
            raise self.unexpected()
        return value

    def peek(self) -> str:
        return self.tokens[self.place]

    def take(self) -> str:
        token = self.peek()
        self.place += bool(token)  # the closing token is never passed
        return token

    def expect(self, mark: str) -> None:
        if self.peek() != mark:
            raise self.unexpected()
        self.take()

    def unexpected(self) -> NotANumber:
        token = self.peek()
        if token:
            return _Unexpected(f'unexpected "{token[:40]}": {RULE}')
        return NotANumber(f"the expression ends too early: {RULE}")

    def sum(self) -> Form:
        value = self.product()
        while self.peek() in ("+", "-"):
            minus = self.take() == "-"
            term = self.product()
            value = bounded.add(value, scaled(term, -1) if minus else term)
        return value

    def product(self) -> Form:
        value = self.signed()
        while self.peek() in ("*", "/"):
            over = self.take() == "/"
            factor = self.signed()
            value = bounded.multiply(value, bounded.power(factor, rational(-1)) if over else factor)
        return value

    def signed(self) -> Form:
        self.depth += 1  # every way down the grammar passes here
        if self.depth > MAX_DEPTH:
            raise NotANumber(f"an expression nests at most {MAX_DEPTH} deep")
        if self.peek() in ("+", "-"):
            minus = self.take() == "-"
            value = scaled(self.signed(), -1) if minus else self.signed()
        else:
            value = self.power()
        self.depth -= 1
        return value

    def power(self) -> Form:
        base = self.atom()
        if self.peek() not in ("**", "^"):
            return base
        self.take()
        return bounded.power(base, self.signed())  # to the right first, as in Python

    def atom(self) -> Form:
        token = self.peek()
        if token[:1].isdigit() or token[:1] == ".":
            return bounded.number(_literal(self.take()))
        if token == "pi":
            self.take()
            return PI
        if token == "sqrt":
            self.take()
            return bounded.power(self.parenthesis(), rational(HALF))
        if token == "(":
            return self.parenthesis()
        raise self.unexpected()

    def parenthesis(self) -> Form:
        self.expect("(")
        value = self.sum()
        self.expect(")")
        return value
