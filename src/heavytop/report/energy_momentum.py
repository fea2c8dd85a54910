"""A diagram of energy and momentum, as facts."""

from __future__ import annotations

from collections.abc import Iterator

from heavytop.report.parts import FactRows, Known, Part, files


def energy_momentum_parts(document: Known) -> Iterator[Part]:
    """Where the scene and the verticals lie, and what a circuit around the thread brings."""
    yield FactRows.of([*_facts(document), *files(document)])


def _facts(document: Known) -> Iterator[tuple[str, str]]:
    ratio = document["ratio"]
    yield "p_psi", f"{document['p_psi']:.9g} kg m² s⁻¹"
    if ratio is not None:
        yield "p_psi²/4A|gMR|", f"{ratio:.9g}"
    yield "the scene", f"{_place(document['start'])}: {document['start']['kind']}"
    yield "upright", _place(document["standing"])
    yield "hanging", _place(document["hanging"])
    if document["thread"] is None:
        yield "thread", f"none: {'no weight' if ratio is None else 'an upright top sleeps'}"
    else:
        yield "thread", f"{_place(document['thread'])}, {document['depth']:.6g} J above the edge"
    if circuit := document["circuit"]:
        yield "Δφ around it", f"{circuit['winding']:+d} turn"
        yield "Δψ around it", f"{circuit['spin_winding']:+d} turn"


def _place(place: Known) -> str:
    return f"p_phi = {place['p_phi']:.9g}, E' = {place['E_prime']:.9g} J"
