"""A run on the page: its facts, its pictures with their numbers, and its frames for the player."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.errors import ForeignFile
from heavytop.report.pages.behind import BEHIND
from heavytop.report.pages.commands import command, folder, scene_file, scene_word
from heavytop.report.pages.descriptions import called, described, given
from heavytop.report.pages.foreign import expect_file, reading
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.pages.tables import Table, cell, rounded
from heavytop.results.plan_document import asked_form
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.integration.outputs import Sample
    from heavytop.report.pages.findings import Finding
    from heavytop.run.trajectory import Trajectory

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
    "theta_min": "least θ of the motion [rad]", "theta_max": "greatest θ of the motion [rad]",
}  # fmt: skip


def run_section(finding: Finding, ident: str) -> Section:
    """Return the section of a run: with pictures and frames where its trajectory is there.

    Raises
    ------
    ForeignFile
        The trajectory is damaged, or that of another run.
    """
    document, scene = finding.document, finding.document["scene"]
    made = command("run", scene_word(scene, ident), *_form(document["plan"]), *folder(ident))
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


def _form(plan: Mapping[str, Any]) -> tuple[str, ...]:
    """The option that asks for the equations; none where auto chose them."""
    form = asked_form(plan)
    return () if form == "auto" else ("--formulation", form)


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
SAME_PLAN: Final = ("formulation", "precision", "states", "tolerance", "projected", "folded")
NEAR: Final = 1e-6  # of what the same steps, taken on another machine, give
UNSEEN: Final = 1e-9  # of a picture
COMPARED: Final = 400  # samples


def _trajectory(finding: Finding) -> Trajectory | None:
    path = finding.path.with_name("trajectory.nc")
    if "trajectory" not in finding.document["files"] or not path.is_file():
        return None
    expect_file(path, MOST_BYTES)
    from heavytop.run.trajectory_file import load_trajectory

    found = load_trajectory(path)
    with reading(path):
        if other := _other(found, finding.document):
            raise ForeignFile(
                f"{harmless(path)}: the trajectory of another {other} than run.json is about"
            )
    return found


def _other(found: Trajectory, told: Mapping[str, Any]) -> str | None:
    """What of a trajectory is not that of which a document tells, if anything."""
    from heavytop.results.plan_document import chosen_document

    scene, chosen = found.scene.document(), chosen_document(found.plan)
    if any(scene[key] != told["scene"].get(key) for key in SAME):
        return "scene"
    if any(chosen[key] != told["plan"][key] for key in SAME_PLAN):
        return "plan"
    if str(found.outcome) != told["outcome"]:
        return "outcome"
    kinds = [row["kind"] for row in told["events"]["table"]]
    if kinds != list(found.events.kind[: len(kinds)]):
        return "list of events"
    return None if all(_agreements(found, told)) else "motion"


def _agreements(found: Trajectory, told: Mapping[str, Any]) -> Iterator[bool]:
    """Whether the end, the events and the samples are those of the document, and of each other."""
    seen, end, last = _in_doubles(found), float(found.orbit.end), told["final"] or {}
    theta = float(seen(end).theta)
    yield _near(end, last.get("t")) and _near(theta, last.get("theta"))
    for row, t, tilt in zip(told["events"]["table"], found.events.t, found.events.theta):  # noqa: B905
        yield _near(float(t), row["t"]) and _near(float(tilt), row["theta"])
    some = found.samples.at(slice(None, None, max(1, found.t.size // 4)))
    yield _agree(some, seen(some.t), NEAR)


def _near(here: float, there: Any) -> bool:
    """Whether a number is the one that is told, if one is."""
    return there is None or abs(here - float(there)) <= NEAR * (1 + abs(here))


def _in_doubles(trajectory: Trajectory) -> Trajectory:
    """The run in double precision where pictures show no more: many digits take long to draw."""
    if trajectory.decimals is None:
        return trajectory
    seen, every = replace(trajectory, decimals=None), -(-trajectory.t.size // COMPARED)
    some = trajectory.samples.at(slice(None, None, every))
    return seen if _agree(some, seen(some.t), UNSEEN) else trajectory


def _agree(one: Sample, other: Sample, most: float) -> bool:
    """Whether axes and angles are the same, but for rounding of the times."""
    late = 4 * np.spacing(np.abs(one.t))
    return all(
        np.allclose(getattr(one, name), getattr(other, name), rtol=most, atol=most + np.max(
            late * np.abs(np.nan_to_num(getattr(one, f"{name}dot"))), initial=0.0), equal_nan=True)
        for name in ("theta", "phi", "psi")
    )  # fmt: skip


def _top(trajectory: Trajectory, ident: str, document: Mapping[str, Any]) -> dict[str, Any]:
    from heavytop.report.pages.player import played

    return {"id": ident, "title": called(document), **played(_in_doubles(trajectory))}


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


def _errors(found: Mapping[str, Any]) -> str:
    from heavytop.report.rows import distances

    words = ", ".join(distances(found, lambda size: cell(size, 2)))
    return words or str(found.get("why_not") or "nothing to compare")


def _pictures(trajectory: Trajectory, ident: str, made: str) -> Iterator[Picture]:
    from heavytop.plots.figures import FIGURES

    name = trajectory.scene.title or trajectory.scene.name
    quick = _in_doubles(trajectory)
    for which, draw in FIGURES.items():
        words, columns = BEHIND[which]
        run = trajectory if which == "errors" else quick
        found = columns(run)
        yield Picture(
            ident=f"{ident}-{which}",
            title=words,
            alt=f"{name}: {words}. {described(which, found)}",
            svg=drawn(draw(run)),
            table=Table.of({HEADS.get(name, name): x for name, x in found.items()}),
            data=found,
            command=made,
        )
