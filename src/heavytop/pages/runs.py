"""A run on the page: its facts, its pictures with their numbers, and its frames for the player."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.errors import ForeignFile, NoClosedForm
from heavytop.pages.commands import command, scene_file, scene_word
from heavytop.pages.section import Picture, Section, Table, drawn

if TYPE_CHECKING:
    from heavytop.pages.findings import Finding
    from heavytop.trajectory import Trajectory

Columns = Mapping[str, list[Any]]

POINTS: Final = 401  # of the numbers behind a picture
MOST_BYTES: Final = 512 * 2**20  # of a stored trajectory
EVENT: Final = {
    "event": "kind", "t [s]": "t", "θ [rad]": "theta", "φ [rad]": "phi", "φ̇ [rad/s]": "phidot",
    "residual": "residual",
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
        heading=scene["title"] or scene["name"],
        words="integrated, and compared with the closed form",
        source=scene["source"],
        facts=tuple(_facts(document)),
        table=Table.of({head: [r[name] for r in rows] for head, name in EVENT.items()}, 30),
        pictures=() if trajectory is None else tuple(_pictures(trajectory, ident, made)),
        command=made,
        scene=scene_file(scene),
        top=None if trajectory is None else _top(trajectory, ident, document),
        notes=()
        if trajectory is not None
        else ("trajectory.nc is not beside run.json: no pictures.",),
    )


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

    scene = document["scene"]
    return {"id": ident, "title": scene["title"] or scene["name"], **played(trajectory)}


def _facts(document: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    from heavytop.report import rows

    yield "kind", rows.kind(document["motion"])
    yield from rows.course(document["motion"])
    yield from rows.constants(document["constants"])
    yield from _plan(document["plan"])
    yield from _end(document["final"])
    yield "off the closed form", _errors(document["errors"])
    if missed := document["missed_digits"]:
        yield "digits missed", ", ".join(f"{name} {size:.1e}" for name, size in missed.items())
    yield "outcome", document["outcome"]


def _plan(plan: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "plan", f"{plan['formulation']}, {plan['precision']}; {'; '.join(plan['reasons'])}"


def _end(final: Mapping[str, Any] | None) -> Iterator[tuple[str, str]]:
    from heavytop.report.rows import brief

    names = (("θ", "theta"), ("φ", "phi"), ("ψ", "psi"))
    known = [
        f"{sign} = {brief(final[name])}"
        for sign, name in names
        if final and final.get(name) is not None
    ]
    if final and known:
        yield f"at t = {brief(final['t'])} s", ", ".join(known) + " rad"


def _errors(found: Mapping[str, Any]) -> str:
    sizes = {name: x for name, x in found.items() if isinstance(x, int | float)}
    words = [f"{name.replace('_', ' ')} {float(x):.2g}" for name, x in sizes.items()]
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
            alt=f"{name}: {words}.",
            svg=drawn(draw(trajectory)),
            table=Table.of({HEADS.get(name, name): x for name, x in found.items()}),
            data=found,
            command=made,
        )


def _over_time(trajectory: Trajectory, names: tuple[str, ...]) -> dict[str, list[Any]]:
    """Quantities over the time that the pictures of a run show."""
    from heavytop.report.figures.style import path

    last = path(trajectory)[1]
    seen = trajectory(np.linspace(0.0, last, POINTS))
    known = {"t": _listed(seen.t)} | {name: _listed(getattr(seen, name)) for name in names}
    return {name: x for name, x in known.items() if any(each is not None for each in x)}


def _axis(trajectory: Trajectory) -> dict[str, list[Any]]:
    found = _over_time(trajectory, ("theta", "phi"))
    seen = trajectory(np.array(found["t"]))
    return found | {f"axis_{x}": _listed(seen.axis[:, k]) for k, x in enumerate("xyz")}


def _angles(trajectory: Trajectory) -> dict[str, list[Any]]:
    return _over_time(trajectory, ("theta", "phi", "psi", "thetadot", "phidot", "psidot"))


def _potential(trajectory: Trajectory) -> dict[str, list[Any]]:
    from heavytop.planning import closed_form_of
    from heavytop.theory.potential import Potential

    motion = closed_form_of(trajectory.scene)
    theta = np.linspace(0.0, np.pi, 203)[1:-1]
    energy = float(trajectory.scene.top.A) * Potential(motion.reduced)(theta)
    level = float(motion.constants.E_prime)
    return {
        "theta": _listed(theta),
        "potential_J": _listed(energy),
        "E_prime_J": [level] * theta.size,
    }


def _phase(trajectory: Trajectory) -> dict[str, list[Any]]:
    return _over_time(trajectory, ("theta", "thetadot"))


def _off(trajectory: Trajectory) -> dict[str, list[Any]]:
    from heavytop.deviations import deviations

    try:
        found = deviations(trajectory, POINTS)
    except NoClosedForm:
        return {"t": []}
    return {"t": _listed(found.t)} | {name: _listed(x) for name, x in found.of.items()}


def _listed(values: Any) -> list[Any]:
    return [float(f"{x:.12g}") if np.isfinite(x) else None for x in np.asarray(values)]


BEHIND: Final[Mapping[str, tuple[str, Callable[[Trajectory], Columns]]]] = {
    "overview": ("tilt over precession, and the path of the axis on the unit sphere", _axis),
    "angles": ("tilt, precession and rate of spin over time", _angles),
    "potential": ("effective potential, energy, and the tilts that they allow", _potential),
    "phase": ("the plane of tilt and tilt rate, with neighbouring energies", _phase),
    "errors": ("distance of the run from the closed form over time", _off),
}
"""By picture of a run: what it shows, and the numbers behind it."""
