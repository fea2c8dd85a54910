"""The text of a scene: TOML in, with the line of every key, and TOML out."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from decimal import Decimal
from fractions import Fraction
from typing import Any, Final

from heavytop.errors import NotANumber
from heavytop.numbers import Exact
from heavytop.spelling import harmless

_HEADER: Final = re.compile(r"\s*\[\s*([\w.-]+)\s*\]")
_KEY: Final = re.compile(r"\s*([\w.-]+|\"[^\"]*\"|'[^']*')\s*=")
_BARE: Final = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?")
_COMMA: Final = re.compile(r"-?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")
_LONGEST_BARE: Final = 100


class NumberText(str):
    """A decimal as TOML spells it: a number, where a plain str would be a text."""

    __slots__ = ()


LONGEST_LINE = 10_000
MAX_TITLE: Final = 500


def parse(text: str) -> dict[str, Any]:
    """Read TOML with its decimals kept as they are spelled.

    Raises
    ------
    ValueError
        The text is not TOML; the message says where.
    """
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > LONGEST_LINE:  # the time to read a dotted key grows as its square
            raise ValueError(f"a line is at most {LONGEST_LINE} characters long (at line {number})")
    try:
        return tomllib.loads(text, parse_float=_decimal)
    except RecursionError:
        raise ValueError("tables or lists are nested too deeply") from None


def _decimal(spelling: str) -> NumberText | float:
    spelling = spelling.replace("_", "")
    return float(spelling) if spelling[-1].isalpha() else NumberText(spelling)  # inf and nan


def key_lines(text: str) -> dict[str, int]:
    """The line of every table and key, by dotted name (tomllib tells none)."""
    lines: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = header[1] + "."
            lines.setdefault(header[1], number)
        elif key := _KEY.match(line):
            lines.setdefault(table + key[1].strip("\"'"), number)
    return lines


def written_at(text: str, line: int | None) -> tuple[str, str]:
    """The key on a line and what is written after it, its comment left out; empty without one."""
    lines = text.splitlines()
    if line is None or not line <= len(lines):
        return "", ""
    keys = {number: key for key, number in key_lines(text).items()}
    found = _KEY.match(lines[line - 1])
    if found is None or line not in keys:
        return "", ""
    value = lines[line - 1][found.end() :].partition("#")[0].strip()
    return harmless(keys[line][:100]), value if len(value) <= 60 else value[:57] + "…"


def mistake(value: str) -> str:
    """A hint at what is wrong with a value that is no TOML, where that can be guessed."""
    if value.count('"') % 2:
        return "a quote is not closed"
    if _COMMA.fullmatch(value):
        return f"a decimal has a point: {value.replace(',', '.')}"
    if value.endswith(","):
        return "no comma ends a line"
    if value and '"' not in value and not _BARE.fullmatch(value):
        return f'words, units and expressions stand in quotes: "{harmless(value)}"'
    return ""


def shown(value: object) -> str:
    """A value as it stands in a message: short, on one line, and harmless to a terminal."""
    try:
        text = _spelled(value)
    except (RecursionError, ValueError):  # nested too deeply, or an integer too long to print
        text = f"a {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "…"


def _spelled(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (NumberText, Exact)):
        return harmless(str(value))
    if isinstance(value, str):
        return f'"{harmless(value[:100])}"'
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_spelled(item) for item in value[:20])}]"
    return "a table" if isinstance(value, dict) else harmless(str(value))


def written(tables: Mapping[str, object]) -> str:
    """TOML text of a scene: `tables` holds numbers, texts, lists of names and tables of those."""
    lines = []
    for name, value in tables.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{name}]", *(f"{key} = {_toml(x)}" for key, x in value.items())]
        else:
            lines.append(f"{name} = {_toml(value)}")
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, Exact):
        return _toml_number(str(value))
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, tuple):
        return f"[{', '.join(_toml(item) for item in value)}]"
    return str(value)


def _toml_number(text: str) -> str:
    if "cos(" in text or "sin(" in text:
        raise NotANumber(f"a scene file holds no cosines or sines, so it cannot say {text}")
    return text if _BARE.fullmatch(text) and len(text) <= _LONGEST_BARE else f'"{text}"'


def json_ready(value: object) -> Any:
    """The same in JSON: a number where that says it exactly in 15 digits, else its text."""
    if isinstance(value, Exact):
        return _json_number(value)
    if isinstance(value, Mapping):
        return {key: json_ready(item) for key, item in value.items()}
    return list(value) if isinstance(value, tuple) else value


def _json_number(x: Exact) -> int | float | str:
    q = x.fraction
    if q is None or abs(q) >= 10**15:
        return str(x)
    if q.denominator == 1:
        return int(q)
    nearest = float(q)
    digits = Decimal(repr(nearest))
    short = len(digits.as_tuple().digits) <= 15 and Fraction(digits) == q
    return nearest if short else str(x)
