"""The kinds of motion side by side: for each the path of the axis on the unit sphere, small."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from heavytop.plots.figures.sphere import View
from heavytop.plots.figures.style import Array

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion

POINTS: Final = 801
GROUND: Final = "#F3F5F8"
LINES: Final = "#C9CED6"
BEHIND: Final = 0.3  # opacity of what runs behind the sphere
PUSHED: Final = 0.6  # opacity of a neighbour's path
HEAD: Final = 0.05  # half the length of an arrow head, in units of the view's reach


def axis_path(motion: Motion, time: float) -> Array:
    """The axis over `time` seconds of the closed form, shape (k, 3)."""
    path: Array = motion.at(np.linspace(0.0, time, POINTS)).axis
    return path


def kind_panel(ax: Axes, path: Array, view: View, colour: str, *, pushed: bool = False) -> None:
    """Draw one path of the axis on the unit sphere, with an arrow head where it ends.

    The cross is the vertical, the dot the start; what runs behind the sphere is paler.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    path : numpy.ndarray, shape (k, 3)
    view : View
    colour : str
    pushed : bool
        The path is that of a neighbour, after a push; the motion itself stays at the dot.
    """
    if abs(view.towards[2]) == 1.0:
        _disc(ax, view)
    else:
        _sphere(ax, view, path[0])
    seen, depth = view.project(path)
    strength = PUSHED if pushed else 1.0
    for hidden, opacity in ((True, BEHIND), (False, 1.0)):
        part = np.where(((depth < 0) == hidden)[:, None], seen, np.nan)
        if np.isfinite(part).any():
            ax.plot(
                part[:, 0], part[:, 1], color=colour, linewidth=1.1, alpha=strength * opacity,
                solid_joinstyle="round", zorder=2 if hidden else 3,
            )  # fmt: skip
    ax.plot(*seen[0], "o", color=colour, markersize=5.5 if pushed else 4, zorder=5)
    _head(ax, seen, view.reach, colour, strength * (BEHIND if depth[-1] < 0 else 1.0))
    ax.set_xlim(-1.02 * view.reach, 1.02 * view.reach)
    ax.set_ylim(-1.02 * view.reach, 1.02 * view.reach)
    ax.set_aspect("equal")
    ax.axis("off")


def _disc(ax: Axes, view: View) -> None:
    """The neighbourhood of a pole, with circles of equal tilt."""
    ax.add_patch(Circle((0.0, 0.0), view.reach, facecolor=GROUND, edgecolor="none", zorder=0))
    tilts = np.arange(view.spacing, 91, view.spacing)
    for radius in np.sin(np.radians(tilts)):
        if radius < view.reach:
            circle = Circle((0.0, 0.0), radius, fill=False, color=LINES, linewidth=0.6, zorder=1)
            ax.add_patch(circle)
    ax.plot(0.0, 0.0, "+", color="black", markersize=6, markeredgewidth=0.8, zorder=4)


def _sphere(ax: Axes, view: View, start: Array) -> None:
    """The whole sphere, with circles of equal tilt and the symmetry axis at the start."""
    ax.add_patch(Circle((0.0, 0.0), 1.0, facecolor=GROUND, edgecolor="none", zorder=0))
    view.draw_graticule(ax)
    spoke = view.project(np.array([[0.0, 0.0, 0.0], start]))[0]
    ax.plot(spoke[:, 0], spoke[:, 1], color="#6B7280", linewidth=0.8, zorder=2)


def _head(ax: Axes, seen: Array, reach: float, colour: str, opacity: float) -> None:
    """An arrow head at the end of a path."""
    end = seen[-1]
    away = np.hypot(*(seen - end).T) > 0.02 * reach
    if not away.any():
        return
    along = end - seen[np.flatnonzero(away)[-1]]
    along *= HEAD * reach / np.hypot(*along)
    across = 0.7 * np.array([-along[1], along[0]])
    corners = np.array([end + along, end - along + across, end - along - across])
    ax.fill(corners[:, 0], corners[:, 1], color=colour, alpha=opacity, linewidth=0, zorder=4)
