"""An energy–momentum document as a table for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.console import Group
from rich.text import Text

from heavytop.report.rows import title, two_columns


def energy_momentum_table(document: Mapping[str, Any]) -> Group:
    """The table of one energy–momentum diagram.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/energy-momentum/1``.

    Returns
    -------
    rich.console.Group
        Where the scene lies, the verticals, and what a circuit around the thread brings.
    """
    return Group(title(document["scene"]), Text(), two_columns(list(_rows(document))))


def _rows(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "p_psi", f"{document['p_psi']:.9g} kg m² s⁻¹"
    if document["ratio"] is not None:
        yield "p_psi²/4A|gMR|", f"{document['ratio']:.9g}"
    start = document["start"]
    yield "the scene", f"{_place(start)}: {start['kind']}"
    yield "upright", _place(document["standing"])
    yield "hanging", _place(document["hanging"])
    if document["thread"] is None:
        yield (
            "thread",
            "none: an upright top sleeps" if document["ratio"] is not None else "none: no weight",
        )
    else:
        yield "thread", f"{_place(document['thread'])}, {document['depth']:.6g} J above the edge"
    if circuit := document["circuit"]:
        yield "Δφ around it", f"{circuit['winding']:+d} turn"
        yield "Δψ around it", f"{circuit['spin_winding']:+d} turn"


def _place(place: Mapping[str, Any]) -> str:
    return f"p_phi = {place['p_phi']:.9g}, E' = {place['E_prime']:.9g} J"
