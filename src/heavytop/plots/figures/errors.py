"""The error of a run against the closed form, over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from heavytop.errors import NoClosedForm
from heavytop.plots.figures.given import expect_run
from heavytop.run.verify import deviations

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

NAMES: Final = {
    "theta": ("tilt θ", "#0072B2", "o"),
    "phi": ("precession φ", "#D55E00", "s"),
    "psi": ("spin ψ", "#009E73", "^"),
    "axis": ("axis, as a length", "#CC79A7", "D"),
}


def errors(ax: Axes, trajectory: Trajectory) -> None:
    """Draw |run - closed form| against time [s], logarithmic.

    The marks are samples, the lines the largest error so far. A sample with no error at all is
    drawn on the lower edge, below every other.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    trajectory : Trajectory
    """
    expect_run(trajectory)
    try:
        found = deviations(trajectory)
        _draw(ax, found.pop("t"), found)
    except NoClosedForm as reason:
        ax.text(0.5, 0.5, str(reason), transform=ax.transAxes, ha="center", wrap=True)
    ax.set_xlabel("time t [s]")
    ax.set_ylabel("|run − closed form| [rad]")


def _draw(ax: Axes, t: NDArray[Any], found: Mapping[str, NDArray[Any]]) -> None:
    seen = np.concatenate(list(found.values()))
    positive = seen[seen > 0]
    smallest = float(positive.min()) if positive.size else float(np.finfo(float).eps)
    floor = 10.0 ** np.floor(np.log10(smallest) - 0.7)
    for name, error in found.items():
        label, colour, marker = NAMES[name]
        shown = np.where(error == 0, floor, error)
        largest = np.fmax.accumulate(error)
        ax.plot(t, shown, marker, color=colour, markersize=1.8, alpha=0.5, linewidth=0)
        ax.plot(
            t, np.where(largest > 0, largest, np.nan), color=colour, linewidth=1.2,
            label=f"{label}: {_size(float(largest[-1]))}",
        )  # fmt: skip
    ax.set_yscale("log")
    ax.set_ylim(bottom=floor)
    ax.annotate(
        "exactly zero", (0, floor), xycoords=("axes fraction", "data"), xytext=(4, 4),
        textcoords="offset points", fontsize="small", color="#666666",
    )  # fmt: skip


def _size(error: float) -> str:
    return f"at most {error:.1e}" if error else "none"
