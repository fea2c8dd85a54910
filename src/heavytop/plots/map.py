"""A stored atlas as a picture: kinds as areas with their shares, boundaries as curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from heavytop.plots.atlas import COLOURS, STROKES
from heavytop.plots.style import STYLE, literal

Known = Mapping[str, Any]

NOTHING: Final = "#FFFFFF"  # where there is no tile


def map_figure(document: Known, kind: NDArray[np.uint8], names: Sequence[str]) -> Figure:
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
        _areas(ax, document["axes"], kind, names)
        _curves(ax, document["curves"])
        scene = document["scene"]
        figure.suptitle(literal(scene["title"] or scene["name"], 80))
        handles, labels = ax.get_legend_handles_labels()
        shares = _shares(document["counts"])
        areas = [Patch(facecolor=c, edgecolor="#444444", linewidth=0.5) for c in shares.values()]
        figure.legend(
            [*areas, *handles], [*shares, *labels],
            loc="outside lower center", ncols=3, frameon=False,
        )  # fmt: skip
    return figure


def _areas(ax: Axes, axes: Known, kind: NDArray[np.uint8], names: Sequence[str]) -> None:
    colours = ListedColormap([COLOURS.get(name, NOTHING) for name in names])
    norm = BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names))
    shown = np.ma.masked_greater_equal(kind, len(names))
    edges = [_edges(axes[name], n) for name, n in zip("xy", kind.shape[::-1], strict=True)]
    ax.pcolormesh(*edges, shown, cmap=colours, norm=norm, rasterized=True)
    for name, scale, label in (
        ("x", ax.set_xscale, ax.set_xlabel), ("y", ax.set_yscale, ax.set_ylabel),
    ):  # fmt: skip
        if axes[name]["log"]:
            scale("log" if axes[name]["low"] > 0 else "symlog")
        label(_label(axes[name]["name"]))
    ax.set_xlim(edges[0][0], edges[0][-1])
    ax.set_ylim(edges[1][0], edges[1][-1])


def _edges(axis: Known, count: int) -> NDArray[np.float64]:
    """The edges of so many pixels; the first and the last value are in the middle of theirs."""
    low, high = float(axis["low"]), float(axis["high"])
    share = (np.arange(count + 1) - 0.5) / max(1, count - 1)
    if axis["log"]:
        return np.asarray(low * (high / low) ** share)
    return np.asarray(low + (high - low) * share)


def _label(name: str) -> str:
    from heavytop.studies.atlases.axes import ROLES

    role = ROLES[name]
    return f"{role.sign} [{role.unit}]"


def _curves(ax: Axes, curves: Sequence[Known]) -> None:
    named: set[str] = set()
    for curve in curves:
        stroke = STROKES[curve["name"]]
        label = stroke.words if curve["name"] not in named else None
        named.add(curve["name"])
        if len(curve["x"]) == 1:
            ax.plot(curve["x"], curve["y"], "*", color=stroke.colour, markersize=9, label=label,
                    linestyle="none", zorder=4)  # fmt: skip
            continue
        ax.plot(curve["x"], curve["y"], "-", color="white", linewidth=2.6, alpha=0.7, zorder=2)
        ax.plot(curve["x"], curve["y"], linestyle=stroke.style, color=stroke.colour,
                linewidth=1.3, label=label, zorder=3)  # fmt: skip


def _shares(counts: Mapping[str, int]) -> dict[str, str]:
    """The kinds that occur with their shares, the most frequent first, and their colours."""
    whole = sum(counts.values()) or 1
    order = sorted(counts.items(), key=lambda each: -each[1])
    return {f"{literal(name)} {n / whole:.2%}": COLOURS.get(name, NOTHING) for name, n in order}
