"""The numbers behind the pictures of a run: the same quantities, at evenly spaced times."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.errors import NoClosedForm

if TYPE_CHECKING:
    from heavytop.integration.outputs import Sample
    from heavytop.run.trajectory import Trajectory

Columns = Mapping[str, list[Any]]

POINTS: Final = 401
TILTS: Final = 201


@lru_cache(maxsize=1)
def _seen(trajectory: Trajectory) -> Sample:
    """The motion at the times of the numbers behind the pictures."""
    from heavytop.plots.figures.style import last_shown

    return trajectory(np.linspace(0.0, last_shown(trajectory), POINTS))


def _over_time(trajectory: Trajectory, names: tuple[str, ...]) -> dict[str, list[Any]]:
    """Quantities over the time that the pictures of a run show."""
    seen = _seen(trajectory)
    known = {"t": _listed(seen.t)} | {name: _listed(getattr(seen, name)) for name in names}
    return {name: x for name, x in known.items() if any(each is not None for each in x)}


def _axis(trajectory: Trajectory) -> dict[str, list[Any]]:
    found = _over_time(trajectory, ("theta", "phi"))
    axis = _seen(trajectory).axis
    return found | {f"axis_{x}": _listed(axis[:, k]) for k, x in enumerate("xyz")}


def _angles(trajectory: Trajectory) -> dict[str, list[Any]]:
    return _over_time(trajectory, ("theta", "phi", "psi", "thetadot", "phidot", "psidot"))


def _potential(trajectory: Trajectory) -> dict[str, list[Any]]:
    from heavytop.analytic.potential import Potential
    from heavytop.plots.figures.energy import tilts_shown

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


def _phase(trajectory: Trajectory) -> dict[str, list[Any]]:
    return _over_time(trajectory, ("theta", "thetadot"))


def _off(trajectory: Trajectory) -> dict[str, list[Any]]:
    from heavytop.run.verify import deviations

    try:
        return {name: _listed(x) for name, x in deviations(trajectory, POINTS).items()}
    except NoClosedForm:
        return {"t": []}


def _listed(values: Any) -> list[Any]:
    return [float(f"{x:.12g}") if np.isfinite(x) else None for x in np.asarray(values)]


FIGURE_DATA: Final[Mapping[str, tuple[str, Callable[[Trajectory], Columns]]]] = {
    "overview": ("tilt over precession, and the path of the axis on the unit sphere", _axis),
    "angles": ("tilt, precession and rate of spin over time", _angles),
    "potential": ("effective potential, energy, and the tilts that they allow", _potential),
    "phase": ("the plane of tilt and tilt rate, with neighbouring energies", _phase),
    "errors": ("distance of the run from the closed form over time", _off),
}
"""By picture of a run: what it shows, and the numbers behind it."""
