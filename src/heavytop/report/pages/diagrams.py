"""The diagram of energy and momentum on the page, and the critical set over all spins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from heavytop.report.pages.commands import command, folder, scene_file, scene_word
from heavytop.report.pages.descriptions import called
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.pages.tables import Table, cell

if TYPE_CHECKING:
    from heavytop.report.pages.findings import Finding

Known = Mapping[str, Any]

HEADS: Final = {
    "p_psi": "p_ψ [kg m²/s]", "p_phi": "p_φ [kg m²/s]", "E_prime": "E′ [J]", "rate": "φ̇ [rad/s]",
}  # fmt: skip


def energy_momentum_section(finding: Finding, ident: str) -> Section:
    """Return the section of an energy–momentum diagram."""
    from heavytop.plots.energy_momentum import energy_momentum_figure

    document, edge = finding.document, finding.document["edge"]
    about = scene_word(document["scene"], ident)
    made = command("atlas", about, "--energy-momentum", *folder(ident))
    start, circuit = document["start"], document["circuit"]
    turn = f" Around the thread Δφ gains {circuit['winding']:+g} turn." if circuit else ""
    columns = {head: edge[name] for name, head in HEADS.items() if name in edge}
    diagram = Picture(
        ident=f"{ident}-diagram",
        title="energy over momentum at the p_ψ of the scene: kinds, and the edge of steady "
        "precession",
        alt=f"{called(document)}: a region of waves, and in it one of loops, above the edge of "
        f"steady precession, over p_φ from {_ends(edge['p_phi'])} kg m²/s. The scene lies at p_φ "
        f"{cell(start['p_phi'], 3)} kg m²/s and E′ {cell(start['E_prime'], 3)} J: "
        f"{start['kind']}.{turn}",
        svg=drawn(energy_momentum_figure(document)),
        table=Table.of(columns),
        data={name: document[name] for name in ("start", "standing", "hanging", "thread", "edge",
                                                "window", "circuit")},
        command=made,
        listed="edge",
    )  # fmt: skip
    return Section(
        ident=ident,
        heading=f"Energy and momentum: {called(document)}",
        words="nothing is integrated",
        source=document["scene"]["source"],
        pictures=(diagram, *_critical_set(document, ident, made)),
        command=made,
        scene=scene_file(document["scene"], {"time": 1}),
    )


def _ends(values: Sequence[Any]) -> str:
    known = [x for x in values if x is not None]
    return f"{cell(min(known), 3)} to {cell(max(known), 3)}"


def _critical_set(document: Known, ident: str, made: str) -> Sequence[Picture]:
    from heavytop.plots.critical_set import critical_set_figure

    found = document.get("critical_set")
    if not found:
        return ()
    thread = found["thread"]
    return [
        Picture(
            ident=f"{ident}-critical-set",
            title="the critical set over all p_ψ: two sheets of steady precession and the thread",
            alt=f"{called(document)}: two sheets that meet along the hanging tops, and the thread "
            "of upright tops that fall, which hangs above them.",
            svg=drawn(critical_set_figure(document)),
            table=Table.of({head: thread[name] for name, head in HEADS.items() if name in thread}),
            data=found,
            command=made,
            turns=True,
            listed="sheets",
        )
    ]
