"""What a scene may say: its tables, key by key, and the rules between the keys.

Each function takes what was read and returns what it makes of it together with everything that is
wrong, so that one reading of a scene finds every fault.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Callable, Collection, Iterable, Mapping
from functools import cache
from typing import Annotated, Any, Final, NamedTuple, TypeAlias

from pydantic import ConfigDict, PlainValidator, TypeAdapter, ValidationError, with_config
from typing_extensions import TypedDict  # before Python 3.12 pydantic reads only these

from heavytop.errors import Impossible
from heavytop.names import nearest
from heavytop.numbers import Exact
from heavytop.numbers.parse import ANGLES, RATES
from heavytop.scene.state import State, broken_angles, broken_spin
from heavytop.scene.text import MAX_TITLE, NumberText
from heavytop.scene.top import Top, broken_moments, broken_parts

FORMAT: Final = 1
QUANTITIES: Final = ("class", "period", "theta", "axis", "phi", "psi", "rates", "attitude")
EVENTS: Final = ("turning", "reversal", "cusp")
MAX_SAMPLES: Final = 10_000_000
MAX_DIGITS: Final = 10_000
_RATES: Final = ("thetadot", "phidot", "psidot")
_RATES_ARE: Final = '{} (did you mean "rates"? it holds thetadot, phidot and psidot)'


class Wrong(NamedTuple):
    """One thing wrong with a table: the key, the rule it breaks, and what would be right."""

    key: str
    rule: str
    hint: str = ""


# --- one value -------------------------------------------------------------------------------


def _number(*units: str) -> PlainValidator:
    return PlainValidator(lambda value: Exact.of(value, units))


def _whole(least: int, most: int) -> PlainValidator:
    def check(value: object) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            digits = ", written in digits alone" if isinstance(value, NumberText) else ""
            raise ValueError(f"a whole number from {least} to {most}{digits}")
        return value

    return PlainValidator(check)


def _text(value: object) -> str:
    if not isinstance(value, str) or isinstance(value, NumberText):
        raise ValueError("a text in quotes")
    if len(value) > MAX_TITLE:
        raise ValueError(f"a text of at most {MAX_TITLE} characters, not {len(value)}")
    if any(_unprintable(letter) for letter in value):
        raise ValueError("a text without control characters")
    return value


def _unprintable(letter: str) -> bool:
    """Controls, line ends, halves of surrogate pairs, no characters, and what turns text around."""
    turning = "\u202a" <= letter <= "\u202e" or "\u2066" <= letter <= "\u2069"
    category = unicodedata.category(letter)
    return turning or category in {"Cc", "Cs", "Zl", "Zp"} or letter in "\ufffe\uffff"


def _choice(*allowed: str) -> PlainValidator:
    def check(value: object) -> str:
        if not isinstance(value, str) or value not in allowed:
            raise ValueError(_with_nearest(f"one of {_listed(allowed)}", value, allowed))
        return str(value)

    return PlainValidator(check)


def _names(allowed: tuple[str, ...], least: int) -> PlainValidator:
    def check(value: object) -> tuple[str, ...]:
        if not isinstance(value, (list, tuple)) or len(value) < least:
            raise ValueError(f'a list of names out of {_listed(allowed)}, such as ["{allowed[0]}"]')
        wrong = [name for name in value if name not in allowed]
        if wrong:
            rule = f"names out of {_listed(allowed)}"
            meant = _RATES_ARE if "rates" in allowed and wrong[0] in _RATES else ""
            raise ValueError(meant.format(rule) or _with_nearest(rule, wrong[0], allowed))
        if len(set(value)) < len(value):
            raise ValueError("a name at most once")
        return tuple(value)

    return PlainValidator(check)


def _table(value: object) -> dict[str, object]:
    if not isinstance(value, dict):
        raise ValueError("a table, not a value")
    return value


def _format(value: object) -> int:
    if value != FORMAT or isinstance(value, (bool, str, float)):
        raise ValueError(f"{FORMAT}, the only format there is")
    return FORMAT


def _listed(names: Iterable[str]) -> str:
    return ", ".join(names)


def _with_nearest(rule: str, value: object, allowed: Collection[str]) -> str:
    hint = nearest(value, allowed)
    return f"{rule} ({hint})" if hint else rule


# --- the tables ------------------------------------------------------------------------------

_STRICT: Final = with_config(ConfigDict(extra="forbid"))  # every key may be left out, none added

# an Exact each; they say Any, so that pydantic does not look into the class
Plain: TypeAlias = Annotated[Any, _number()]
Angle: TypeAlias = Annotated[Any, _number(*ANGLES)]
Rate: TypeAlias = Annotated[Any, _number(*RATES)]
Text: TypeAlias = Annotated[str, PlainValidator(_text)]
Table: TypeAlias = Annotated[dict[str, Any], PlainValidator(_table)]


@_STRICT
class SceneKeys(TypedDict, total=False):
    """A scene file as a whole."""

    format: Annotated[int, PlainValidator(_format)]
    title: Text
    source: Text
    top: Table
    start: Table
    span: Table
    want: Table


@_STRICT
class TopKeys(TypedDict, total=False):
    """[top]: the moments about the pivot, or the parts they come from."""

    A: Plain
    C: Plain
    gMR: Plain
    mass: Plain
    distance: Plain
    gravity: Plain
    A_cm: Plain
    C_cm: Plain


@_STRICT
class StartKeys(TypedDict, total=False):
    """[start]: angles and rates, or constants of the motion, or a steady precession."""

    theta: Angle
    thetadot: Rate
    phi: Angle
    phidot: Rate
    psi: Angle
    psidot: Rate
    omega3: Rate
    E: Plain
    p_phi: Plain
    p_psi: Plain
    branch: Annotated[str, _choice("falling", "rising")]
    steady: Annotated[str, _choice("slow", "fast")]


@_STRICT
class SpanKeys(TypedDict, total=False):
    """[span]: how long."""

    time: Plain
    periods: Plain


@_STRICT
class WantKeys(TypedDict, total=False):
    """[want]: what of the motion, how finely, how well."""

    quantities: Annotated[tuple[str, ...], _names(QUANTITIES, least=1)]
    events: Annotated[tuple[str, ...], _names(EVENTS, least=0)]
    samples: Annotated[int, _whole(2, MAX_SAMPLES)]
    digits: Annotated[int, _whole(1, MAX_DIGITS)]


TABLES: Final = {"top": TopKeys, "start": StartKeys, "span": SpanKeys, "want": WantKeys}


@cache
def _reader(keys: type) -> TypeAdapter[dict[str, Any]]:
    return TypeAdapter(keys)


def checked(keys: type, raw: Mapping[str, object]) -> tuple[dict[str, Any], list[Wrong]]:
    """Read a table key by key: the values that are right, and what is wrong with the others."""
    try:
        return _reader(keys).validate_python(raw), []
    except ValidationError as error:
        wrong = [_wrong(keys, details) for details in error.errors(include_url=False)]
    bad = {fault.key for fault in wrong}
    kept = {key: value for key, value in raw.items() if key not in bad}
    return _reader(keys).validate_python(kept), wrong


def _wrong(keys: type, details: Any) -> Wrong:
    key = str(details["loc"][0])
    if details["type"] != "extra_forbidden":
        return Wrong(key, str(details["ctx"]["error"]))
    home = [name for name, table in TABLES.items() if key in table.__annotations__]
    hint = f"it belongs in [{home[0]}]" if home else nearest(key, keys.__annotations__)
    return Wrong(key, "unknown key", hint or f"known are {_listed(keys.__annotations__)}")


# --- the rules between the keys --------------------------------------------------------------

_NEEDED: Final = {"format": f"missing: a scene begins with format = {FORMAT}"} | {
    table: f"missing: a scene has a table [{table}]" for table in ("top", "start", "span")
}
_MOMENTS: Final = ("A", "C", "gMR")
_PARTS: Final = ("mass", "distance", "gravity", "A_cm", "C_cm")
_CONSTANTS: Final = ("E", "p_phi", "p_psi", "theta", "branch")
_STEADY: Final = ("steady", "theta", "omega3")


def read_scene_keys(raw: Mapping[str, object]) -> tuple[dict[str, Any], list[Wrong]]:
    """The tables of a scene and its titles; a table that is missing or wrong is empty."""
    values, wrong = checked(SceneKeys, raw)
    wrong += [Wrong(key, rule) for key, rule in _NEEDED.items() if key not in raw]
    return {name: {} for name in TABLES} | values, wrong


def read_top(raw: Mapping[str, object]) -> tuple[Top | None, list[Wrong]]:
    """The top a [top] table describes."""
    values, wrong = checked(TopKeys, raw)
    moments, parts = [[key for key in style if key in raw] for style in (_MOMENTS, _PARTS)]
    if moments and parts:
        rule = f"either {_listed(_MOMENTS)} or {_listed(_PARTS)}, not some of both"
        wrong += [Wrong(parts[0], rule)]
    elif parts:
        wrong += _missing(_PARTS, raw) + _as_wrong(broken_parts(values))
    else:
        wrong += _missing(_MOMENTS, raw) + _as_wrong(broken_moments(values))
    if wrong:
        return None, wrong
    return _made(Top.from_parts if parts else Top, values)


def read_start(raw: Mapping[str, object], top: Top | None) -> tuple[State | None, list[Wrong]]:
    """The start a [start] table describes; None without faults where `top` is not known."""
    values, wrong = checked(StartKeys, raw)
    wrong += _as_wrong(broken_angles(values))
    if "steady" in raw:
        wrong += _style(raw, _STEADY, 'steady = "slow" or "fast" with theta and omega3')
        make: Callable[..., State] = State.steady
        values = {"which" if key == "steady" else key: value for key, value in values.items()}
    elif any(key in raw for key in ("E", "p_phi", "p_psi", "branch")):
        wrong += _style(raw, _CONSTANTS, "the constants E, p_phi, p_psi with theta and branch")
        make = State.from_constants
    else:
        wrong += _as_wrong(broken_spin(raw))
        return (None, wrong) if wrong else _made(State, {"theta": 0} | values)
    return (None, wrong) if wrong or top is None else _made(make, {"top": top} | values)


def _style(raw: Mapping[str, object], keys: tuple[str, ...], style: str) -> list[Wrong]:
    foreign = [key for key in raw if key in StartKeys.__annotations__]
    foreign = [key for key in foreign if key not in (*keys, "phi", "psi")]
    return _missing(keys, raw) + [Wrong(key, f"does not go with {style}") for key in foreign]


def read_span(raw: Mapping[str, object]) -> tuple[dict[str, Any], list[Wrong]]:
    """The time or the number of periods of a [span] table."""
    values, wrong = checked(SpanKeys, raw)
    for key, value in values.items():
        if not value.sign():
            wrong.append(Wrong(key, "not 0: a span has a length"))
    if "time" in raw and "periods" in raw:
        wrong.append(Wrong("periods", "time or periods, not both"))
    elif "time" not in raw and "periods" not in raw and not wrong:
        wrong.append(Wrong("time", "missing: a span is time = … or periods = …"))
    return values, wrong


def _missing(keys: Iterable[str], raw: Mapping[str, object]) -> list[Wrong]:
    return [Wrong(key, "missing") for key in keys if key not in raw]


def _as_wrong(broken: Iterable[tuple[str, str]]) -> list[Wrong]:
    return [Wrong(key, rule) for key, rule in broken]


def _made(make: Callable[..., Any], values: Mapping[str, Any]) -> tuple[Any, list[Wrong]]:
    try:
        return make(**values), []
    except Impossible as error:
        return None, _as_wrong(error.broken)
