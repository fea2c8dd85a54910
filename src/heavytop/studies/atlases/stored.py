"""The map as a netCDF file with CF flags, written tile by tile."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from heavytop import __version__
from heavytop.hdf5 import write_sealed
from heavytop.studies.atlases.atlas import Atlas
from heavytop.studies.atlases.columns import SETS
from heavytop.studies.atlases.described import attributes, coordinates
from heavytop.studies.ledger.canonical import canonical


def store(atlas: Atlas, path: Path) -> None:
    """Write ``atlas.nc``: a tile at a time in memory, whole or not at all.

    Raises
    ------
    OSError
    """
    write_sealed(path, lambda part: _write(atlas, part))


def _write(atlas: Atlas, path: Path) -> None:
    import h5netcdf

    plane, what = atlas.study.plane, atlas.study.what
    tiles = list(atlas.study.tiles.values())
    chunk = tiles[0].shape
    with h5netcdf.File(path, "w") as file:
        file.attrs["Conventions"] = "CF-1.11"
        file.attrs["title"] = plane.scene.title or plane.scene.name
        file.attrs["source"] = f"heavytop {__version__}"
        file.attrs["identity"] = canonical(atlas.study.identity)
        file.dimensions = {plane.y.name: plane.y.count, plane.x.name: plane.x.count}
        for name, (_, values, unit) in coordinates(plane).items():
            _described(file.create_variable(name, (name,), data=values), unit)
        dims = (plane.y.name, plane.x.name)
        variables = {
            name: _described(
                file.create_variable(
                    name, dims, column.dtype, chunks=chunk, compression="gzip", compression_opts=1,
                    shuffle=True, fillvalue=None if column.dtype == "u1" else np.nan,
                ),
                attributes(name, what),
            )
            for name, column in SETS[what].items()
        }  # fmt: skip
        for tile, columns in atlas.tiles():
            for name, variable in variables.items():
                variable[tile.rows, tile.columns] = columns[name]


def _described(variable: Any, about: dict[str, Any]) -> Any:
    for name, value in about.items():
        variable.attrs[name] = value
    return variable
