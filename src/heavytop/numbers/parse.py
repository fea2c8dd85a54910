"""The small grammar of the numbers a scene may hold: text in, exact numbers out.

A scene is untrusted text, so nothing here evaluates Python: a tokenizer and a recursive descent
over ``sum > product > sign > power > atom``, with every size bounded before it is built.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from fractions import Fraction
from typing import Final

from heavytop.errors import NotANumber
from heavytop.numbers.exact import MAX_DECIMAL_EXPONENT, PI, Exact, in_range, out_of_range, size
from heavytop.numbers.normal_form import HALF, Form

MAX_TEXT: Final = 4000
MAX_DEPTH: Final = 50
MAX_NODES: Final = 500
_LARGEST_LOG2: Final = 997
_MAX_BITS: Final = 16384  # of any rational,
_MAX_POWER: Final = 64  # of an exponent as it is written, and
_MAX_BUILT_POWER: Final = 4096  # of one that results

ANGLES: Final = ("deg", "rad")
RATES: Final = ("rpm", "deg/s", "rad/s")
UNITS: Final = ANGLES + RATES
_UNIT_SIZES: Final = {"deg": PI / 180, "rpm": PI / 30, "deg/s": PI / 180}  # the others are 1

RULE: Final = "a number may use digits, pi, sqrt( ), + - * / ** (or ^) and parentheses"

_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)"
    r"|(?P<word>[^\W\d]\w*)|(?P<mark>\*\*|[-+*/^()]))"
)
_PLAIN: Final = str.maketrans({"×": "*", "·": "*", "÷": "/", "−": "-", "π": " pi "})


class _Unexpected(NotANumber):
    """Something that no number holds, and that may have been meant as a unit."""


def read(text: str, units: Collection[str] = UNITS) -> Exact:
    """Read the number `text`, with an optional trailing unit out of `units`.

    Angles come out in radians, rates in radians per second; what is not a number of the grammar, or
    is larger than it allows, raises `NotANumber`.
    """
    if len(text) > MAX_TEXT:
        raise NotANumber(f"a number is at most {MAX_TEXT} characters long, not {len(text)}")
    body, unit = _split_unit(text.translate(_PLAIN))
    if unit and unit not in units:
        allowed = f"a unit here is {' or '.join(units)}" if units else "a number here has no unit"
        raise NotANumber(f"{allowed}, not {unit}")
    try:
        value = _Parser(_tokens(body)).whole()
    except _Unexpected as wrong:
        known = f"a unit: {', '.join(units)}" if units else "no unit here"
        raise NotANumber(f"{wrong}, and {known}") from None
    return _limited(value * _UNIT_SIZES[unit]) if unit in _UNIT_SIZES else value


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
            mark = text[place:].lstrip()[:1]
            if mark == ",":
                raise NotANumber("unexpected ',': a decimal is written with a point")
            raise _Unexpected(f"unexpected {mark!r}: {RULE}")
        tokens.append(match[0].strip())
        place = match.end()
    if sum(token not in "()" for token in tokens) > MAX_NODES:
        raise NotANumber(f"an expression holds at most {MAX_NODES} numbers and operators")
    return [*tokens, ""]


class _Parser:
    """One reading of one list of tokens, one method per rule of the grammar."""

    def __init__(self, tokens: list[str]) -> None:
        self.tokens = tokens
        self.place = self.depth = 0

    def whole(self) -> Exact:
        value = self.sum()
        if self.peek():
            raise self.unexpected()
        return value

    def peek(self) -> str:
        return self.tokens[self.place]

    def take(self, *marks: str) -> str:
        """The next token if it is one of these, which is then passed; else an empty one."""
        token = self.peek()
        if token not in marks:
            return ""
        self.place += 1
        return token

    def unexpected(self) -> NotANumber:
        token = self.peek()
        if token:
            return _Unexpected(f'unexpected "{token[:40]}": {RULE}')
        return NotANumber(f"the expression ends too early: {RULE}")

    def sum(self) -> Exact:
        value = self.product()
        while mark := self.take("+", "-"):
            term = self.product()
            value = _limited(value + term if mark == "+" else value - term)
        return value

    def product(self) -> Exact:
        value = self.signed()
        while mark := self.take("*", "/"):
            factor = self.signed()
            value = _limited(value * (factor if mark == "*" else _power(factor, Fraction(-1))))
        return value

    def signed(self) -> Exact:
        self.depth += 1  # every way down the grammar passes here
        if self.depth > MAX_DEPTH:
            raise NotANumber(f"an expression nests at most {MAX_DEPTH} deep")
        mark = self.take("+", "-")
        value = self.signed() if mark else self.power()
        self.depth -= 1
        return -value if mark == "-" else value

    def power(self) -> Exact:
        base = self.atom()
        if not self.take("**", "^"):
            return base
        return _power(base, self.signed().fraction)  # to the right first, as in Python

    def atom(self) -> Exact:
        token = self.peek()
        if token[:1].isdigit() or token[:1] == ".":
            return _literal(self.take(token))
        if self.take("pi"):
            return PI
        if self.take("sqrt"):
            return _power(self.parenthesis(), HALF)
        return self.parenthesis()

    def parenthesis(self) -> Exact:
        if not self.take("("):
            raise self.unexpected()
        value = self.sum()
        if not self.take(")"):
            raise self.unexpected()
        return value


# --- limits on size --------------------------------------------------------------------------


def _literal(token: str) -> Exact:
    """The exact value of a decimal literal; its exponent is checked before it is built."""
    exponent = re.search(r"[eE](.*)", token)
    if exponent and abs(int(exponent[1])) > MAX_DECIMAL_EXPONENT:
        raise NotANumber(f"a decimal exponent lies within ±{MAX_DECIMAL_EXPONENT}")
    return in_range(Fraction(token))


def _power(base: Exact, e: Fraction | None) -> Exact:
    """Return base to the exponent, which has to be a small rational."""
    if e is None or _height(e) > _MAX_POWER:
        raise NotANumber(f"an exponent is a rational p/q with |p|, q up to {_MAX_POWER}")
    if _bits(base.terms) * abs(e.numerator) > _MAX_BITS:
        raise NotANumber("a power is too large to be held exactly")
    return _limited(base**e)


def _limited(x: Exact) -> Exact:
    """The number itself, if it is within the limits."""
    exponents = [e for monomial, _ in x.terms for _, e in monomial]
    if _bits(x.terms) > _MAX_BITS or any(_height(e) > _MAX_BUILT_POWER for e in exponents):
        raise NotANumber("a number is too large to be held exactly")
    if (q := x.fraction) is not None:
        return in_range(q)
    if abs(size(x)) > _LARGEST_LOG2:
        raise out_of_range()
    return x


def _height(q: Fraction) -> int:
    """The larger of numerator and denominator."""
    return max(abs(q.numerator), q.denominator)


def _bits(x: Form) -> int:
    rationals = [c for _, c in x]
    rationals += [atom for m, _ in x for atom, _ in m if isinstance(atom, Fraction)]
    return max((_height(q).bit_length() for q in rationals), default=0)
