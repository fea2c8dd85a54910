"""What the files of a study say, held against what a study writes there: nothing is believed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import isfinite
from typing import Any, Final

from heavytop.errors import ForeignFile, HeavyTopError
from heavytop.scene import scene_file
from heavytop.scene.arguments import Range, shown
from heavytop.scene.scene import Scene, read_scene

MOST: Final = 2**63 - 1
TITLES: Final = ("name", "title", "source")


def refused(name: str, value: object, rule: str) -> ForeignFile:
    """Return what refuses a value, with its name and the rule."""
    return ForeignFile(f"{name} = {shown(value)}: {rule}")


@contextmanager
def naming(file: object) -> Iterator[None]:
    """Name the file in which something is refused."""
    try:
        yield
    except ForeignFile as fault:
        raise ForeignFile(f"{file}: {fault}") from None


def table(name: str, value: object, keys: Sequence[str]) -> Mapping[str, Any]:
    """Return a table that has these keys."""
    if not isinstance(value, Mapping):
        raise refused(name, value, "expected a table")
    if missing := [key for key in keys if key not in value]:
        raise ForeignFile(f"{name}: without {', '.join(missing)}")
    return value


def text(name: str, value: object) -> str:
    """Return a text."""
    if not isinstance(value, str):
        raise refused(name, value, "expected a text")
    return value


def texts(name: str, value: object) -> tuple[str, ...]:
    """Return the texts of a list that is not empty."""
    if not isinstance(value, list) or not value:
        raise refused(name, value, "expected a list of texts")
    return tuple(text(name, each) for each in value)


def whole(name: str, value: object, least: int, most: int = MOST) -> int:
    """Return a whole number within its bounds."""
    if type(value) is not int or not least <= value <= most:
        raise refused(name, value, f"expected a whole number from {least} to {most}")
    return value


def number(name: str, value: object, least: float, most: float) -> float:
    """Return a number within its bounds, as it is: a study is known by how its numbers look."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
        raise refused(name, value, f"expected a number from {least:g} to {most:g}")
    return value


def numbers(found: Mapping[str, Any], table: Mapping[str, Range]) -> dict[str, Any]:
    """Return the options of a table as they were written: plain numbers within their bounds."""
    return {
        name: whole(name, found[name], int(each.least), int(each.most))
        if each.whole
        else number(name, found[name], each.least, each.most)
        for name, each in table.items()
    }


def word(name: str, value: object) -> float:
    """Return the finite float of a hexadecimal text."""
    try:
        found = float.fromhex(text(name, value))
    except (ValueError, OverflowError):
        found = float("nan")
    if not isfinite(found):
        raise refused(name, value, "expected a finite number as hexadecimal text")
    return found


def words(name: str, value: object, *counts: int) -> tuple[float, ...]:
    """Return finite floats, as many as one of these counts says."""
    if not isinstance(value, list) or len(value) not in counts:
        raise refused(name, value, f"expected a list of {' or '.join(map(str, counts))} numbers")
    return tuple(word(name, each) for each in value)


def scene(found: object) -> Scene:
    """Return the scene of an identity: its top and its start, with a span of no meaning.

    Numbers are texts or decimals that say them exactly.
    """
    tables = table("scene", found, (*TITLES, "top", "start"))
    titles = {name: text(name, tables[name]) for name in TITLES}
    parts = {name: table(name, tables[name], ()) for name in ("top", "start")}
    where = titles.pop("name")
    try:
        whole = scene_file.written({"format": 1, **titles, **parts, "span": {"periods": 1}})
        return read_scene(whole, where=where)
    except HeavyTopError as wrong:
        raise ForeignFile(f"scene: {wrong}") from None
