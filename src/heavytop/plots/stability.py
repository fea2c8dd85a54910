"""Charts of the theory pages: stability, what a fast spin costs, formulas for steady precession."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter
from numpy.typing import ArrayLike

from heavytop.plots.style import BLACK, COLOURS, FAINT, MARKERS, OTHER, PATH, STYLE

Points = Sequence[tuple[float, float]]
ON: Final = 1e-9  # so near the circle a modulus counts as on it,
BESIDE: Final = 1e-2  # and a swing as the small one that it should be
SERIES: Final = (*COLOURS[:4], BLACK)


@dataclass(frozen=True, slots=True)
class Cone:
    """A steady precession, and what became of it.

    Attributes
    ----------
    ratio, tilt : float
        p_ψ²/4A gMR, and θ [rad].
    fast : bool
        Whether it is the fast one of the two.
    off : float
        How far the modulus of its multiplier is from 1.
    strayed : float
        How far the swing of a pushed run is from the small one, relative.
    """

    ratio: float
    tilt: float
    fast: bool
    off: float
    strayed: float


def stability_figure(
    cones: Sequence[Cone],
    theory: Points,
    multipliers: Points,
    runs: Points,
) -> Figure:
    """Stability against p_ψ²/4A gMR: of steady precession by tilt, of the sleeping top by growth.

    Parameters
    ----------
    cones : sequence of Cone
        Steady precessions.
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


def _cones(ax: Axes, cones: Sequence[Cone]) -> None:
    tilts = np.linspace(0.0, np.pi / 2, 181)
    ax.plot(np.cos(tilts), np.degrees(tilts), color=PATH, linewidth=1.2)
    ax.fill_betweenx(np.degrees(tilts), 0, np.cos(tilts), color=FAINT, alpha=0.4, linewidth=0)
    ax.text(0.3, 25, "no steady\nprecession", ha="center", fontsize=8)
    on = [c for c in cones if abs(c.off) <= ON]
    _marked(ax, [c for c in on if not c.fast], "o", PATH, "slow: multipliers on the circle")
    _marked(ax, [c for c in on if c.fast], "x", "black", "fast: multipliers on the circle")
    _marked(ax, [c for c in cones if abs(c.off) > ON], "D", OTHER, "multipliers off the circle")
    stayed = [c for c in cones if c.strayed <= BESIDE]
    _marked(ax, stayed, "_", OTHER, "pushed runs that stay beside it")
    _marked(ax, [c for c in cones if c.strayed > BESIDE], "s", OTHER, "pushed runs that leave it")
    ax.plot([0, 1], [0, 0], color=OTHER, linewidth=3, solid_capstyle="butt", label="upright, falls")
    ax.plot([1, 2], [0, 0], color=PATH, linewidth=3, solid_capstyle="butt", label="upright, sleeps")
    ax.set_ylabel("tilt [°]")
    ax.legend(frameon=False, fontsize=7.5, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def _marked(ax: Axes, cones: Sequence[Cone], marker: str, colour: str, label: str) -> None:
    """Mark cones, if there are any."""
    if cones:
        ax.plot([c.ratio for c in cones], np.degrees([c.tilt for c in cones]), marker, color=colour,
                markersize=6, markerfacecolor="none", linestyle="none", label=label)  # fmt: skip


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
    """Steps in a nutation period against ω3 at the same p_ψ, for every form.

    Parameters
    ----------
    steps : mapping from str to sequence of (spin, steps)
        By the name of the form; spins in rad/s.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 4.0), layout="constrained")
        ax = figure.subplots()
        for i, (name, points) in enumerate(steps.items()):
            ax.loglog(*zip(*points, strict=True), marker=MARKERS[i % 5], markersize=4,
                      color=SERIES[i % 5], linewidth=1.0, label=name,
                      linestyle="-" if i < 5 else "--")  # fmt: skip
        ax.set_xlabel("spin rate ω3 [rad/s] at the same p_ψ")
        ax.set_ylabel("steps in a nutation period")
        ax.grid(True, which="major", linewidth=0.3, color=FAINT)
        ax.legend(frameon=False, fontsize=7.5)
    return figure


def steady_errors(ax: Axes, omega3: ArrayLike, errors: Mapping[str, ArrayLike]) -> None:
    """Draw |relative error| of each formula against the spin ω3 [rad/s], both logarithmic.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    omega3 : array_like, shape (n,)
    errors : mapping from str to array_like, shape (n,)
        Relative errors by the name of the formula; a zero is drawn as the rounding of doubles.
    """
    rounding = np.finfo(np.float64).eps / 2
    for (name, values), marker, colour in zip(errors.items(), MARKERS, SERIES, strict=False):
        sizes = np.maximum(np.abs(np.asarray(values, dtype=np.float64)), rounding)
        ax.loglog(omega3, sizes, marker=marker, color=colour, linewidth=1.0, label=name)
    ax.set_xlabel("spin ω₃ [rad/s]")
    ax.set_ylabel("relative error of the precession")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.grid(True, which="major", linewidth=0.4, color=FAINT)
    ax.legend(frameon=False, fontsize="small")
