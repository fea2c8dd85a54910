"""The result of an atlas: its axes, how many pixels have which kind, and where kinds meet."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from heavytop.results.base import Number, Part, Problem, Result, Text


@dataclass(frozen=True, kw_only=True)
class AxisRange(Part):
    """One side of a map: `count` values from `low` to `high`, both among them."""

    name: Text
    low: Number
    high: Number
    count: int
    log: bool


@dataclass(frozen=True, kw_only=True)
class BoundaryCurve(Part):
    """A piece of a boundary, by its points; a single one where it is a point of the plane."""

    name: Text
    x: tuple[Number, ...]
    y: tuple[Number, ...]


@dataclass(frozen=True, kw_only=True, repr=False)
class AtlasResult(Result):
    """What is known of an atlas without its map, which is in ``atlas.nc``.

    Attributes
    ----------
    scene : Problem
        It says every number that no axis changes.
    axes : dict from str to AxisRange
        ``x`` and ``y``.
    shape : (int, int)
        Pixels along y, and along x.
    what : str
        ``kind`` or ``rows``.
    counts, details : dict from str to int
        How many pixels there are of each kind that occurs, and of each that is told apart further.
    sent : int
        How many pixels doubles could not decide, so that interval arithmetic was used.
    uncertified : int
        How many pixels have a kind that is not proved.
    curves : tuple of BoundaryCurve
        The boundaries between kinds.
    kinds_per_s, rows_per_s : float or None
        Pixels computed here in a second, of all processes together; whole rows.
    jobs : int or None
        Processes that computed them.
    """

    schema: Literal["heavytop/atlas/1"] = "heavytop/atlas/1"
    scene: Problem
    axes: Mapping[Literal["x", "y"], AxisRange]
    shape: tuple[int, int]
    what: Text
    counts: Mapping[Text, int]
    details: Mapping[Text, int]
    sent: int
    uncertified: int
    curves: tuple[BoundaryCurve, ...]
    kinds_per_s: Number | None = None
    rows_per_s: Number | None = None
    jobs: int | None = None

    def __repr__(self) -> str:
        y, x = self.shape
        axes = f"{self.axes['y'].name} × {self.axes['x'].name}, {y} × {x} pixels"
        return f"<Atlas: {axes}: {', '.join(f'{n} {name}' for name, n in self.counts.items())}>"
