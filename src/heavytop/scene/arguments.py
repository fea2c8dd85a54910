"""Checks of arguments, with errors that say what would be right.

Checks of single arguments raise at once. Options and lists of names are read as a whole, so that
every fault is listed. Top and State read their numbers here too.
"""

from __future__ import annotations

import math
import numbers
import operator
import os
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias, TypeVar

from heavytop.errors import BadScene, Fault, Impossible, Refused, WrongType
from heavytop.exact import Exact
from heavytop.exact.parse import text_of
from heavytop.text import LONGEST_NAME, cut, nearest, printable, with_article

T = TypeVar("T")
Reader: TypeAlias = Callable[[object], Any]  # of one value; raises `Refused`

_LONGEST_VALUE: Final = 60  # characters of a value, in a message
_PRINTED_TYPES: Final = str, bytes, numbers.Number, Exact, type(None)  # others are named by type


# --- values in messages ----------------------------------------------------------------------


class NumberText(str):
    """A decimal as TOML spells it: a number, where a plain str would be a text."""

    __slots__ = ()


def value_text(value: object) -> str:
    """Return a value for a message: its text, cut to 60 characters, or the name of its type."""
    try:
        text = _full_text(value)
    except (RecursionError, ValueError):  # nested too deeply, or an integer too long to print
        text = _type_name(type(value))
    return cut(text, _LONGEST_VALUE)


def _full_text(value: object) -> str:
    """The text of a value, spelled as in TOML where there is a spelling."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str) and not isinstance(value, NumberText):
        return f'"{printable(value[:100])}"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(_full_text(item) for item in value[:20])}]"
    if isinstance(value, os.PathLike):
        return _full_text(os.fspath(value))
    return printable(str(value)) if isinstance(value, _PRINTED_TYPES) else _type_name(type(value))


def _type_name(kind: type) -> str:
    """The name of a type with its article; a str is a text, a dict a table."""
    name = kind.__name__[:LONGEST_NAME]
    return with_article({"str": "text", "dict": "table"}.get(name, name))


def short_text(x: Exact) -> str:
    """Return a number for a message: exact in at most 24 characters, else to 17 digits."""
    exact = text_of(x)
    return exact if x.fraction is not None and len(exact) <= 24 else f"{float(x):.17g}"


# --- one argument ----------------------------------------------------------------------------


def wrong_type(name: str, what: str, value: object) -> WrongType:
    """Return the error for a value of a wrong type; `what` says in words what is taken."""
    return WrongType(f"{name}: {what}, not {value_text(value)}")


def expect(name: str, value: object, kind: type[T], hint: str = "") -> T:
    """Return an argument of a type; raise `WrongType` for another, with a hint where one is had.

    >>> expect("top", "sicm", float)
    Traceback (most recent call last):
    ...
    heavytop.errors.WrongType: top: a float, not "sicm"
    """
    if not isinstance(value, kind):
        raise wrong_type(name, _type_name(kind) + (f" ({hint})" if hint else ""), value)
    return value


def path_of(name: str, value: object) -> Path:
    """Return the path of an argument, a text or path-like; raise `WrongType` for anything else."""
    if isinstance(value, str | os.PathLike) and isinstance(found := os.fspath(value), str):
        return Path(found)
    raise wrong_type(name, "a path", value)


def check_callable(name: str, value: object) -> None:
    """Raise `WrongType` for an argument that is neither a function nor None."""
    if not (value is None or callable(value)):
        raise wrong_type(name, "a function", value)


def read_argument(name: str, value: object, read: Reader) -> Any:
    """Return the value that a reader makes of an argument; raise `Impossible` where it refuses.

    >>> read_argument("digits", "x", Range(1, 10, whole=True))
    Traceback (most recent call last):
    ...
    heavytop.errors.Impossible: digits = "x": a whole number from 1 to 10
    """
    values, faults = parse_options("", {name: value}, {name: read})
    if faults:
        raise Impossible(faults)
    return values[name]


def integer(name: str, value: object, least: int, most: float = math.inf) -> int:
    """Return an argument as an int; raise `Impossible` where it is none from `least` to `most`."""
    return int(read_argument(name, value, Range(least, most, whole=True)))


# --- options and lists of names --------------------------------------------------------------


@contextmanager
def gather(broken: Broken | None = None) -> Iterator[Callable[..., Any]]:
    """Collect the `Impossible` that functions raise, and raise all of them together at the end.

    >>> with gather() as attempt:
    ...     attempt(integer, "jobs", 0, 1), attempt(integer, "seed", 7, 1)
    Traceback (most recent call last):
    ...
    heavytop.errors.Impossible: jobs = 0: a whole number, at least 1
    """
    refusals = [Impossible(broken)] if broken else []

    def attempt(function: Callable[..., Any], *given: Any, **options: Any) -> Any:
        try:
            return function(*given, **options)
        except Impossible as refusal:
            refusals.append(refusal)

    yield attempt
    if len(refusals) > 1:
        raise BadScene(fault for each in refusals for fault in each.faults)
    if refusals:
        raise refusals[0]


def parse_options(
    file: str, given: Mapping[str, object], readers: Mapping[str, Reader], table: str = ""
) -> tuple[dict[str, Any], list[Fault]]:
    """Return the valid values, each as its reader makes it, and a fault for each other one.

    Faults name `file`, and keys with `table` before them.

    >>> readers = {"jobs": Range(1, 9), "seed": Range(0, 9)}
    >>> parse_options("drift", {"jobs": 0, "seed": 3}, readers)[0]
    {'seed': 3.0}
    """
    values, faults = {}, []
    for key, value in given.items():
        try:
            if key not in readers:
                known = f"known are {', '.join(readers)}"
                raise Refused("unknown key", nearest(key, readers) or known)
            values[key] = readers[key](value)
        except Refused as wrong:
            faults.append(Fault(file, None, table + key, value_text(value), wrong.rule, wrong.hint))
    return values, faults


@dataclass(frozen=True, slots=True)
class Range:
    """A reader of numbers from `least` to `most`, both included: real ones, or integers alone.

    >>> Range(1, 1e6)(100), Range(1, 1024, whole=True)(2)
    (100.0, 2)
    >>> Range(1, 1024, whole=True)(2.5)
    Traceback (most recent call last):
    ...
    heavytop.errors.Refused: a whole number from 1 to 1024
    """

    least: float
    most: float
    whole: bool = False

    def __call__(self, value: object) -> Any:
        """Return a value as a float or an int; raise `Refused` outside the bounds."""
        found: Any = math.nan
        with suppress(TypeError, OverflowError, ValueError):  # longer than any float; an sNaN
            if self.whole:
                found = operator.index(value)  # type: ignore[arg-type]
            elif isinstance(value, numbers.Real | Decimal):
                found = float(value)
        if not isinstance(value, bool) and self.least <= found <= self.most:
            return found
        kind, style = ("a whole number", "d") if self.whole else ("a number", "g")
        if self.most == math.inf:
            raise Refused(f"{kind}, at least {self.least:{style}}")
        raise Refused(f"{kind} from {self.least:{style}} to {self.most:{style}}")


def restrict(read: Reader, fits: Callable[[Any], object], rule: str) -> Reader:
    """Return a reader that reads as another does, and refuses values that do not fit."""

    def read_fitting(value: object) -> Any:
        found = read(value)
        if not fits(found):
            raise Refused(rule)
        return found

    return read_fitting


def instance_of(kind: type) -> Reader:
    """Return a reader that takes the values of a type, unchanged."""
    return restrict(lambda value: value, lambda value: isinstance(value, kind), _type_name(kind))


JOBS: Final = Range(1, 1024, whole=True)  # processes, or threads
positive = partial(restrict, fits=lambda x: x.sign() == 1, rule="must be greater than 0")
not_negative = partial(restrict, fits=lambda x: x.sign() != -1, rule="must not be negative")
not_zero = partial(restrict, fits=Exact.sign, rule="not 0: a span has a length")


def one_of(known: Mapping[str, T]) -> Callable[[object], T]:
    """Return a reader that takes a name, and gives its value in a table."""

    def read(value: object) -> T:
        if not isinstance(value, str) or value not in known:
            raise Refused(f"one of {', '.join(known)}", nearest(value, known))
        return known[value]

    return read


def items_of(value: Any) -> list[Any] | None:
    """Return the items of a sequence or an array as a list; None of a text or a single value."""
    with suppress(TypeError):  # of an array of no dimension too
        return None if isinstance(value, str | bytes) else list(value)
    return None


def parse_names(
    file: str, key: str, given: object, read: Callable[[Any], T], kinds: Any = str, least: int = 1
) -> tuple[list[T], list[Fault]]:
    """Return the values that names stand for, and a fault for each name that stands for none.

    Names are of the types `kinds`, and at least `least` of them; `read` returns the value of one,
    or raises `Refused`. Faults name `file` and `key`, which is a plural.

    >>> found, wrong = parse_names("stress", "cases", ["cups"], one_of({"cusp": 1}))
    >>> print(wrong[0])
    stress: cases = cups: one of cusp (did you mean "cusp"?)
    """
    names = items_of(given)
    if names is None:
        return [], [Fault(file, None, key, value_text(given), "a sequence of names")]
    found, faults = [], []
    for name in names:
        try:
            if not isinstance(name, kinds):
                raise Refused("a name, as text")
            found.append(read(name))
        except Refused as wrong:
            value = name[:LONGEST_NAME] if name and isinstance(name, str) else value_text(name)
            faults.append(Fault(file, None, key, value, wrong.rule, wrong.hint))
    if len(names) < least:
        faults.append(Fault(file, None, key, "", f"at least one {key.removesuffix('s')}"))
    return found, faults


# --- the numbers of a scene ------------------------------------------------------------------

Numbers: TypeAlias = Mapping[str, Exact]
Broken: TypeAlias = list[tuple[str, str]]
"""Names of values, and the rules that they break."""


class Way(NamedTuple):
    """A set of names that determine a thing: one name out of each slot, or out of `needed` slots.

    `make` computes the thing from the values, by name; `optional` slots may stay empty.
    """

    name: str
    slots: tuple[tuple[str, ...], ...]
    make: Callable[..., dict[str, Any]]
    optional: tuple[tuple[str, ...], ...] = ()
    needed: int | None = None  # of the slots; all of them

    def lacking(self, given: Collection[str]) -> list[tuple[str, ...]]:
        """The slots of which no name is given."""
        return [slot for slot in self.slots if not {*slot} & {*given}]

    def foreign(self, given: Collection[str]) -> list[str]:
        """The names that belong in no slot."""
        return [name for name in given if not any(name in x for x in self.slots + self.optional)]

    def distance(self, given: Collection[str]) -> float:
        """The share of empty slots, plus the number of names that belong in none."""
        return len(self.lacking(given)) / len(self.slots) + len(self.foreign(given))


@lru_cache(64)  # most tops and starts are given by the same few names
def broken_names(way: Way, given: tuple[str, ...]) -> Broken:
    """Return the names that are missing, excluded by another, or foreign to a way, and why."""
    broken: Broken = []
    for slot in (*way.slots, *way.optional):
        first, *more = [name for name in slot if name in given] or [""]
        broken += [(name, f"give {first} or {name}, not both") for name in more]
    broken += [(name, f"does not go with {way.name}") for name in way.foreign(given)]
    lacking = way.lacking(given)
    needed = len(way.slots) if way.needed is None else way.needed
    count = needed - len(way.slots) + len(lacking)
    listed = ", ".join(" or ".join(slot) for slot in (lacking if count > 0 else way.slots))
    if count > 0:
        which = "" if count == len(lacking) else f"{count} more of "
        broken.append((lacking[0][0], f"missing for {way.name}: {which}{listed}"))
    if count < 0:
        broken.append((way.slots[0][0], f"one too many for {way.name}: {needed} of {listed}"))
    return [*dict.fromkeys(broken)]


def exact_numbers(
    refused: type[Impossible], way: Way, given: Mapping[str, object], readers: Mapping[str, Reader]
) -> dict[str, Any]:
    """Return the values of a way as exact numbers; raise `refused` with all faults at once."""
    values, faults = parse_options("", given, readers)
    broken = broken_names(way, tuple(name for name in given if name in readers))
    if faults or broken:
        raise refused((*faults, *broken))
    return values


def drop_none(**values: object) -> dict[str, Any]:
    """Return the values that are not None, by their names."""
    return {name: value for name, value in values.items() if value is not None}


def set_fields(instance: object, values: Mapping[str, object]) -> None:
    """Set fields of a frozen instance, in its `__init__`."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def call_text(name: str, /, **values: object) -> str:
    """Return the text of the call that makes an instance, with exact numbers as texts."""
    texts = {key: str(x) if isinstance(x, Exact) else x for key, x in values.items()}
    return f"{name}({', '.join(f'{key}={value!r}' for key, value in texts.items())})"
