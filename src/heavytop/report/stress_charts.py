"""Two charts beside a stress test: which motions are stable, and who pays for a fast spin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.report.figures.style import FAINT, OTHER, PATH, STYLE
from heavytop.report.steady_figure import COLOURS, MARKERS

Points = Sequence[tuple[float, float]]


def stability_figure(
    cones: Sequence[tuple[float, float, float]],
    theory: Points,
    multipliers: Points,
    runs: Points,
) -> Figure:
    """Stability against p_ψ²/4A gMR: of steady precession by tilt, of the sleeping top by growth.

    Parameters
    ----------
    cones : sequence of (ratio, tilt, modulus less 1)
        Steady precessions: p_ψ²/4A gMR, θ [rad], and how far their multipliers are off the circle.
    theory, multipliers, runs : sequence of (ratio, growth)
        Growth rates of the sleeping top over √(gMR/A), from each source.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 6.4), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True)
        _cones(above, cones)
        _growth(below, theory, multipliers, runs)
        below.set_xlabel("p_ψ²/4A gMR")
    return figure


def _cones(ax: Axes, cones: Sequence[tuple[float, float, float]]) -> None:
    tilts = np.linspace(0.0, np.pi / 2, 181)
    ax.plot(np.cos(tilts), np.degrees(tilts), color=PATH, linewidth=1.2)
    ax.fill_betweenx(np.degrees(tilts), 0, np.cos(tilts), color=FAINT, alpha=0.4, linewidth=0)
    ax.text(0.3, 25, "no steady\nprecession", ha="center", fontsize=8)
    looks = ((0, "o", PATH, "slow"), (1, "x", "black", "fast"))
    for first, marker, colour, name in looks:
        some = cones[first::2]
        ax.plot([c[0] for c in some], np.degrees([c[1] for c in some]), marker, color=colour,
                markersize=5, markerfacecolor="none", linestyle="none",
                label=f"{name} precession: multipliers on the circle")  # fmt: skip
    ax.plot([0, 1], [0, 0], color=OTHER, linewidth=3, solid_capstyle="butt", label="upright, falls")
    ax.plot([1, 2], [0, 0], color=PATH, linewidth=3, solid_capstyle="butt", label="upright, sleeps")
    ax.set_ylabel("tilt [°]")
    ax.legend(frameon=False, fontsize=7.5, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def _growth(ax: Axes, theory: Points, multipliers: Points, runs: Points) -> None:
    ax.plot(*zip(*theory, strict=True), color=PATH, linewidth=1.2, label="√(1 − p_ψ²/4A gMR)")
    ax.plot(*zip(*multipliers, strict=True), "o", color=PATH, markersize=4, markerfacecolor="none",
            label="Floquet multipliers", linestyle="none")  # fmt: skip
    ax.plot(*zip(*runs, strict=True), "x", color=OTHER, markersize=5, label="perturbed runs",
            linestyle="none")  # fmt: skip
    ax.set_ylabel("growth of a small tilt, over √(gMR/A)")
    ax.set_xlim(0, 2)
    ax.legend(frameon=False, fontsize=7.5)
    ax.grid(True, linewidth=0.3, color=FAINT)


def spin_figure(steps: Mapping[str, Points]) -> Figure:
    """Steps in a nutation period against ψ̇ at the same p_ψ, for every form.

    Parameters
    ----------
    steps : mapping from str to sequence of (spin, steps)
        By the name of the form; spins in rad/s.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        ax = figure.subplots()
        for i, (name, points) in enumerate(steps.items()):
            ax.loglog(*zip(*points, strict=True), marker=MARKERS[i % len(MARKERS)], markersize=4,
                      color=COLOURS[i % len(COLOURS)], linewidth=1.0, label=name,
                      linestyle="-" if i < len(MARKERS) else "--")  # fmt: skip
        ax.set_xlabel("spin rate ψ̇ [rad/s] at the same p_ψ")
        ax.set_ylabel("steps in a nutation period")
        ax.grid(True, which="major", linewidth=0.3, color=FAINT)
        ax.legend(frameon=False, fontsize=7.5)
    return figure
