"""What the verb find prints: solutions with their brackets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from heavytop.analytic.find import unit_of
from heavytop.results.base import Fact, Result
from heavytop.scene.quantities import Quantity


def fact_quantity(name: str, form: str = ".12g") -> Quantity:
    """A fact, or a key of a scene, as a quantity."""
    return Quantity(name.replace("_", " "), unit_of(name), format=form)


@dataclass(frozen=True, kw_only=True, repr=False)
class FoundResult(Result):
    """What `heavytop find` found: its solutions, and why there are no others."""

    schema: ClassVar = "heavytop/find/1"
    heading: ClassVar = "Found"

    scene: Mapping[str, Any]
    vary: str
    so_that: str
    solutions: Sequence[Any]
    why: str

    def facts(self) -> Iterator[Fact]:
        """The solutions, and the facts of each."""
        key = self.vary.partition("=")[0].strip()
        varied = fact_quantity(key)
        yield "so that", self.so_that
        for each in self.solutions:
            low, high = (f"{end * varied.shown[1]:.17g}" for end in each.bracket)
            yield key, f"{varied.with_unit(each.value)}, proved between {low} and {high}"
            facts = {fact_quantity(name): x for name, x in each.facts.items() if x is not None}
            yield (
                "",
                ", ".join(f"{q.symbol} {q.with_unit(x, form='.6g')}" for q, x in facts.items()),
            )
        if self.why:
            yield "", self.why
