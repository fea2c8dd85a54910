"""Documents that anybody may have written: read within bounds, and held against a shape."""

from __future__ import annotations

import json
import unicodedata
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from heavytop.errors import ForeignFile

MOST_BYTES: Final = 64 * 2**20  # of a document
MOST_VALUES: Final = 3_000_000
DEEPEST: Final = 40  # indented by so much, a page of lists is still of their size
MOST_LETTERS: Final = 20_000  # of a text: a decimal of so many digits is still one
LARGEST: Final = 1e300  # of a number: its square is still one

Wrong = str | None
Shape = Callable[[Any], Wrong]
FAULTS: Final = (KeyError, IndexError, TypeError, ValueError, AttributeError, ArithmeticError)


class Place(NamedTuple):
    """Where a document lies, and the document."""

    path: Path
    document: Mapping[str, Any]


def document_at(path: Path) -> dict[str, Any]:
    """Return the JSON object that a file holds.

    Raises
    ------
    ForeignFile
        It is no regular file, too large, no JSON object, or has NaN, or texts and numbers that
        no result has.
    """
    if not path.is_file():
        raise ForeignFile(f"{path}: not a file")
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise ForeignFile(f"{path}: more than {MOST_BYTES >> 20} MB")
        found = json.loads(data.decode("utf-8"))
    except (OSError, ValueError, RecursionError) as fault:
        raise ForeignFile(f"{path}: not readable as JSON ({fault})") from None
    if not isinstance(found, dict):
        raise ForeignFile(f"{path}: not the document of a result")
    if wrong := _unbounded(found):
        raise ForeignFile(f"{path}: {wrong}")
    return found


def _unbounded(found: object) -> Wrong:
    """Say what in a document is larger than in any result."""
    left, count = [(found, 0)], 0
    while left:
        each, depth = left.pop()
        count += 1
        if count > MOST_VALUES:
            return f"more than {MOST_VALUES} values"
        if depth > DEEPEST:
            return f"lists in lists, more than {DEEPEST} deep"
        if isinstance(each, str) and (wrong := _unreadable(each)):
            return wrong
        if isinstance(each, int | float) and not -LARGEST < each < LARGEST:  # NaN neither
            return "a number that no result has"
        inside = [*each, *each.values()] if isinstance(each, dict) else each
        if isinstance(inside, list):
            left += [(one, depth + 1) for one in inside]
    return None


def _unreadable(text: str) -> Wrong:
    """Say what in a text no result has: too many letters, or some that no page can show."""
    if len(text) > MOST_LETTERS:
        return f"a text of {len(text)} letters"
    if any(
        unicodedata.category(letter) in {"Cc", "Cs"} and letter not in "\n\t" for letter in text
    ):
        return "a text with control characters"
    return None


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Let a document be read; what is missing in it, or of another type, is the file's fault.

    Raises
    ------
    ForeignFile
    """
    try:
        yield
    except ForeignFile:  # which names its file itself
        raise
    except FAULTS as fault:
        why = " ".join(f"{type(fault).__name__}: {fault}".split())[:200]
        raise ForeignFile(f"{path}: not what was written ({why})") from fault


def hold(place: Place, shape: Shape) -> None:
    """Hold a document against a shape.

    Raises
    ------
    ForeignFile
        The message names the file and what in it is wrong.
    """
    if wrong := shape(place.document):
        raise ForeignFile(f"{place.path}: {wrong}")


def number(value: Any) -> Wrong:
    """A number."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return None
    return "not a number"


def text(value: Any) -> Wrong:
    """A text."""
    return None if isinstance(value, str) else "not a text"


def truth(value: Any) -> Wrong:
    """True or false."""
    return None if isinstance(value, bool) else "neither true nor false"


def either(*shapes: Shape) -> Shape:
    """Something of one of these shapes."""

    def wrong(value: Any) -> Wrong:
        found = [shape(value) for shape in shapes]
        return None if None in found else found[0]

    return wrong


def known(shape: Shape) -> Shape:
    """Something of this shape, or null."""
    return lambda value: None if value is None else shape(value)


def listed(shape: Shape, most: int = 1_000_000) -> Shape:
    """A list of things of one shape."""

    def wrong(value: Any) -> Wrong:
        if not isinstance(value, list):
            return "not a list"
        if len(value) > most:
            return f"a list of {len(value)}, more than {most}"
        return next((f"[{k}] {why}" for k, x in enumerate(value) if (why := shape(x))), None)

    return wrong


def named(shape: Shape, most: int = 1000) -> Shape:
    """Things of one shape by names that are free."""

    def wrong(value: Any) -> Wrong:
        if not isinstance(value, dict):
            return "not an object"
        if len(value) > most:
            return f"{len(value)} names, more than {most}"
        return next((f"{k[:40]!r}: {why}" for k, x in value.items() if (why := shape(x))), None)

    return wrong


def having(**shapes: Shape) -> Shape:
    """An object that has these keys, and maybe others."""

    def wrong(value: Any) -> Wrong:
        if not isinstance(value, dict):
            return "not an object"
        for name, shape in shapes.items():
            if name not in value:
                return f"{name} is missing"
            if why := shape(value[name]):
                return f"{name}: {why}"
        return None

    return wrong
