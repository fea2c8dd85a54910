"""An atlas' document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rich_tables import Fitted, grid, two_columns

SHOWN: Final = 10  # pixels that differ


def atlas_table(document: Mapping[str, Any]) -> Group:
    """The table of one atlas.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/atlas/1``.

    Returns
    -------
    rich.console.Group
        The axes, how many pixels there are of each kind, the boundaries, and where two maps
        differ.
    """
    return Group(*_parts(document))


def _parts(document: Mapping[str, Any]) -> Iterator[RenderableType]:
    title = Text("atlas: ", style="bold")
    yield title.append(str(document["scene"].get("title") or document["scene"]["name"]))
    yield Text()
    yield _kinds(document)
    yield Text()
    yield two_columns(list(_facts(document)))
    if document.get("pixels"):
        yield Text()
        yield Fitted(partial(_pixels, document["pixels"][:SHOWN]), range(9, 2, -1))
        if document["differing"] > SHOWN:
            yield Text(
                f"… and {document['differing'] - SHOWN} more, of which atlas.json has a thousand"
            )


def _kinds(document: Mapping[str, Any]) -> Table:
    table = grid(("kind", "pixels", "share"))
    every = sum(document["counts"].values())
    for name, count in sorted(document["counts"].items(), key=lambda each: -each[1]):
        table.add_row(name, str(count), f"{count / every:.3%}")
        for detail, part in document["details"].items():
            if detail.startswith(f"{name}, "):
                table.add_row(f"  {detail.partition(', ')[2]}", str(part), f"{part / every:.3%}")
    return table


def _facts(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    from heavytop.studies.atlas_plane import ROLES

    for side, axis in document["axes"].items():
        scale = ", logarithmic" if axis["log"] else ""
        unit = ROLES[axis["name"]].unit
        ends = f"{axis['low']:.6g} … {axis['high']:.6g} {unit}".strip()
        yield side, f"{axis['name']} = {ends}, {axis['count']} values{scale}"
    yield "held", ", ".join(_held(document))
    yield "not proved", str(document["uncertified"])
    yield "settled by balls", str(document["sent"])
    names = [curve["name"] for curve in document["curves"]]
    counted = ", ".join(
        f"{name} ({many} line{'s' * (many > 1)})" for name, many in Counter(names).items()
    )
    yield "boundaries", counted or "none"
    if document["differing"] is not None:
        yield "kinds that a run tells otherwise", str(document["differing"])
        yield "… by more than rounding", str(document["unexplained"])
        yield "that a run cannot tell", str(document["untold"])
    yield "pixels per second", f"{document['kinds_per_s']:.3g}"


def _held(document: Mapping[str, Any]) -> Iterator[str]:
    """What no axis changes."""
    from heavytop.studies.atlas_plane import ROLES

    changed = {ROLES[axis["name"]].sets for axis in document["axes"].values()}
    for name, value in (document["scene"]["top"] | document["scene"]["start"]).items():
        if name in ROLES and ROLES[name].sets not in changed:
            yield f"{name} = {value:.6g} {ROLES[name].unit}"


def _pixels(pixels: list[Mapping[str, Any]], digits: int) -> Table:
    table = grid(("kind", "integrated", "x", "y", "margin"), left=2)
    for each in pixels:
        x, y = (f"{each[side]:.{digits}g}" for side in ("x", "y"))
        table.add_row(each["kind"], each["integrated"], x, y, f"{each['margin']:.1e}")
    return table
