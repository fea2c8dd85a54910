"""An atlas on the page: the map of its kinds, their shares and their boundaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.hdf5 import attribute, dataset, opened
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.parts import Table, called, headed
from heavytop.report.studies import atlas_parts

if TYPE_CHECKING:
    from pathlib import Path

    from heavytop.report.pages.load import Result

Known = Mapping[str, Any]
Codes = NDArray[np.uint8]

FINEST: Final = 600  # pixels drawn along an axis, and
KEPT: Final = 100  # those behind the picture
MOST_PIXELS: Final = 2_000_000_000


def atlas_section(result: Result, ident: str) -> Section:
    """Return the section of an atlas; its map is read from ``atlas.nc``.

    Raises
    ------
    ForeignFile
        The map is damaged, or is not the one that the document tells of.
    """
    document, said = result.document, atlas_parts(result.document)
    pictures = tuple(_map(result))
    notes = () if pictures else ("There is no whole map beside atlas.json: no figure.",)
    return Section(result, ident, f"Atlas: {called(document)}", (*notes, *said), pictures)


def _map(result: Result) -> Sequence[Picture]:
    from heavytop.plots.atlas import map_figure

    document, path = result.document, result.path.with_name("atlas.nc")
    if "map" not in document.get("files", {}) or not path.is_file():
        return ()
    kind, names = stored_map(path, document["shape"])
    few = kind[:: -(-kind.shape[0] // KEPT), :: -(-kind.shape[1] // KEPT)]
    heads = {side: headed(axis["name"]) for side, axis in document["axes"].items()}
    return [
        Picture(
            name="map",
            title=f"kinds of motion over {heads['x']} and {heads['y']}",
            svg=drawn(map_figure(document, kind, names)),
            table=_boundaries(document["curves"], heads),
            data={
                "axes": document["axes"], "counts": document["counts"], "names": list(names),
                "kind_of_every_so_many_pixels": few.tolist(), "curves": document["curves"],
            },
            listed="curves",
        )
    ]  # fmt: skip


def _boundaries(curves: Sequence[Known], heads: Mapping[str, str]) -> Table:
    """The curves of an atlas: how many points each has, and how far it reaches."""
    columns: dict[str, list[Any]] = {
        "boundary": [curve["name"] for curve in curves],
        "points": [len(curve["x"]) for curve in curves],
    }
    for axis, head in heads.items():
        columns[f"from {head}"] = [min(curve[axis], default=None) for curve in curves]
        columns[f"to {head}"] = [max(curve[axis], default=None) for curve in curves]
    return Table.of_columns(columns)


def stored_map(path: Path, shape: Sequence[float]) -> tuple[Codes, tuple[str, ...]]:
    """Return the codes of a stored map, of at most `FINEST` pixels an axis, and their names.

    Raises
    ------
    ForeignFile
        It is damaged, too large, or of another shape.
    """
    with opened(path) as file:
        kind = dataset(file, "kind")
        if list(kind.shape) != list(shape) or not all(kind.shape):
            raise ValueError(f"a map of {kind.shape}, not of {tuple(shape)}")
        if kind.dtype != np.uint8 or kind.size > MOST_PIXELS:
            raise ValueError("a map of another type, or too large")
        codes = kind[:: -(-kind.shape[0] // FINEST), :: -(-kind.shape[1] // FINEST)]
        return np.asarray(codes), tuple(attribute(kind, "flag_meanings").split())
