"""Scene files: TOML in and out, the keys of each table, and the rules between the keys.

What reads a table returns its values together with everything that is wrong with it, so that one
reading of a scene finds every fault.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any, Final

from heavytop.errors import Fault, Impossible, NotANumber
from heavytop.names import nearest
from heavytop.numbers import Exact
from heavytop.scene import arguments
from heavytop.scene.arguments import NumberText, Range, Reader, Refused, Wrong, faults, one_of
from heavytop.scene.state import CHOICES, State, broken_angles, broken_spin
from heavytop.scene.top import Top, broken_body
from heavytop.spelling import harmless

FORMAT: Final = 1
QUANTITIES: Final = ("class", "period", "theta", "axis", "phi", "psi", "rates", "attitude")
EVENTS: Final = ("turning", "reversal", "cusp")
MAX_SAMPLES: Final = 10_000_000
MAX_DIGITS: Final = 10_000
MAX_TITLE: Final = 500
MAX_LINE: Final = 10_000  # characters: the time to read a dotted key grows as its square

_HEADER: Final = re.compile(r"\s*\[\s*([\w.-]+)\s*\]")
_KEY: Final = re.compile(r"\s*([\w.-]+|\"[^\"]*\"|'[^']*')\s*=")
_BARE: Final = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?")
_COMMA: Final = re.compile(r"-?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")
_LONGEST_BARE: Final = 100


# --- TOML in ---------------------------------------------------------------------------------


def parse(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text, decimals as they are spelled; a ValueError says where not.

    >>> parse("x = 1.50")
    {'x': '1.50'}
    """
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > MAX_LINE:
            raise ValueError(f"a line is at most {MAX_LINE} characters long (at line {number})")
    try:
        return tomllib.loads(text, parse_float=_decimal)
    except RecursionError:
        raise ValueError("tables or lists are nested too deeply") from None


def _decimal(spelling: str) -> NumberText | float:
    spelling = spelling.replace("_", "")
    return float(spelling) if spelling[-1].isalpha() else NumberText(spelling)  # inf and nan


def key_lines(text: str) -> dict[str, int]:
    """Return the line of every table and key, by dotted name (tomllib tells none)."""
    lines: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = header[1] + "."
            lines.setdefault(header[1], number)
        elif key := _KEY.match(line):
            lines.setdefault(table + key[1].strip("\"'"), number)
    return lines


def written_at(text: str, line: int) -> tuple[str, str]:
    """Return the key on a line and what is written after it, less comments; empty without one."""
    key = next((key for key, number in key_lines(text).items() if number == line), "")
    found = _KEY.match(text.splitlines()[line - 1]) if key else None
    if found is None:
        return "", ""
    value = found.string[found.end() :].partition("#")[0].strip()
    return harmless(key[:100]), value if len(value) <= 60 else value[:57] + "…"


def mistake(value: str) -> str:
    """Return a hint at what is wrong with a value that is no TOML, where that can be guessed."""
    if value.count('"') % 2:
        return "a quote is not closed"
    if _COMMA.fullmatch(value):
        return f"a decimal has a point: {value.replace(',', '.')}"
    if value.endswith(","):
        return "no comma ends a line"
    if value and '"' not in value and not _BARE.fullmatch(value):
        return f'words, units and expressions stand in quotes: "{harmless(value)}"'
    return ""


# --- one value -------------------------------------------------------------------------------


def _text(value: object) -> str:
    if not isinstance(value, str) or isinstance(value, NumberText):
        raise Refused("a text in quotes")
    if len(value) > MAX_TITLE:
        raise Refused(f"a text of at most {MAX_TITLE} characters, not {len(value)}")
    if any(_unprintable(letter) for letter in value):
        raise Refused("a text without control characters")
    return value


def _unprintable(letter: str) -> bool:
    """Controls, line ends, halves of surrogate pairs, no characters, and what turns text around."""
    turning = "\u202a" <= letter <= "\u202e" or "\u2066" <= letter <= "\u2069"
    category = unicodedata.category(letter)
    return turning or category in {"Cc", "Cs", "Zl", "Zp"} or letter in "\ufffe\uffff"


def _names(allowed: tuple[str, ...], least: int) -> Reader:
    listed = ", ".join(allowed)

    def read(value: object) -> tuple[str, ...]:
        if not isinstance(value, list | tuple) or len(value) < least:
            raise Refused(f'a list of names out of {listed}, such as ["{allowed[0]}"]')
        wrong = [name for name in value if name not in allowed]
        if wrong:
            hint = nearest(wrong[0], allowed)
            if "rates" in allowed and wrong[0] in ("thetadot", "phidot", "psidot"):
                hint = 'did you mean "rates"? it holds thetadot, phidot and psidot'
            raise Refused(f"names out of {listed}", hint)
        if len(set(value)) < len(value):
            raise Refused("a name at most once")
        return tuple(value)

    return read


def _table(value: object) -> dict[str, object]:
    if not isinstance(value, dict):
        raise Refused("a table, not a value")
    return value


def _format(value: object) -> int:
    if value != FORMAT or isinstance(value, bool | str | float):
        raise Refused(f"{FORMAT}, the only format there is")
    return FORMAT


# --- the keys --------------------------------------------------------------------------------

_MOMENTS: Final = ("A", "C", "gMR")
_PARTS: Final = ("mass", "distance", "gravity", "A_cm", "C_cm")
_CONSTANTS: Final = ("E", "p_phi", "p_psi", "theta", "branch")
_STEADY: Final = ("steady", "theta", "omega3")

TABLES: Final[Mapping[str, Mapping[str, Reader]]] = {
    "top": dict.fromkeys((*_MOMENTS, *_PARTS), arguments.PLAIN),
    "start": {
        **arguments.STATE,
        **dict.fromkeys(("E", "p_phi", "p_psi"), arguments.PLAIN),
        **{key: one_of({name: name for name in names}) for key, names in CHOICES.items()},
    },
    "span": {"time": arguments.PLAIN, "periods": arguments.PLAIN},
    "want": {
        "quantities": _names(QUANTITIES, least=1),
        "events": _names(EVENTS, least=0),
        "samples": Range(2, MAX_SAMPLES, whole=True),
        "digits": Range(1, MAX_DIGITS, whole=True),
    },
}
SCENE: Final[Mapping[str, Reader]] = {
    "format": _format,
    "title": _text,
    "source": _text,
    **dict.fromkeys(TABLES, _table),
}
_NEEDED: Final = {"format": f"missing: a scene begins with format = {FORMAT}"} | {
    table: f"missing: a scene has a table [{table}]" for table in ("top", "start", "span")
}


def read_table(
    keys: Mapping[str, Reader], raw: Mapping[str, object]
) -> tuple[dict[str, Any], list[Wrong]]:
    """Return the values of a table that are right, and what is wrong with the others."""
    values, wrong = arguments.read_values({key: raw[key] for key in raw if key in keys}, keys)
    for key in raw:
        if key not in keys:
            homes = [f"it belongs in [{name}]" for name, table in TABLES.items() if key in table]
            hint = "".join(homes) or nearest(key, keys) or f"known are {', '.join(keys)}"
            wrong.append(Wrong(key, "unknown key", hint))
    return values, wrong


def read_tables(file: str, raw: Mapping[str, object]) -> tuple[dict[str, Any], list[Fault]]:
    """Return what a scene says, by the names of the arguments of `Scene`, and every fault."""
    found, wrong = read_table(SCENE, raw)
    wrong += [Wrong(key, rule) for key, rule in _NEEDED.items() if key not in raw]
    tables = {name: found.pop(name, {}) for name in TABLES}
    top, wrong_top = read_top(tables["top"])
    start, wrong_start = read_start(tables["start"], top)
    span, wrong_span = read_span(tables["span"])
    want, wrong_want = read_table(TABLES["want"], tables["want"])
    every = faults(file, raw, wrong)
    each = {"top": wrong_top, "start": wrong_start, "span": wrong_span, "want": wrong_want}
    for name, wrong in each.items():
        if isinstance(raw.get(name), dict):  # else that it is missing or no table is said already
            every += faults(file, tables[name], wrong, f"{name}.")
    found.pop("format", None)
    return {"top": top, "start": start} | span | want | found, every


# --- the rules between the keys --------------------------------------------------------------


def read_top(raw: Mapping[str, object]) -> tuple[Top | None, list[Wrong]]:
    """Return the top that a [top] table describes: its moments, or the parts they come from."""
    values, wrong = read_table(TABLES["top"], raw)
    moments, parts = [[key for key in style if key in raw] for style in (_MOMENTS, _PARTS)]
    if moments and parts:
        rule = f"either {', '.join(_MOMENTS)} or {', '.join(_PARTS)}, not some of both"
        wrong.append(Wrong(parts[0], rule))
    else:
        wrong += _missing(_PARTS if parts else _MOMENTS, raw) + broken_body(values)
    return (None, wrong) if wrong else _made(Top.from_parts if parts else Top, values)


def read_start(raw: Mapping[str, object], top: Top | None) -> tuple[State | None, list[Wrong]]:
    """Return the state that a [start] table describes: rates, constants or steady precession.

    It is None without faults where it needs a `top` that is not known.
    """
    values, wrong = read_table(TABLES["start"], raw)
    wrong += broken_angles(values)
    if "steady" in raw:
        wrong += _style(raw, _STEADY, 'steady = "slow" or "fast" with theta and omega3')
        make: Callable[..., State] = State.steady
        values = {"which" if key == "steady" else key: value for key, value in values.items()}
    elif any(key in raw for key in ("E", "p_phi", "p_psi", "branch")):
        wrong += _style(raw, _CONSTANTS, "the constants E, p_phi, p_psi with theta and branch")
        make = State.from_constants
    else:
        wrong += broken_spin(raw)
        return (None, wrong) if wrong else _made(State, {"theta": 0} | values)
    return (None, wrong) if wrong or top is None else _made(make, {"top": top} | values)


def _style(raw: Mapping[str, object], keys: tuple[str, ...], style: str) -> list[Wrong]:
    others = TABLES["start"].keys() - {*keys, "phi", "psi"}
    foreign = [Wrong(key, f"does not go with {style}") for key in raw if key in others]
    return _missing(keys, raw) + foreign


def read_span(raw: Mapping[str, object]) -> tuple[dict[str, Any], list[Wrong]]:
    """Return the time or the number of periods of a [span] table."""
    values, wrong = read_table(TABLES["span"], raw)
    empty = [key for key, value in values.items() if not value.sign()]
    wrong += [Wrong(key, "not 0: a span has a length") for key in empty]
    if "time" in raw and "periods" in raw:
        wrong.append(Wrong("periods", "time or periods, not both"))
    elif "time" not in raw and "periods" not in raw and not wrong:
        wrong.append(Wrong("time", "missing: a span is time = … or periods = …"))
    return values, wrong


def _missing(keys: Iterable[str], raw: Mapping[str, object]) -> list[Wrong]:
    return [Wrong(key, "missing") for key in keys if key not in raw]


def _made(make: Callable[..., Any], values: Mapping[str, Any]) -> tuple[Any, list[Wrong]]:
    try:
        return make(**values), []
    except Impossible as error:
        return None, [Wrong(*each) for each in error.broken]


# --- TOML and JSON out -----------------------------------------------------------------------


def written(tables: Mapping[str, object]) -> str:
    """Return the TOML text of a scene: numbers, texts, lists of names and tables of those."""
    lines = []
    for name, value in tables.items():
        if isinstance(value, Mapping):
            lines += ["", f"[{name}]", *(f"{key} = {_toml(x)}" for key, x in value.items())]
        else:
            lines.append(f"{name} = {_toml(value)}")
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    text = str(value)
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, Exact) and ("cos(" in text or "sin(" in text):
        raise NotANumber(f"a scene file holds no cosines or sines, so it cannot say {text}")
    plain = isinstance(value, Exact) and _BARE.fullmatch(text) and len(text) <= _LONGEST_BARE
    if plain or isinstance(value, int):
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def json_ready(value: object) -> Any:
    """Return the same for JSON: a number where 15 digits say it exactly, else its text."""
    if isinstance(value, Mapping):
        return {key: json_ready(item) for key, item in value.items()}
    if not isinstance(value, Exact):
        return list(value) if isinstance(value, tuple) else value
    q = value.fraction
    if q is None or abs(q) >= 10**15 or Fraction(f"{float(q):.15g}") != q:
        return str(value)
    return int(q) if q.denominator == 1 else float(q)
