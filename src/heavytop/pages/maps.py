"""An atlas on the page: the map of its kinds, their shares and their boundaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import ForeignFile
from heavytop.hdf5 import expect_harmless
from heavytop.pages.commands import command, scene_file, scene_word
from heavytop.pages.descriptions import called
from heavytop.pages.section import Picture, Section, drawn
from heavytop.pages.tables import Table

if TYPE_CHECKING:
    from pathlib import Path

    from heavytop.pages.findings import Finding

Known = Mapping[str, Any]
Codes = NDArray[np.uint8]

FINEST: Final = 600  # pixels drawn along an axis, and
KEPT: Final = 100  # those behind the picture
MOST_PIXELS: Final = 2_000_000_000


def atlas_section(finding: Finding, ident: str) -> Section:
    """Return the section of an atlas; its map is read from ``atlas.nc``.

    Raises
    ------
    ForeignFile
        The map is damaged, or is not the one that the document tells of.
    """
    document = finding.document
    axes, counts, pixels = document["axes"], document["counts"], sum(document["counts"].values())
    made = command(
        "atlas", scene_word(document["scene"]),
        "--x", _asked(axes["x"]), "--y", _asked(axes["y"]), "-o", "out",
    )  # fmt: skip
    order = sorted(counts.items(), key=lambda each: -each[1])
    shares = Table.of(
        {
            "kind": [name for name, _ in order],
            "pixels": [count for _, count in order],
            "share": [f"{100 * count / (pixels or 1):.2f} %" for _, count in order],
        }
    )
    pictures = tuple(_map(finding, ident, made))
    return Section(
        ident=ident,
        heading=f"Atlas: {called(document)}",
        words=f"{pixels} tops, {pixels - document['uncertified']:g} of them with a proved kind",
        source=document["scene"]["source"],
        table=shares,
        pictures=pictures,
        command=made,
        scene=scene_file(document["scene"], {"time": 1}),
        notes=() if pictures else ("There is no whole map beside atlas.json: no figure.",),
    )


def _map(finding: Finding, ident: str, made: str) -> Sequence[Picture]:
    from heavytop.report.map_figure import map_figure

    document, path = finding.document, finding.path.with_name("atlas.nc")
    if "map" not in document["files"] or not path.is_file():
        return ()
    kind, names = stored_map(path, document["shape"])
    few = kind[:: -(-kind.shape[0] // KEPT), :: -(-kind.shape[1] // KEPT)]
    counts = document["counts"]
    x, y = (document["axes"][k] for k in "xy")
    return [
        Picture(
            ident=f"{ident}-map",
            title=f"kinds of motion over {x['name']} and {y['name']}",
            alt=f"{called(document)}: a map of {x['name']} from {x['low']:g} to {x['high']:g} and "
            f"{y['name']} from {y['low']:g} to {y['high']:g}; shares of the area: "
            + "; ".join(f"{name} {count / (sum(counts.values()) or 1):.1%}" for name, count in
                        sorted(counts.items(), key=lambda each: -each[1]) if count) + ".",
            svg=drawn(map_figure(document, kind, names)),
            table=Table.of(
                {
                    "boundary": [c["name"] for c in document["curves"]],
                    "points": [len(c["x"]) for c in document["curves"]],
                    "from x": [min(c["x"], default=None) for c in document["curves"]],
                    "to x": [max(c["x"], default=None) for c in document["curves"]],
                    "from y": [min(c["y"], default=None) for c in document["curves"]],
                    "to y": [max(c["y"], default=None) for c in document["curves"]],
                }
            ),
            data={
                "axes": document["axes"], "counts": counts, "names": list(names),
                "kind_of_every_so_many_pixels": few.tolist(), "curves": document["curves"],
            },
            command=made,
            listed="curves",
        )
    ]  # fmt: skip


def stored_map(path: Path, shape: Sequence[float]) -> tuple[Codes, tuple[str, ...]]:
    """Return the codes of a stored map, of at most `FINEST` pixels an axis, and their names.

    Raises
    ------
    ForeignFile
        It is damaged, too large, or of another shape.
    """
    import h5netcdf

    try:
        expect_harmless(path)
        with h5netcdf.File(path, "r") as file:
            kind = file.variables["kind"]
            names = tuple(str(kind.attrs["flag_meanings"]).split())
            if list(kind.shape) != list(shape) or not all(kind.shape):
                raise ValueError(f"a map of {kind.shape}, not of {tuple(shape)}")
            if kind.dtype != np.uint8 or kind.shape[0] * kind.shape[1] > MOST_PIXELS:
                raise ValueError("a map of another type, or too large")
            codes = kind[:: -(-kind.shape[0] // FINEST), :: -(-kind.shape[1] // FINEST)]
    except ForeignFile:
        raise
    except Exception as fault:  # a damaged file fails in any of the libraries that read it
        raise ForeignFile(f"{path}: not a readable map ({fault})") from fault
    return np.asarray(codes, np.uint8), names


def _asked(axis: Known) -> str:
    """The axis as an option spells it."""
    words = f"{axis['name']}={axis['low']!r}:{axis['high']!r}:{axis['count']}"
    return words + (":log" if axis["log"] else "")
