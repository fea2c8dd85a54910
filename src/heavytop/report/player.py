"""A run as data of a page: the top that turns."""

from __future__ import annotations

from base64 import b64encode
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.plots.sphere import PUSH, momentum_path, touched
from heavytop.plots.style import EVENTS, PATH

if TYPE_CHECKING:
    from heavytop.analytic.record import Record
    from heavytop.integration.outputs import Sample
    from heavytop.run.trajectory import Trajectory

FRAMES: Final = 1001
TURN: Final = 360.0  # rad of spin that are played: more would take too long
PERIODS: Final = 12
MOST_EVENTS: Final = 200
BLURRED: Final = 2.0  # rad of spin from frame to frame: more is not seen as a turning


def tops(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """What a player takes: runs, and how their events and paths are drawn in every figure."""
    marks = {kind: mark._asdict() for kind, mark in EVENTS.items()}
    return {"runs": runs, "marks": marks, "path": PATH}


def frames(trajectory: Trajectory) -> dict[str, Any]:
    """The frames of a run at even steps from its start to ``end`` [s].

    ``quaternion``, body to space and scalar first, and ``momentum``, the angular momentum over its
    largest size, are float32 in base64; ``spin`` is by how much ψ changes [rad], ``theta`` the
    tilts between which the axis stays, ``shape`` C/A and on which side of the pivot the centre of
    mass is (1, −1 or 0), and ``notes`` says what is played where it is not the run.
    """
    scene, end = trajectory.scene, float(trajectory.orbit.end)
    pushed = touched(trajectory.motion)
    motion = pushed or trajectory.motion
    last = float(np.copysign(min(abs(end), _longest(motion)), end))
    times, notes = np.linspace(0.0, last, FRAMES), []
    seen: Sample | Record = motion.at(times) if pushed else trajectory(times)
    if pushed:
        notes.append(f"Without a push it stays as it is; here it was pushed at {PUSH:g} rad/s.")
    elif not (np.isfinite(seen.quaternion).all() and np.isfinite(seen.omega).all()):
        seen = motion.at(times)
        notes.append("The attitude is from the closed form: the run does not follow all angles.")
    if abs(last) < 0.999 * abs(end):
        notes.append(f"The first {abs(last):.3g} s of {abs(end):.3g} s are shown.")
    spin = float(seen.psi[-1] - seen.psi[0])
    if abs(spin) > BLURRED * FRAMES:
        notes.append("The spin is too fast to be shown as it is.")
    found = trajectory.events
    events = [
        {"kind": str(kind), "t": float(t), "axis": axis.round(5).tolist()}
        for kind, t, axis in zip(found.kind, found.t, found.axis, strict=True)
        if not pushed and abs(t) <= abs(last) and np.isfinite(axis).all()
    ]
    return {
        "title": scene.title or scene.name, "end": last, "spin": spin, "notes": notes,
        "theta": [float(motion.theta_min), float(motion.theta_max)], "events": events[:MOST_EVENTS],
        "shape": [float(scene.top.C / scene.top.A), float(np.sign(float(scene.top.gMR)))],
        "quaternion": _packed(seen.quaternion), "momentum": _packed(momentum_path(scene.top, seen)),
    }  # fmt: skip


def _longest(motion: Motion) -> float:
    """How long is played [s]: some nutations, and no more spin than can be followed."""
    period, rate = motion.period or np.inf, abs(motion.mean_angle_rates[1])
    turns = TURN / rate if rate else np.inf
    return float(min(PERIODS * period, max(turns, period if np.isfinite(period) else 0.0)))


def _packed(rows: Any) -> str:
    return b64encode(np.asarray(rows, "<f4").tobytes()).decode("ascii")
