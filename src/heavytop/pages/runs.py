"""A run on the page: its facts, its pictures with their numbers, and its frames for the player."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from heavytop.errors import ForeignFile
from heavytop.pages.behind import BEHIND
from heavytop.pages.commands import command, scene_file, scene_word
from heavytop.pages.descriptions import called, described, given
from heavytop.pages.section import Picture, Section, drawn
from heavytop.pages.tables import Table, cell, rounded

if TYPE_CHECKING:
    from heavytop.pages.findings import Finding
    from heavytop.trajectory import Trajectory

ROUNDING: Final = 1e-9
MOST_BYTES: Final = 512 * 2**20  # of a stored trajectory
EVENT: Final = {
    "event": "kind", "t [s]": "t", "θ [rad]": "theta", "φ [rad]": "phi", "φ̇ [rad/s]": "phidot",
    "residual": "residual",
}  # fmt: skip
CALLED: Final = {
    "theta_min": "θ least", "theta_max": "θ greatest", "reversal": "precession reverses",
}  # fmt: skip

HEADS: Final = {
    "t": "t [s]", "theta": "θ [rad]", "phi": "φ [rad]", "psi": "ψ [rad]", "thetadot": "θ̇ [rad/s]",
    "phidot": "φ̇ [rad/s]", "psidot": "ψ̇ [rad/s]", "axis_x": "axis x", "axis_y": "axis y",
    "axis_z": "axis z", "potential_J": "potential [J]", "E_prime_J": "E′ [J]",
}  # fmt: skip


def run_section(finding: Finding, ident: str) -> Section:
    """Return the section of a run: with pictures and frames where its trajectory is there.

    Raises
    ------
    ForeignFile
        The trajectory is damaged, or that of another run.
    """
    document, scene = finding.document, finding.document["scene"]
    made = command("run", scene_word(scene), "-o", "out")
    trajectory = _trajectory(finding)
    rows = document["events"]["table"]
    return Section(
        ident=ident,
        heading=called(document),
        words="integrated, and compared with the closed form",
        source=scene["source"],
        facts=tuple(_facts(document)),
        table=_events(rows),
        pictures=() if trajectory is None else tuple(_pictures(trajectory, ident, made)),
        command=made,
        scene=scene_file(scene),
        top=None if trajectory is None else _top(trajectory, ident, document),
        notes=tuple(_notes(document, trajectory)),
    )


def _notes(document: Mapping[str, Any], trajectory: Trajectory | None) -> Iterator[str]:
    if trajectory is None:
        yield "trajectory.nc is not beside run.json: no pictures."
    if document["motion"]["kind"].startswith("through-") and document["events"]["table"]:
        yield "At the pole φ is that before or after, half a turn apart, and its rate is the limit."


def _events(rows: list[Mapping[str, Any]]) -> Table:
    columns = {head: [_spelt(row[name]) for row in rows] for head, name in EVENT.items()}
    columns["event"] = [CALLED.get(kind, kind) for kind in columns["event"]]
    columns["residual"] = [cell(row["residual"], 2) for row in rows]
    return Table.of(columns, 30)


def _spelt(value: Any) -> str:
    """A value; of what is but rounding two digits."""
    return cell(value, 2) if isinstance(value, float) and abs(value) < ROUNDING else cell(value)


SAME: Final = ("top", "start", "title", "span")


def _trajectory(finding: Finding) -> Trajectory | None:
    path = finding.path.with_name("trajectory.nc")
    if "trajectory" not in finding.document["files"] or not path.is_file():
        return None
    if path.stat().st_size > MOST_BYTES:
        raise ForeignFile(f"{path}: more than {MOST_BYTES >> 20} MB")
    from heavytop.archive import load_trajectory

    found = load_trajectory(path)
    there = finding.document["scene"]
    if any(found.scene.document()[key] != there.get(key) for key in SAME):
        raise ForeignFile(f"{path}: the trajectory of another scene than run.json is about")
    return found


def _top(trajectory: Trajectory, ident: str, document: Mapping[str, Any]) -> dict[str, Any]:
    from heavytop.pages.player import played

    return {"id": ident, "title": called(document), **played(trajectory)}


def _facts(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    from heavytop.report import rows

    yield "top", given(document["scene"]["top"])
    yield "start", given(document["scene"]["start"])
    yield "kind", rows.kind(document["motion"])
    yield from rows.course(rounded(document["motion"]))
    yield from rows.constants(rounded(document["constants"]))
    yield from _plan(document["plan"])
    yield from _end(document["final"])
    yield "off the closed form", _errors(document["errors"])
    if missed := document["missed_digits"]:
        yield "digits missed", ", ".join(f"{name} {size:.1e}" for name, size in missed.items())
    yield "outcome", document["outcome"]


def _plan(plan: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "plan", f"{plan['formulation']}, {plan['precision']}; {'; '.join(plan['reasons'])}"


def _end(final: Mapping[str, Any] | None) -> Iterator[tuple[str, str]]:
    names = (("θ", "theta"), ("φ", "phi"), ("ψ", "psi"))
    known = [
        f"{sign} = {cell(float(final[name]))}"
        for sign, name in names
        if final and final.get(name) is not None
    ]
    if final and known:
        yield f"at t = {cell(float(final['t']))} s", ", ".join(known) + " rad"


UNITS: Final = {
    "theta": " rad", "phi": " rad", "psi": " rad", "event_time": " s", "input_rounding": " rad",
}  # fmt: skip
"""Of the distances from the closed form; the others are lengths or relative."""


def _errors(found: Mapping[str, Any]) -> str:
    sizes = {name: x for name, x in found.items() if isinstance(x, int | float)}
    words = [
        f"{name.replace('_', ' ')} {cell(x, 2)}{UNITS.get(name, '')}" for name, x in sizes.items()
    ]
    return ", ".join(words) or str(found.get("why_not") or "nothing to compare")


def _pictures(trajectory: Trajectory, ident: str, made: str) -> Iterator[Picture]:
    from heavytop.report.figures import FIGURES

    name = trajectory.scene.title or trajectory.scene.name
    for which, draw in FIGURES.items():
        words, columns = BEHIND[which]
        found = columns(trajectory)
        yield Picture(
            ident=f"{ident}-{which}",
            title=words,
            alt=f"{name}: {words}. {described(which, found)}",
            svg=drawn(draw(trajectory)),
            table=Table.of({HEADS.get(name, name): x for name, x in found.items()}),
            data=found,
            command=made,
        )
