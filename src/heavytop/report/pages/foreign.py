"""Documents that anybody may have written: read within bounds, and cut to a shape."""

from __future__ import annotations

import json
import stat
import unicodedata
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from heavytop.errors import ForeignFile, HeavyTopError
from heavytop.report.pages.forms import Shape, Unfit
from heavytop.spelling import harmless

MOST_BYTES: Final = 64 * 2**20  # of a document
MOST_VALUES: Final = 3_000_000
DEEPEST: Final = 40  # indented by so much, a page of lists is still of their size
MOST_LETTERS: Final = 20_000  # of a text: a decimal of so many digits is still one
LARGEST: Final = 1e150  # of a number: its square is still one

Wrong = str | None

FAULTS: Final = (
    LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RuntimeError, MemoryError,
    HeavyTopError,
)  # fmt: skip


class Source(NamedTuple):
    """A document, and the bytes that it was read from."""

    document: dict[str, Any]
    data: bytes


def read(path: Path) -> Source:
    """Return the JSON object that a file holds.

    Raises
    ------
    ForeignFile
        It is no regular file, too large, no JSON object, or has NaN, or texts and numbers that
        no result has.
    """
    expect_file(path, MOST_BYTES)
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
        found = json.loads(data.decode("utf-8"))
    except OSError as fault:
        raise ForeignFile(f"{harmless(path)}: {fault.strerror or fault}") from None
    except (ValueError, RecursionError) as fault:
        raise ForeignFile(f"{harmless(path)}: not readable as JSON ({fault})") from None
    if not isinstance(found, dict):
        raise ForeignFile(f"{harmless(path)}: not the document of a result")
    if wrong := _unbounded(found):
        raise ForeignFile(f"{harmless(path)}: {wrong}")
    return Source(found, data)


def expect_file(path: Path, most: int) -> None:
    """Expect a regular file with something in it; others may have no end, or never answer.

    Parameters
    ----------
    path : Path
    most : int
        Bytes that it may have.

    Raises
    ------
    ForeignFile
    """
    try:
        found = path.stat()
    except OSError as fault:
        raise ForeignFile(f"{harmless(path)}: {fault.strerror or fault}") from None
    if not stat.S_ISREG(found.st_mode):
        raise ForeignFile(f"{harmless(path)}: not a file")
    if not found.st_size:  # as of what a kernel tells
        raise ForeignFile(f"{harmless(path)}: an empty file")
    if found.st_size > most:
        raise ForeignFile(f"{harmless(path)}: more than {most >> 20} MB")


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
    if any(map(_unprintable, text)):
        return "a text with control characters"
    return None


def _unprintable(letter: str) -> bool:
    """Controls, halves of surrogate pairs, what is no character, and what turns text around."""
    turning = "\u202a" <= letter <= "\u202e" or "\u2066" <= letter <= "\u2069"
    wrong = unicodedata.category(letter) in {"Cc", "Cs"} or letter in "\ufffe\uffff"
    return turning or (wrong and letter not in "\n\t")


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
        why = harmless(f"{type(fault).__name__}: {fault}")[:200]
        raise ForeignFile(f"{harmless(path)}: not what was written ({why})") from fault


def cut(path: Path, document: Mapping[str, Any], shape: Shape) -> Any:
    """What a shape has of a document, and nothing else.

    Raises
    ------
    ForeignFile
        The message names the file and what in it is wrong.
    """
    try:
        return shape(document)
    except Unfit as wrong:
        raise ForeignFile(f"{harmless(path)}: {wrong}") from None
