"""The result of a validation: claims, and what was measured."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any, ClassVar, Final

from heavytop.errors import Exit
from heavytop.results.base import Result, group
from heavytop.results.table import FAIL, Fact, Table
from heavytop.scene.quantities import QUANTITIES, Quantity

THIS_PROJECT: Final = "this project"  # the authority of claims that have no outside one
VERDICTS: Final = {True: "ok", False: FAIL, None: "skip"}
MEANINGS: Final = {"verdict": Quantity("", ""), "statement": Quantity("claim", ""),
                   "bound": QUANTITIES["claim_bound"]}  # fmt: skip
CLAIM_COLUMNS: Final = ("verdict", "statement", "numbers", "measured", "bound")


class Validation(Result):
    """The claims that were measured.

    Attributes
    ----------
    asked : tuple of str
        The names that were given; empty where all registered claims were measured.
    proofs : bool
        Whether the claims of this project's own authority were measured too.
    claims : tuple of mapping
        In the order of their scripts, of which they have ``id``, ``statement``, ``authority``,
        ``numbers``, ``bound``, ``reason``, ``script``, ``holds`` and ``needs``. ``measured`` is
        None where nothing came out; ``passed`` is None where it was skipped, and ``skipped`` says
        why. ``failure`` says what went wrong, where that is not a number beyond its bound.
    """

    schema: ClassVar = "heavytop/validate/1"
    heading: ClassVar = "Claims"
    table: ClassVar = "claims"
    index: ClassVar = ("id",)

    asked: tuple[str, ...] = ()
    proofs: bool = False
    claims: tuple[Any, ...]

    @property
    def failed(self) -> tuple[Any, ...]:
        """The claims that do not hold."""
        return tuple(each for each in self.claims if each["passed"] is False)

    @property
    def counts(self) -> dict[str, int]:
        """The numbers of claims that hold, do not hold, and were skipped."""
        found = Counter(each["passed"] for each in self.claims)
        return {"passed": found[True], "failed": found[False], "skipped": found[None]}

    def document(self) -> dict[str, Any]:
        """Return the document heavytop/validate/1, with what follows from the claims."""
        authorities = {each["authority"] for each in self.claims} - {THIS_PROJECT}
        return super().document() | {"counts": self.counts, "authorities": len(authorities)}

    def facts(self) -> Iterator[Fact]:
        """Yield how many claims hold; what went wrong or was skipped, and why."""
        yield "claims", ", ".join(f"{count} {word}" for word, count in self.counts.items())
        yield "", "a claim holds if the measured number is at most its bound"
        for claim in self.claims:
            if claim["skipped"]:
                yield claim["id"], f"skipped: {claim['skipped']}"
            elif claim["failure"] or claim["passed"] is False:
                yield claim["id"], claim["failure"] or "out of its bound"

    def tables(self) -> Iterator[Table]:
        """Yield for each authority the table of its claims."""
        for (authority,), claims in group(self.claims, "authority").items():
            rows = [{"verdict": VERDICTS[each["passed"]], **each} for each in claims]
            yield Table(rows, CLAIM_COLUMNS, authority, MEANINGS, left=3)

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """Yield the claims that do not hold."""
        for claim in self.failed:
            why = f": {claim['failure']}" if claim["failure"] else ""
            yield Exit.OUT_OF_BOUND, f"{claim['id']} does not hold{why}"
