"""A claim: what is measured, on whose authority and by whose numbers, and its bound."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, Final

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


@dataclass(frozen=True, slots=True)
class Claim:
    """One thing that is claimed.

    Parameters
    ----------
    id : str
        Its name.
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
        The script that measures it.
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
            raise ForeignFile(f"claim {table.get('id', '')!r}: {'; '.join(faults)}")
        said = {**table, "authority": authorities[table["authority"]]}
        return cls(**{**said, "bound": float(table["bound"]), "holds": tuple(table["holds"])})


KEYS: Final = {field.name: field.default is MISSING for field in fields(Claim)}  # whether required
TEXTS: Final = {"id", "statement", "authority", "numbers", "reason", "script", "needs"}


def _misnamed(table: Mapping[str, Any]) -> Iterator[str]:
    for key, required in KEYS.items():
        if required and key not in table:
            yield f"{key} is missing"
    for key in table:
        if key not in KEYS:
            near = nearest(key, KEYS)
            yield f"{key} is unknown" + (f" ({near})" if near else "")


def _misvalued(table: Mapping[str, Any], authorities: Mapping[str, str]) -> Iterator[str]:
    for key in TEXTS & table.keys():
        if not isinstance(table[key], str) or not table[key].strip():
            yield f"{key} = {table[key]!r}: not a text"
    if "bound" in table and not _is_bound(table["bound"]):
        yield f"bound = {table['bound']!r}: not a finite number from 0 up"
    if "holds" in table and not _are_texts(table["holds"]):
        yield f"holds = {table['holds']!r}: not a list of texts"
    for key, known in (("authority", authorities), ("numbers", NUMBERS)):
        value = table.get(key)
        if isinstance(value, str) and value.strip() and value not in known:
            yield f"{key} = {value!r}: none of {', '.join(known)}"


def _is_bound(value: object) -> bool:
    return isinstance(value, int | float) and type(value) is not bool and 0 <= value < math.inf


def _are_texts(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(x, str) for x in value)
