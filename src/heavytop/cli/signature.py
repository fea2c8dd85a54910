"""The options of a verb, made of the signature and the docstring of its function.

Both are read from its source, so that help and a wrong option import nothing. At a terminal a scene
is a name with --set, a folder is -o, an executor the address of a dask scheduler, and a sequence a
list with commas.
"""

from __future__ import annotations

import re
from ast import literal_eval
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from inspect import Parameter, getdoc, signature
from pathlib import Path
from typing import Any, Final

import click

ROOT: Final = Path(__file__).parents[1]
SPELLED: Final = {
    "changes": ("--set",),
    "executor": ("--scheduler",),
    "folder": ("-o", "--output"),
    "jobs": ("-j", "--jobs"),
    "listing": ("--list",),
    "path": ("-o", "--output"),
    "undone": ("--as",),
}
"""The options whose names differ from those of their parameters."""
HELP: Final = {
    "changes": "Change a value of the scene; may be repeated: --set start.phidot=-14.",
    "executor": "Use the workers of a dask scheduler, such as tcp://192.168.0.2:8786.",
    "scene": "A shipped scene (heavytop scenes lists them), a TOML file, or the folder of a run.",
}
"""The help of parameters that differ between a terminal and Python."""
SECTION: Final = re.compile(r"^(\w+)\n-+\n", re.MULTILINE)
ENTRY: Final = re.compile(r"^(\w+(?:, \w+)*) : .*\n((?:    .*\n|\n)*)", re.MULTILINE)
MARKED_CODE: Final = re.compile(r"`+(?:heavytop\.)?([^`]*)`+")
LITERAL: Final = re.compile(r'^(\w+): Final = ([\d.]+$|\((?:\s*"[^"]*",)+\s*\))', re.MULTILINE)


def read_verb(
    places: str, *, stored: bool = False
) -> tuple[dict[str, Parameter], list[click.Parameter], str]:
    """Read the parameters of a verb, its options, and its help.

    `places` has its function, and after it the function that it calls, whose parameters it has too.
    A verb whose result can be stored has -o.
    """
    takes: dict[str, Parameter] = {}
    about: dict[str, str] = {}
    text = ""
    for function in map(read_function, reversed(places.split())):
        takes |= signature(function).parameters
        text, *parts = SECTION.split(f"{getdoc(function)}\n")
        sections = dict(zip(parts[::2], parts[1::2], strict=True))
        for names, words in ENTRY.findall(sections.get("Parameters", "")):
            about |= dict.fromkeys(names.split(", "), plain(words))
    takes = {name: each for name, each in takes.items() if each.kind is not each.VAR_KEYWORD}
    about |= {name: text for name, text in HELP.items() if name in (positional(takes), "executor")}
    stored &= not takes.keys() & {"folder", "path"}
    folder = Parameter("folder", Parameter.KEYWORD_ONLY, default=None)
    about = {"folder": "Write document and chart to this folder."} | about
    options = [*options_of(takes | {"folder": folder} if stored else takes, about)]
    return takes, options, "\n\n".join(map(plain, text.split("\n\n")))


def read_function(place: str) -> Callable[..., Any]:
    """Read a function, named ``module:function``, from its source: it has its signature alone."""
    module, _, name = place.partition(":")
    text = ROOT.joinpath(*module.split(".")).with_suffix(".py").read_text("utf-8")
    found = re.search(rf"^def {name}\(.*?(?=^[^\s)]|\Z)", text, re.MULTILINE | re.DOTALL)
    assert found, place
    named = ((name, literal_eval(value)) for name, value in LITERAL.findall(text))
    names: dict[str, Any] = defaultdict(lambda: None, named)  # None: a default that is computed
    exec(f"from __future__ import annotations\n{found[0]}", {}, names)
    function: Callable[..., Any] = names[name]
    return function


def plain(text: str) -> str:
    """A text of a docstring on one line, without marks of code."""
    return MARKED_CODE.sub(r"\1", " ".join(text.split()))


def positional(takes: Mapping[str, Parameter]) -> str:
    """The name of the parameter that is an argument and no option; empty where there is none."""
    first = next(iter(takes.values()), None)
    return "" if first is None or first.kind is first.KEYWORD_ONLY else first.name


def read_names(text: str) -> tuple[str, ...]:
    """Read a list of names, without blanks around them."""
    return tuple(name.strip() for name in text.split(","))


def read_pairs(text: str) -> dict[str, str]:
    """Read a list of NAME=VALUE."""
    pairs = [name.partition("=") for name in read_names(text)]
    if not all(equals for _, equals, _ in pairs):
        raise click.BadParameter(f"{text!r} is not NAME=VALUE,…")
    return {name: value for name, _, value in pairs}


def read_name(text: str) -> str:
    """Read a name; refuse an empty one, such as that of a shell variable that is not set."""
    if not text:
        raise click.BadParameter("a name cannot be empty")
    return text


TYPES: Final[Mapping[str, tuple[Any, str | None]]] = {
    "Path": (lambda text: Path(read_name(text)), "PATH"),
    "Sequence[": (read_names, "NAME,…"),
    "Mapping[": (read_pairs, "NAME=VALUE,…"),
    "int": (int, None),
    "float": (float, None),
    "str": (str, None),
    "Executor": (str, "ADDRESS"),
}
"""The reader of a value, and the word for it, by the beginning of an annotation: the first one."""
DRAWN: Final[Mapping[str, Any]] = {"flag_value": False, "default": True}


def options_of(
    takes: Mapping[str, Parameter], about: Mapping[str, str]
) -> Iterator[click.Parameter]:
    """Yield the argument and the options of the parameters of a function."""
    place = positional(takes)
    for name, each in takes.items():
        kinds = ["Path"] if name in ("folder", "path") else each.annotation.split(" | ")
        kind = next((word for x in kinds for word in TYPES if x.startswith(word)), "")
        flags = SPELLED.get(name, (f"--{name.replace('_', '-')}",))
        given: dict[str, Any] = {"help": about.get(name), "required": each.default is each.empty}
        if name == place:
            given |= {"nargs": -1} if kind == "Sequence[" else {}
            read = TYPES["Path"][0] if kind == "Path" else read_name
            yield click.Argument([name], type=read, **given)
        elif each.annotation == "bool" and name != "figures":
            yield click.Option([*flags, name], is_flag=True, **given)
        elif kind and name != "changes":
            default = each.default if isinstance(each.default, int | float | str) else None
            if kind == "Sequence[" and isinstance(each.default, tuple):
                default = ",".join(each.default) or None
            if name == "path" and default:  # without -o nothing is written
                given["required"], default = True, None
            read, metavar = TYPES[kind]
            given |= {"type": read, "metavar": metavar, "show_default": True}
            given |= {} if given["required"] else {"default": default}  # None would be a value
            yield click.Option([*flags, name], **given)
        if name == "folder":
            yield click.Option(["--no-figures", "figures"], help="Do not draw figures.", **DRAWN)
        if name == "changes" or name == place == "scene":
            yield click.Option(
                ["--set", "changes"], metavar="KEY=VALUE", multiple=True, help=HELP["changes"]
            )
