"""Arguments: what a function is given is what it takes, or an error says what that would be."""

from __future__ import annotations

import operator
import os
from pathlib import Path
from typing import Final

from heavytop.errors import Impossible, NotANumber, WrongType
from heavytop.names import LONGEST
from heavytop.numbers import Exact, Number
from heavytop.scene.text import shown

_PLAIN: Final = (str, bytes, int, float, type(None))  # which are known best by their value


def expect(name: str, value: object, kind: type, hint: str = "") -> None:
    """Refuse an argument that is not of a type.

    Parameters
    ----------
    name : str
    value : object
    kind : type
    hint : str
        Where one is to be had.

    Raises
    ------
    WrongType

    Examples
    --------
    >>> expect("top", "sicm", float)
    Traceback (most recent call last):
    ...
    heavytop.errors.WrongType: top: a float, not "sicm"
    """
    if not isinstance(value, kind):
        what = _a(kind) + (f" ({hint})" if hint else "")
        raise wrong_type(name, what, value)


def path_of(name: str, value: object) -> Path:
    """Return the path that an argument is.

    Raises
    ------
    WrongType
        It is neither a text nor an object that stands for one, as a `pathlib.Path` does.
    """
    found = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(found, str):
        raise wrong_type(name, "a path", value)
    return Path(found)


def number_of(name: str, value: Number) -> Exact:
    """Return the exact number that an argument is.

    Raises
    ------
    NotANumber
        It is none; the message names the argument.
    """
    try:
        return Exact.of(value)
    except NotANumber as wrong:
        raise NotANumber(f"{name}: {wrong}") from None


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return the whole number that an argument is.

    Raises
    ------
    NotANumber
        It is none.
    Impossible
        It is out of bounds.

    Examples
    --------
    >>> whole("digits", "x", 1, 10)
    Traceback (most recent call last):
    ...
    heavytop.errors.NotANumber: digits: a whole number from 1 to 10, not "x"
    """
    bounds = f", at least {least}" if most is None else f" from {least} to {most}"
    try:
        found = operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        found = None
    if found is None or isinstance(value, bool):
        raise NotANumber(f"{name}: a whole number{bounds}, not {told(value)}")
    if found < least or (most is not None and found > most):
        raise Impossible([(name, f"a whole number{bounds}")])
    return found


def heard(name: str, value: object) -> None:
    """Refuse what is to be told of progress, if it is there and no function.

    Raises
    ------
    WrongType
    """
    if not (value is None or callable(value)):
        raise wrong_type(name, "a function", value)


def text_of(name: str, value: object) -> str:
    """Return the text that an argument is.

    Raises
    ------
    WrongType
        It is none.
    """
    if not isinstance(value, str):
        raise wrong_type(name, "a text", value)
    return value


def wrong_type(name: str, what: str, value: object) -> WrongType:
    """Return what refuses a value that is not what an argument takes, in words."""
    return WrongType(f"{name}: {what}, not {told(value)}")


def told(value: object) -> str:
    """Return what a message calls a value: itself where it is short, else its type."""
    return shown(value) if isinstance(value, _PLAIN) else _a(type(value))


def _a(kind: type) -> str:
    name = kind.__name__[:LONGEST]
    return f"an {name}" if name[0] in "aeiouAEIOU" else f"a {name}"
