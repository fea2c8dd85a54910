"""A run as data of a page: the numbers behind its pictures, and the top that turns."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.errors import NoClosedForm
from heavytop.plots.figures import last_shown, seen_of, tilts_shown
from heavytop.plots.sphere import PUSH, momentum_path, touched
from heavytop.plots.style import EVENTS, PATH

if TYPE_CHECKING:
    from heavytop.analytic.many_times import DoubleRecord
    from heavytop.integration.outputs import Sample
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory import Trajectory

POINTS: Final = 401  # times of the numbers of a run
TILTS: Final = 201
UNSEEN: Final = 1e-6  # rad, in a picture
FRAMES: Final = 1001
TURN: Final = 360.0  # rad of spin that are played: more would take too long
PERIODS: Final = 12
MOST_EVENTS: Final = 200
BLURRED: Final = 2.0  # rad of spin from frame to frame: more is not seen as a turning


def run_data(trajectory: Trajectory | SceneMotion) -> tuple[Any, dict[str, Any]]:
    """The run as pictures show it, and the numbers in them: motion, potential and errors.

    Of a run in many digits, which take long to draw, pictures show the doubles if no eye could
    tell them apart. What was not integrated has no errors.
    """
    from heavytop.run.verify import deviations

    if (exact := seen_of(trajectory)) is not trajectory:
        return exact, {"motion": _motion(exact), "potential": _potential(exact)}
    doubles = replace(trajectory, decimals=None)
    ours, theirs = doubles.samples.axis, trajectory.samples.axis
    same = np.allclose(ours, theirs, UNSEEN, UNSEEN, equal_nan=True)
    seen = doubles if same else trajectory
    try:
        errors = {name: _listed(x) for name, x in deviations(trajectory, POINTS).items()}
    except NoClosedForm:
        errors = {"t": []}
    return seen, {"motion": _motion(seen), "potential": _potential(seen), "errors": errors}


def _motion(trajectory: Trajectory) -> dict[str, Any]:
    """A run at even times over what is drawn of it; what it does not follow is left out."""
    seen = trajectory(np.linspace(0.0, last_shown(trajectory), POINTS))
    names = ("t", "theta", "phi", "psi", "thetadot", "phidot", "psidot")
    columns = {name: getattr(seen, name) for name in names}
    columns |= zip(("axis_x", "axis_y", "axis_z"), seen.axis.T, strict=True)
    return {name: _listed(x) for name, x in columns.items() if np.isfinite(x).any()}


def _potential(trajectory: Trajectory) -> dict[str, Any]:
    motion, A = trajectory.motion, float(trajectory.scene.top.A)
    potential = Potential(motion.rising.source)
    theta = np.linspace(*tilts_shown(potential), TILTS + 2)[1:-1]
    return {
        "theta": _listed(theta),
        "potential": _listed(A * potential(theta)),
        "E_prime": float(motion.constants.E_prime),
        "theta_min": float(motion.theta_min),
        "theta_max": float(motion.theta_max),
    }


def _listed(values: Any) -> list[Any]:
    return [float(f"{x:.12g}") if np.isfinite(x) else None for x in np.asarray(values)]


def tops(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """What a player takes: runs, and how their events and paths are drawn in every figure."""
    marks = {kind: mark._asdict() for kind, mark in EVENTS.items()}
    return {"runs": runs, "marks": marks, "path": PATH}


def frames(trajectory: Trajectory) -> dict[str, Any]:
    """The frames of a run at even steps from its start to ``end`` [s].

    ``quaternion``, body to space and scalar first, and ``momentum``, the angular momentum over its
    largest size, are float32 in base64; ``spin`` is by how much ψ changes [rad], ``theta`` the
    tilts between which the axis stays, and ``notes`` says what is played where it is not the run.
    """
    scene, end = trajectory.scene, float(trajectory.orbit.end)
    pushed = touched(trajectory.motion)
    motion = pushed or trajectory.motion
    last = float(np.copysign(min(abs(end), _longest(motion)), end))
    times, notes = np.linspace(0.0, last, FRAMES), []
    seen: Sample | DoubleRecord = motion.at(times) if pushed else trajectory(times)
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
        "quaternion": _packed(seen.quaternion), "momentum": _packed(momentum_path(scene.top, seen)),
    }  # fmt: skip


def _longest(motion: Motion) -> float:
    """How long is played [s]: some nutations, and no more spin than can be followed."""
    period, rate = motion.period or np.inf, abs(motion.mean_angle_rates[1])
    turns = TURN / rate if rate else np.inf
    return float(min(PERIODS * period, max(turns, period if np.isfinite(period) else 0.0)))


def _packed(rows: Any) -> str:
    return b64encode(np.asarray(rows, "<f4").tobytes()).decode("ascii")
