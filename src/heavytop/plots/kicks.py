"""The path of the axis seen from above, small: one for each rung of a ladder of kicks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion

PATH: Final = "#0072B2"
START: Final = "#D55E00"
FAINT: Final = "#BBBBBB"
POINTS: Final = 1501


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
    axis = motion.at(np.linspace(0.0, time, POINTS)).axis
    x, y = axis[:, 0], axis[:, 1]
    start = float(np.hypot(x[0], y[0]))
    around = np.linspace(0.0, 2 * np.pi, 121)
    ax.plot(start * np.cos(around), start * np.sin(around), color=FAINT, linewidth=0.6)
    ax.plot(0.0, 0.0, "+", color="black", markersize=5)
    ax.plot(x, y, color=PATH, linewidth=0.8)
    ax.plot(x[0], y[0], "o", color=START, markersize=3)
    reach = 1.1 * max(float(np.hypot(x, y).max()), start)
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    ax.set_aspect("equal")
    ax.axis("off")
