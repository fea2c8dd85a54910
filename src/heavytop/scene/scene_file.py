"""Scene files: reading and writing of TOML, the readers of each key, the shipped scenes.

A function that reads a table returns its values and all its faults, so that one reading of a scene
finds every fault.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from heavytop.errors import BadScene, Fault, Impossible, Refused
from heavytop.exact import Exact
from heavytop.scene import arguments, starts
from heavytop.scene.arguments import NumberText, Range, Reader
from heavytop.scene.quantities import QUANTITY_READERS, wanted
from heavytop.scene.state import State
from heavytop.scene.top import TOP, Top
from heavytop.text import nearest

FORMAT: Final = 1
EVENTS: Final = ("turning", "reversal", "cusp")
MAX_SAMPLES: Final = 10_000_000
MAX_DIGITS: Final = 10_000
MAX_TITLE: Final = 500

_HEADER: Final = re.compile(r"\s*\[\s*([\w.-]+)\s*\]")
_KEY: Final = re.compile(r"\s*([\w.-]+|\"[^\"]*\"|'[^']*')\s*=")
_BARE: Final = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][-+]?[0-9]+)?")
_LONGEST_BARE: Final = 100
_CONTROLS: Final = {"Cc", "Cf", "Cn", "Cs", "Zl", "Zp"}  # Unicode categories: controls, unassigned


# --- TOML in ---------------------------------------------------------------------------------


def parse(text: str) -> dict[str, Any]:
    """Return the tables of a TOML text, decimals as they are spelled; a ValueError names the line.

    >>> parse("x = 1.50")
    {'x': '1.50'}
    """
    try:
        return tomllib.loads(text, parse_float=_decimal)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # of int()
        raise ValueError("an integer has more than 4300 digits") from None
    except RecursionError:
        raise ValueError("tables or lists are nested too deeply") from None


def _decimal(spelling: str) -> NumberText | float:
    """A TOML float as it is spelled, without underscores; inf and nan as floats."""
    spelling = spelling.replace("_", "")
    return float(spelling) if spelling[-1].isalpha() else NumberText(spelling)  # inf and nan


def written_keys(text: str) -> Iterator[tuple[int, str, str]]:
    """Yield line, dotted name and spelled value of every table and key; tomllib has no lines."""
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = header[1] + "."
            yield number, header[1], ""
        elif key := _KEY.match(line):
            value = line[key.end() :].partition("#")[0].strip()
            yield number, table + key[1].strip("\"'"), value


# --- one value -------------------------------------------------------------------------------


def _text(value: object) -> str:
    """A title or a source; `Refused` where it is no text, too long, or has control characters."""
    if not isinstance(value, str) or isinstance(value, NumberText):
        raise Refused("a text in quotes")
    if len(value) > MAX_TITLE:
        raise Refused(f"a text of at most {MAX_TITLE} characters, not {len(value)}")
    if any(unicodedata.category(letter) in _CONTROLS for letter in value):
        raise Refused("a text without control characters")
    return value


def _names(known: Callable[[], tuple[str, ...]], least: int) -> Reader:
    """The reader of a list of at least so many known names, each at most once."""

    def read(value: object) -> tuple[str, ...]:
        allowed = known()
        rule = f'a list such as ["{allowed[2]}"] of {", ".join(allowed)}, each at most once'
        if not isinstance(value, list | tuple) or len(value) < least:
            raise Refused(rule)
        wrong = [name for name in value if name not in allowed]
        if wrong or len({*value}) < len(value):
            raise Refused(rule, nearest(wrong[0], allowed) if wrong else "")
        return tuple(value)

    return read


def _format(value: object) -> int:
    if value != FORMAT or isinstance(value, bool | str | float):
        raise Refused(f"{FORMAT}, the only format there is")
    return FORMAT


# --- the keys --------------------------------------------------------------------------------

TABLES: Final[Mapping[str, Mapping[str, Reader]]] = {
    "top": TOP,
    "start": starts.START_READERS,
    "span": {name: arguments.not_zero(QUANTITY_READERS[name]) for name in ("time", "periods")},
    "want": {
        "quantities": _names(wanted, least=1),
        "events": _names(lambda: EVENTS, least=0),
        "samples": Range(2, MAX_SAMPLES, whole=True),
        "digits": Range(1, MAX_DIGITS, whole=True),
    },
}
SCENE_READERS: Final[Mapping[str, Reader]] = {
    "format": _format,
    "title": _text,
    "source": _text,
    **dict.fromkeys(TABLES, arguments.instance_of(dict)),
}
_NEEDED: Final = {"format": f"missing: a scene begins with format = {FORMAT}"} | {
    table: f"missing: a scene has a table [{table}]" for table in ("top", "start")
}
_HOMES: Final = {key: name for name, keys in TABLES.items() for key in keys}
_MEANT: Final = {  # keys that people try, and what they are called here
    **dict.fromkeys(("I", "I1", "I_1", "Ixx"), "A, about the pivot, or A_cm"),
    **dict.fromkeys(("I3", "I_3", "Izz"), "C, about the axis"),
    **dict.fromkeys(("m", "M"), "mass"), "g": "gravity",
    **dict.fromkeys(("l", "L", "R", "d"), "distance, from the pivot to the centre of mass"),
    **dict.fromkeys(("radius", "thickness", "height"), "solids, which have shape and size"),
    "spin": "psidot, or omega3, along the axis",
    **dict.fromkeys(("omega", "angular_velocity"), "omega3, a number, or omega_body, a vector"),
    "tilt": "theta", "nutation": "thetadot", "precession": "phidot",
}  # fmt: skip
_SPAN: Final = arguments.Way("a span", (), dict, (("time", "periods"),))


# --- reading tables --------------------------------------------------------------------------


def read_span(raw: Mapping[str, object]) -> dict[str, Exact]:
    """Return the time or the periods of a table; raise `Impossible` where it has both."""
    return arguments.exact_numbers(Impossible, _SPAN, raw, TABLES["span"])


def faults_of(
    error: Impossible, file: str, given: Mapping[str, object], table: str = ""
) -> list[Fault]:
    """Return the faults of an error, each with file, key and value."""
    shown = {key: arguments.value_text(value) for key, value in given.items()}
    return [
        replace(fault, file=file, key=table + fault.key, value=shown.get(fault.key, ""))
        for fault in error.faults
        if fault.key != starts.WITHOUT_TOP  # the faults of the top say why
    ]


def read_tables(file: str, raw: Mapping[str, object]) -> tuple[dict[str, Any], list[Fault]]:
    """Return the arguments of `Scene` that the tables of a file give, and every fault."""
    found, faults = arguments.parse_options(file, raw, SCENE_READERS)
    faults += [Fault(file, None, key, "", rule) for key, rule in _NEEDED.items() if key not in raw]
    tables = {name: found.pop(name) for name in TABLES if name in found}  # the top before the start
    wants, of_wants = arguments.parse_options(file, tables.pop("want", {}), TABLES["want"], "want.")
    faults += of_wants
    for name, table in tables.items():
        try:
            if name == "top":
                found["top"] = Top.of(table)
            elif name == "start":
                found["start"] = State.of(table, found.get("top"))
            else:
                found |= read_span(table)
        except Impossible as error:
            faults += faults_of(error, file, table, f"{name}.")
    found.pop("format", None)
    return found | wants, [*map(_add_hint, faults)]


def _add_hint(fault: Fault) -> Fault:
    """Return a fault; of an unknown key with its table, or with its name in this package."""
    table, _, key = fault.key.rpartition(".")
    home, meant = _HOMES.get(key, table), _MEANT.get(key)
    if not fault.rule.startswith("unknown key") or (home == table and not meant):
        return fault
    hint = f"it belongs in [{home}]: {home}.{key}" if home != table else f"did you mean {meant}?"
    return replace(fault, rule="unknown key", hint=hint)


# --- TOML and JSON out -----------------------------------------------------------------------


def toml_text(tables: Mapping[str, object]) -> str:
    """Return the TOML text of a scene: numbers, texts, lists and tables of those."""
    lines = []
    for name, value in tables.items():
        if not isinstance(value, Mapping):
            lines.append(f"{name} = {_toml(value)}")
        elif value:
            lines += ["", f"[{name}]", *(f"{key} = {_toml(x)}" for key, x in value.items())]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    text = str(value)
    if isinstance(value, bool):
        return text.lower()
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_toml, value))}]"
    plain = isinstance(value, Exact) and _BARE.fullmatch(text) and len(text) <= _LONGEST_BARE
    if plain or isinstance(value, int | float):
        return text
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def json_ready(value: object) -> Any:
    """Return a value for JSON: numbers where 15 digits are exact, else their exact text."""
    if isinstance(value, Mapping):
        return {key: json_ready(item) for key, item in value.items()}
    if not isinstance(value, Exact):
        return [json_ready(item) for item in value] if isinstance(value, tuple) else value
    q = value.fraction
    if q is None or abs(q) >= 10**15 or Fraction(f"{float(q):.15g}") != q:
        return str(value)
    return int(q) if q.denominator == 1 else float(q)


# --- the scenes that come with the package ------------------------------------------------------


FOLDER: Final = Path(__file__).parents[1] / "scenes"


def shipped_scenes() -> dict[str, str]:
    """The scenes that come with the package.

    Returns
    -------
    dict from str to str
        Their titles, by their names.

    Examples
    --------
    >>> shipped_scenes()["sicm-dropped"]
    'SICM 2.10, let go from rest: cusps'
    """
    texts = {name: shipped_text(name) for name in shipped_names()}
    return {name: parse(text)["title"] for name, text in texts.items()}


def shipped_text(name: str) -> str:
    """The text of a scene that comes with the package, comments and all.

    Parameters
    ----------
    name : str
        A key of `shipped_scenes`.

    Returns
    -------
    str

    Raises
    ------
    BadScene
        No shipped scene has this name.

    Examples
    --------
    >>> print(shipped_text("sicm-dropped").splitlines()[0])
    format = 1
    """
    if name not in shipped_names():
        hint = nearest(name, shipped_names())
        raise BadScene((Fault(name, None, "scene", "", "no shipped scene has this name", hint),))
    return (FOLDER / f"{name}.toml").read_text("utf-8")


def shipped_names() -> list[str]:
    """The names of the scenes that come with the package, in alphabetical order."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))
