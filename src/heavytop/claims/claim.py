"""A claim: what is measured, on whose authority and by whose numbers, and its bound."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, Final

from heavytop.claims.told import number, words
from heavytop.errors import ForeignFile
from heavytop.names import nearest

OURS: Final = "this project"
NUMBERS: Final = {
    "printed": "figures that the authority printed",
    "program": "the authority's own program, run here",
    "formula": "the authority's formula or theorem, evaluated here",
    "ours": "the authority's equations, integrated by code of this project",
}
"""Whose numbers a claim is held against."""
SIMPLE: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+=-]*")  # no option, no list, no path
SCRIPT: Final = re.compile(rf"{SIMPLE.pattern}\.py")


@dataclass(frozen=True, slots=True)
class Claim:
    """One thing that is claimed.

    Parameters
    ----------
    id : str
        Its name: letters, digits and ``._+=-``, the first a letter or a digit.
    statement : str
        What is measured, with its unit.
    authority : str
        Who says so, outside this project.
    numbers : str
        Whose numbers it is held against: a name of `NUMBERS`.
    bound : float
        What is measured, a distance or a count, is at most this.
    reason : str
        Why this bound.
    script : str
        The script that measures it: the name of a file beside the register.
    holds : tuple of str
        What of the package is held against the authority.
    needs : str, optional
        A package that not everybody has.
    """

    id: str
    statement: str
    authority: str
    numbers: str
    bound: float
    reason: str
    script: str
    holds: tuple[str, ...]
    needs: str | None = None

    @classmethod
    def of(cls, table: Mapping[str, Any], authorities: Mapping[str, str]) -> Claim:
        """The claim that a table of ``claims.toml`` makes.

        Parameters
        ----------
        table : mapping
        authorities : mapping from str to str
            Who is meant, by the name that the table has for him.

        Raises
        ------
        ForeignFile
            Keys that are missing or unknown, or values that are none; the message names the claim.

        Examples
        --------
        >>> table = {"id": "x", "statement": "a sum", "authority": "a", "script": "1.py"}
        >>> table |= {"reason": "exact", "holds": ["symbols"], "bound": -1, "numbers": "ours"}
        >>> Claim.of(table, {"a": "A. N. Other"})
        Traceback (most recent call last):
        heavytop.errors.ForeignFile: claim 'x': bound = -1: not a finite number from 0 up
        """
        if faults := [*_misnamed(table), *_misvalued(table, authorities)]:
            raise ForeignFile(f"claim {words(repr(table.get('id', '')))}: {'; '.join(faults)}")
        said = {**table, "authority": authorities[table["authority"]]}
        return cls(**{**said, "bound": float(table["bound"]), "holds": tuple(table["holds"])})


KEYS: Final = {field.name: field.default is MISSING for field in fields(Claim)}  # whether required


def _misnamed(table: Mapping[str, Any]) -> Iterator[str]:
    for key, required in KEYS.items():
        if required and key not in table:
            yield f"{key} is missing"
    for key in table:
        if key not in KEYS:
            near = nearest(key, KEYS)
            yield f"{words(key)} is unknown" + (f" ({near})" if near else "")


def _misvalued(table: Mapping[str, Any], authorities: Mapping[str, str]) -> Iterator[str]:
    for key, (fits, rule) in VALUES.items():
        if key in table and not fits(table[key]):
            yield f"{key} = {words(repr(table[key]), 80)}: {rule}"
    for key, known in (("authority", authorities), ("numbers", NUMBERS)):
        value = table.get(key)
        if is_text(value) and value not in known:
            yield f"{key} = {value!r}: none of {', '.join(known)}"


def is_text(value: object) -> bool:
    """Whether a value is a text of one line, without escape codes.

    Examples
    --------
    >>> is_text("a sum"), is_text(" "), is_text(chr(27) + "[31m"), is_text(3)
    (True, False, False, False)
    """
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def _is_bound(value: object) -> bool:
    bound = number(value)
    return bound is not None and bound >= 0


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(map(is_text, value))


def _is_package(value: object) -> bool:
    return is_text(value) and all(part.isidentifier() for part in str(value).split("."))


def _simple(pattern: re.Pattern[str]) -> Callable[[object], bool]:
    return lambda value: isinstance(value, str) and bool(pattern.fullmatch(value))


VALUES: Final[Mapping[str, tuple[Callable[[object], bool], str]]] = {
    **dict.fromkeys(("statement", "authority", "numbers", "reason"), (is_text, "not a text")),
    "id": (_simple(SIMPLE), "not letters, digits and ._+=- alone, or not begun by the former"),
    "script": (_simple(SCRIPT), "not the plain name of a .py file"),
    "needs": (_is_package, "not a text that names a package"),
    "bound": (_is_bound, "not a finite number from 0 up"),
    "holds": (_are_texts, "not a list of texts"),
}
