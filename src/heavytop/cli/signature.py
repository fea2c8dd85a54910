"""What a function takes, as arguments and options: its signature and its docstring say it all.

Both are read from its source, so that help and a mistyped option import nothing. At a terminal a
scene is a name with --set, a folder is -o, an executor the address of a dask scheduler, and a
sequence a list with commas.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import click

ROOT: Final = Path(__file__).parents[1]
REQUIRED: Final = object()
SPELLED: Final = {
    "changes": ("--set",),
    "executor": ("--scheduler",),
    "folder": ("-o", "--output"),
    "jobs": ("-j", "--jobs"),
    "listing": ("--list",),
    "path": ("-o", "--output"),
    "undone": ("--as",),
}
"""Options that are not named as their parameters are."""
HELP: Final = {
    "executor": "Use the workers of a dask scheduler, such as tcp://192.168.0.2:8786.",
    "scene": "A shipped scene (heavytop scenes lists them), a TOML file, or the folder of a run.",
}
"""Of parameters that are something else at a terminal than in Python."""
SECTION: Final = re.compile(r"^(\w+)\n-+\n", re.MULTILINE)
ENTRY: Final = re.compile(r"^(\w+(?:, \w+)*) : .*\n((?:    .*\n|\n)*)", re.MULTILINE)
MARKED_CODE: Final = re.compile(r"`+(?:heavytop\.)?([^`]*)`+")


class Parameter(NamedTuple):
    """A parameter of a function: its annotation is a text, its default a value."""

    name: str
    kind: str
    default: Any
    has_place: bool
    about: str = ""


# --- from the source -------------------------------------------------------------------------


def read_verb(places: str) -> tuple[dict[str, Parameter], list[click.Parameter], str]:
    """Read what a verb takes, in Python and as it is typed, and its help.

    Its function may be followed by the one that it calls.
    """
    functions = [read_function(place) for place in places.split()]
    takes = parameters_of(*functions)
    typed = {each.name: each for known in takes.values() for each in as_typed(known)}
    text = sections_of(functions[0])[""]
    return takes, [*typed.values()], "\n\n".join(map(plain, text.split("\n\n")))


def read_function(place: str) -> ast.FunctionDef:
    """Read the source of a function, named as ``module:function``."""
    module, _, name = place.partition(":")
    text = ROOT.joinpath(*module.split(".")).with_suffix(".py").read_text("utf-8")
    lines = re.search(rf"^def {name}\(.*?(?=^[^\s)]|\Z)", text, re.MULTILINE | re.DOTALL)
    function = ast.parse(lines[0] if lines else "").body[0]
    assert isinstance(function, ast.FunctionDef)
    return function


def sections_of(function: ast.FunctionDef) -> dict[str, str]:
    """Split a numpydoc docstring; what stands before its sections has no name."""
    first, *parts = SECTION.split(f"{ast.get_docstring(function)}\n")
    return {"": first, **dict(zip(parts[::2], parts[1::2], strict=True))}


def parameters_of(*functions: ast.FunctionDef) -> dict[str, Parameter]:
    """The parameters of a function, by name, and those of the functions that it calls.

    What it says of one goes before what they say. The first has a place if it is not named.
    """
    found: dict[str, Parameter] = {}
    about: dict[str, str] = {}
    for function in reversed(functions):
        for names, text in ENTRY.findall(sections_of(function).get("Parameters", "")):
            about |= dict.fromkeys(names.split(", "), plain(text))
        taken = function.args
        needed = len(taken.args) - len(taken.defaults)
        defaults = [None] * needed + [*taken.defaults, *taken.kw_defaults]
        for each, default in zip(taken.args + taken.kwonlyargs, defaults, strict=True):
            kind = ast.unparse(each.annotation) if each.annotation else ""
            has_place = each in taken.args[:1]
            found[each.arg] = Parameter(each.arg, kind, value_of(default), has_place)
    return {name: x._replace(about=about.get(name, "")) for name, x in found.items()}


def plain(text: str) -> str:
    """A text of a docstring on one line, without its marks."""
    return MARKED_CODE.sub(r"\1", " ".join(text.split()))


def value_of(default: ast.expr | None) -> Any:
    """The value of a default; None where only the module of the function knows it."""
    if default is None:
        return REQUIRED
    try:
        return ast.literal_eval(default)
    except ValueError:
        return None


# --- to the terminal -------------------------------------------------------------------------


class Value(click.ParamType[Any]):
    """A value that a function reads; the ValueError of one that it refuses is the message."""

    def __init__(self, name: str, read: Callable[[str], Any]) -> None:
        self.name, self.read = name, read

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Read what was typed."""
        try:
            return self.read(value) if isinstance(value, str) else value
        except ValueError as refused:
            self.fail(str(refused), param, ctx)


def read_names(text: str) -> tuple[str, ...]:
    """Read a list of names, without the blanks around them."""
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise ValueError(f"{text!r} is not NAME,NAME,…: a name is empty")
    return names


def read_pairs(text: str) -> dict[str, str]:
    """Read values by their names."""
    pairs = [pair.partition("=") for pair in read_names(text)]
    if not all(equals for _, equals, _ in pairs):
        raise ValueError(f"{text!r} is not NAME=VALUE,…")
    return {name: value for name, _, value in pairs}


def read_change(text: str) -> str:
    """Read a change of a scene, which stays a text."""
    key, equals, _ = text.partition("=")
    if not (key.strip() and equals):
        raise ValueError(f"{text!r} is not KEY=VALUE, in one word: start.phidot=-14")
    return text


def read_path(text: str) -> Path:
    """Read a path; an empty one would be the folder one happens to be in."""
    if not text:
        raise ValueError("the name of a file or a folder cannot be empty")
    return Path(text)


OPTION_TYPES: Final = {
    "Path": Value("PATH", read_path),
    "Sequence[": Value("NAME,…", read_names),
    "Mapping[": Value("NAME=VALUE,…", read_pairs),
    "int": click.INT,
    "float": click.FLOAT,
    "str": click.STRING,
    "Executor": Value("ADDRESS", str),
}
"""By how an annotation, or one of its alternatives, begins; of several the first."""
SET_OPTION: Final = click.Option(
    ["--set", "changes"],
    type=Value("KEY=VALUE", read_change),
    multiple=True,
    help="Change a value of the scene; may be repeated: --set start.phidot=-14.",
)
NO_FIGURES_OPTION: Final = click.Option(
    ["--no-figures", "figures"], flag_value=False, default=True, help="Do not draw figures."
)


def as_typed(parameter: Parameter) -> Iterator[click.Parameter]:
    """What is typed for a parameter: an argument, options, or nothing."""
    name, kind, default, has_place, about = parameter
    flags = SPELLED.get(name) or [f"--{name.replace('_', '-')}"]
    kinds = ["Path"] if name in ("folder", "path") else kind.split(" | ")
    types = (each for kind in kinds for word, each in OPTION_TYPES.items() if kind.startswith(word))
    given: dict[str, Any] = {"type": next(types, None), "required": default is REQUIRED}
    if has_place and kind.startswith("Scene"):
        yield click.Argument([name], help=HELP[name], **given | {"type": click.STRING})
        yield SET_OPTION
    elif has_place:
        several = {"type": click.STRING, "nargs": -1} if kind.startswith("Sequence[") else {}
        yield click.Argument([name], help=about, **given | several)
    elif name in ("changes", "figures"):
        yield SET_OPTION if name == "changes" else NO_FIGURES_OPTION
    elif kind == "bool":
        yield click.Option([*flags, name], is_flag=True, help=about)
    elif given["type"] is not None:
        if isinstance(default, tuple) and kind.startswith("Sequence["):
            default = ",".join(default) or None
        if isinstance(default, int | float | str):
            given |= {"default": default, "show_default": True}
        if name == "path":  # without -o nothing is written
            given["required"] = default is not None
        yield click.Option([*flags, name], help=HELP.get(name, about), **given)
        if name == "folder":
            yield NO_FIGURES_OPTION
