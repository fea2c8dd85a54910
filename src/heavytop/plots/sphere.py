"""The path of the symmetry axis on the unit sphere: views of it, and small pictures."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from heavytop.analytic.motion import Motion
from heavytop.exact.pairs import Array
from heavytop.plots.style import BLACK, FAINT, KIND_STYLES, STYLE, line_style
from heavytop.scene.state import State
from heavytop.scene.top import Top

MUCH: Final = 0.3  # distance of the mean of a path from the centre: beyond, the view is turned
NARROW: Final = 0.1  # a path that the view sees no wider is seen edge-on
BEHIND: Final = 0.3  # opacity of lines behind the sphere
TOUCHED: Final = 0.6  # opacity of the motion after a push
TINT: Final = 0.3  # share of the colour of a kind in the ground of a sphere
PUSH: Final = 1.0  # rad/s, across the axis
STILL_KINDS: Final = ("at-rest", "sleeping", "hanging")
NUTATIONS: Final = 3  # shown in a small picture
STEADY_TURN_S: Final = 1.0  # shown of a motion without a period


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
        view = cls.from_horizon(axis.mean(axis=0))
        edge_on = np.ptp(view.project(axis)[0][:, 0]) < NARROW
        return cls.from_horizon(axis.mean(axis=0), aside=1.0) if edge_on else view

    @classmethod
    def from_pole(cls, side: float, reach: float) -> View:
        """From straight above (side 1) or below (−1), `reach` being half the width of the view."""
        steps = (step for step in (1, 2, 5, 10, 15) if np.sin(np.radians(4 * step)) > reach)
        words = f"from straight {'above' if side > 0 else 'below'}"
        x, y, z = np.eye(3)
        return cls(x, side * y, side * z, reach, next(steps, 30), words)

    @classmethod
    def from_horizon(cls, mean: Array, aside: float = 0.0) -> View:
        """From 25° above or below the horizon, on the side of the mean of a path, shape (3,).

        Or `aside` of it, by so much [rad].
        """
        x, y = mean[:2] if np.hypot(mean[0], mean[1]) > MUCH else (0.0, -1.0)
        lift = np.radians(-25.0 if mean[2] < -MUCH else 25.0)
        words = f"from 25° {'above' if lift > 0 else 'below'} the horizon"
        return cls.from_side(float(np.arctan2(y, x)) + aside, float(lift), words)

    @classmethod
    def from_side(cls, azimuth: float, lift: float, words: str = "") -> View:
        """From an azimuth and an angle above the horizon [rad]."""
        s, c, up, level = np.sin(azimuth), np.cos(azimuth), np.sin(lift), np.cos(lift)
        right, over = np.array([-s, c, 0]), np.array([-up * c, -up * s, level])
        return cls(right, over, np.array([level * c, level * s, up]), 1.06, 30, words)

    def widen(self, axis: Array) -> View:
        """The same view, wide enough for another path, shape (k, 3)."""
        far = float(np.hypot(*self.project(axis)[0].T).max())
        wide = self.from_pole(float(self.towards[2]), min(1.15 * far, 1.06))
        return wide if abs(self.towards[2]) == 1 and wide.reach > self.reach else self

    def project(self, points: Array) -> tuple[Array, Array]:
        """Points on the paper, shape (…, 2), and their depth, positive towards the eye, (…,)."""
        flat = np.stack((points @ self.right, points @ self.up), axis=-1)
        return flat, points @ self.towards

    def draw_graticule(self, ax: Axes, ground: Any = "none", size: float = 6.5) -> None:
        """Draw the sphere on its ground, circles of equal tilt with their degrees, the vertical."""
        radius, whole = min(self.reach, 1.0), self.reach >= 1.0
        ax.add_patch(Circle((0.0, 0.0), radius, fc=ground, ec=FAINT, lw=1.0 * whole, zorder=0))
        for degrees in range(self.spacing, 180, self.spacing):
            z, far = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
            flat, depth = self.project(circle(np.radians(degrees)))
            if not (depth > 0).any() or not (whole or far < radius):
                continue
            ax.plot(*np.where(depth > 0, flat.T, np.nan), color=FAINT, lw=0.6, zorder=1)
            front = z * self.up[2] - far * self.towards[2]
            if abs(front) < 0.95 * radius:
                ax.text(0.0, front, f"{degrees}°", fontsize=size, color="#606060", ha="center",
                        va="bottom", zorder=1.5)  # fmt: skip
        pole = self.project(np.array([[0.0, 0.0, np.sign(self.towards[2])]]))[0][0]
        ax.plot(*pole, "+", color=BLACK, ms=6, mew=0.8, zorder=4)

    def draw_path(
        self, ax: Axes, axis: Array, colour: str, opacity: float = 1.0, **looks: Any
    ) -> None:
        """Draw a path of the axis from its dot to its arrow head, paler behind the sphere."""
        looks = line_style({"color": colour, "alpha": opacity, "lw": 1.0}, looks)
        colour, opacity = looks["color"], looks["alpha"]
        self.draw_line(ax, axis, **looks)
        flat = self.project(axis)[0]
        ax.plot(*flat[0], "o", color=colour, ms=3, zorder=4)
        away = np.flatnonzero(np.hypot(*(flat - flat[-1]).T) > 0.02 * self.reach)
        if away.size:
            head = {"arrowstyle": "-|>", "color": colour, "alpha": opacity, "shrinkB": 0}
            ax.annotate("", flat[-1], flat[away[-1]], arrowprops=head, zorder=4)

    def draw_line(self, ax: Axes, points: Array, alpha: float = 1.0, **looks: Any) -> None:
        """Draw a line on the sphere, paler behind it."""
        flat, depth = self.project(points)
        for behind, strength in ((False, alpha), (True, BEHIND * alpha)):
            part = np.where(((depth < 0) == behind)[:, None], flat, np.nan)
            if np.isfinite(part).any():
                ours = {"solid_joinstyle": "round", "zorder": 2 if behind else 3}
                ax.plot(*part.T, **ours | looks, alpha=strength)
                looks.pop("label", None)  # of one of the parts alone

    def frame(self, ax: Axes) -> None:
        """Set the limits of axes to the view, and hide the axes themselves."""
        edge = 1.02 * self.reach
        ax.set(xlim=(-edge, edge), ylim=(-edge, edge), aspect="equal")
        ax.axis("off")


def circle(tilt: float) -> Array:
    """Points of equal tilt [rad] on the unit sphere, shape (k, 3)."""
    around = np.linspace(0.0, 2 * np.pi, 91)
    x, y = np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around)
    return np.stack((x, y, 0 * x + np.cos(tilt)), axis=-1)


def push(motion: Motion) -> Motion | None:
    """The motion of a top that rests, sleeps or hangs after a push; None for a top that moves."""
    if motion.kind not in STILL_KINDS:
        return None
    start = motion.start
    return Motion(motion.top, State(start.theta, thetadot=PUSH, omega3=start.omega3))


def momentum_path(top: Top, record: Any) -> Array:
    """The angular momentum over its largest size at the times of a sample or record, (k, 3)."""
    A, C = float(top.A), float(top.C)
    along = np.sum(record.omega * record.axis, axis=1, keepdims=True)
    momentum = A * record.omega + (C - A) * along * record.axis
    return np.asarray(momentum / (float(np.linalg.norm(momentum, axis=1).max()) or 1.0))


def axis_path(motion: Motion, time: float) -> Array:
    """The axis over `time` seconds of the closed form, shape (k, 3)."""
    return np.asarray(motion.at(np.linspace(0.0, time, 801)).axis)


def kind_panel(ax: Axes, path: Array, view: View, kind: str, *, pushed: bool = False) -> None:
    """Draw a path of the axis on the unit sphere, on a ground of the colour of its kind.

    The cross is the vertical, the dot the start, the arrow head the end; what runs behind the
    sphere is paler.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    path : numpy.ndarray, shape (k, 3)
    view : View
    kind : str
        That of the motion.
    pushed : bool
        The path is what the top does when it is touched; by itself it stays at the dot.
    """
    colour = np.array(to_rgb(KIND_STYLES[kind].colour))
    view.draw_graticule(ax, tuple(1 - TINT * (1 - colour)), size=5)
    view.draw_path(ax, path, "#222222", TOUCHED if pushed else 1.0)
    view.frame(ax)


@mpl.rc_context(STYLE)
def motion_figure(motion: Motion) -> Figure:
    """A small picture of a motion: some nutations of the axis on the ground of its kind."""
    figure, pushed = Figure(figsize=(2.4, 2.4), layout="constrained"), push(motion)
    moving, still = pushed or motion, pushed is not None
    path = axis_path(moving, NUTATIONS * moving.period if moving.period else STEADY_TURN_S)
    kind_panel(figure.subplots(), path, View.of(path), str(motion.kind), pushed=still)
    return figure
