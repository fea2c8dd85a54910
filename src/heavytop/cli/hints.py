"""Hints: what was meant by words that the command line does not take."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import typer

Usage: Final[Any] = typer.BadParameter.__mro__[1]
"""What typer raises for words that do not fit; it is not among its public names."""

EXAMPLE: Final = "sicm-kicked"
_OPTION: Final = re.compile(r"--|-[a-z]$")


def hinted(error: Any, words: Sequence[str]) -> None:
    """Add a hint to an error of usage, where one can be given.

    Parameters
    ----------
    error : Usage
        What typer says is wrong; its message is changed.
    words : sequence of str
        All that stands behind the name of the command.
    """
    if told := _hint(error, words):
        said = error.message.rstrip(".")
        error.message = f"{said}: {told}" if said else told[0].upper() + told[1:]
        error.possibilities = None  # options that only look alike


def _hint(error: Any, words: Sequence[str]) -> str:
    kind = type(error).__name__
    if kind == "MissingParameter":
        return _missing(error.param, words[0])
    if kind == "NoSuchOption":
        return _parted(words) or _option(error.option_name.lstrip("-"), words)
    if kind != "UsageError":
        return ""
    return _parted(words) or ("" if error.ctx.parent else _verb(words))


def _missing(parameter: Any, verb: str) -> str:
    if parameter is None or parameter.metavar != "SCENE":
        return ""
    return f"as in heavytop {verb} {EXAMPLE}; heavytop scenes lists those that are shipped"


def _parted(words: Sequence[str]) -> str:
    """A hint at blanks around = or before a unit, of which the shell makes several words."""
    for at, word in enumerate(words, start=1):
        if word == "--set" and (change := _joined(words[at:])):
            return f"KEY=VALUE is one word, --set {shlex.quote(change)}"
    return ""


def _joined(words: Sequence[str]) -> str:
    """The change that begins with these words, if it was meant to be more than the first."""
    from heavytop.numbers.parse import UNITS

    key, equals, value = (words[0] if words else "").partition("=")
    rest = list(words[1:])
    if not equals and rest and rest[0].startswith("="):
        value = rest.pop(0)[1:]
    if not value and rest:
        value = rest.pop(0)
    if rest and rest[0] in UNITS:
        value = f"{value} {rest.pop(0)}"
    alone = len(rest) == len(words) - 1
    return "" if alone or not value or _OPTION.match(value) else f"{key}={value}"


def _option(name: str, words: Sequence[str]) -> str:
    """A hint at how a scene is named, or changed."""
    from heavytop.scene.scene_file import TABLES

    after = dict(pairwise(words)).get(f"--{name}", "")
    if name == "scene":
        return f"a scene has no option before it, as in heavytop run {_quoted(after)}"
    home = [table for table, keys in TABLES.items() if name in keys]
    return f"a scene is changed by --set {home[0]}.{name}=VALUE" if home else ""


def _verb(words: Sequence[str]) -> str:
    """A hint at the verb that is missing, where the first word is none."""
    first, *others = words
    if first == "help":
        return " ".join(("it is heavytop", *others[:1], "--help"))
    scene = _scene(first)
    return f"a scene stands behind a verb, as in heavytop run {_quoted(scene)}" if scene else ""


def _scene(word: str) -> str:
    """The scene that a word names or nearly names, if any."""
    from heavytop.names import closest
    from heavytop.scene.scene import shipped_scenes

    shipped = shipped_scenes()
    is_file = Path(word).suffix == ".toml" or Path(word).is_file()
    return word if word in shipped or is_file else closest(word, shipped)


def _quoted(word: str) -> str:
    return shlex.quote(word) if word and word.isprintable() else EXAMPLE
