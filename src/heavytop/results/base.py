"""What every result is: a frozen dataclass whose fields are its JSON, with the command behind it.

A part of a result, such as a point of a diagram, is one too. Files of results are exchanged:
pydantic reads them by the types of the fields, nothing in them is executed, and of their texts
what a terminal would act on is spelled out.
"""

from __future__ import annotations

import json
import math
import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, fields
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self, TypeAlias

from heavytop.display import Shown
from heavytop.errors import ForeignFile
from heavytop.files import write_document
from heavytop.spelling import harmless


class _Harmless:
    """Spells out what a terminal would act on, in texts that are read."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core.core_schema import no_info_after_validator_function

        return no_info_after_validator_function(harmless, handler(source))


class _Finite:
    """Refuses what is no number of JSON, though Python reads it."""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        return handler(source) | {"allow_inf_nan": False}


Text: TypeAlias = Annotated[str, _Harmless()]
Number: TypeAlias = int | Annotated[float, _Finite()]
Value: TypeAlias = Number | Text | None  # more than 15 digits are a text
Values: TypeAlias = Mapping[Text, Value]
Column: TypeAlias = tuple[Number | None, ...]

# --- the command line ------------------------------------------------------------------------

_TYPED: ContextVar[str | None] = ContextVar("command", default=None)


def typed() -> str | None:
    """What was typed, where this process is a command; None where Python is used."""
    return _TYPED.get()


def spelt(words: Sequence[str]) -> str:
    """A command line as a shell takes it, in letters that a terminal does not act on.

    Examples
    --------
    >>> spelt(["run", "my scene.toml"])
    "heavytop run 'my scene.toml'"
    """
    return harmless(shlex.join(["heavytop", *words]))


@contextmanager
def typing(command: str | None) -> Iterator[None]:
    """Let results be those of a command."""
    token = _TYPED.set(command)
    try:
        yield
    finally:
        _TYPED.reset(token)


def with_command(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document of a result with the command that makes it, unless it names one."""
    return {"schema": document["schema"], "command": typed(), **document}


def command_of(path: Path) -> str | None:
    """The command that a document names, if there is one that does."""
    try:
        with path.open("rb") as file:
            found = json.loads(file.readline() if path.suffix == ".jsonl" else file.read())[
                "command"
            ]
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return None
    return found if isinstance(found, str) else None


# --- results ---------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a result: its fields, by their names, are its JSON.

    Keys without a field are left out when it is read: they follow from the fields.
    """

    def document(self) -> dict[str, Any]:
        """Return the part for JSON."""
        return {each.name: plain(getattr(self, each.name)) for each in fields(self)}


@dataclass(frozen=True, kw_only=True)
class Problem(Part):
    """The top of a study and its start, as `heavytop.Scene.problem` gives them.

    Attributes
    ----------
    name, title, source : str
    top, start : mapping from str to (float or str)
        Beyond 15 digits a number is a decimal text.
    """

    name: Text
    title: Text
    source: Text
    top: Values
    start: Mapping[Text, Any]


@dataclass(frozen=True, kw_only=True)
class SceneTables(Part):
    """A scene, as `heavytop.Scene.document` gives it: in the order of a scene file."""

    name: Text
    format: int
    title: Text
    source: Text
    top: Values
    start: Mapping[Text, Any]
    span: Values
    want: Mapping[Text, Value | tuple[Value, ...]]


@dataclass(frozen=True, kw_only=True)
class Answer(Part, Shown):
    """What a command prints; a subclass gives `schema` its one value.

    Attributes
    ----------
    schema : str
        What the fields mean: a name and the number of its edition.
    command : str or None
        What was typed, as a text that is never executed; None where Python was used.
    """

    schema: Text
    command: Text | None = field(default_factory=typed)


@dataclass(frozen=True, kw_only=True)
class Result(Answer):
    """What a file holds: an answer with the names of its files, and versions.

    Attributes
    ----------
    files : mapping from str to str
        Names of the files that were written, by what they are.
    versions : mapping from str to (str or None)
        Of what the last bits depend on.
    """

    files: Mapping[Text, Text] = field(default_factory=dict)
    versions: Mapping[Text, Text | None] = field(default_factory=dict)

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the result for JSON.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return super().document() | ({"files": dict(files)} if files else {})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the result as JSON; `load` reads it.

        Parameters
        ----------
        path : path
        """
        write_document(Path(path), self.document())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return the result that a file holds.

        Parameters
        ----------
        path : path

        Raises
        ------
        ForeignFile
            It is no regular file, or not such a result: the message has the place and the rule.
        """
        found: Self = read(Path(path), cls).found
        return found


def plain(value: Any) -> Any:
    """Return a value of plain types, as JSON has them."""
    if isinstance(value, Part):
        return value.document()
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    return [plain(each) for each in value] if isinstance(value, tuple | list) else value


def finite(value: Any) -> Any:
    """Return a number as JSON holds it: None for what is not finite; of a mapping each."""
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, Mapping):
        return {name: finite(each) for name, each in value.items()}
    number = float(value)
    return number if math.isfinite(number) else None


class Stored(NamedTuple):
    """What a file holds, and its fingerprint."""

    found: Any
    sha256: str


def read(path: Path, kind: Any) -> Stored:
    """Read JSON as a type says it.

    Raises
    ------
    ForeignFile
        It is no regular file, or not of this type: the message has the place and the rule.
    """
    from pydantic import TypeAdapter, ValidationError

    try:
        with path.open("rb") as file:
            data = file.read()
        with typing(None):  # what a file does not say was not typed here
            found = TypeAdapter(kind).validate_json(data, strict=True)
    except OSError as fault:
        raise ForeignFile(f"{harmless(path)}: not readable ({fault.strerror or fault})") from None
    except ValidationError as wrong:
        first = wrong.errors()[0]
        place = harmless(": ".join(map(str, first["loc"])))[:200]
        if first["type"] == "json_invalid":
            place = "not readable"
        said = [harmless(path), *[place] * bool(place), harmless(first["msg"])[:200]]
        raise ForeignFile(": ".join(said)) from None
    return Stored(found, sha256(data).hexdigest())
