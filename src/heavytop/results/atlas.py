"""The result of an atlas: its axes, how many pixels have which kind, and where kinds meet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Final

from heavytop.errors import Exit
from heavytop.results.base import Chart, Fact, Result, Table, given, with_unit

ROLES: Final = {
    "theta": "tilt",
    "thetadot": "nodding",
    "phidot": "precession",
    "psidot": "spin",
    "omega3": "spin",
    "p_phi": "precession",
    "p_psi": "spin",
    "E": "nodding",
    "A": "A",
    "C": "C",
    "gMR": "gMR",
}
"""What may change along an axis, and what it sets: two axes of a plane set different things."""


@dataclass(frozen=True, kw_only=True, repr=False)
class AtlasResult(Result):
    """What is known of an atlas without its map, which is in ``atlas.nc``.

    Attributes
    ----------
    scene : mapping
        It says every number that no axis changes.
    axes : mapping
        ``x`` and ``y``: ``name``, and ``count`` values from ``low`` to ``high``, both among them,
        maybe ``log``.
    shape : (int, int)
        Pixels along y, and along x.
    what : str
        ``kind`` or ``rows``.
    counts, details : mapping from str to int
        How many pixels there are of each kind that occurs, and of each that is told apart further.
    sent : int
        How many pixels doubles could not decide, so that interval arithmetic was used.
    uncertified : int
        How many pixels have a kind that is not proved.
    curves : tuple of mapping
        Pieces of the boundaries between kinds, by ``name`` and their points ``x`` and ``y``; a
        single one where it is a point of the plane.
    kinds_per_s, rows_per_s : float or None
        Pixels computed here in a second, of all processes together; whole rows.
    jobs : int or None
        Processes that computed them.
    """

    schema: ClassVar = "heavytop/atlas/1"
    heading: ClassVar = "Atlas"
    chart: ClassVar = Chart("atlas.atlas_figure", "kinds of motion, and their boundaries", "counts")
    goes_on: ClassVar = True
    costs: ClassVar = ("kinds_per_s", "rows_per_s", "jobs")

    scene: Mapping[str, Any]
    axes: Any
    shape: tuple[int, int]
    what: str
    counts: Mapping[str, int]
    details: Mapping[str, int]
    sent: int
    uncertified: int
    curves: tuple[Any, ...]
    kinds_per_s: float | None = None
    rows_per_s: float | None = None
    jobs: int | None = None

    def document(self, *, costs: bool = True) -> dict[str, Any]:
        """Return what was found, for JSON; the map itself is in ``atlas.nc``.

        Parameters
        ----------
        costs : bool
            Whether with what it took; without it there are no wall-clock values.
        """
        return super().document() | ({} if costs else dict.fromkeys(self.costs))

    def facts(self) -> Iterator[Fact]:
        """The axes, what is held, and the boundaries."""
        for side, axis in self.axes.items():
            ends = with_unit(axis.name, f"{axis.low:.6g} … {axis.high:.6g}")
            scale = ", logarithmic" if axis.log else ""
            yield side, f"{axis.name} = {ends}, {axis.count} values{scale}"
        changed = {ROLES[axis.name] for axis in self.axes.values()}
        held = (self.scene["top"] | self.scene["start"]).items()
        yield "held", given({n: x for n, x in held if n in ROLES and ROLES[n] not in changed})
        yield "not proved", str(self.uncertified)
        lines = Counter(curve.name for curve in self.curves).items()
        counted = (f"{name} ({n} line{'s' * (n > 1)})" for name, n in lines)
        yield "boundaries", ", ".join(counted) or "none"
        yield "decided by intervals", str(self.sent)
        if self.kinds_per_s is not None:
            yield "pixels per second", f"{self.kinds_per_s:.3g}"

    def tables(self) -> Iterator[Table]:
        """How many pixels there are of each kind, and of its parts; every pixel once."""
        counts = dict(self.counts)
        for part, count in self.details.items():
            counts[part.partition(",")[0]] -= count
        pixels = {name: count for name, count in counts.items() if count}
        pixels |= self.details
        every = sum(pixels.values()) or 1
        order = sorted(pixels.items(), key=lambda each: -each[1])
        rows = [{"kind": name, "pixels": n, "share": n / every} for name, n in order]
        yield Table(rows, ("kind", "pixels", "share"))

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """A note where axes about 0 have no pixel at 0, where cusps and planar motions may lie."""
        around = [x for x in self.axes.values() if x.low == -x.high and not x.count % 2]
        if around:
            none = " or ".join(f"{axis.name} = 0" for axis in around)
            odd = f"an odd COUNT, such as {around[0].count + 1}, gives one"
            yield Exit.OK, f"note: no pixel has {none}; {odd}"
