"""What the player plays: the attitude of a top, its angular momentum and its events, by frames."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import NoClosedForm

if TYPE_CHECKING:
    from heavytop.integration.outputs import Sample
    from heavytop.run.trajectory import Trajectory

Array = NDArray[np.float64]

FRAMES: Final = 600
TURN: Final = 0.6  # rad of spin from frame to frame: more would not be seen as a turning
PERIODS: Final = 12
EVENTS: Final = 200
PLACES: Final = 5  # decimals: a hundredth of what a screen shows


def played(trajectory: Trajectory) -> dict[str, Any]:
    """The frames of a run.

    Parameters
    ----------
    trajectory : Trajectory

    Returns
    -------
    dict
        ``t`` [s]; ``quaternion``, body to space and scalar first, and ``momentum``, the angular
        momentum over its largest size, both flat; ``events`` with their frame and place; ``spin``,
        where the angle of spin is from; ``per_frame``, the largest turn in a frame [rad]; ``end``,
        the last time of the run [s].
    """
    times = np.linspace(0.0, shown(trajectory), FRAMES)
    seen = trajectory(times)
    axis, psi, phi, spin = _angles(trajectory, seen)
    momentum = _momentum(trajectory, seen, axis)
    largest = float(np.max(np.linalg.norm(momentum, axis=1))) or 1.0
    quaternion = attitude(axis, phi, psi)
    return {
        "t": [float(f"{t:.9g}") for t in times],
        "quaternion": _flat(quaternion),
        "momentum": _flat(momentum / largest),
        "events": _events(trajectory, float(times[-1])),
        "spin": spin,
        "per_frame": _largest_turn(quaternion),
        "end": float(trajectory.orbit.end),
    }


def shown(trajectory: Trajectory) -> float:
    """The last time that is played [s]: spin is to be seen, and not too many periods."""
    end = float(trajectory.orbit.end)
    motion = trajectory.motion
    rate = abs(motion.mean_angle_rates[1])
    period = motion.period or 0.0
    most = [PERIODS * period] if period else []
    if rate:
        most.append(max(FRAMES * TURN / rate, period))
    return float(np.copysign(min([abs(end), *most]), end))


def attitude(axis: Array, phi: Array, psi: Array) -> Array:
    """The quaternion of an axis and its angles, body to space, shape (k, 4).

    Angles at a pole are those of the run there: only their sum or difference is one.
    """
    half = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2]) / 2
    plus, minus = (phi + psi) / 2, (phi - psi) / 2
    c, s = np.cos(half), np.sin(half)
    parts = (c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus))
    return np.stack(parts, axis=-1)


def _angles(trajectory: Trajectory, seen: Sample) -> tuple[Array, Array, Array, str]:
    """The axis and the angles: of the run, and what it does not follow from the closed form."""
    if np.isfinite(seen.axis).all() and np.isfinite(seen.psi).all() and np.isfinite(seen.phi).all():
        return seen.axis, seen.psi, seen.phi, "the run"
    try:
        exact = trajectory.motion.at(seen.t)
        return np.where(np.isfinite(seen.axis), seen.axis, exact.axis), exact.psi, exact.phi, (
            "the closed form"
        )  # fmt: skip
    except NoClosedForm:
        phi = np.nan_to_num(seen.phi)
        axis = np.stack(
            (np.sin(seen.theta) * np.sin(phi), -np.sin(seen.theta) * np.cos(phi),
             np.cos(seen.theta)), axis=-1,
        )  # fmt: skip
        return axis, np.zeros_like(phi), phi, "nothing: the spin is not drawn"


def _momentum(trajectory: Trajectory, seen: Sample, axis: Array) -> Array:
    """The angular momentum in space, A ω + (C − A)(ω·e) e, shape (k, 3) [kg m²/s]."""
    top = trajectory.scene.top
    A, C = float(top.A), float(top.C)
    omega = seen.omega
    if not np.isfinite(omega).all():
        omega = _omega(seen, axis)
    along = np.sum(omega * axis, axis=1, keepdims=True)
    return np.asarray(A * omega + (C - A) * along * axis)


def _omega(seen: Sample, axis: Array) -> Array:
    """ω from the rates: θ̇ about the line of nodes, φ̇ about the vertical, ψ̇ about the axis."""
    across = np.hypot(axis[:, 0], axis[:, 1])
    nodes = np.stack((-axis[:, 1], axis[:, 0], np.zeros_like(across)), axis=-1)
    nodes /= np.where(across > 0, across, 1.0)[:, None]
    up = np.array([0.0, 0.0, 1.0])
    rates = [np.nan_to_num(r)[:, None] for r in (seen.thetadot, seen.phidot, seen.psidot)]
    return np.asarray(rates[0] * nodes + rates[1] * up + rates[2] * axis)


def _events(trajectory: Trajectory, last: float) -> list[dict[str, Any]]:
    events = trajectory.events
    found: list[dict[str, Any]] = []
    for kind, t, axis in zip(events.kind, events.t, events.axis, strict=True):
        if abs(t) > abs(last) or len(found) == EVENTS or not np.isfinite(axis).all():
            continue
        frame = round(t / last * (FRAMES - 1)) if last else 0
        place = [round(float(x), PLACES) for x in axis]
        found.append({"kind": str(kind), "t": float(t), "frame": frame, "axis": place})
    return found


def _largest_turn(quaternion: Array) -> float:
    """The largest turn of the body from one frame to the next [rad]."""
    one, two = quaternion[:-1], quaternion[1:]
    same = np.abs(np.sum(one * two, axis=1)).clip(0.0, 1.0)
    return float(np.max(2 * np.arccos(same), initial=0.0))


def _flat(rows: Array) -> list[float]:
    return [round(float(x), PLACES) for x in np.nan_to_num(rows).ravel()]
