"""The register of claims: what is measured, on whose authority, to what bound, by which script."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from heavytop.errors import ForeignFile, HeavyTopError

NAME: Final = "claims.toml"
PACKAGE: Final = Path(__file__).parents[1]
PACKED: Final = PACKAGE / "_validation"  # where a wheel has them
BESIDE: Final = PACKAGE.parents[1] / "validation"  # where a checkout has them
NUMBERS: Final = {
    "printed": "figures that the authority printed",
    "program": "the authority's own program, run here",
    "formula": "the authority's formula or theorem, evaluated here",
    "ours": "the authority's equations, integrated by code of this project",
}
"""Whose numbers a claim is held against."""

Line: TypeAlias = Annotated[
    str, Field(pattern=r"^[^\x00-\x1f\x7f]*[^\s\x00-\x1f\x7f][^\x00-\x1f\x7f]*$")
]
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
    proofs : tuple of str
        Scripts that only ``--proofs`` runs.
    """

    folder: Path
    claims: tuple[Claim, ...]
    proofs: tuple[str, ...]

    @cached_property
    def scripts(self) -> dict[str, tuple[Claim, ...]]:
        """Every script with the registered claims that it measures, in the order of the file."""
        found: dict[str, tuple[Claim, ...]] = {}
        for claim in self.claims:
            found[claim.script] = (*found.get(claim.script, ()), claim)
        return found | dict.fromkeys(self.proofs, ())

    @property
    def names(self) -> tuple[str, ...]:
        """What can be asked for: claims, and scripts without their ending."""
        return (*(claim.id for claim in self.claims), *map(stem, self.scripts))


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
        claims = tuple(_whole(claim, found.authorities, place) for claim in found.claim)
        scripts = sorted(each.name for each in place.glob("[0-9]*.py"))
        measured = {claim.script for claim in claims}
        register = Register(place, claims, tuple(each for each in scripts if each not in measured))
        if twice := [name for name, n in Counter(register.names).items() if n > 1]:
            raise ValueError(f"{twice[0]!r}: the name of two claims, or of a claim and a script")
    except FileNotFoundError:
        raise HeavyTopError(f"{path} is not there: installed without its claims") from None
    except ValidationError as wrong:  # every fault with its place: claims are counted from 0
        faults = ((".".join(map(str, each["loc"])), each) for each in wrong.errors())
        told = (f"{where} = {each['input']!r:.60}: {each['msg']}" for where, each in faults)
        raise ForeignFile(f"{path}: {'; '.join(told)}") from None
    except (ValueError, OSError) as fault:  # of TOML, of letters, of the file, or ours
        raise ForeignFile(f"{path}: {fault}") from None
    return register


def _whole(claim: Claim, authorities: Mapping[str, str], place: Path) -> Claim:
    """The claim with its authority in full, if that and its script are there."""
    if claim.authority not in authorities:
        known = ", ".join(authorities)
        raise ValueError(f"claim {claim.id!r}: authority = {claim.authority!r}: none of {known}")
    if not (place / claim.script).is_file():
        raise ValueError(f"claim {claim.id!r}: script = {claim.script!r}: not there")
    return claim.model_copy(update={"authority": authorities[claim.authority]})
