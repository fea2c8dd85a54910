"""One tile of an atlas: kinds by the criteria, rows by the closed form, kinds by integration."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.atlases.columns import SETS, Columns
from heavytop.atlases.integrated import integrated
from heavytop.atlases.plane import Plane, Tile
from heavytop.kinds.many import Verdicts, classify_many
from heavytop.motions import motions_many

VERDICTS: Final = ("kind", "detail", "certified", "tags", "open_tags", "margin")
CLOSED: Final = ("theta_min", "theta_max", "period", "precession")


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
    columns: dict[str, Any] = {}
    if what == "kind":
        verdicts = classify_many(**tops)
    else:
        found = motions_many(**tops, tags=what == "rows")
        verdicts = found.verdicts
        columns = {name: getattr(found, name) for name in CLOSED}
    if what == "integrate":
        columns["integrated"] = integrated(tops, columns["period"])
    columns |= {name: getattr(verdicts, name) for name in VERDICTS}
    wanted = SETS[what]
    shaped = {name: _as(columns[name], wanted[name].dtype, tile) for name in wanted}
    return Computed(shaped, verdicts.sent)


def counts(columns: Columns) -> dict[str, int]:
    """How many pixels of a tile are of each kind."""
    counted = np.bincount(columns["kind"].ravel(), minlength=len(Verdicts.names)).tolist()
    return {name: n for name, n in zip(Verdicts.names, counted, strict=True) if n}


def _as(array: Any, dtype: str, tile: Tile) -> NDArray[Any]:
    return np.broadcast_to(np.asarray(array), tile.shape).astype(dtype)
