"""One tile of an atlas: kinds by the criteria, rows by the closed form, kinds by integration."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.many_motions import motions_many
from heavytop.classification.many import Verdicts, classify_many
from heavytop.studies.atlas_integrated import integrated
from heavytop.studies.atlas_plane import Columns, Plane, Tile, mirrored, restored
from heavytop.studies.atlases.columns import SETS

VERDICTS: Final = ("kind", "detail", "certified", "tags", "open_tags", "margin")
CLOSED: Final = ("theta_min", "theta_max", "period", "precession", "spin")


class Computed(NamedTuple):
    """A tile.

    Attributes
    ----------
    columns : dict from str to ndarray, shape (rows, columns)
    sent : int
        How many pixels doubles could not tell, and balls were asked.
    """

    columns: Columns
    sent: int


def tile_of(plane: Plane, tile: Tile, what: str) -> Computed:
    """Compute a tile.

    Parameters
    ----------
    plane : Plane
    tile : Tile
    what : str
        A key of `columns.SETS`.
    """
    tops: dict[str, Any] = plane.tops(tile)
    bottom = np.broadcast_to(np.equal(tops["theta"], np.pi), tile.shape)
    seen = mirrored(tops, bottom) if bottom.any() else tops
    columns, sent = _columns(seen, what)
    if bottom.any():
        columns = restored(columns, tops, bottom)
    if what == "integrate":
        columns["integrated"] = integrated(tops, columns["period"])
    wanted = SETS[what]
    shaped = {name: _as(columns[name], wanted[name].dtype, tile) for name in wanted}
    return Computed(shaped, sent)


def _columns(tops: dict[str, Any], what: str) -> tuple[Columns, int]:
    """Kinds, and unless these are all that is asked for, rows; how many balls were asked about."""
    columns: dict[str, Any] = {}
    if what == "kind":
        verdicts = classify_many(**tops)
    else:
        found = motions_many(**tops, tags=True)
        verdicts = found.verdicts
        columns = {name: getattr(found, name) for name in CLOSED}
    columns |= {
        name: getattr(verdicts, name) for name in VERDICTS if getattr(verdicts, name) is not None
    }
    return columns, verdicts.sent


def details(columns: Columns) -> dict[str, int]:
    """How many pixels of a tile there are of each kind that is told apart further."""
    both = columns["kind"].astype(np.int64) * len(Verdicts.details) + columns["detail"]
    codes, counted = np.unique(both[columns["detail"] > 0], return_counts=True)
    pairs = (divmod(code, len(Verdicts.details)) for code in codes.tolist())
    words = (f"{Verdicts.names[kind]}, {Verdicts.details[detail]}" for kind, detail in pairs)
    return dict(zip(words, counted.tolist(), strict=True))


def counts(columns: Columns) -> dict[str, int]:
    """How many pixels of a tile are of each kind."""
    counted = np.bincount(columns["kind"].ravel(), minlength=len(Verdicts.names)).tolist()
    return {name: n for name, n in zip(Verdicts.names, counted, strict=True) if n}


def _as(array: Any, dtype: str, tile: Tile) -> NDArray[Any]:
    return np.broadcast_to(np.asarray(array), tile.shape).astype(dtype)
