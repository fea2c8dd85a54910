"""The errors of a trajectory that somebody else computed, over time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots import style
from heavytop.plots.style import label_axes, line, literal
from heavytop.results.base import error_of
from heavytop.results.check import CHECKED_QUANTITIES, Check
from heavytop.scene.quantities import SI, show_units


def check_charts(_: Check) -> Mapping[str, Callable[..., Axes]]:
    """The pictures of a check: the errors over time, and the phase error."""
    return {"errors": checked_errors, "phase": checked_phase}


def check_figure(found: Check) -> Figure:
    """The figure of a check: its errors over time with the conditioning; below, the phase error."""
    grid = {"nrows": 2, "sharex": True, "height_ratios": (3, 2)}
    with style.sheet(literal(found.data["file"]), (7.0, 5.2), 3, **grid) as (figure, axes):
        checked_errors(axes[0, 0], found).set_xlabel("")
        checked_phase(axes[1, 0], found)
    return figure


def checked_errors(ax: Axes, /, found: Check, **looks: Any) -> Axes:
    """Draw the magnitude of every error against time, logarithmic, above conditioning.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Check
    """
    curves = {name: np.array(x, float) for name, x in found.curves.items()}
    ax.set_yscale("log")
    with show_units(SI):  # errors of several units share the axis
        labels = {name: error_of(name).heading for name in CHECKED_QUANTITIES}
    for name, colour in zip(CHECKED_QUANTITIES, style.COLOURS, strict=True):
        if name in curves:
            off = np.where(curves[name], abs(curves[name]), np.nan)  # a logarithm shows no zero
            line(ax, curves["t"], off, looks, color=colour, lw=1.0, label=labels[name])
    if limit := found.condition:
        ax.axhline(limit, color=style.BLACK, ls=":", lw=1.0, label="conditioning")
    return label_axes(ax, "t [s]", "error")


def checked_phase(ax: Axes, /, found: Check, **looks: Any) -> Axes:
    """Draw by how much the data run ahead of the exact motion [s] against time.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Check
    """
    curves = found.curves
    line(ax, curves["phase_t"], curves["phase"], looks, color=style.BLUE, marker="o", ms=3, lw=1.0)
    return label_axes(ax, "t [s]", "runs ahead by [s]")
