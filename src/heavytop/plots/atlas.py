"""An atlas as a picture: kinds as areas, boundaries as curves, and a path of the axis for each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
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
from heavytop.plots.style import STYLE, literal, title_of
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.studies.atlas_plane import ROLES

if TYPE_CHECKING:
    from heavytop.studies.atlas import Atlas
    from heavytop.studies.atlas_plane import Plane

Codes = NDArray[np.uint8]
Known = Mapping[str, Any]

FINEST: Final = 1000  # pixels of the picture along an axis: of more, every so many is drawn
TRACED: Final = 8  # regions with a path of the axis: the largest
CELLS: Final = 80  # along an axis of the mesh on which regions are told
PERIODS: Final = 3
SECONDS: Final = 2.0  # of a path, where nothing nutates
NOTHING: Final = "#FFFFFF"  # of kinds without a colour
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
        plane = atlas.plane
        held = (f"{ROLES[name].sign} = {value:.6g}" for name, value in plane.held.items())
        left.suptitle(f"{literal(plane.scene.name, 60)}; held: {', '.join(held)}", fontsize=10)
        ax = left.subplots()
        _map(ax, atlas.document(costs=False), kind, atlas.names)
        _own(ax, plane)
        handles = [*_shares(atlas.counts), *ax.get_legend_handles_labels()[0]]
        ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=3,
                  frameon=False, fontsize=8)  # fmt: skip
        shown = list(_examples(atlas, kind, columns, rows))
        for number, example in enumerate(shown, start=1):
            _number(ax, example.x, example.y, number)
        _legend(right, shown)
    return figure


def map_figure(document: Known, kind: Codes, names: Sequence[str]) -> Figure:
    """The picture of a stored atlas.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/atlas/1``.
    kind : numpy.ndarray, shape (y, x)
        Codes of kinds, maybe of every so many pixels only.
    names : sequence of str
        What the codes mean.

    Returns
    -------
    matplotlib.figure.Figure
        The map; under it the kinds that occur, with their shares.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.2, 6.2), layout="constrained")
        ax = figure.subplots()
        _map(ax, document, kind, names)
        figure.suptitle(title_of(document["scene"]))
        handles = [*_shares(document["counts"]), *ax.get_legend_handles_labels()[0]]
        figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    return figure


class Example(NamedTuple):
    """A region: its kind, and the motion at a pixel in its midst."""

    name: str
    x: float
    y: float
    motion: Motion


def _thinned(atlas: Atlas) -> tuple[Codes, Any, Any]:
    """The codes of every so many pixels, and which columns and rows those are."""
    count_y, count_x = atlas.plane.shape
    rows, columns = (np.arange(0, n, -(-n // FINEST)) for n in (count_y, count_x))
    kind = np.empty((rows.size, columns.size), np.uint8)
    for tile, found in atlas.read_tiles():
        inside_y = (rows >= tile.rows.start) & (rows < tile.rows.stop)
        inside_x = (columns >= tile.columns.start) & (columns < tile.columns.stop)
        part = found["kind"][np.ix_(rows[inside_y] - tile.rows.start,
                                    columns[inside_x] - tile.columns.start)]  # fmt: skip
        kind[np.ix_(inside_y, inside_x)] = part
    return kind, columns, rows


def _map(ax: Axes, document: Known, kind: Codes, names: Sequence[str]) -> None:
    """Kinds as areas; the boundaries of a document as lines, each named once."""
    colours = ListedColormap([COLOURS.get(name, NOTHING) for name in names])
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    axes = [document["axes"][side] for side in "xy"]
    edges = [_edges(axis, n) for axis, n in zip(axes, kind.shape[::-1], strict=True)]
    shown = np.ma.masked_greater_equal(kind, len(names))  # where there is no tile
    ax.pcolormesh(*edges, shown, cmap=colours, norm=norm, rasterized=True)
    for side, axis, ends in zip("xy", axes, edges, strict=True):
        if axis["log"]:
            ax.set(**{f"{side}scale": "log" if axis["low"] > 0 else "symlog"})
        role = ROLES[axis["name"]]
        ax.set(**{f"{side}label": f"{role.sign} [{role.unit}]", f"{side}lim": (ends[0], ends[-1])})
    named: set[str] = set()
    for curve in document["curves"]:
        x, y, stroke = curve["x"], curve["y"], STROKES[curve["name"]]
        label = None if curve["name"] in named else stroke.words
        named.add(curve["name"])
        if len(x) == 1:
            ax.plot(x, y, "*", color=stroke.colour, markersize=9, label=label, zorder=4,
                    markeredgecolor="white", markeredgewidth=0.6)  # fmt: skip
            continue
        ax.plot(x, y, "-", color="white", linewidth=2.6, alpha=0.7, zorder=2)
        ax.plot(x, y, linestyle=stroke.style, color=stroke.colour, linewidth=1.3, label=label,
                zorder=3)  # fmt: skip


def _edges(axis: Known, count: int) -> NDArray[np.float64]:
    """The edges of so many pixels; the first and the last value are in the middle of theirs."""
    low, high, share = axis["low"], axis["high"], (np.arange(count + 1) - 0.5) / max(1, count - 1)
    if axis["log"]:
        return np.asarray(low * (high / low) ** share)
    return np.asarray(low + (high - low) * share)


def _shares(counts: Mapping[str, int]) -> list[Patch]:
    """The kinds that occur with their shares, the most frequent first, for a legend."""
    whole = sum(counts.values()) or 1
    return [
        Patch(facecolor=COLOURS.get(name, NOTHING), edgecolor="#555555", linewidth=0.5,
              label=f"{literal(name)} {count / whole:.2%}")
        for name, count in sorted(counts.items(), key=lambda each: -each[1])
    ]  # fmt: skip


def _own(ax: Axes, plane: Plane) -> None:
    """Mark where the scene itself lies, if that is on the map."""
    x, y = plane.place
    if all(low <= at <= high for at, (low, high) in ((x, ax.get_xlim()), (y, ax.get_ylim()))):
        ax.plot(x, y, "P", color="black", markersize=9, markeredgecolor="white", zorder=7,
                label=literal(plane.scene.name, 30))  # fmt: skip


def _examples(atlas: Atlas, kind: Codes, columns: Any, rows: Any) -> Iterator[Example]:
    """The largest regions in which something moves."""
    x, y = atlas.plane.x.values, atlas.plane.y.values
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
    from scipy import ndimage

    for code in np.unique(cells).tolist():
        same = cells == code
        rings = ndimage.distance_transform_cdt(np.pad(same, 1), "taxicab")[1:-1, 1:-1]
        labels, count = ndimage.label(same)
        for k in range(1, count + 1):
            inside = labels == k
            row, column = np.unravel_index(np.argmax(rings * inside), cells.shape)
            yield Region(code, int(inside.sum()), (int(row), int(column)))


def _motion(atlas: Atlas, x: float, y: float) -> Motion:
    tops = atlas.plane.at(np.array([x]), np.array([y]))
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
