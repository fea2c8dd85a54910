"""The register of claims: what ``claims.toml`` says, and where its scripts are."""

from __future__ import annotations

import ast
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from heavytop.claims.claim import SCRIPT, Claim, is_text
from heavytop.claims.told import words
from heavytop.errors import ForeignFile, HeavyTopError

NAME: Final = "claims.toml"
PACKAGE: Final = Path(__file__).parents[1]
PACKED: Final = PACKAGE / "_validation"  # where a wheel has them
BESIDE: Final = PACKAGE.parents[1] / "validation"  # where a checkout has them


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
    ForeignFile
        It is not as it should be; the message names the claim.

    Examples
    --------
    >>> load_register().scripts["35_steady.py"][0].id
    'betsch-cone'
    """
    place = folder or (PACKED if (PACKED / NAME).is_file() else BESIDE)
    try:
        claims = tuple(_claims(tomllib.loads((place / NAME).read_text("utf-8")), place))
    except FileNotFoundError:
        raise HeavyTopError(f"{place / NAME} is not there: installed without its claims") from None
    except (ValueError, RecursionError, OSError) as fault:  # of TOML, letters, a claim, the file
        raise ForeignFile(f"{place / NAME}: {fault}") from None
    proofs = dict(_others(place, {claim.script for claim in claims}))
    scripts = {stem(script) for script in (*proofs, *(claim.script for claim in claims))}
    if both := next((claim.id for claim in claims if claim.id in scripts), None):
        raise ForeignFile(f"{place / NAME}: claim {both!r}: the name of a script as well")
    return Register(place, claims, proofs)


def _claims(tables: Mapping[str, Any], folder: Path) -> Iterator[Claim]:
    """The claims of a file, each name told apart and each script there."""
    found, authorities = tables.get("claim", []), tables.get("authorities", {})
    if not isinstance(found, list) or not all(isinstance(each, dict) for each in found):
        raise ForeignFile("claims stand under [[claim]]")
    if not isinstance(authorities, dict) or not all(map(is_text, authorities.values())):
        raise ForeignFile("authorities, each a text, stand under [authorities]")
    claims = [Claim.of(each, authorities) for each in found]
    times = Counter(claim.id for claim in claims)
    for claim in claims:
        if times[claim.id] > 1:
            raise ForeignFile(f"claim {claim.id!r} stands there {times[claim.id]} times")
        if not (folder / claim.script).is_file():
            raise ForeignFile(f"claim {claim.id!r}: script = {claim.script!r}: not there")
        yield claim


def _others(folder: Path, registered: set[str]) -> Iterator[tuple[str, str]]:
    """The other numbered scripts, and the first line of what each says of itself."""
    for path in sorted(folder.glob("[0-9]*.py")):
        if path.name not in registered:
            yield path.name, words(_about(path).partition("\n")[0])


def _about(path: Path) -> str:
    """What a script says of itself."""
    if not SCRIPT.fullmatch(path.name) or not path.is_file():
        raise ForeignFile(f"{words(str(path))}: not the plain name of a .py file")
    try:
        return ast.get_docstring(ast.parse(path.read_text("utf-8"))) or path.stem
    except (SyntaxError, ValueError, RecursionError, MemoryError, OSError) as fault:
        raise ForeignFile(f"{path}: not readable as Python ({fault})") from None
