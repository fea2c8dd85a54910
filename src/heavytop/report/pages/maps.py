"""An atlas on the page: the map of its kinds, their shares and their boundaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.hdf5 import attribute, dataset, opened
from heavytop.report.pages.commands import command, exactly, folder, scene_file, scene_word
from heavytop.report.pages.descriptions import GIVEN, called
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.pages.tables import Table

if TYPE_CHECKING:
    from pathlib import Path

    from heavytop.report.pages.findings import Finding

Known = Mapping[str, Any]
Codes = NDArray[np.uint8]

FINEST: Final = 600  # pixels drawn along an axis, and
KEPT: Final = 100  # those behind the picture
MOST_PIXELS: Final = 2_000_000_000
WHAT: Final = {"kind": ("--only", "kind"), "integrate": ("--integrate",)}
"""The options that ask for another set of columns than the usual one."""


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
        "atlas", scene_word(document["scene"], ident),
        "--x", _asked(axes["x"]), "--y", _asked(axes["y"]), *WHAT.get(document.get("what", ""), ()),
        *folder(ident),
    )  # fmt: skip
    shares = Table.of(
        {
            "kind": [name for name, _ in _shares(counts)],
            "pixels": [counts[name] for name, _ in _shares(counts)],
            "share": [f"{100 * share:.2f} %" for _, share in _shares(counts)],
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
    from heavytop.plots.atlas import map_figure

    document, path = finding.document, finding.path.with_name("atlas.nc")
    if "map" not in document["files"] or not path.is_file():
        return ()
    kind, names = stored_map(path, document["shape"])
    few = kind[:: -(-kind.shape[0] // KEPT), :: -(-kind.shape[1] // KEPT)]
    counts = document["counts"]
    x, y = (document["axes"][k] for k in "xy")
    shares = "; ".join(f"{name} {share:.1%}" for name, share in _shares(counts) if share)
    return [
        Picture(
            ident=f"{ident}-map",
            title=f"kinds of motion over {_headed(x)} and {_headed(y)}",
            alt=f"{called(document)}: a map of {_ranged(x)} and {_ranged(y)}; "
            f"shares of the area: {shares}.",
            svg=drawn(map_figure(document, kind, names)),
            table=_boundaries(document["curves"], {"x": _headed(x), "y": _headed(y)}),
            data={
                "axes": document["axes"], "counts": counts, "names": list(names),
                "kind_of_every_so_many_pixels": few.tolist(), "curves": document["curves"],
            },
            command=made,
            listed="curves",
        )
    ]  # fmt: skip


def _shares(counts: Mapping[str, float]) -> list[tuple[str, float]]:
    """The kinds with their parts of the area, the largest first."""
    pixels = sum(counts.values()) or 1
    order = sorted(counts.items(), key=lambda each: -each[1])
    return [(name, count / pixels) for name, count in order]


def _headed(axis: Known) -> str:
    """The sign of what changes along an axis, and its unit."""
    sign, unit = GIVEN[axis["name"]]
    return f"{sign} [{unit}]"


def _ranged(axis: Known) -> str:
    sign, unit = GIVEN[axis["name"]]
    return f"{sign} from {axis['low']:g} to {axis['high']:g} {unit}"


def _boundaries(curves: Sequence[Known], heads: Mapping[str, str]) -> Table:
    """The curves of an atlas: how many points each has, and how far it reaches."""
    columns: dict[str, list[Any]] = {
        "boundary": [curve["name"] for curve in curves],
        "points": [len(curve["x"]) for curve in curves],
    }
    for axis, head in heads.items():
        columns[f"from {head}"] = [min(curve[axis], default=None) for curve in curves]
        columns[f"to {head}"] = [max(curve[axis], default=None) for curve in curves]
    return Table.of(columns)


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


def _asked(axis: Known) -> str:
    """The axis as an option spells it."""
    ends = ":".join(exactly(axis[name]) for name in ("low", "high", "count"))
    words = f"{axis['name']}={ends}"
    return words + (":log" if axis["log"] else "")
