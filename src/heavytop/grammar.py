"""The small grammar of the numbers a scene may hold: text in, exact arithmetic out.

A scene is untrusted text, so nothing here evaluates Python: a tokenizer and a recursive descent
over ``sum > product > sign > power > atom``, with every size bounded before it is built. The
arithmetic itself belongs to the caller (`Algebra`), so the same few rules serve any number type.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from fractions import Fraction
from typing import Final, Generic, Protocol, TypeVar

from heavytop.errors import NotANumber

MAX_TEXT: Final = 4000
MAX_DEPTH: Final = 50
MAX_NODES: Final = 500
MAX_DECIMAL_EXPONENT: Final = 400

ANGLES: Final = ("deg", "rad")
RATES: Final = ("rpm", "deg/s", "rad/s")
UNITS: Final = ANGLES + RATES

RULE: Final = "a number may use digits, pi, sqrt( ), + - * / ^ and parentheses"

_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<word>[^\W\d]\w*)|(?P<mark>\*\*|[-+*/^()]))"
)
_PLAIN: Final = str.maketrans({"×": "*", "·": "*", "÷": "/", "−": "-", "π": " pi "})

V = TypeVar("V")


class Algebra(Protocol[V]):
    """What the grammar asks of a number type."""

    def number(self, value: Fraction) -> V:
        """A rational number."""
        ...

    def pi(self) -> V:
        """The number π."""
        ...

    def add(self, a: V, b: V) -> V:
        """Return a + b."""
        ...

    def multiply(self, a: V, b: V) -> V:
        """Return a · b."""
        ...

    def power(self, base: V, exponent: V) -> V:
        """Return base to the exponent."""
        ...


def read(text: str, algebra: Algebra[V], units: Collection[str] = UNITS) -> V:
    """Read the number `text` in `algebra`, with an optional trailing unit out of `units`.

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
    value = _Descent(_tokens(body), algebra).whole()
    return value if unit is None else algebra.multiply(value, _unit_size(unit, algebra))


def _split_unit(text: str) -> tuple[str, str | None]:
    text = text.rstrip()
    for unit in sorted(UNITS, key=len, reverse=True):
        body = text.removesuffix(unit)
        if body != text and not body[-1:].isalpha():
            return body, unit
    return text, None


def _unit_size(unit: str, algebra: Algebra[V]) -> V:
    turns = {"deg": Fraction(1, 180), "deg/s": Fraction(1, 180), "rpm": Fraction(1, 30)}
    if unit not in turns:
        return algebra.number(Fraction(1))
    return algebra.multiply(algebra.number(turns[unit]), algebra.pi())


def _tokens(text: str) -> list[str]:
    """Cut `text` into tokens, closed by an empty one."""
    tokens: list[str] = []
    place, text = 0, text.rstrip()
    while place < len(text):
        match = _TOKEN.match(text, place)
        if match is None:
            raise NotANumber(f"unexpected {text[place:].lstrip()[:1]!r}: {RULE}")
        tokens.append(match[0].strip())
        place = match.end()
    if sum(token not in "()" for token in tokens) > MAX_NODES:
        raise NotANumber(f"an expression holds at most {MAX_NODES} numbers and operators")
    return [*tokens, ""]


def _literal(token: str) -> Fraction:
    """The exact value of a decimal literal; its exponent is checked before it is built."""
    exponent = re.search(r"[eE](.*)", token)
    if exponent and abs(int(exponent[1])) > MAX_DECIMAL_EXPONENT:
        raise NotANumber(f"a decimal exponent lies within ±{MAX_DECIMAL_EXPONENT}")
    return Fraction(token)


class _Descent(Generic[V]):
    """One reading of one list of tokens, one method per rule of the grammar."""

    def __init__(self, tokens: list[str], algebra: Algebra[V]) -> None:
        self.tokens, self.algebra = tokens, algebra
        self.place = self.depth = 0

    def whole(self) -> V:
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
            return NotANumber(f'unexpected "{token[:40]}": {RULE}')
        return NotANumber(f"the expression ends too early: {RULE}")

    def sum(self) -> V:
        value = self.product()
        while self.peek() in ("+", "-"):
            minus = self.take() == "-"
            term = self.product()
            value = self.algebra.add(value, self.negative(term) if minus else term)
        return value

    def product(self) -> V:
        value = self.signed()
        while self.peek() in ("*", "/"):
            over = self.take() == "/"
            factor = self.signed()
            value = self.algebra.multiply(value, self.inverse(factor) if over else factor)
        return value

    def signed(self) -> V:
        self.depth += 1  # every way down the grammar passes here
        if self.depth > MAX_DEPTH:
            raise NotANumber(f"an expression nests at most {MAX_DEPTH} deep")
        if self.peek() in ("+", "-"):
            minus = self.take() == "-"
            value = self.negative(self.signed()) if minus else self.signed()
        else:
            value = self.power()
        self.depth -= 1
        return value

    def power(self) -> V:
        base = self.atom()
        if self.peek() not in ("**", "^"):
            return base
        self.take()
        return self.algebra.power(base, self.signed())  # to the right first, as in Python

    def atom(self) -> V:
        token = self.peek()
        if token[:1].isdigit() or token[:1] == ".":
            return self.algebra.number(_literal(self.take()))
        if token == "pi":
            self.take()
            return self.algebra.pi()
        if token == "sqrt":
            self.take()
            return self.algebra.power(self.parenthesis(), self.algebra.number(Fraction(1, 2)))
        if token == "(":
            return self.parenthesis()
        raise self.unexpected()

    def parenthesis(self) -> V:
        self.expect("(")
        value = self.sum()
        self.expect(")")
        return value

    def negative(self, value: V) -> V:
        return self.algebra.multiply(self.algebra.number(Fraction(-1)), value)

    def inverse(self, value: V) -> V:
        return self.algebra.power(value, self.algebra.number(Fraction(-1)))
