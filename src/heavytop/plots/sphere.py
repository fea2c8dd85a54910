"""The path of the symmetry axis on the unit sphere: how it is seen, and small pictures of it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from matplotlib.transforms import Affine2D

from heavytop.plots.style import FAINT, ORANGE, PATH, STYLE, Array, literal

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion


MUCH: Final = 0.3  # how far the mean of a path is off the centre before the view follows it
GROUND: Final = "#F3F5F8"
LINES: Final = "#C9CED6"
BEHIND: Final = 0.3  # opacity of what runs behind the sphere
PUSHED: Final = 0.6  # opacity of a neighbour's path
HEAD: Final = 0.05  # half the length of an arrow head, in units of the view's reach
ACROSS: Final = 4  # panels in a row
BY_KIND: Final = (PATH, ORANGE, "#009E73", "#882255", "#7A4F00", "#333333")


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

    def parts(self, points: Array) -> Iterator[tuple[Array, bool]]:
        """What of a path is in front of the sphere, and what behind it, the rest as nan."""
        seen, depth = self.project(points)
        for behind in (False, True):
            yield np.where(((depth < 0) == behind)[:, None], seen, np.nan), behind

    def frame(self, ax: Axes, margin: float = 1.0) -> None:
        """Show the view on axes that are not drawn."""
        edge = margin * self.reach
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
        ax.axis("off")

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


def axis_path(motion: Motion, time: float) -> Array:
    """The axis over `time` seconds of the closed form, shape (k, 3)."""
    path: Array = motion.at(np.linspace(0.0, time, 801)).axis
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
    for part, behind in view.parts(path):
        if np.isfinite(part).any():
            ax.plot(
                part[:, 0], part[:, 1], color=colour, linewidth=1.1,
                alpha=strength * (BEHIND if behind else 1.0), solid_joinstyle="round",
                zorder=2 if behind else 3,
            )  # fmt: skip
    ax.plot(*seen[0], "o", color=colour, markersize=5.5 if pushed else 4, zorder=5)
    _head(ax, seen, view.reach, colour, strength * (BEHIND if depth[-1] < 0 else 1.0))
    view.frame(ax, 1.02)


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


def axis_trace(ax: Axes, motion: Motion, time: float) -> None:
    """Draw the path of the axis from above, over `time` seconds.

    The cross is the vertical, the dot the start, the grey circle the tilt of the start; the scale
    is that of the path.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    motion : Motion
        The closed form.
    time : float
        How much of it is drawn [s].
    """
    axis = motion.at(np.linspace(0.0, time, 1501)).axis
    x, y = axis[:, 0], axis[:, 1]
    start = float(np.hypot(x[0], y[0]))
    around = np.linspace(0.0, 2 * np.pi, 121)
    ax.plot(start * np.cos(around), start * np.sin(around), color=FAINT, linewidth=0.6)
    ax.plot(0.0, 0.0, "+", color="black", markersize=5)
    ax.plot(x, y, color=PATH, linewidth=0.8)
    ax.plot(x[0], y[0], "o", color=ORANGE, markersize=3)
    reach = 1.1 * max(float(np.hypot(x, y).max()), start)
    View.from_pole(1.0, reach).frame(ax)


def traces_figure(document: Mapping[str, Any]) -> Figure:
    """The chart of axis traces.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/traces/1``.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each scene, with its kind; scenes of a kind have a colour.
    """
    traces = document["traces"]
    rows = max(1, math.ceil(len(traces) / ACROSS))
    kinds = list(dict.fromkeys(each["kind"] for each in traces))
    with mpl.rc_context(STYLE | {"path.simplify_threshold": 0.5}):
        figure = Figure(figsize=(2.4 * ACROSS, 2.65 * rows), layout="constrained")
        panels = figure.subplots(rows, ACROSS, squeeze=False).ravel()
        for ax in panels:
            ax.axis("off")
        for ax, each in zip(panels, traces, strict=False):
            path = np.array(each["axis"], float).reshape(-1, 3)
            kind_panel(ax, path, View.of(path), BY_KIND[kinds.index(each["kind"]) % len(BY_KIND)])
            words = (
                f"{literal(each['name'], 40)}\n{literal(each['kind'], 40)}\n{each['seconds']:.3g} s"
            )
            ax.set_title(words, fontsize=8)
    return figure
