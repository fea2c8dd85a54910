"""The register of claims: what is measured, on whose authority, to what bound, by which script."""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from heavytop.errors import ForeignFile, HeavyTopError

NAME: Final = "claims.toml"
PACKAGE: Final = Path(__file__).parents[1]
PACKED: Final = PACKAGE / "_validation"  # where a wheel has them
BESIDE: Final = PACKAGE.parents[1] / "validation"  # where a checkout has them
OURS: Final = "this project"
NUMBERS: Final = {
    "printed": "figures that the authority printed",
    "program": "the authority's own program, run here",
    "formula": "the authority's formula or theorem, evaluated here",
    "ours": "the authority's equations, integrated by code of this project",
}
"""Whose numbers a claim is held against."""

Line = Annotated[str, Field(pattern=r"^[^\x00-\x1f\x7f]*[^\s\x00-\x1f\x7f][^\x00-\x1f\x7f]*$")]
"""A text of one line, without escape codes."""


class Claim(BaseModel):
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

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+=-]*$")]
    statement: Line
    authority: Line
    numbers: Literal["printed", "program", "formula", "ours"]
    bound: Annotated[float, Field(ge=0, allow_inf_nan=False, strict=True)]
    reason: Line
    script: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._+=-]*\.py$")]
    holds: Annotated[tuple[Line, ...], Field(min_length=1)]
    needs: Annotated[str, Field(pattern=r"^\w+(\.\w+)*$")] | None = None


class _File(BaseModel):
    """What ``claims.toml`` has."""

    model_config = ConfigDict(extra="forbid")

    format: Literal[1]
    authorities: dict[str, Line] = {}
    claim: tuple[Claim, ...] = ()


@dataclass(frozen=True)
class Register:
    """All claims, and the scripts that state their own.

    Parameters
    ----------
    folder : Path
        Where the scripts are.
    claims : tuple of Claim
    proofs : mapping from str to str
        Scripts that only ``--proofs`` runs, and what each of them is about.
    """

    folder: Path
    claims: tuple[Claim, ...]
    proofs: Mapping[str, str]

    @cached_property
    def scripts(self) -> dict[str, tuple[Claim, ...]]:
        """The scripts of registered claims, with what each measures, in the order of the file."""
        found: dict[str, tuple[Claim, ...]] = {}
        for claim in self.claims:
            found[claim.script] = (*found.get(claim.script, ()), claim)
        return found

    @property
    def names(self) -> tuple[str, ...]:
        """What can be asked for: claims, and scripts without their ending."""
        scripts = (*self.scripts, *self.proofs)
        return (*(claim.id for claim in self.claims), *(stem(script) for script in scripts))


def stem(script: str) -> str:
    """A script's name without its ending."""
    return script.removesuffix(".py")


def load_register(folder: Path | None = None) -> Register:
    """The register of this package, or of a folder with a ``claims.toml``.

    Parameters
    ----------
    folder : Path, optional
        Where it is; by default packed with the package, or beside the sources.

    Raises
    ------
    HeavyTopError
        There is none: the package was installed without its scripts.
    ForeignFile
        It is not as it should be; the message names the place in it.

    Examples
    --------
    >>> load_register().scripts["35_steady.py"][0].id
    'betsch-cone'
    """
    place = folder or (PACKED if (PACKED / NAME).is_file() else BESIDE)
    path = place / NAME
    try:
        found = _File.model_validate(tomllib.loads(path.read_text("utf-8")))
    except FileNotFoundError:
        raise HeavyTopError(f"{path} is not there: installed without its claims") from None
    except ValidationError as wrong:
        raise ForeignFile(f"{path}: {_said(wrong)}") from None
    except (ValueError, OSError) as fault:  # of TOML, of letters, of the file
        raise ForeignFile(f"{path}: {fault}") from None
    claims = tuple(_named(claim, found.authorities, path) for claim in found.claim)
    registered = {claim.script for claim in claims}
    others = (each for each in sorted(place.glob("[0-9]*.py")) if each.name not in registered)
    register = Register(place, claims, {each.name: _about(each) for each in others})
    if twice := next((name for name, n in Counter(register.names).items() if n > 1), None):
        raise ForeignFile(f"{path}: {twice!r}: the name of two claims, or of a claim and a script")
    return register


def _said(wrong: ValidationError) -> str:
    """Every fault of a register, each with its place: claims are counted from 0."""
    faults = ((".".join(map(str, each["loc"])), each) for each in wrong.errors())
    return "; ".join(f"{place} = {each['input']!r:.60}: {each['msg']}" for place, each in faults)


def _named(claim: Claim, authorities: Mapping[str, str], path: Path) -> Claim:
    """The claim with its authority in full, if that and its script are there."""
    if claim.authority not in authorities:
        known = ", ".join(authorities)
        rule = f"authority = {claim.authority!r}: none of {known}"
        raise ForeignFile(f"{path}: claim {claim.id!r}: {rule}")
    if not path.with_name(claim.script).is_file():
        raise ForeignFile(f"{path}: claim {claim.id!r}: script = {claim.script!r}: not there")
    return claim.model_copy(update={"authority": authorities[claim.authority]})


def _about(path: Path) -> str:
    """The first line of what a script says of itself."""
    try:
        said = ast.get_docstring(ast.parse(path.read_text("utf-8")))
    except (SyntaxError, ValueError, OSError) as fault:
        raise ForeignFile(f"{path}: not readable as Python ({fault})") from None
    return (said or path.stem).partition("\n")[0]
