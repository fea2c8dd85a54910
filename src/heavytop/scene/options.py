"""Options: what may be given for each, and everything that is wrong with what is."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from decimal import Decimal
from numbers import Real
from typing import Any, TypeVar

from heavytop.errors import Fault
from heavytop.names import LONGEST, listed, nearest
from heavytop.scene.text import shown
from heavytop.spelling import harmless

T = TypeVar("T")


class Refused(ValueError):
    """A value that an option does not take, and the rule that says so.

    Attributes
    ----------
    rule : str
    hint : str
        What may have been meant; empty where nothing is near.
    """

    def __init__(self, rule: str, hint: str = "") -> None:
        super().__init__(rule, hint)
        self.rule, self.hint = rule, hint

    def __str__(self) -> str:
        return f"{self.rule} ({self.hint})" if self.hint else self.rule


@dataclass(frozen=True, slots=True)
class Number:
    """Numbers within bounds, which belong to them.

    Attributes
    ----------
    least, most : float
    whole : bool
        Whether only integers will do, of Python's or of numpy's kind.

    Examples
    --------
    >>> Number(1, 1e6)(100), Number(1, 1024, whole=True)(2)
    (100.0, 2)
    >>> Number(1, 1024, whole=True)(2.5)
    Traceback (most recent call last):
    ...
    heavytop.scene.options.Refused: a whole number from 1 to 1024
    """

    least: float
    most: float
    whole: bool = False

    def __call__(self, value: object) -> Any:
        """Return a value as a plain number.

        Raises
        ------
        Refused
            It is no number (a truth value is none), not whole, or out of the bounds.
        """
        found = _whole(value) if self.whole else _real(value)
        if found is None or not self.least <= found <= self.most:  # nan too
            raise Refused(self.rule)
        return found

    @property
    def rule(self) -> str:
        """The rule, in words."""
        kind = "a whole number" if self.whole else "a number"
        return f"{kind} from {_short(self.least)} to {_short(self.most)}"


def taken(
    file: str, given: Mapping[str, object], table: Mapping[str, Callable[[object], Any]]
) -> tuple[dict[str, Any], list[Fault]]:
    """Return what options stand for, and what is wrong with the others.

    Parameters
    ----------
    file : str
        What the faults name.
    given : mapping from str to object
    table : mapping from str to callable
        By option, what reads it, or raises `Refused`: a `Number`, a name out of a list (`one_of`).

    Examples
    --------
    >>> taken("drift", {"jobs": 0, "seed": 3}, {"jobs": Number(1, 9), "seed": Number(0, 9)})[0]
    {'seed': 3.0}
    """
    values, faults = {}, []
    for key, value in given.items():
        try:
            values[key] = table[key](value)
        except Refused as wrong:
            faults.append(Fault(file, None, key, shown(value), wrong.rule, wrong.hint))
    return values, faults


def named(
    file: str, key: str, given: object, read: Callable[[str], T]
) -> tuple[list[T], list[Fault]]:
    """Return what the names of a list stand for, and what is wrong with the others.

    Parameters
    ----------
    file, key : str
        What the faults name; the key is a plural.
    given : iterable of str
        At least one name.
    read : callable
        Takes a name, or raises `Refused`.

    Examples
    --------
    >>> found, faults = named("stress", "cases", ["cups"], one_of({"cusp": 1}))
    >>> print(faults[0])
    stress: cases = cups: one of cusp (did you mean "cusp"?)
    """
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        return [], [Fault(file, None, key, shown(given), "a sequence of names")]
    try:
        every = list(given)
    except TypeError:  # an array of no dimension
        return [], [Fault(file, None, key, shown(given), "a sequence of names")]
    found, faults = [], []
    for name in every:
        try:
            found.append(read(_text(name)))
        except Refused as wrong:
            faults.append(Fault(file, None, key, _told(name), wrong.rule, wrong.hint))
    if not every:
        faults.append(Fault(file, None, key, "", f"at least one {key.removesuffix('s')}"))
    return found, faults


def one_of(known: Mapping[str, T], everything: str = "") -> Callable[[object], T]:
    """Return what reads a name out of a table, of which `everything` says where all is listed."""

    def read(value: object) -> T:
        if not isinstance(value, str) or value not in known:
            raise Refused(f"one of {listed(value, known, everything)}", nearest(value, known))
        return known[value]

    return read


def _text(name: object) -> str:
    if not isinstance(name, str):
        raise Refused("a name, as text")
    return name


def _told(name: object) -> str:
    """Return a name for a message: without quotes, where there is anything between them."""
    return harmless(name[:LONGEST]) if isinstance(name, str) and name else shown(name)


def _whole(value: object) -> int | None:
    if isinstance(value, bool):
        return None
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        return None


def _real(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, Real | Decimal):
        return None
    try:
        return float(value)
    except (OverflowError, ValueError):  # longer than any float; a signalling nan
        return None


def _short(bound: float) -> str:
    """Return a bound in few digits, where those are all that it has."""
    short = f"{bound:g}"
    return short if float(short) == bound else str(bound)
