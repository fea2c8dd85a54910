"""Shapes of what JSON can say: each keeps what is of it, and says where something is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

Shape = Callable[[Any], Any]
"""What is kept of a value; it raises `Unfit` where the value is of another shape."""


class Unfit(Exception):
    """A value of another shape: where it stands in the document, and what it is not."""

    def __init__(self, rule: str, *places: str) -> None:
        super().__init__(rule, *places)
        self.rule, self.places = rule, places

    def within(self, place: str) -> Unfit:
        """The same of what it stands in."""
        return Unfit(self.rule, place, *self.places)

    def __str__(self) -> str:
        return " ".join([*(f"{place}:" for place in self.places), self.rule])


def number(value: Any) -> Any:
    """A number."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    raise Unfit("not a number")


def size(value: Any) -> Any:
    """A number that is not negative."""
    if number(value) >= 0:
        return value
    raise Unfit("less than 0")


def text(value: Any) -> Any:
    """A text."""
    if isinstance(value, str):
        return value
    raise Unfit("not a text")


def truth(value: Any) -> Any:
    """True or false."""
    if isinstance(value, bool):
        return value
    raise Unfit("neither true nor false")


def either(*shapes: Shape) -> Shape:
    """Something of one of these shapes."""

    def kept(value: Any) -> Any:
        wrong: list[Unfit] = []
        for shape in shapes:
            try:
                return shape(value)
            except Unfit as each:
                wrong.append(each)
        raise wrong[0]

    return kept


def known(shape: Shape) -> Shape:
    """Something of this shape, or null."""
    return lambda value: None if value is None else shape(value)


def plain(value: Any) -> Any:
    """A number or a text; null for anything else."""
    return value if isinstance(value, int | float | str) else None


def one_of(*words: str) -> Shape:
    """One of these words."""

    def kept(value: Any) -> Any:
        if text(value) in words:
            return value
        raise Unfit(f"{value[:40]!r} is none of {', '.join(words)}")

    return kept


def listed(shape: Shape, most: int = 1_000_000) -> Shape:
    """A list of things of one shape."""

    def kept(value: Any) -> Any:
        if not isinstance(value, list):
            raise Unfit("not a list")
        if len(value) > most:
            raise Unfit(f"a list of {len(value)}, more than {most}")
        return [_inside(k, shape, each) for k, each in enumerate(value)]

    return kept


def named(shape: Shape, most: int = 1000) -> Shape:
    """Things of one shape by names that are free."""

    def kept(value: Any) -> Any:
        if not isinstance(value, dict):
            raise Unfit("not an object")
        if len(value) > most:
            raise Unfit(f"{len(value)} names, more than {most}")
        return {name: _inside(f"{name[:40]!r}", shape, each) for name, each in value.items()}

    return kept


def having(also: Mapping[str, Shape] | None = None, /, **shapes: Shape) -> Shape:
    """An object that has these keys, and maybe those of `also`; no others are kept."""

    def kept(value: Any) -> Any:
        if not isinstance(value, dict):
            raise Unfit("not an object")
        if missing := [name for name in shapes if name not in value]:
            raise Unfit(f"{missing[0]} is missing")
        there = {name: shape for name, shape in (also or {}).items() if name in value}
        return {
            name: _inside(name, shape, value[name]) for name, shape in {**shapes, **there}.items()
        }

    return kept


def _inside(place: str | int, shape: Shape, value: Any) -> Any:
    try:
        return shape(value)
    except Unfit as wrong:
        raise wrong.within(place if isinstance(place, str) else f"[{place}]") from None
