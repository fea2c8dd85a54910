"""One text for one value, its digest, and documents that show whether they were changed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

from heavytop.errors import ForeignFile
from heavytop.files import regular

SEAL = "sha256"


def canonical(value: Any) -> str:
    """The one JSON text of a value: keys in order, no spaces, ASCII, never NaN.

    Raises
    ------
    TypeError, ValueError
        For what JSON cannot hold.

    Examples
    --------
    >>> canonical({"b": (1, 2), "a": None})
    '{"a":null,"b":[1,2]}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def plain(value: Any) -> Any:
    """What is left of a value when it went through JSON: lists for tuples, texts for keys."""
    return json.loads(canonical(value))


def digest(text: str | bytes) -> str:
    """The SHA-256 of a text, in hexadecimal."""
    return sha256(text.encode() if isinstance(text, str) else text).hexdigest()


def sealed(document: Mapping[str, Any], indent: int | None = None) -> str:
    """The text of a document that carries its own digest."""
    whole = {**document, SEAL: digest(canonical(document))}
    if indent is None:
        return canonical(whole) + "\n"
    return json.dumps(whole, sort_keys=True, indent=indent, allow_nan=False) + "\n"


def unsealed(path: Path, schema: str) -> dict[str, Any]:
    """Read a sealed document of a schema; return it without its seal.

    Raises
    ------
    ForeignFile
        It is missing, truncated, of another schema, or was changed since it was written.
    """
    document = parsed(path, contents(path))
    if document.get("schema") != schema:
        raise ForeignFile(f"{path}: schema = {document.get('schema')!r}: expected {schema}")
    if document.pop(SEAL, None) != digest(canonical(document)):
        raise ForeignFile(f"{path}: changed since it was written")
    return document


def contents(path: Path) -> bytes:
    """The bytes of a file that must be there."""
    try:
        with regular(path) as file:
            return file.read()
    except OSError as fault:
        raise ForeignFile(f"{path}: cannot be read ({fault.strerror})") from None


def parsed(path: Path, text: bytes) -> dict[str, Any]:
    """The JSON object that a file holds; `path` names it where it does not."""
    try:
        document = json.loads(text, parse_constant=_refuse, parse_float=_finite)
    except (ValueError, RecursionError) as fault:
        raise ForeignFile(f"{path}: damaged or cut short ({fault})") from None
    if not isinstance(document, dict):
        raise ForeignFile(f"{path}: damaged: not a JSON object")
    return document


def _refuse(constant: str) -> float:
    raise ValueError(f"{constant} is no number")


def _finite(text: str) -> float:
    value = float(text)
    return value if isfinite(value) else _refuse(text)
