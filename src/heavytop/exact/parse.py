"""The grammar of numbers in scenes: from texts to exact numbers, and back.

A scene is untrusted text, so nothing here evaluates Python: a tokenizer and a parser by operator
precedence, which check every size before a number can grow.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Mapping
from decimal import Context, Decimal, InvalidOperation
from fractions import Fraction
from typing import Final

from heavytop.errors import NotANumber
from heavytop.exact.functions import FUNCTIONS
from heavytop.exact.number import ONE, PI, Exact, in_range, out_of_range, split
from heavytop.text import closest, nearest, printable

MAX_TEXT: Final = 4000
MAX_DEPTH: Final = 50
_MAX_HEIGHT: Final = 2**16384  # of numerators and denominators
_MAX_POWER: Final = 64  # of numerator and denominator of an exponent
_POWER_RULE: Final = f"an exponent is a whole number or p/q, both at most {_MAX_POWER}"
_SIZE_BITS: Final = 128  # of precision, when the size of an irrational number is checked

_THOUSANDTH: Final = Exact.of(Decimal("1e-3"))
UNITS_OF: Final[Mapping[str, Mapping[str, Exact]]] = {
    "rad": {"deg": PI / 180, "rad": ONE, "rev": 2 * PI},
    "rad/s": {
        "rpm": PI / 30, "rev/min": PI / 30, "rps": 2 * PI, "rev/s": 2 * PI, "Hz": 2 * PI,
        "deg/s": PI / 180, "rad/s": ONE,
    },
    "kg": {"kg": ONE, "g": _THOUSANDTH},
    "m": {"m": ONE, "cm": 10 * _THOUSANDTH, "mm": _THOUSANDTH},
    "s": {"s": ONE, "ms": _THOUSANDTH, "min": 60 * ONE},
    "kg m²": {"kg m^2": ONE, "g cm^2": _THOUSANDTH**2 / 10},
    "J": {"J": ONE, "N m": ONE, "kg m^2/s^2": ONE},
    "kg m²/s": {"kg m^2/s": ONE, "J s": ONE},
    "m/s²": {"m/s^2": ONE},
    "kg/m³": {"kg/m^3": ONE, "g/cm^3": ONE / _THOUSANDTH},
    "": {},
}  # fmt: skip
"""For each unit of SI the units that may be written in its place, with their sizes in it."""
UNITS: Final = {name: size for units in UNITS_OF.values() for name, size in units.items()}
_IN_WORDS: Final = {
    "degrees": "deg", "grad": "deg", "radians": "rad", "turns": "rev", "hertz": "Hz",
    "kilograms": "kg", "grams": "g", "meters": "m", "centimeters": "cm", "millimeters": "mm",
    "seconds": "s", "milliseconds": "ms", "minutes": "min",
}  # fmt: skip

RULE: Final = (
    f"a number may use digits, pi, {', '.join(FUNCTIONS)}, + - * / ** (or ^) and parentheses"
)

_LONGEST_FIRST: Final = map(re.escape, sorted(UNITS, key=len, reverse=True))
_UNIT: Final = re.compile(rf"(?<![^\W\d_])(?:{'|'.join(_LONGEST_FIRST)})$")
_TOKEN: Final = re.compile(
    r"(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
    r"|(?:(?:sqrt|a?cos|a?sin|a?tan)\s*)?\(|\*\*|\w+|\S"
)
_COMMA: Final = re.compile(r"(?<=[0-9]),(?=[0-9])")
_THOUSANDS: Final = re.compile(r"(?<![0-9.])[1-9][0-9]{0,2}(?:,[0-9]{3})+(?![0-9])")
_DIGITS: Final = frozenset(".0123456789")
_ASCII: Final = str.maketrans(
    {"×": "*", "·": "*", "÷": "/", "−": "-", "π": " pi ", "°": " deg", "²": "^2", "³": "^3"}
)


class _Unexpected(Exception):
    """A token that is not allowed at its place; an empty one is the end of the text."""


def read(text: str, units: Collection[str] = UNITS) -> Exact:
    """Read the number `text`, with an optional trailing unit out of `units`: that of its last term.

    Angles come out in radians, rates in radians per second; what is not a number of the grammar, or
    is larger than it allows, raises `NotANumber`.
    """
    if len(text) > MAX_TEXT:
        raise NotANumber(f"a number is at most {MAX_TEXT} characters long, not {len(text)}")
    if _THOUSANDS.search(text):
        raise NotANumber("a comma before three digits may be a point or nothing: write which")
    body = _COMMA.sub(".", text.translate(_ASCII)).rstrip()
    unit = found[0] if (found := _UNIT.search(body)) else ""
    if unit and unit not in units:
        allowed = f"a unit here is {' or '.join(units)}" if units else "a number here has no unit"
        raise NotANumber(f"{allowed}, not {unit}")
    texts = [*_TOKEN.findall(body.removesuffix(unit)), *filter(None, [unit])]
    tokens = ["", *(f" {each}" if each == unit else each for each in reversed(texts))]
    try:
        value = _expression(tokens)
        if tokens[-1]:
            raise _Unexpected(tokens[-1])
    except _Unexpected as wrong:
        raise NotANumber(_refusal(str(wrong), units)) from None
    except InvalidOperation:  # a decimal exponent of twenty digits
        raise out_of_range() from None
    return value


def of_one_unit(low: str, high: str) -> tuple[str, str]:
    """The ends of a range; an end without a unit gets that of the other end.

    >>> of_one_unit("20 + 10", "60 rpm"), of_one_unit("1 rad", "90 deg")
    (('(20 + 10) rpm', '60 rpm'), ('1 rad', '90 deg'))
    """
    low, high = (end.translate(_ASCII).strip() for end in (low, high))
    one, other = (found[0] if (found := _UNIT.search(end)) else "" for end in (low, high))
    return low if one else _times(low, other), high if other else _times(high, one)


def _times(text: str, unit: str) -> str:
    """A text followed by a unit, in brackets where the unit would belong to the last term alone."""
    return f"({text}) {unit}" if unit and {*text[1:]} & {*"+-"} else f"{text} {unit}".rstrip()


def unit_hint(word: str, units: Collection[str]) -> str:
    """A hint with the unit nearest to a word; empty where none is near."""
    spelled = {unit: unit for unit in units}
    spelled |= {long: unit for long, unit in _IN_WORDS.items() if unit in units}
    return nearest(spelled.get(closest(word, spelled)), units)


def _refusal(token: str, units: Collection[str]) -> str:
    """The message about a token that is out of place."""
    if token[:1] in ("", " "):
        return f"the expression ends too early: {RULE}"
    known = f"a unit: {', '.join(units)}" if units else "no unit here"
    meant = f" ({hint})" if (hint := unit_hint(token, units)) else ""
    return f'unexpected "{printable(token[:40])}"{meant}: {RULE}, and {known}'


def _expression(tokens: list[str], loosest: int = 1, depth: int = 1) -> Exact:
    """Read an expression from the end of `tokens`, up to an operator of a lower precedence."""
    if depth > MAX_DEPTH:
        raise NotANumber(f"an expression nests at most {MAX_DEPTH} deep")
    token = tokens.pop()
    if token in ("+", "-"):
        operand = _expression(tokens, _SIGN, depth + 1)
        value = -operand if token == "-" else operand
    elif token.endswith("("):
        inner = _expression(tokens, depth=depth + 1)
        if (end := tokens.pop()) != ")":
            raise _Unexpected(end)
        value = _check_limits(FUNCTIONS[token[:-1].rstrip()](inner)) if token[:-1] else inner
    elif token == "pi":
        value = PI
    elif token[:1] in _DIGITS:
        value = Exact.of(Decimal(token))
    else:
        raise _Unexpected(token)
    while (mark := tokens[-1]) in _OPERATORS and _OPERATORS[mark][0] >= loosest:
        _, tighter, applied = _OPERATORS[tokens.pop()]
        operand = UNITS.get(mark.lstrip()) or _expression(tokens, tighter, depth + 1)
        value = _check_limits(applied(value, operand))
    return value


def _power(base: Exact, exponent: Exact) -> Exact:
    """Return base to the exponent, which has to be small."""
    e = exponent.fraction
    if e is None or _height(e) > _MAX_POWER:
        raise NotANumber(_POWER_RULE)
    return base**e


_SIGN: Final = 3  # precedence of a sign
_OPERATORS: Final[dict[str, tuple[int, int, Callable[[Exact, Exact], Exact]]]] = {
    "+": (1, 2, operator.add),  # its precedence, and the lowest one in its right operand
    "-": (1, 2, operator.sub),
    "*": (2, 3, operator.mul),
    "/": (2, 3, operator.truediv),
    "deg": (2, 3, operator.mul),  # within an expression, as in cos(30 deg)
    **{f" {unit}": (2, 3, operator.mul) for unit in UNITS},  # the unit at the end of the text
    "^": (4, 3, _power),  # from right to left, as in Python
    "**": (4, 3, _power),
}


# --- limits on size --------------------------------------------------------------------------


def _check_limits(x: Exact) -> Exact:
    """Return a number; raise `NotANumber` where it, or a part of it, is beyond the limits."""
    parts = x.args if x.op in ("+", "*") else (x,)
    if any(part.op == "rational" and _height(part.args[0]) > _MAX_HEIGHT for part in parts):
        raise NotANumber("a number is too large to be held exactly")
    if (q := x.fraction) is not None:
        return in_range(q)
    size = x.ball(_SIZE_BITS).abs_upper()
    if size < 1e-300 or size > 1e300:
        raise out_of_range()
    if any(part.op == "^" and _height(part.args[-1]) > _MAX_POWER for part in parts):
        raise NotANumber(_POWER_RULE)  # the text of such a number could not be read back
    return x


def _height(q: Fraction) -> int:
    """The larger of numerator and denominator."""
    return max(abs(q.numerator), q.denominator)


def text_of(x: Exact) -> str:
    """The text of a computed number, which `read` reads back."""
    if x.op == "rational":
        return _decimal(x.args[0])
    if x.op == "+":
        return " + ".join(map(text_of, x.args)).replace(" + -", " - ")
    if x.op == "*":
        q, rest = split(x)
        if q != 1 and any(each.op == "+" for each in x.args):  # 2*(pi + 2)*pi would distribute
            text = f"{_decimal(q)}*({text_of(rest)})"
        else:
            text = "*".join(f"({text_of(e)})" if e.op == "+" else text_of(e) for e in x.args)
        return f"-{text[3:]}" if text.startswith("-1*") else text
    if x.op == "^":
        base, exponent = x.args
        if exponent == Fraction(1, 2):
            return f"sqrt({text_of(base)})"
        text = f"({text_of(base)})" if base.op in ("+", "*", "^") else text_of(base)
        return f"{text}^{exponent}" if exponent.denominator == 1 else f"{text}^({exponent})"
    return f"{x.op}({text_of(x.args[0])})" if x.args else x.op


def _decimal(q: Fraction) -> str:
    """A decimal where the expansion ends, else p/q; through Decimal, which knows no longest int."""
    p, d = Decimal(q.numerator), Decimal(q.denominator)
    places = q.denominator.bit_length()
    if pow(10, places, q.denominator):
        return f"{p}/{d}"
    return str(Context(q.numerator.bit_length() + places).divide(p, d))
