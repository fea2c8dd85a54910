"""An atlas: what was found of every pixel of a plane."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.classification.kinds import Kind
from heavytop.classification.many import Verdicts
from heavytop.errors import ForeignFile
from heavytop.studies.atlas_plane import Columns, Tile
from heavytop.studies.atlases.columns import SETS, unpacked
from heavytop.studies.atlases.study import Study
from heavytop.studies.ledger import Book

if TYPE_CHECKING:
    import xarray

    from heavytop.studies.atlas_boundaries import Boundary

SCHEMA: Final = "heavytop/atlas/1"
ROUNDING: Final = 1e-10
"""Margins above this are no rounding of a run: there the integrated kind has to be the same."""
LISTED: Final = 1000  # pixels that differ, in the document


class Differing(NamedTuple):
    """A pixel whose integrated kind is another one.

    Attributes
    ----------
    x, y : float
        Where it is.
    kind, integrated : str
        What it is proved to be, and what the events of a run say.
    margin : float
        How far the nearest other verdict is.
    """

    x: float
    y: float
    kind: str
    integrated: str
    margin: float


@dataclass(frozen=True, repr=False)
class Atlas:
    """A plane of tops and what kind of motion each of its pixels is.

    ``atlas["period"]`` is a column, as an array of shape (y, x): ``theta_min`` and ``theta_max``
    [rad], ``period`` [s], ``precession`` and ``spin`` in a period [rad], ``margin``, ``kind`` as an
    index of `names`. `counts` and `details` say how many pixels there are of each kind, `curves`
    are the boundaries, `to_xarray()` is all of it.

    Attributes
    ----------
    study : Study
        The plane, and what was asked.
    book : Book
        Where the tiles are kept: a folder, or memory.
    tasks : tuple of str
        The tiles that are there: all, or those of a shard.
    jobs : int
        Processes that computed them.
    """

    study: Study
    book: Book
    tasks: tuple[str, ...]
    jobs: int = 1

    def __repr__(self) -> str:
        y, x = self.study.plane.shape
        axes = f"{self.study.plane.y.name} × {self.study.plane.x.name}, {y} × {x} pixels"
        return f"<Atlas: {axes}: {', '.join(f'{n} {name}' for name, n in self.counts.items())}>"

    @property
    def names(self) -> tuple[str, ...]:
        """What the codes of ``kind`` and ``integrated`` mean."""
        return Verdicts.names

    @property
    def whole(self) -> bool:
        """Whether every tile is there, and not only those of a shard."""
        return len(self.tasks) == len(self.study.tiles)

    @cached_property
    def counts(self) -> dict[str, int]:
        """How many pixels there are of each kind that occurs."""
        found = dict.fromkeys(self.names, 0)
        for _, row in self._rows():
            for name, count in row["counts"].items():
                found[name] += count
        return {name: count for name, count in found.items() if count}

    @cached_property
    def details(self) -> dict[str, int]:
        """How many pixels there are of each kind that is told apart further."""
        found: dict[str, int] = {}
        for _, row in self._rows():
            for name, count in row["details"].items():
                found[name] = found.get(name, 0) + count
        return found

    @cached_property
    def sent(self) -> int:
        """How many pixels doubles could not tell, so that balls were asked."""
        return sum(row["sent"] for _, row in self._rows())

    @cached_property
    def uncertified(self) -> int:
        """How many pixels have a kind that is not proved."""
        return sum(row["uncertified"] for _, row in self._rows())

    @property
    def per_s(self) -> float:
        """Pixels computed in a second, of all processes together."""
        pixels = sum(self.counts.values())
        spent = sum(self.book.spent_s(task) for task in self.tasks)
        return pixels / spent * self.jobs if spent else 0.0

    @cached_property
    def curves(self) -> tuple[Boundary, ...]:
        """The boundaries between kinds, as curves."""
        from heavytop.studies.atlas_boundaries import curves

        return curves(self.study.plane)

    @cached_property
    def differing(self) -> tuple[Differing, ...]:
        """The pixels whose integrated kind is another one, the largest margin first.

        Those that a run cannot tell are not among them: `untold` counts these.
        """
        found = [each for tile, columns in self.tiles() for each in self._differing(tile, columns)]
        return tuple(sorted(found, key=lambda each: -each.margin))

    @cached_property
    def untold(self) -> int:
        """How many pixels a run cannot tell, as what decides is below its own error."""
        code = self.names.index(Kind.UNDECIDED)
        return sum(int((columns["integrated"] == code).sum()) for _, columns in self.tiles())

    @property
    def unexplained(self) -> tuple[Differing, ...]:
        """Those of them whose margin is no rounding."""
        return tuple(each for each in self.differing if each.margin > ROUNDING)

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A column, shape (y, x): with several, `tiles` needs less memory.

        Raises
        ------
        KeyError
            It has no such column.
        """
        if name not in SETS[self.study.what]:
            raise KeyError(f"{name!r}: this atlas has {', '.join(SETS[self.study.what])}")
        dtype = SETS[self.study.what][name].dtype
        whole = np.full(self.study.plane.shape, *_nothing(dtype, name))
        for tile, columns in self.tiles():
            whole[tile.rows, tile.columns] = columns[name]
        return whole

    def tiles(self) -> Iterator[tuple[Tile, Columns]]:
        """The tiles and their columns, one at a time in memory."""
        for tile, row in self._rows():
            yield tile, unpacked(row["columns"], self.study.what, tile.shape)

    def document(
        self, *, costs: bool = True, files: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """Return what was found, for JSON; the map itself is in ``atlas.nc``.

        Parameters
        ----------
        costs : bool
            Whether with what it took; without it there are no wall-clock values.
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        plane, rate, what = self.study.plane, self.per_s, self.study.what
        document = {
            "schema": SCHEMA,
            "scene": self.study.identity["scene"],
            "axes": {"x": _axis(plane.x), "y": _axis(plane.y)},
            "shape": list(plane.shape),
            "what": what,
            "counts": self.counts,
            "details": self.details,
            "sent": self.sent,
            "uncertified": self.uncertified,
            "kinds_per_s": rate,
            "rows_per_s": rate if what == "rows" else None,
            "tops_per_s": rate if what == "integrate" else None,
            "jobs": self.jobs,
            "tiles": {"done": len(self.tasks), "all": len(self.study.tiles)},
            "curves": [each.document() for each in self.curves],
            "files": dict(files or {}),
        }
        if not costs:  # what is written holds no wall-clock values
            for name in ("kinds_per_s", "rows_per_s", "tops_per_s", "jobs"):
                del document[name]
        if what == "integrate":
            document["differing"] = len(self.differing)
            document["untold"] = self.untold
            document["unexplained"] = len(self.unexplained)
            document["pixels"] = [each._asdict() for each in self.differing[:LISTED]]
        return document

    def to_xarray(self) -> xarray.Dataset:
        """Return the columns as an xarray Dataset, dimensions named as the axes, y first."""
        import xarray

        from heavytop.studies.atlases.described import attributes, coordinates

        plane, what = self.study.plane, self.study.what
        dims = (plane.y.name, plane.x.name)
        variables = {name: (dims, self[name], attributes(name, what)) for name in SETS[what]}
        return xarray.Dataset(variables, coordinates(plane))

    def _rows(self) -> Iterator[tuple[Tile, Mapping[str, Any]]]:
        tiles = self.study.tiles
        for task in self.tasks:
            rows = [checked_row(self.book, task, k, row) for k, row in
                    enumerate(self.book.rows(task))]  # fmt: skip
            if len(rows) != 1:
                raise ForeignFile(f"{self.book.origin(task)}: {len(rows)} rows, not 1")
            yield tiles[task], rows[0]

    def _differing(self, tile: Tile, columns: Columns) -> Iterator[Differing]:
        x, y = self.study.plane.x.values, self.study.plane.y.values
        kind, run = columns["kind"], columns["integrated"]
        told = run != self.names.index(Kind.UNDECIDED)
        for row, column in np.argwhere((kind != run) & told).tolist():
            yield Differing(
                float(x[tile.columns.start + column]), float(y[tile.rows.start + row]),
                self.names[kind[row, column]], self.names[run[row, column]],
                float(columns["margin"][row, column]),
            )  # fmt: skip


def gathered(study: Study, book: Book, tasks: Sequence[str], jobs: int) -> Atlas:
    """Return the atlas of those of some tasks that are at their end.

    Raises
    ------
    ForeignFile
        A row is not what a tile writes.
    """
    atlas = Atlas(study, book, tuple(task for task in tasks if book.entry(task).ended), jobs)
    for _ in atlas._rows():
        pass
    return atlas


def checked_row(book: Book, task: str, k: int, row: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a row that has what the row of a tile has.

    Raises
    ------
    ForeignFile
    """
    counts = row.get("counts")
    sound = (
        isinstance(counts, dict)
        and all(name in Verdicts.names and type(n) is int and n >= 0 for name, n in counts.items())
        and all(type(row.get(name)) is int for name in ("sent", "uncertified"))
        and isinstance(row.get("columns"), dict)
        and isinstance(row.get("details"), dict)
        and all(type(n) is int and n >= 0 for n in row["details"].values())
    )
    if not sound:
        raise ForeignFile(f"{book.origin(task, k)}: not the row of a tile")
    return row


def _axis(axis: Any) -> dict[str, Any]:
    values = axis.values
    return {
        "name": axis.name,
        "low": float(values[0]),
        "high": float(values[-1]),
        "count": axis.count,
        "log": axis.log,
    }


def _nothing(dtype: str, name: str) -> tuple[Any, str]:
    """What stands in a column where no tile is."""
    if dtype != "u1":
        return np.nan, dtype
    return (255 if name in ("kind", "integrated", "detail") else 0), dtype
