"""The picture of an atlas: kinds as areas, boundaries as curves, and a mark for its scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heavytop.plots.style import KIND_STYLES, Known, literal, sheet, title_of
from heavytop.results.atlas import Atlas
from heavytop.results.base import nonzero
from heavytop.scene.quantities import quantity_of
from heavytop.scene.scene import scene_of
from heavytop.studies.atlas_plane import Axis, Plane

FINEST_PICTURE: Final = 1000  # pixels along an axis: of more, every second, third, … is drawn
BOUNDS: Final = {"cusp": "cusps", "steady": "uniform-precession"}  # others have names of kinds


def atlas_charts(found: Atlas) -> Mapping[str, Callable[..., Axes]]:
    """The picture of the map, if the atlas has one."""
    return {} if found.map is None else {"map": draw_map}


def atlas_figure(found: Atlas) -> Figure:
    """The picture of an atlas.

    Parameters
    ----------
    found : Atlas

    Returns
    -------
    matplotlib.figure.Figure
        The map, with what is held, and the scene as a bold cross.
    """
    plane = Plane(scene_of(found.scene), *(Axis.of_range(found.axes[side]) for side in "xy"))
    title = f"{title_of(found.scene)}\nheld: {nonzero(plane.held)}"
    with sheet(title, (7.2, 6.6), 3) as (figure, axes):
        ax = draw_map(axes[0, 0], found)
        limits, name = (ax.get_xlim(), ax.get_ylim()), literal(found.scene["name"], 30)
        place = [at * _unit_scale(found, side) for side, at in zip("xy", plane.place, strict=True)]
        if all(low <= at <= high for at, (low, high) in zip(place, limits, strict=True)):
            ax.plot(*place, "Pk", ms=9, mec="white", zorder=7, label=name)
    return figure


def draw_map(ax: Axes, /, found: Atlas, **mesh: Any) -> Axes:
    """Draw the kinds as areas, with their shares, and their boundaries as lines.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Atlas
    **mesh
        Keywords of the mesh.
    """
    names, codes = found.names, found.to_xarray()["kind"]
    kind = codes[tuple(np.s_[:: -(-n // FINEST_PICTURE)] for n in codes.shape)].values
    colours = ListedColormap([KIND_STYLES[name].colour for name in names])
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    sizes = {side: _unit_scale(found, side) for side in "xy"}
    counts = zip(sizes.items(), kind.shape[::-1], strict=True)
    edges = [_edges(found.axes[side], n) * size for (side, size), n in counts]
    ours: dict[str, Any] = {"cmap": colours, "norm": norm, "rasterized": True}
    ax.pcolormesh(*edges, kind, **ours | mesh)
    for side, ends in zip("xy", edges, strict=True):
        axis = found.axes[side]
        if axis.log:
            ax.set(**{f"{side}scale": "log" if axis.low > 0 else "symlog"})
        ax.set(**{f"{side}label": quantity_of(axis.name).heading, f"{side}lim": ends[[0, -1]]})
    every, lines = sum(found.counts.values()), {BOUNDS.get(x.name, x.name) for x in found.curves}
    for name, count in sorted(found.counts.items(), key=lambda each: -each[1]):
        look, area = KIND_STYLES[name], names.index(name) in _areas(kind)
        if area or name not in lines:
            label = f"{look.label} {count / every:.2%}" if area else look.label
            ax.fill([], [], fc=look.colour, ec="#555555", lw=0.5, label=label)
    for curve in found.curves:
        x, y = (np.multiply(getattr(curve, side), size) for side, size in sizes.items())
        look = KIND_STYLES[BOUNDS.get(curve.name, curve.name)]
        looks: dict[str, Any] = {"ls": look.marker, "lw": 1.5, "zorder": 3}
        if len(x) == 1:
            looks = {"ls": "none", "marker": "*", "ms": 9, "mec": "white", "mew": 0.6, "zorder": 4}
        else:
            ax.plot(x, y, "-", color="white", lw=2.6, alpha=0.7, zorder=2)
        ax.plot(x, y, color=look.colour, label=look.label, **looks)
    return ax


def _unit_scale(found: Atlas, side: str) -> float:
    """The factor from SI to the unit in which an axis is shown."""
    return quantity_of(found.axes[side].name).shown[1]


def _areas(kind: NDArray[np.uint8]) -> set[int]:
    """The codes that fill a square of four pixels somewhere; others are lines and points."""
    corner = kind[:-1, :-1]
    same = (corner == kind[1:, :-1]) & (corner == kind[:-1, 1:]) & (corner == kind[1:, 1:])
    return set(corner[same].tolist())


def _edges(axis: Known, count: int) -> NDArray[np.float64]:
    """The edges of so many pixels; the first and the last value are in the middle of theirs."""
    return Axis.of_range(axis).at((np.arange(count + 1) - 0.5) / max(1, count - 1))
