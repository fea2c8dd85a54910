"""The result of an atlas: a map of kinds and numbers, counts of pixels, boundaries of kinds."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

from numpy.typing import NDArray

from heavytop.files import expect_intact, expect_sealed, write_sealed
from heavytop.results.base import Result, nonzero
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import quantity_of

if TYPE_CHECKING:
    import pandas
    import xarray

ROLES: Final = {
    "theta": "tilt", "thetadot": "nodding", "E": "nodding", "phidot": "precession",
    "p_phi": "precession", "psidot": "spin", "omega3": "spin", "p_psi": "spin",
    "A": "A", "C": "C", "gMR": "gMR",
}  # fmt: skip
"""What may vary along an axis, and what that sets: two axes of a plane set different things."""


MAP: Final = "atlas.nc"


class Atlas(Result):
    """A plane of tops and what kind of motion each of its pixels is.

    ``atlas["period"]`` is a column, as an array of shape (y, x): ``theta_min`` and ``theta_max``
    [rad], ``period`` [s], ``precession`` and ``spin`` in a period [rad], ``kind`` as an index of
    `names`.

    Attributes
    ----------
    map : xarray.Dataset
        All columns, dimensions named as the axes, y first; None where its file is not there.
    scene : mapping
        It gives every number that no axis changes.
    axes : mapping
        ``x`` and ``y``: ``name``, and ``count`` values from ``low`` to ``high``, both among them,
        maybe ``log``.
    shape : (int, int)
        Pixels along y, and along x.
    what : str
        ``kind`` or ``rows``.
    counts, details : mapping from str to int
        Numbers of pixels of each kind that occurs, and of each subdivision of a kind.
    uncertified : int
        How many pixels have a kind that is not proved.
    curves : tuple of mapping
        Pieces of the boundaries between kinds, by ``name`` and their points ``x`` and ``y``; a
        single one where it is a point of the plane.
    kinds_per_s, rows_per_s : float or None
        Pixels computed in a second by all processes together [1/s], for the atlas' ``what``; None
        in its folder.
    """

    schema: ClassVar = "heavytop/atlas/1"
    data_file: ClassVar = MAP
    left_out: ClassVar = ("map",)

    __eq__, __hash__ = object.__eq__, object.__hash__
    map: xarray.Dataset | None = None
    scene: Mapping[str, Any]
    axes: Any
    shape: tuple[int, int]
    what: str
    counts: Mapping[str, int]
    details: Mapping[str, int]
    uncertified: int
    curves: tuple[Any, ...]
    kinds_per_s: float | None = None
    rows_per_s: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The kinds of motion, by the codes of ``kind``."""
        return tuple(self.to_xarray()["kind"].attrs["flag_meanings"].split())

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column, shape (y, x); KeyError if there is none of this name."""
        column: NDArray[Any] = self.to_xarray()[name].values
        return column

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return the atlas of ``atlas.json``; its map is read from its file when it is used.

        Parameters
        ----------
        path : path

        Raises
        ------
        ForeignFile
            It is no atlas, or its map is damaged.
        """
        found, place = super().load(path), Path(path).with_name(MAP)
        if "map" not in found.files or not place.is_file():
            return found
        with expect_intact(place):
            import xarray

            expect_sealed(place)
            known = xarray.open_dataset(place, engine="h5netcdf", mask_and_scale=False)
        return replace(found, map=known)

    def to_xarray(self) -> xarray.Dataset:
        """Return the map, an xarray Dataset with units and names.

        Raises
        ------
        LookupError
            Its file is not there.
        """
        if self.map is None:
            raise LookupError(f"the map of this atlas is not there: {MAP}")
        return self.map

    def to_pandas(self) -> pandas.DataFrame:
        """Return a pandas DataFrame with a row for each pixel, units in its attributes.

        Its index are the values of both axes, y first.
        """
        over = tuple(map(str, self.to_xarray().dims))
        found = self.to_xarray().to_dataframe(dim_order=over)
        found.attrs = Table((), (*over, *map(str, self.to_xarray()))).to_pandas().attrs
        return found

    def without_times(self) -> Mapping[str, Any]:
        """Without how fast it was, which `resume` may change."""
        return {"kinds_per_s": None, "rows_per_s": None}

    def save_data(self, folder: Path) -> dict[str, str]:
        """Write ``atlas.nc``, whole or not at all.

        Parameters
        ----------
        folder : Path
        """
        packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True, "_FillValue": None}
        known = self.to_xarray()
        how: dict[str, Any] = {"engine": "h5netcdf", "encoding": dict.fromkeys(known, packed)}
        write_sealed(folder / MAP, lambda part: known.to_netcdf(part, **how))
        return {"map": MAP}

    def facts(self) -> Iterator[Fact]:
        """Yield the axes, the numbers that no axis changes, and the boundaries."""
        for side, axis in self.axes.items():
            ends = quantity_of(axis.name).with_unit(axis.low, axis.high, between=" … ", form=".6g")
            scale = ", logarithmic" if axis.log else ""
            yield side, f"{axis.name} = {ends}, {axis.count} values{scale}"
        changed = {ROLES[axis.name] for axis in self.axes.values()}
        held = (self.scene["top"] | self.scene["start"]).items()
        kept = {name: x for name, x in held if name in ROLES and ROLES[name] not in changed}
        yield "held", nonzero(kept)
        yield "not proved", str(self.uncertified)
        if self.counts.get("impossible"):
            yield "impossible", "no top or start has these numbers; θ is 0 … π rad"
        lines = Counter(curve.name for curve in self.curves).items()
        counted = (f"{name} ({n} line{'s' * (n > 1)})" for name, n in lines)
        yield "boundaries", ", ".join(counted) or "none"
        if speed := self.kinds_per_s or self.rows_per_s:
            yield "pixels per second", f"{speed:.3g}"

    def tables(self) -> Iterator[Table]:
        """Yield the table of pixels by kind and its subdivisions, in which every pixel is once."""
        pixels = Counter(self.counts)
        for part, count in self.details.items():
            pixels[part.partition(",")[0]] -= count
        pixels = +pixels | Counter(self.details)
        every = pixels.total() or 1
        rows = [{"kind": x, "pixels": n, "share": n / every} for x, n in pixels.most_common()]
        yield Table(rows, ("kind", "pixels", "share"))
