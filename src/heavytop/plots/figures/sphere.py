"""The symmetry axis on the unit sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from heavytop.plots.figures.given import expect_run
from heavytop.plots.figures.style import FAINT, PATH, Array, mark_events, path

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory


def axis_on_sphere(ax: Axes, trajectory: Trajectory) -> None:
    """Draw the path of the symmetry axis on the unit sphere, seen from far away.

    A path that keeps near the vertical is seen from straight above (or below), and the view
    closes in on it; any other from 25 degrees above or below the horizon, on the side where it
    mostly is, and dotted where it runs behind. The dot is the start.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    expect_run(trajectory)
    drawn, shown = path(trajectory)
    view = View.of(drawn.axis)
    view.draw_graticule(ax)
    seen, depth = view.project(drawn.axis)
    for hidden, style in ((False, "-"), (True, ":")):
        part = np.where(((depth < 0) == hidden)[:, None], seen, np.nan)
        ax.plot(part[:, 0], part[:, 1], style, color=PATH, linewidth=1.0)
    ax.plot(seen[0, 0], seen[0, 1], "o", color=PATH, markersize=2.5, zorder=4)
    mark_events(ax, trajectory, shown, view.project(trajectory.events.axis)[0])
    ax.set_xlim(-view.reach, view.reach)
    ax.set_ylim(-view.reach, view.reach)
    ax.set_aspect("equal")
    ax.axis("off")
    ax.set_title(f"the axis on the unit sphere,\n{view.words}", fontsize="medium")


MUCH = 0.3  # how far the mean of a path is off the centre before the view follows it


class View(NamedTuple):
    """An orthographic view of the unit sphere."""

    right: Array
    up: Array
    towards: Array
    reach: float
    spacing: int
    words: str

    @classmethod
    def of(cls, axis: Array) -> View:
        """The view that shows a path best; `axis` has shape (k, 3)."""
        tilt = float(np.hypot(axis[:, 0], axis[:, 1]).max())
        side = np.sign(axis[0, 2])
        if tilt < 0.7 and np.all(side * axis[:, 2] > 0):
            return cls.from_pole(1.0 if side > 0 else -1.0, max(1.15 * tilt, 1e-3))
        return cls.from_horizon(axis.mean(axis=0))

    @classmethod
    def from_pole(cls, side: float, reach: float) -> View:
        """From straight above (side 1) or below (−1), `reach` being half the width of the view."""
        steps = (step for step in (1, 2, 5, 10, 15) if np.sin(np.radians(5 * step)) > reach)
        spacing = next(steps, 30)
        words = f"from {'above' if side > 0 else 'below'}; circles {spacing}° apart"
        x, y, z = np.eye(3)
        return cls(x, side * y, side * z, reach, spacing, words)

    @classmethod
    def from_horizon(cls, mean: Array) -> View:
        """From 25° above or below the horizon, on the side of the mean of a path, shape (3,)."""
        lift = np.radians(-25.0 if mean[2] < -MUCH else 25.0)
        side = mean[:2] if np.hypot(mean[0], mean[1]) > MUCH else np.array([0.0, -1.0])
        x, y = side / np.hypot(side[0], side[1])
        towards = np.array([np.cos(lift) * x, np.cos(lift) * y, np.sin(lift)])
        up = np.array([-np.sin(lift) * x, -np.sin(lift) * y, np.cos(lift)])
        words = f"from 25° {'above' if lift > 0 else 'below'} the horizon; circles 30° apart"
        return cls(np.array([-y, x, 0.0]), up, towards, 1.06, 30, words)

    def project(self, points: Array) -> tuple[Array, Array]:
        """Points on the paper, shape (k, 2), and their depth, positive towards the eye, (k,)."""
        return np.column_stack((points @ self.right, points @ self.up)), points @ self.towards

    def draw_graticule(self, ax: Axes) -> None:
        """Draw the outline, circles of equal tilt, and the vertical."""
        ax.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=FAINT, linewidth=1.0))
        for tilt in np.radians(np.arange(self.spacing, 180, self.spacing)):
            if (reach := self._visible(tilt)) > 0:
                arc = Path.arc(-90 - np.degrees(reach), -90 + np.degrees(reach))
                flat = Affine2D().scale(np.sin(tilt), np.sin(tilt) * self.towards[2])
                seen = flat.translate(0.0, np.cos(tilt) * self.up[2]).transform_path(arc)
                ax.add_patch(PathPatch(seen, fill=False, color=FAINT, linewidth=0.6, zorder=1))
        pole = self.project(np.array([[0.0, 0.0, np.sign(self.towards[2])]]))[0][0]
        ax.plot(*pole, "+", color="black", markersize=7, zorder=1)

    def _visible(self, tilt: float) -> float:
        """How far to either side the circle of equal tilt can be seen, 0 … π, from its front."""
        over, front = np.cos(tilt) * self.towards[2], np.sin(tilt) * self.up[2]
        if abs(over) >= front:
            return np.pi if over > 0 else 0.0
        return float(np.arccos(-over / front))
