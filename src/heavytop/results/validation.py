"""The result of a validation: what is claimed, and what was measured."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from heavytop.results.base import Number, Part, Result, Text

OURS: Final = "this project"  # as an authority: of the claims that a script states of itself


@dataclass(frozen=True, kw_only=True)
class CheckedClaim(Part):
    """One claim, and what came of it.

    Attributes
    ----------
    id, statement, authority, numbers, reason, script : str
        As in the register.
    bound : float or None
    holds : tuple of str
    needs : str or None
    measured : float or None
        None where it was skipped, and where nothing came out.
    passed : bool or None
        None where it was skipped.
    skipped : str or None
        Why, where it was.
    failure : str or None
        What went wrong, where that is not a number beyond its bound; a number that was measured
        before it did is kept.
    """

    id: Text
    statement: Text
    authority: Text
    numbers: Text
    bound: Number | None
    reason: Text = ""
    script: Text = ""
    holds: tuple[Text, ...] = ()
    needs: Text | None = None
    measured: Number | None = None
    passed: bool | None = None
    skipped: Text | None = None
    failure: Text | None = None


@dataclass(frozen=True, kw_only=True)
class Validation(Result):
    """The claims that were looked at.

    Attributes
    ----------
    asked : tuple of str
        The names that were asked for; none where all registered claims were.
    proofs : bool
        Whether every script was asked for.
    claims : tuple of CheckedClaim
        In the order of the register.
    """

    schema: Literal["heavytop/validate/1"] = "heavytop/validate/1"
    asked: tuple[Text, ...] = ()
    proofs: bool = False
    claims: tuple[CheckedClaim, ...]

    @property
    def failed(self) -> tuple[CheckedClaim, ...]:
        """What does not hold."""
        return tuple(each for each in self.claims if each.passed is False)

    @property
    def counts(self) -> dict[str, int]:
        """How many hold, do not hold, and were skipped."""
        return counts(self.claims)

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/validate/1, with what follows from the claims.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return super().document(files=files) | {
            "counts": self.counts,
            "authorities": len({each.authority for each in self.claims} - {OURS}),
        }


def counts(claims: Iterable[CheckedClaim]) -> dict[str, int]:
    """Return how many claims hold, do not hold, and were skipped."""
    found = Counter(each.passed for each in claims)
    return {"passed": found[True], "failed": found[False], "skipped": found[None]}
