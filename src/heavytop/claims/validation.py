"""What was measured of the claims: one document, and whether all of them hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from heavytop.claims.register import Claim
from heavytop.machine import versions

SCHEMA: Final = "heavytop/validate/1"


@dataclass(frozen=True, slots=True)
class Measured:
    """One claim, and what came of it.

    Parameters
    ----------
    claim : Claim
    measured : float, optional
        None where it was skipped, and where nothing came out.
    passed : bool, optional
        None where it was skipped.
    skipped : str, optional
        Why, where it was.
    failure : str, optional
        What happened instead, where nothing came out.
    """

    claim: Claim
    measured: float | None = None
    passed: bool | None = None
    skipped: str | None = None
    failure: str | None = None

    @property
    def row(self) -> dict[str, Any]:
        """The claim as a table of the document."""
        found = {name: getattr(self, name) for name in ("measured", "passed", "skipped", "failure")}
        said = asdict(self.claim)
        said["holds"] = list(said["holds"])
        return {**said, **found}


@dataclass(frozen=True, slots=True)
class Validation:
    """The claims that were looked at.

    Parameters
    ----------
    results : tuple of Measured
        In the order of the register.
    proofs : bool
        Whether every script was asked for.
    """

    results: tuple[Measured, ...]
    proofs: bool = False

    @property
    def failed(self) -> tuple[Measured, ...]:
        """What does not hold."""
        return tuple(each for each in self.results if each.passed is False)

    @property
    def counts(self) -> dict[str, int]:
        """How many hold, do not hold, and were skipped."""
        words = {True: "passed", False: "failed", None: "skipped"}
        found = dict.fromkeys(words.values(), 0)
        for each in self.results:
            found[words[each.passed]] += 1
        return found

    def document(self, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """The document of the schema ``heavytop/validate/1``.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return {
            "schema": SCHEMA,
            "proofs": self.proofs,
            "counts": self.counts,
            "authorities": len({each.claim.authority for each in self.results}),
            "claims": [each.row for each in self.results],
            "files": dict(files or {}),
            "versions": versions(),
        }
