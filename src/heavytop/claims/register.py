"""The register of claims: what ``claims.toml`` says, and where its scripts are."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from heavytop.errors import HeavyTopError

NAME: Final = "claims.toml"
OURS: Final = "this project"
PACKAGE: Final = Path(__file__).parents[1]
PACKED: Final = PACKAGE / "_validation"  # where a wheel has them
BESIDE: Final = PACKAGE.parents[1] / "validation"  # where a checkout has them


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
    bound : float
        What is measured is at most this.
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
    bound: float
    reason: str
    script: str
    holds: tuple[str, ...]
    needs: str | None = None


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
    """A script's name without its ending.

    Examples
    --------
    >>> stem("31_book.py")
    '31_book'
    """
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

    Examples
    --------
    >>> load_register().scripts["35_steady.py"][0].id
    'betsch-cone'
    """
    place = folder or (PACKED if (PACKED / NAME).is_file() else BESIDE)
    try:
        tables = tomllib.loads((place / NAME).read_text("utf-8"))
    except FileNotFoundError:
        raise HeavyTopError(f"{place / NAME} is not there: installed without its claims") from None
    claims = tuple(_claim(each, tables["authorities"]) for each in tables.get("claim", ()))
    return Register(place, claims, dict(_others(place, {claim.script for claim in claims})))


def _others(folder: Path, registered: set[str]) -> Iterator[tuple[str, str]]:
    """The other numbered scripts, and the first line of what each says of itself."""
    for path in sorted(folder.glob("[0-9]*.py")):
        if path.name not in registered:
            said = ast.get_docstring(ast.parse(path.read_text("utf-8"))) or path.stem
            yield path.name, said.partition("\n")[0]


def _claim(table: Mapping[str, Any], authorities: Mapping[str, str]) -> Claim:
    said = {**table, "authority": authorities[table["authority"]]}
    return Claim(**{**said, "bound": float(table["bound"]), "holds": tuple(table["holds"])})
