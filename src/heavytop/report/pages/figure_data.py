"""The numbers behind the pictures of a run: the same quantities, at evenly spaced times."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.errors import NoClosedForm

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

Columns = Mapping[str, list[Any]]

POINTS: Final = 401
TILTS: Final = 201
TITLES: Final = {
    "overview": "tilt over precession, and the path of the axis on the unit sphere",
    "angles": "tilt, precession and rate of spin over time",
    "potential": "effective potential, energy, and the tilts that they allow",
    "phase": "the plane of tilt and tilt rate, with neighbouring energies",
    "errors": "distance of the run from the closed form over time",
}
"""By picture of a run: what it shows."""

OVER_TIME: Final = {
    "overview": ("theta", "phi", "axis"),
    "angles": ("theta", "phi", "psi", "thetadot", "phidot", "psidot"),
    "phase": ("theta", "thetadot"),
}


def figure_data(name: str, trajectory: Trajectory) -> Columns:
    """The numbers behind a picture, by columns; those in which there is nothing are left out."""
    if name == "potential":
        return _potential(trajectory)
    if name == "errors":
        return _errors(trajectory)
    from heavytop.plots.figures import last_shown

    seen = trajectory(np.linspace(0.0, last_shown(trajectory), POINTS))
    columns = {"t": seen.t} | {each: getattr(seen, each) for each in OVER_TIME[name]}
    if "axis" in columns:
        columns |= zip(("axis_x", "axis_y", "axis_z"), columns.pop("axis").T, strict=True)
    return {each: _listed(x) for each, x in columns.items() if np.isfinite(x).any()}


def _potential(trajectory: Trajectory) -> Columns:
    from heavytop.analytic.potential import Potential
    from heavytop.plots.figures import tilts_shown

    motion = trajectory.motion
    potential = Potential(motion.rising.source)
    theta = np.linspace(*tilts_shown(potential), TILTS + 2)[1:-1]
    known = {
        "E_prime": motion.constants.E_prime,
        "theta_min": motion.theta_min,
        "theta_max": motion.theta_max,
    }
    return {
        "theta": _listed(theta),
        "potential": _listed(float(trajectory.scene.top.A) * potential(theta)),
    } | {name: _listed([float(value)]) * theta.size for name, value in known.items()}


def _errors(trajectory: Trajectory) -> Columns:
    from heavytop.run.verify import deviations

    try:
        return {name: _listed(x) for name, x in deviations(trajectory, POINTS).items()}
    except NoClosedForm:
        return {"t": []}


def _listed(values: Any) -> list[Any]:
    return [float(f"{x:.12g}") if np.isfinite(x) else None for x in np.asarray(values)]
