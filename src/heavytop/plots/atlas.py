"""An atlas as a picture: kinds as areas, boundaries as curves, and a path of the axis for each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.plots.sphere import View, axis_path, kind_panel, touched
from heavytop.plots.style import KINDS, STYLE, UNKNOWN, Known, literal, title_of
from heavytop.scene.quantities import quantity_of
from heavytop.scene.state import State
from heavytop.scene.top import Top

if TYPE_CHECKING:
    from heavytop.studies.atlas import Atlas

Codes = NDArray[np.uint8]
Numbers = NDArray[np.float64]

FINEST: Final = 1000  # pixels of the picture along an axis: of more, every so many is drawn
TRACED: Final = 8  # regions with a path of the axis: the largest
CELLS: Final = 80  # along an axis of the mesh on which regions are told
PERIODS: Final = 3
SECONDS: Final = 2.0  # of a path, where nothing nutates
LEAST: Final = 0.005  # of the map: smaller regions have no number, unless their kind has no other
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
        The map; beside it, for every region of some extent, the path of the axis of a top in its
        midst, whose place on the map has the same number.
    """
    plane = atlas.plane
    rows, columns = _every(atlas)
    kind = atlas["kind"][rows, columns]
    figure = Figure(figsize=(9.6, 6.0), layout="constrained")
    parts: Any = figure.subfigures(1, 2, width_ratios=(2.6, 1.0))
    held = (f"{quantity_of(name).latex} = {value:.6g}" for name, value in plane.held.items())
    parts[0].suptitle(f"{literal(plane.scene.name, 60)}; held: {', '.join(held)}", fontsize=10)
    ax = parts[0].subplots()
    handles = _map(ax, atlas.document(), kind, atlas.names)
    (x, y), name = plane.place, literal(plane.scene.name, 30)
    if all(low <= at <= high for at, (low, high) in ((x, ax.get_xlim()), (y, ax.get_ylim()))):
        handles += ax.plot(x, y, "Pk", ms=9, mec="white", zorder=7, label=name)
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.11), ncols=3, fontsize=8)
    places = plane.x.values[columns], plane.y.values[rows]
    examples = list(_examples(kind, atlas.names, *places))
    panels = parts[1].subplots(max(3, -(-len(examples) // 2)), 2).ravel()
    for panel in panels:
        panel.axis("off")
    box = {"boxstyle": "circle", "facecolor": "white", "edgecolor": "black", "linewidth": 0.7}
    for number, (panel, (name, x, y)) in enumerate(zip(panels, examples, strict=False), start=1):
        ax.text(x, y, str(number), ha="center", va="center", fontsize=8, zorder=6, bbox=box)
        own = _motion(atlas, x, y)
        motion = touched(own) or own
        path = axis_path(motion, PERIODS * motion.period if motion.period else SECONDS)
        kind_panel(panel, path, View.of(path), name, pushed=motion is not own)
        words = f"{number}: {KINDS[name].label}{', touched' * (motion is not own)}"
        panel.set_title(words, fontsize=7.5)
    return figure


@mpl.rc_context(STYLE)
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
        The map; under it the kinds that occur, areas with their shares.
    """
    figure = Figure(figsize=(7.2, 6.2), layout="constrained")
    handles = _map(figure.subplots(), document, kind, names)
    figure.suptitle(title_of(document["scene"]))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


def kinds_map(ax: Axes, atlas: Atlas, **looks: Any) -> Axes:
    """Draw the kinds as areas and their boundaries; keywords are those of the mesh.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    atlas : Atlas
    """
    kind = atlas["kind"][_every(atlas)]
    for each in _map(ax, atlas.document(), kind, atlas.names, **looks):
        if isinstance(each, Patch):  # the legend of the axes names the areas too
            ax.fill([], [], fc=each.get_facecolor(), ec=each.get_edgecolor(), lw=0.5,
                    label=each.get_label())  # fmt: skip
    return ax


def _every(atlas: Atlas) -> tuple[slice, slice]:
    """The rows and columns that are drawn."""
    rows, columns = (slice(None, None, -(-n // FINEST)) for n in atlas.plane.shape)
    return rows, columns


def _map(ax: Axes, document: Known, kind: Codes, names: Sequence[str], **mesh: Any) -> list[Any]:
    """Draw kinds as areas, boundaries as lines; return what a legend has, areas with shares."""
    colours = ListedColormap([KINDS.get(name, UNKNOWN).colour for name in names])
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    axes = [document["axes"][side] for side in "xy"]
    edges = [_edges(axis, n) for axis, n in zip(axes, kind.shape[::-1], strict=True)]
    shown = np.ma.masked_greater_equal(kind, len(names))  # where there is no tile
    ours: dict[str, Any] = {"cmap": colours, "norm": norm, "rasterized": True}
    ax.pcolormesh(*edges, shown, **ours | mesh)
    for side, axis, ends in zip("xy", axes, edges, strict=True):
        if axis["log"]:
            ax.set(**{f"{side}scale": "log" if axis["low"] > 0 else "symlog"})
        along = quantity_of(axis["name"])
        ax.set(
            **{f"{side}label": f"{along.latex} [{along.unit}]", f"{side}lim": (ends[0], ends[-1])}
        )
    for curve in document["curves"]:
        x, y, look = curve["x"], curve["y"], KINDS[BOUNDS.get(curve["name"], curve["name"])]
        if len(x) == 1:
            looks: dict[str, Any] = {"ls": "none", "marker": "*", "ms": 9, "mec": "white"}
            looks |= {"mew": 0.6, "zorder": 4}
        else:
            ax.plot(x, y, "-", color="white", lw=2.6, alpha=0.7, zorder=2)
            looks = {"ls": look.marker, "lw": 1.5, "zorder": 3}
        ax.plot(x, y, color=look.colour, label=look.label, **looks)
    handles = {}
    for name, count in sorted(document["counts"].items(), key=lambda each: -each[1]):
        look = KINDS.get(name, UNKNOWN)
        label = look.label or literal(name)
        if names.index(name) in _areas(kind):
            label += f" {count / sum(document['counts'].values()):.2%}"
        handles[label] = Patch(facecolor=look.colour, edgecolor="#555555", lw=0.5, label=label)
    lines, labels = ax.get_legend_handles_labels()
    return [*(handles | dict(zip(labels, lines, strict=True))).values()]


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


def _examples(
    kind: Codes, names: Sequence[str], x: Numbers, y: Numbers
) -> Iterator[tuple[str, float, float]]:
    """The largest regions of what can be, and the largest of each kind: kind, and a place in it."""
    coarse = [np.linspace(0, n - 1, min(n, CELLS)).astype(int) for n in kind.shape]
    cells = kind[np.ix_(*coarse)]
    seen: set[int] = set()
    large: list[Region] = []
    for region in sorted(regions(cells), key=lambda each: -each.size):
        if names[region.code] != "impossible" and (
            region.size >= LEAST * cells.size or region.code not in seen
        ):
            large.append(region)
        seen.add(region.code)
    for region in large[:TRACED]:
        row, column = (int(places[k]) for places, k in zip(coarse, region.middle, strict=True))
        yield names[region.code], float(x[column]), float(y[row])


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
    return Motion(Top.of_numbers(**moments), State(**numbers))
