"""An atlas as a picture: kinds as areas, boundaries as curves, and a path of the axis for each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.plots.sphere import draw_motion
from heavytop.plots.style import KIND_STYLES, STYLE, Known, legend, literal, title_of
from heavytop.results.atlas import Atlas
from heavytop.scene.quantities import quantity_of
from heavytop.scene.scene import scene_of
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.studies.atlas_plane import Axis, Plane

Codes = NDArray[np.uint8]
Numbers = NDArray[np.float64]

FINEST_PICTURE: Final = 1000  # pixels of the picture along an axis: of more, every so many is drawn
ABREAST: Final = 4  # of these paths
BOUNDS: Final = {"cusp": "cusps", "steady": "uniform-precession"}  # the others are named as kinds


@mpl.rc_context(STYLE)
def atlas_figure(atlas: Atlas) -> Figure:
    """The picture of an atlas.

    Parameters
    ----------
    atlas : Atlas

    Returns
    -------
    matplotlib.figure.Figure
        The map; below it, for every kind, the path of the axis of a top in its midst, whose place
        on the map has the same number.
    """
    plane, kind = _plane(atlas), _thinned(atlas)
    examples = list(_examples(kind.values, atlas.names))
    height, width = (kind[name].values for name in kind.dims)
    rows = -(-len(examples) // ABREAST)
    figure = Figure(figsize=(7.2, 6.6 + 1.9 * rows), layout="constrained")
    parts: Any = figure.subfigures(2, 1, height_ratios=(6.6, max(1.9 * rows, 0.01)))
    held = (f"{quantity_of(name).symbol} = {value:.6g}" for name, value in plane.held.items())
    parts[0].suptitle(f"{title_of(atlas.scene)}\nheld: {', '.join(held)}", fontsize=9)
    ax = draw_map(parts[0].subplots(), atlas)
    (x, y), name = plane.place, literal(atlas.scene["name"], 30)
    if all(low <= at <= high for at, (low, high) in ((x, ax.get_xlim()), (y, ax.get_ylim()))):
        ax.plot(x, y, "Pk", ms=9, mec="white", zorder=7, label=name)
    legend(parts[0], 3, fontsize=8)
    panels = parts[1].subplots(rows, ABREAST, squeeze=False).ravel() if rows else ()
    box = {"boxstyle": "circle", "facecolor": "white", "edgecolor": "black", "linewidth": 0.7}
    for panel in panels:
        panel.axis("off")
    for number, (panel, (name, row, column)) in enumerate(zip(panels, examples, strict=False), 1):
        x, y = float(width[column]), float(height[row])
        ax.text(x, y, str(number), ha="center", va="center", fontsize=8, zorder=6, bbox=box)
        pushed = draw_motion(panel, _motion(plane, x, y))
        words = f"{number}: {KIND_STYLES[name].label}{', touched' * pushed}"
        panel.set_title(words, fontsize=7.5)
    return figure


def draw_map(ax: Axes, atlas: Atlas, **mesh: Any) -> Axes:
    """Draw the kinds as areas, with their shares, and their boundaries as lines.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    atlas : Atlas
    **mesh
        Keywords of the mesh.
    """
    names, kind = atlas.names, _thinned(atlas).values
    colours = ListedColormap([KIND_STYLES[name].colour for name in names])
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    edges = [_edges(atlas.axes[side], n) for side, n in zip("xy", kind.shape[::-1], strict=True)]
    ours: dict[str, Any] = {"cmap": colours, "norm": norm, "rasterized": True}
    ax.pcolormesh(*edges, kind, **ours | mesh)
    for side, ends in zip("xy", edges, strict=True):
        axis = atlas.axes[side]
        along = quantity_of(axis.name)
        if axis.log:
            ax.set(**{f"{side}scale": "log" if axis.low > 0 else "symlog"})
        ax.set(**{f"{side}label": f"{along.symbol} [{along.unit}]", f"{side}lim": ends[[0, -1]]})
    every, lines = sum(atlas.counts.values()), {BOUNDS.get(x.name, x.name) for x in atlas.curves}
    for name, count in sorted(atlas.counts.items(), key=lambda each: -each[1]):
        look, area = KIND_STYLES[name], names.index(name) in _areas(kind)
        if area or name not in lines:
            label = f"{look.label} {count / every:.2%}" if area else look.label
            ax.fill([], [], fc=look.colour, ec="#555555", lw=0.5, label=label)
    for curve in atlas.curves:
        x, y, look = curve.x, curve.y, KIND_STYLES[BOUNDS.get(curve.name, curve.name)]
        if len(x) == 1:
            looks: dict[str, Any] = {"ls": "none", "marker": "*", "ms": 9, "mec": "white"}
            looks |= {"mew": 0.6, "zorder": 4}
        else:
            ax.plot(x, y, "-", color="white", lw=2.6, alpha=0.7, zorder=2)
            looks = {"ls": look.marker, "lw": 1.5, "zorder": 3}
        ax.plot(x, y, color=look.colour, label=look.label, **looks)
    return ax


def _plane(atlas: Atlas) -> Plane:
    x, y = (Axis.of_range(atlas.axes[side]) for side in "xy")
    return Plane(scene_of(atlas.scene), x, y)


def _thinned(atlas: Atlas) -> Any:
    """The codes of kinds that are drawn, an array of xarray."""
    kind = atlas.to_xarray()["kind"]
    return kind[tuple(slice(None, None, -(-n // FINEST_PICTURE)) for n in kind.shape)]


def _areas(kind: Codes) -> set[int]:
    """The codes that fill a square of four pixels somewhere: others are lines and points."""
    corner = kind[:-1, :-1]
    same = (corner == kind[1:, :-1]) & (corner == kind[:-1, 1:]) & (corner == kind[1:, 1:])
    return set(corner[same].tolist())


def _edges(axis: Known, count: int) -> Numbers:
    """The edges of so many pixels; the first and the last value are in the middle of theirs."""
    low, high, share = axis["low"], axis["high"], (np.arange(count + 1) - 0.5) / max(1, count - 1)
    if axis["log"]:
        return np.asarray(low * (high / low) ** share)
    return np.asarray(low + (high - low) * share)


def _examples(kind: Codes, names: Sequence[str]) -> Iterator[tuple[str, int, int]]:
    """The pixel of each kind, row and column, that is farthest from others; the commonest first."""
    from scipy.ndimage import distance_transform_cdt

    codes, counts = np.unique(kind, return_counts=True)
    for code in codes[np.argsort(-counts)].tolist():
        if names[code] != "impossible":
            inside = distance_transform_cdt(np.pad(kind == code, 1), "taxicab")[1:-1, 1:-1]
            row, column = np.unravel_index(np.argmax(inside), kind.shape)
            yield names[code], int(row), int(column)


def _motion(plane: Plane, x: float, y: float) -> Motion:
    tops = plane.at(np.array([x]), np.array([y]))
    numbers = {name: float(np.ravel(each)[0]) for name, each in tops.items()}
    moments = {name: numbers.pop(name) for name in ("A", "C", "gMR")}
    return Motion(Top.of_numbers(**moments), State(**numbers))
