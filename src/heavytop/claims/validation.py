"""What was measured of the claims: one document, and whether all of them hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Final

from heavytop.claims.claim import OURS, Claim
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
        What went wrong, where that is not a number beyond its bound; a number that was measured
        before it did is kept.
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


def counts(results: Iterable[Measured]) -> dict[str, int]:
    """How many hold, do not hold, and were skipped."""
    words = {True: "passed", False: "failed", None: "skipped"}
    found = dict.fromkeys(words.values(), 0)
    for each in results:
        found[words[each.passed]] += 1
    return found


@dataclass(frozen=True, slots=True)
class Validation:
    """The claims that were looked at.

    Parameters
    ----------
    results : tuple of Measured
        In the order of the register.
    proofs : bool
        Whether every script was asked for.
    asked : tuple of str
        The names that were asked for; none where all registered claims were.
    """

    results: tuple[Measured, ...]
    proofs: bool = False
    asked: tuple[str, ...] = ()

    @property
    def failed(self) -> tuple[Measured, ...]:
        """What does not hold."""
        return tuple(each for each in self.results if each.passed is False)

    @property
    def counts(self) -> dict[str, int]:
        """How many hold, do not hold, and were skipped."""
        return counts(self.results)

    def document(self, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """The document of the schema ``heavytop/validate/1``.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return {
            "schema": SCHEMA,
            "asked": list(self.asked),
            "proofs": self.proofs,
            "counts": self.counts,
            "authorities": len({each.claim.authority for each in self.results} - {OURS}),
            "claims": [each.row for each in self.results],
            "files": dict(files or {}),
            "versions": versions(),
        }
