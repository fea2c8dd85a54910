"""The angles: against time, and the tilt against the precession (SICM, figures 2.5 to 2.8)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from heavytop.plots.figures.given import expect_run
from heavytop.plots.figures.style import PATH, Array, mark_events, part_shown, path

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory


CONSTANT = 1e-9  # a range below this [rad] is rounding, and not worth a scale of its own
PEAK = 20.0  # times the usual range: beyond, a peak would leave nothing else to see


def loop(ax: Axes, trajectory: Trajectory) -> None:
    """Draw theta [rad] against phi [rad], upright: where the axis stands higher, so does the line.

    The dot is the start.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory

    Raises
    ------
    WrongType
        It is no Trajectory; the other figures say the same.
    ValueError
        The trajectory did not follow phi.
    """
    expect_run(trajectory)
    if trajectory.phi is None:
        raise ValueError("phi: not followed by this trajectory; nutation() draws theta over t")
    drawn, shown = path(trajectory)
    ax.plot(drawn.phi, drawn.theta, color=PATH, linewidth=1.0)
    ax.plot(drawn.phi[0], drawn.theta[0], "o", color=PATH, markersize=2.5, zorder=4)
    events = trajectory.events
    mark_events(ax, trajectory, shown, np.column_stack((events.phi, events.theta)))
    _upright(ax, drawn.theta)
    ax.set_xlabel("precession φ [rad]")
    ax.set_ylabel("tilt θ [rad]")
    ax.set_title(part_shown(trajectory, shown), fontsize="medium")


def nutation(ax: Axes, trajectory: Trajectory) -> None:
    """Draw theta [rad] against time [s], upright.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    expect_run(trajectory)
    drawn, shown = path(trajectory)
    ax.plot(drawn.t, drawn.theta, color=PATH, linewidth=1.0)
    events = trajectory.events
    mark_events(ax, trajectory, shown, np.column_stack((events.t, events.theta)))
    _upright(ax, drawn.theta)
    ax.set_xlabel("time t [s]")
    ax.set_ylabel("tilt θ [rad]")
    ax.set_title(part_shown(trajectory, shown), fontsize="medium")


def precession(ax: Axes, trajectory: Trajectory) -> None:
    """Draw phi [rad] against time [s].

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory

    Raises
    ------
    ValueError
        The trajectory did not follow phi.
    """
    expect_run(trajectory)
    if trajectory.phi is None:
        raise ValueError("phi: not followed by this trajectory")
    drawn, shown = path(trajectory)
    ax.plot(drawn.t, drawn.phi, color=PATH, linewidth=1.0)
    events = trajectory.events
    mark_events(ax, trajectory, shown, np.column_stack((events.t, events.phi)))
    ax.set_xlabel("time t [s]")
    ax.set_ylabel("precession φ [rad]")


def spin_rate(ax: Axes, trajectory: Trajectory) -> None:
    """Draw psidot [rad/s] against time [s]: the top spins faster when it is more vertical.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    expect_run(trajectory)
    drawn, _ = path(trajectory)
    ax.plot(drawn.t, drawn.psidot, color=PATH, linewidth=1.0)
    _cut_peaks(ax, drawn.psidot)
    ax.set_xlabel("time t [s]")
    ax.set_ylabel("spin rate ψ̇ [rad/s]")


def _upright(ax: Axes, theta: Array) -> None:
    """Let tilt grow downwards; give a constant one a scale that can be read."""
    ax.invert_yaxis()
    low, high = float(np.nanmin(theta)), float(np.nanmax(theta))
    if high - low < CONSTANT:
        ax.set_ylim(high + 0.01, low - 0.01)


def _cut_peaks(ax: Axes, values: Array) -> None:
    """Show the usual range where the passes near a pole would dwarf it, and say so."""
    known = values[np.isfinite(values)]
    if not known.size:
        return
    low, high = np.percentile(known, (1.0, 99.0))
    usual = float(high - low)
    if 0 < PEAK * usual < float(np.ptp(known)):
        ax.set_ylim(low - 2 * usual, high + 2 * usual)
        ax.set_title("peaks near a pole are cut off", loc="right", fontsize="small", pad=2)
