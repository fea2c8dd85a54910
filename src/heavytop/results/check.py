"""A check as a page reads it back: what is said of a trajectory of somebody else."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from heavytop.results.base import Chart, Fact, Result, draw


@dataclass(frozen=True, kw_only=True, repr=False)
class CheckResult(Result):
    """What `heavytop.Check.document` says of a trajectory of somebody else."""

    schema: ClassVar = "heavytop/check/1"
    heading: ClassVar = "Check"
    chart: ClassVar = Chart("studies.check_figure", "errors and phase over time", "curves")

    scene: Mapping[str, Any]
    origin: str
    data: Any
    errors: Mapping[str, Any]
    growth: Mapping[str, float | None]
    events: Mapping[str, Any]
    condition: float
    digits: float
    digits_as_given: float
    conventions: Sequence[Any]
    alternatives: Sequence[Any]
    method: Mapping[str, Any]
    assumed: Sequence[str]
    slip: Any
    curves: Mapping[str, Any]

    def facts(self) -> Iterator[Fact]:
        """The errors of the trajectory, its events, and the slip that explains them."""
        from heavytop.checking.result import lines  # which brings numpy along

        return lines(self.document())

    def charts(self) -> Mapping[str, Callable[..., Any]]:
        """The errors over time, and how far the data run ahead."""
        return {
            "errors": draw("studies", "checked_errors", self),
            "phase": draw("studies", "checked_phase", self),
        }
