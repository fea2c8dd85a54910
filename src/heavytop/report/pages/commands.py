"""The command that makes a result, and the scene that it takes."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping
from typing import Any

Known = Mapping[str, Any]


def command(verb: str, *words: str) -> str:
    """The command line of a verb, quoted for a shell.

    Examples
    --------
    >>> command("run", "my scene.toml", "-o", "out")
    "heavytop run 'my scene.toml' -o out"
    """
    return " ".join(map(quoted, ["heavytop", verb, *words]))


def folder(ident: str) -> tuple[str, str]:
    """The option that names a folder of its own: no two studies write into the same."""
    return "-o", f"out/{ident}"


def exactly(x: float) -> str:
    """The shortest text of a number that is read as the same number.

    Examples
    --------
    >>> exactly(1234567.0), exactly(0.1), exactly(30)
    ('1234567', '0.1', '30')
    """
    return repr(x).removesuffix(".0")


def changed(options: Mapping[str, tuple[float | None, float]]) -> Iterator[str]:
    """The options that are known and not what holds where they are left out.

    Examples
    --------
    >>> list(changed({"--budget": (40.0, 240.0), "--step-limit": (None, 9), "--x": (1, 1.0)}))
    ['--budget', '40']
    """
    for option, (value, usual) in options.items():
        if value is not None and value != usual:
            yield from (option, exactly(value))


def quoted(word: str) -> str:
    r"""A word as a shell takes it, on one line.

    Examples
    --------
    >>> print(quoted("a b"), quoted("a\nb"), quoted("caf\udce9"))
    'a b' $'a\x0ab' $'caf\xe9'
    """
    if word.isprintable():
        return shlex.quote(word)
    return "$'" + "".join(map(_escaped, word)) + "'"


def _escaped(letter: str) -> str:
    if letter.isprintable() and letter not in "\\'":
        return letter
    return "".join(f"\\x{byte:02x}" for byte in letter.encode("utf-8", "surrogateescape"))


def scene_word(scene: Known, ident: str) -> str:
    """The shipped scene that this one is, else the file that `scene_file` gives, by the name of
    its section.
    """
    return str(scene["name"]) if is_shipped(scene) else f"{ident}.toml"


def is_shipped(scene: Known) -> bool:
    """Whether it says what the shipped scene of its name says."""
    from heavytop.scene.scene import load_scene, shipped_scenes

    if scene["name"] not in shipped_scenes():
        return False
    own = load_scene(scene["name"]).document()
    return all(own.get(key) == value for key, value in scene.items())


def scene_file(scene: Known, span: Known | None = None) -> str:
    r"""The scene as a TOML file, with a span where it says none; empty where it is a shipped one.

    Examples
    --------
    >>> print(scene_file({"name": "x", "title": 'a "b"', "top": {"A": 2, "C": "1/3"}}))
    title = "a \"b\""
    <BLANKLINE>
    [top]
    A = 2
    C = "1/3"
    """
    if is_shipped(scene):
        return ""
    lines: list[str] = []
    tables = {"span": span or {}, **scene}
    for name, value in sorted(tables.items(), key=lambda each: isinstance(each[1], Mapping)):
        if isinstance(value, Mapping) and value:
            lines += ["", f"[{_key(name)}]", *_pairs(value)]
        elif name != "name" and value not in ({}, None):
            lines.append(f"{_key(name)} = {_toml(value)}")
    return "\n".join(lines)


def _pairs(table: Known) -> list[str]:
    return [f"{_key(k)} = {_toml(x)}" for k, x in table.items() if x is not None]


def _key(name: str) -> str:
    return name if name.replace("_", "").isalnum() and name.isascii() else _toml(name)


def _toml(value: Any) -> str:
    """A value; what JSON spells is TOML, but for the letter that TOML wants escaped."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
