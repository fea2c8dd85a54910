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
        """The solutions, and the facts of each; or why there is none."""
        key = self.vary.partition("=")[0].strip()
        yield "so that", self.so_that
        for each in self.solutions:
            ends = fact_quantity(key, ".17g").with_unit(*each.bracket, between=" and ")
            yield key, f"{fact_quantity(key).with_unit(each.value)}, proved between {ends}"
            known = {fact_quantity(n, ".6g"): x for n, x in each.facts.items() if x is not None}
            yield "", ", ".join(f"{of.symbol} {of.with_unit(x)}" for of, x in known.items())
        if self.why:
            yield "", self.why
