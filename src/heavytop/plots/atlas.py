"""An atlas as a picture: kinds as areas, boundaries as curves, and a path of the axis for each."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.plots.sphere import View, axis_path, kind_panel
from heavytop.plots.style import STYLE, literal
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.studies.atlases.axes import ROLES

if TYPE_CHECKING:
    from heavytop.studies.atlases.atlas import Atlas
    from heavytop.studies.atlases.axes import Axis
    from heavytop.studies.atlases.curves import Curve
    from heavytop.studies.atlases.plane import Plane

Codes = NDArray[np.uint8]

FINEST: Final = 1000  # pixels of the picture along an axis: of more, every so many is drawn
TRACED: Final = 8  # regions with a path of the axis: the largest
CELLS: Final = 80  # along an axis of the mesh on which regions are told
PERIODS: Final = 3
SECONDS: Final = 2.0  # of a path, where nothing nutates
LEAST: Final = 0.005  # of the map: smaller regions have no number, unless their kind has no other

# Tints of Okabe and Ito's colours, each of another lightness than its neighbours on any map.
COLOURS: Final = {
    "at-rest": "#FFFFFF", "force-free": "#DDCC77", "sleeping": "#E69F00", "hanging": "#999933",
    "planar-pendulum": "#B8E0F5", "separatrix": "#882255", "through-top": "#D55E00",
    "through-bottom": "#CC79A7", "uniform-precession": "#009E73", "loops": "#5AA9D6",
    "cusps": "#000000", "waves": "#F8EFA4", "undecided": "#FF00FF", "impossible": "#B9B9B9",
}  # fmt: skip


class Stroke(NamedTuple):
    """How a boundary is drawn, and what it is called."""

    style: Any
    colour: str
    words: str


STROKES: Final = {
    "cusp": Stroke("-", "#000000", "cusps"),
    "through-top": Stroke((0, (5, 2)), "#9C3A00", "through the top"),
    "through-bottom": Stroke((0, (5, 2, 1, 2)), "#8E3B6E", "through the bottom"),
    "steady": Stroke((0, (1, 1.5)), "#00523B", "steady precession"),
    "sleeping": Stroke("-", "#7A4F00", "threshold of sleep"),
    "separatrix": Stroke((0, (3, 1, 1, 1, 1, 1)), "#882255", "separatrix"),
}


def atlas_figure(atlas: Atlas) -> Figure:
    """The picture of an atlas.

    Parameters
    ----------
    atlas : Atlas
        All of its tiles are there.

    Returns
    -------
    matplotlib.figure.Figure
        The map; beside it, for every region of some extent, the path of the axis of a top in its
        midst, whose place on the map has the same number.
    """
    kind, columns, rows = _thinned(atlas)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9.6, 6.0), layout="constrained")
        parts: Any = figure.subfigures(1, 2, width_ratios=(2.6, 1.0))
        left, right = parts
        plane = atlas.study.plane
        held = (f"{ROLES[name].sign} = {value:.6g}" for name, value in plane.held.items())
        left.suptitle(f"{literal(plane.scene.name, 60)}; held: {', '.join(held)}", fontsize=10)
        ax = left.subplots()
        _map(ax, atlas, kind)
        _own(ax, plane)
        _strokes(ax, atlas.curves)
        _kinds(ax, atlas)
        shown = list(_examples(atlas, kind, columns, rows))
        for number, example in enumerate(shown, start=1):
            _number(ax, example.x, example.y, number)
        _legend(right, shown)
    return figure


class Example(NamedTuple):
    """A region: its kind, and the motion at a pixel in its midst."""

    name: str
    x: float
    y: float
    motion: Motion


def _thinned(atlas: Atlas) -> tuple[Codes, Any, Any]:
    """The codes of every so many pixels, and which columns and rows those are."""
    count_y, count_x = atlas.study.plane.shape
    rows, columns = (np.arange(0, n, -(-n // FINEST)) for n in (count_y, count_x))
    kind = np.empty((rows.size, columns.size), np.uint8)
    for tile, found in atlas.tiles():
        inside_y = (rows >= tile.rows.start) & (rows < tile.rows.stop)
        inside_x = (columns >= tile.columns.start) & (columns < tile.columns.stop)
        part = found["kind"][np.ix_(rows[inside_y] - tile.rows.start,
                                    columns[inside_x] - tile.columns.start)]  # fmt: skip
        kind[np.ix_(inside_y, inside_x)] = part
    return kind, columns, rows


def _map(ax: Axes, atlas: Atlas, kind: Codes) -> None:
    plane = atlas.study.plane
    colours = ListedColormap([COLOURS[name] for name in atlas.names])
    norm = BoundaryNorm(np.arange(len(atlas.names) + 1) - 0.5, len(atlas.names))
    edges = [_edges(axis, n) for axis, n in zip((plane.x, plane.y), kind.shape[::-1], strict=True)]
    ax.pcolormesh(*edges, kind, cmap=colours, norm=norm, rasterized=True)
    for axis, set_scale, set_label in (
        (plane.x, ax.set_xscale, ax.set_xlabel), (plane.y, ax.set_yscale, ax.set_ylabel),
    ):  # fmt: skip
        if axis.log:
            set_scale("log" if float(axis.low) > 0 else "symlog")
        set_label(_label(axis))
    ax.set_xlim(edges[0][0], edges[0][-1])
    ax.set_ylim(edges[1][0], edges[1][-1])


def _own(ax: Axes, plane: Plane) -> None:
    """Mark where the scene itself lies, if that is on the map."""
    x, y = plane.place
    if all(low <= at <= high for at, (low, high) in ((x, ax.get_xlim()), (y, ax.get_ylim()))):
        ax.plot(x, y, "P", color="black", markersize=9, markeredgecolor="white", zorder=7,
                label=literal(plane.scene.name, 30))  # fmt: skip


def _edges(axis: Axis, count: int) -> NDArray[np.float64]:
    """The edges of so many pixels; the first and the last value are in the middle of theirs."""
    low, high, steps = float(axis.low), float(axis.high), np.arange(count + 1) - 0.5
    share = steps / max(1, count - 1)
    if axis.log:
        return np.asarray(low * (high / low) ** share)
    return np.asarray(low + (high - low) * share)


def _label(axis: Axis) -> str:
    role = ROLES[axis.name]
    return f"{role.sign} [{role.unit}]"


def _strokes(ax: Axes, curves: tuple[Curve, ...]) -> None:
    named: set[str] = set()
    for curve in curves:
        stroke = STROKES[curve.name]
        label = stroke.words if curve.name not in named else None
        named.add(curve.name)
        if curve.x.size == 1:
            ax.plot(curve.x, curve.y, "*", color=stroke.colour, markersize=9, label=label, zorder=4,
                    markeredgecolor="white", markeredgewidth=0.6)  # fmt: skip
            continue
        ax.plot(curve.x, curve.y, "-", color="white", linewidth=2.6, alpha=0.7, zorder=2)
        ax.plot(curve.x, curve.y, linestyle=stroke.style, color=stroke.colour, linewidth=1.3,
                label=label, zorder=3)  # fmt: skip


def _kinds(ax: Axes, atlas: Atlas) -> None:
    """The legend: areas with the share of each kind, and the boundaries."""
    every = sum(atlas.counts.values())
    areas = [
        Patch(facecolor=COLOURS[name], edgecolor="#555555", linewidth=0.5,
              label=f"{name} {count / every:.2%}")
        for name, count in sorted(atlas.counts.items(), key=lambda each: -each[1])
    ]  # fmt: skip
    lines = ax.get_legend_handles_labels()[0]
    ax.legend(handles=[*areas, *lines], loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=3,
              frameon=False, fontsize=8)  # fmt: skip


def _examples(atlas: Atlas, kind: Codes, columns: Any, rows: Any) -> Iterator[Example]:
    """The largest regions in which something moves."""
    x, y = atlas.study.plane.values
    coarse = [np.linspace(0, n - 1, min(n, CELLS)).astype(int) for n in kind.shape]
    cells = kind[np.ix_(*coarse)]
    found = [
        each for each in regions(cells) if atlas.names[each.code] not in ("impossible", "at-rest")
    ]
    seen: set[int] = set()
    large: list[Region] = []
    for region in sorted(found, key=lambda each: -each.size):
        if region.size >= LEAST * cells.size or region.code not in seen:
            large.append(region)
        seen.add(region.code)
    for region in large[:TRACED]:
        row, column = (int(places[k]) for places, k in zip(coarse, region.middle, strict=True))
        at = float(x[columns[column]]), float(y[rows[row]])
        yield Example(atlas.names[region.code], *at, _motion(atlas, *at))


class Region(NamedTuple):
    """Cells of one code that hang together, and the one that is farthest from the others."""

    code: int
    size: int
    middle: tuple[int, int]


def regions(cells: Codes) -> Iterator[Region]:
    """The regions of a map, told by neighbours to the sides.

    Examples
    --------
    >>> list(regions(np.array([[1, 1, 2], [1, 1, 1]], np.uint8)))
    [Region(code=1, size=5, middle=(0, 0)), Region(code=2, size=1, middle=(0, 2))]
    """
    depth, seen = _depth(cells), np.zeros(cells.shape, bool)
    for start in map(tuple, np.argwhere(cells == cells)):
        if seen[start]:
            continue
        seen[start], inside, left = True, [start], [start]
        while left:
            for at in _beside(left.pop(), cells.shape):
                if not seen[at] and cells[at] == cells[start]:
                    seen[at] = True
                    inside.append(at)
                    left.append(at)
        middle = max(inside, key=lambda at: (depth[at], (-at[0], -at[1])))
        yield Region(int(cells[start]), len(inside), (int(middle[0]), int(middle[1])))


def _depth(cells: Codes) -> NDArray[np.int64]:
    """How many rings of cells of the same code there are about each; the edge of the map is one."""
    depth, same = np.zeros(cells.shape, int), np.ones(cells.shape, bool)
    while same.any():
        depth += same
        wide = np.pad(same, 1)
        codes = np.pad(cells, 1, constant_values=255)
        for shift in ((0, 1), (2, 1), (1, 0), (1, 2)):
            part = tuple(slice(k, k + n) for k, n in zip(shift, cells.shape, strict=True))
            same = same & wide[part] & (codes[part] == cells)
    return depth


def _beside(at: tuple[int, int], shape: tuple[int, ...]) -> Iterator[tuple[int, int]]:
    for i, j in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        if 0 <= at[0] + i < shape[0] and 0 <= at[1] + j < shape[1]:
            yield at[0] + i, at[1] + j


def _motion(atlas: Atlas, x: float, y: float) -> Motion:
    tops = atlas.study.plane.at(np.array([x]), np.array([y]))
    numbers = {name: float(np.ravel(each)[0]) for name, each in tops.items()}
    moments = {name: numbers.pop(name) for name in ("A", "C", "gMR")}
    return Motion(Top(**moments), State(**numbers))


def _number(ax: Axes, x: float, y: float, number: int) -> None:
    ax.text(x, y, str(number), ha="center", va="center", fontsize=8, zorder=6,
            bbox={"boxstyle": "circle", "facecolor": "white", "edgecolor": "black",
                  "linewidth": 0.7})  # fmt: skip


def _legend(figure: Any, shown: list[Example]) -> None:
    """Small paths of the axis over a few nutations, each under the name of its kind."""
    panels = figure.subplots(max(3, -(-len(shown) // 2)), 2).ravel()
    for ax in panels:
        ax.axis("off")
    for number, (ax, example) in enumerate(zip(panels, shown, strict=False), start=1):
        period = example.motion.period
        path = axis_path(example.motion, SECONDS if period is None else PERIODS * period)
        kind_panel(ax, path, View.of(path), "#333333")
        ax.set_title(f"{number}: {example.name}", fontsize=7.5)
        colour = COLOURS[example.name]
        swatch = {"boxstyle": "round,pad=0.25", "facecolor": colour, "linewidth": 0.5}
        ax.text(0.02, 0.02, "  ", transform=ax.transAxes, fontsize=6, bbox=swatch)
