"""What the verbs find and sweep print: solutions with their brackets, and facts over a range."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from heavytop.analytic.find import unit_of
from heavytop.results.base import Chart, Fact, Result, Table
from heavytop.scene.quantities import Quantity


def _quantity(name: str, form: str = ".12g") -> Quantity:
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
        varied = _quantity(key)
        yield "so that", self.so_that
        for each in self.solutions:
            low, high = (f"{end * varied.shown[1]:.17g}" for end in each.bracket)
            value = f"{varied.text(each.value)} {varied.shown[0]}".rstrip()
            yield key, f"{value}, proved between {low} and {high}"
            shown = ((_quantity(name, ".6g"), x) for name, x in each.facts.items() if x is not None)
            yield "", ", ".join(f"{q.symbol} {q.text(x)} {q.shown[0]}".rstrip() for q, x in shown)
        if self.why:
            yield "", self.why


@dataclass(frozen=True, kw_only=True, repr=False)
class SweepResult(Result):
    """What `heavytop sweep` tabulates: the kind of motion and its facts for each value."""

    schema: ClassVar = "heavytop/sweep/1"
    heading: ClassVar = "Sweep"
    chart: ClassVar = Chart("studies.sweep_figure", "facts over the range", "sweep")

    scene: Mapping[str, Any]
    over: str
    sweep: Sequence[Any]

    def tables(self) -> Iterator[Table]:
        """A row for each value."""
        names = [*self.sweep[0]]
        yield Table(self.sweep, names, meanings={x: _quantity(x, ".8g") for x in names}, left=0)

    def document(self, *, costs: bool = True) -> dict[str, Any]:
        """Return the result for JSON."""
        found = super().document(costs=costs)
        return {"rows" if name == "sweep" else name: x for name, x in found.items()}
