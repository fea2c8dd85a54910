"""The figures of a run, each on a page of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots.figures.angles import loop, nutation, precession, spin_rate
from heavytop.plots.figures.energy import effective_potential, phase_plane
from heavytop.plots.figures.errors import errors
from heavytop.plots.figures.given import expect_run
from heavytop.plots.figures.sphere import axis_on_sphere
from heavytop.plots.figures.style import STYLE, literal

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory


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
    expect_run(trajectory)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 5.2), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
        (nutation if trajectory.phi is None else loop)(left, trajectory)
        axis_on_sphere(right, trajectory)
        _finish(figure, trajectory, right, 4)
    return figure


def angles(trajectory: Trajectory) -> Figure:
    """The angles against time: theta, phi where it was followed, and psidot.

    Parameters
    ----------
    trajectory : Trajectory
    """
    expect_run(trajectory)
    panels = [nutation, *([precession] if trajectory.phi is not None else []), spin_rate]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 2.3 * len(panels)), layout="constrained")
        axes = figure.subplots(len(panels), 1, sharex=True)
        for ax, draw in zip(axes, panels, strict=True):
            draw(ax, trajectory)
        for ax in axes[:-1]:
            ax.set_xlabel("")
        _finish(figure, trajectory, axes[0], 4)
    return figure


def _page(draw: Callable[[Axes, Trajectory], None], trajectory: Trajectory) -> Figure:
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 4.8), layout="constrained")
        ax = figure.subplots()
        draw(ax, trajectory)
        _finish(figure, trajectory, ax, 2)
    return figure


def potential(trajectory: Trajectory) -> Figure:
    """The effective potential with the energy and the turning points.

    Parameters
    ----------
    trajectory : Trajectory
    """
    return _page(effective_potential, trajectory)


def phase(trajectory: Trajectory) -> Figure:
    """The plane of tilt and tilt rate.

    Parameters
    ----------
    trajectory : Trajectory
    """
    return _page(phase_plane, trajectory)


def accuracy(trajectory: Trajectory) -> Figure:
    """The error against the closed form.

    Parameters
    ----------
    trajectory : Trajectory
    """
    return _page(errors, trajectory)


def _finish(figure: Figure, trajectory: Trajectory, labelled: Axes, columns: int) -> None:
    """Set the title and the legend."""
    figure.suptitle(literal(trajectory.scene.title or trajectory.scene.name))
    handles, labels = labelled.get_legend_handles_labels()
    if handles:
        figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)


FIGURES: Final[Mapping[str, Callable[[Trajectory], Figure]]] = {
    "overview": overview,
    "angles": angles,
    "potential": potential,
    "phase": phase,
    "errors": accuracy,
}
"""The figures that a run writes, by the name of the file."""
