"""Pictures of a trajectory: each is a function of the axes it draws on, and computes nothing.

The same trajectory gives the same SVG, byte for byte. Colours are those of Okabe and Ito, and
every kind of event has its own marker, so that nothing rests on telling colours apart.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from numpy.typing import NDArray

from heavytop.files import write_whole

if TYPE_CHECKING:
    from heavytop.quantities import Sample
    from heavytop.trajectory import Trajectory

Array = NDArray[np.float64]

MOST_PERIODS: Final = 12  # more would only blacken the paper
POINTS: Final = 4001
PATH: Final = "#0072B2"
FAINT: Final = "#BBBBBB"


class Mark(NamedTuple):
    """How one kind of event is drawn."""

    label: str
    marker: str
    colour: str


MARKS: Final = {
    "theta_min": Mark("turning point, axis highest", "^", "#009E73"),
    "theta_max": Mark("turning point, axis lowest", "v", "#D55E00"),
    "reversal": Mark("reversal of precession", "o", "#CC79A7"),
    "cusp": Mark("cusp", "D", "#000000"),
}

_STYLE: Final[Any] = {
    "svg.hashsalt": "heavytop",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.formatter.useoffset": False,
}
# No date and no program version: the file depends on the trajectory alone.
_METADATA: Final[dict[str, dict[str, Any]]] = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
}


def overview(trajectory: Trajectory) -> Figure:
    """The picture of a run: the tilt against the precession, and the axis on the sphere.

    Parameters
    ----------
    trajectory : Trajectory

    Returns
    -------
    matplotlib.figure.Figure
        Where phi was not followed, the tilt is drawn against time instead.
    """
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.6, 5.2), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        (nutation if trajectory.phi is None else loop)(left, trajectory)
        axis_on_sphere(right, trajectory)
        # A title is text that somebody else wrote: a $ in it starts no formula.
        title = trajectory.scene.title or trajectory.scene.name
        figure.suptitle(_shortened(title), parse_math=False)
        handles, labels = right.get_legend_handles_labels()
        if handles:
            figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return figure


def loop(ax: Axes, trajectory: Trajectory) -> None:
    """Draw theta [rad] against phi [rad], upright: where the axis stands higher, so does the line.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory

    Raises
    ------
    ValueError
        The trajectory did not follow phi.
    """
    if trajectory.phi is None:
        raise ValueError("phi: not followed by this trajectory; nutation() draws theta over t")
    path, shown = _path(trajectory)
    ax.plot(path.phi, path.theta, color=PATH, linewidth=1.0)
    events = trajectory.events
    _mark(ax, trajectory, shown, np.column_stack((events.phi, events.theta)))
    ax.invert_yaxis()
    ax.set_xlabel("precession φ [rad]")
    ax.set_ylabel("tilt θ [rad]")
    ax.set_title(_part_shown(trajectory, shown), fontsize="medium")


def nutation(ax: Axes, trajectory: Trajectory) -> None:
    """Draw theta [rad] against time [s], upright.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    path, shown = _path(trajectory)
    ax.plot(path.t, path.theta, color=PATH, linewidth=1.0)
    events = trajectory.events
    _mark(ax, trajectory, shown, np.column_stack((events.t, events.theta)))
    ax.invert_yaxis()
    ax.set_xlabel("time t [s]")
    ax.set_ylabel("tilt θ [rad]")
    ax.set_title(_part_shown(trajectory, shown), fontsize="medium")


def axis_on_sphere(ax: Axes, trajectory: Trajectory) -> None:
    """Draw the path of the symmetry axis on the unit sphere, seen from far away.

    A path that keeps near the vertical is seen from straight above (or below), and the view
    closes in on it; any other from 25 degrees above the horizon, dotted where it runs behind.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    path, shown = _path(trajectory)
    view = View.of(path.axis)
    view.draw_graticule(ax)
    seen, depth = view.project(path.axis)
    for hidden, style in ((False, "-"), (True, ":")):
        part = np.where(((depth < 0) == hidden)[:, None], seen, np.nan)
        ax.plot(part[:, 0], part[:, 1], style, color=PATH, linewidth=1.0)
    _mark(ax, trajectory, shown, view.project(trajectory.events.axis)[0])
    ax.set_xlim(-view.reach, view.reach)
    ax.set_ylim(-view.reach, view.reach)
    ax.set_aspect("equal")
    ax.axis("off")
    ax.set_title(f"the axis on the unit sphere, {view.words}", fontsize="medium")


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
            return cls._from_pole(1.0 if side > 0 else -1.0, max(1.15 * tilt, 1e-3))
        return cls._from_horizon()

    @classmethod
    def _from_pole(cls, side: float, reach: float) -> View:
        spacing = next(step for step in (1, 2, 5, 10, 15) if np.sin(np.radians(5 * step)) > reach)
        words = f"from {'above' if side > 0 else 'below'}; circles {spacing}° apart"
        x, y, z = np.eye(3)
        return cls(x, side * y, side * z, reach, spacing, words)

    @classmethod
    def _from_horizon(cls) -> View:
        lift = np.radians(25.0)
        towards = np.array([0.0, -np.cos(lift), np.sin(lift)])
        up = np.array([0.0, np.sin(lift), np.cos(lift)])
        words = "from 25° above the horizon; circles 30° apart"
        return cls(np.array([1.0, 0.0, 0.0]), up, towards, 1.06, 30, words)

    def project(self, points: Array) -> tuple[Array, Array]:
        """Points on the paper, shape (k, 2), and their depth, positive towards the eye, (k,)."""
        return np.column_stack((points @ self.right, points @ self.up)), points @ self.towards

    def draw_graticule(self, ax: Axes) -> None:
        """Draw the outline, circles of equal tilt, and the vertical."""
        ax.add_patch(Circle((0.0, 0.0), 1.0, fill=False, color=FAINT, linewidth=1.0))
        around = np.linspace(0.0, 2 * np.pi, 181)
        for tilt in np.radians(np.arange(self.spacing, 180, self.spacing)):
            circle = np.column_stack(
                (
                    np.sin(tilt) * np.cos(around),
                    np.sin(tilt) * np.sin(around),
                    np.full_like(around, np.cos(tilt)),
                )
            )
            seen, depth = self.project(circle)
            seen = np.where((depth >= -1e-12)[:, None], seen, np.nan)
            ax.plot(seen[:, 0], seen[:, 1], color=FAINT, linewidth=0.6, zorder=1)
        pole = self.project(np.array([[0.0, 0.0, np.sign(self.towards[2])]]))[0][0]
        ax.plot(*pole, "+", color="black", markersize=7, zorder=1)


def _path(trajectory: Trajectory) -> tuple[Sample, float]:
    """The motion at the times drawn, and the last of them [s]."""
    end = float(trajectory.orbit.end)
    lowest = [t for kind, t in _timed(trajectory) if kind == "theta_max"]
    last = float(lowest[MOST_PERIODS]) if len(lowest) > MOST_PERIODS else end
    return trajectory(np.linspace(0.0, last, POINTS)), last


def _timed(trajectory: Trajectory) -> zip[tuple[str, float]]:
    return zip(trajectory.events.kind, trajectory.events.t, strict=True)


def _mark(ax: Axes, trajectory: Trajectory, shown: float, places: Array) -> None:
    """Mark the events up to the time `shown` at the given places, shape (k, 2)."""
    kinds = np.asarray(trajectory.events.kind, dtype=object)
    drawn = np.abs(np.asarray(trajectory.events.t)) <= abs(shown)
    for kind, mark in MARKS.items():
        here = places[drawn & (kinds == kind)]
        if len(here):
            ax.plot(
                here[:, 0],
                here[:, 1],
                mark.marker,
                label=mark.label,
                color=mark.colour,
                markersize=5,
                markerfacecolor="white",
                linestyle="none",
                zorder=3,
            )


def _part_shown(trajectory: Trajectory, shown: float) -> str:
    end = float(trajectory.orbit.end)
    if shown == end:
        return f"0 to {end:.6g} s"
    return f"the first {shown:.4g} s of {end:.6g} s"


def _shortened(title: str, most: int = 90) -> str:
    return title if len(title) <= most else title[: most - 1] + "…"


def save(figure: Figure, path: Path) -> None:
    """Write a figure whole; the name ends in ``.svg`` or ``.png``.

    Raises
    ------
    ValueError
        For any other ending.
    OSError
        The file cannot be written.
    """
    form = path.suffix.removeprefix(".")
    if form not in _METADATA:
        raise ValueError(f"{path.name}: a figure is .svg or .png")
    with mpl.rc_context(_STYLE), warnings.catch_warnings():
        # A title in a script the font lacks is drawn with boxes; the run is none the worse.
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)
        metadata = _METADATA[form]
        write_whole(
            path, lambda part: figure.savefig(part, format=form, dpi=160, metadata=metadata)
        )
