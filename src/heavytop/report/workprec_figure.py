"""What a period costs against the error that is attained, both logarithmic, with the front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.report.figures.style import FAINT, STYLE

OURS: Final = ("#0072B2", "#009E73", "#56B4E9", "#000000")
THEIRS: Final = ("#D55E00", "#E69F00", "#CC79A7")
MARKERS: Final = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "p", "h")
LABELS: Final = {"error": "error of the axis", "theta_error": "error of θ [rad]"}
Known = Mapping[str, Any]


def workprec_figure(document: Known) -> Figure:
    """The chart of a work–precision diagram.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/workprec/1``.

    Returns
    -------
    matplotlib.figure.Figure
        Time against the error of the axis, of the methods that give it, and against that of θ, of
        all. Rivals are drawn dashed and hollow, what auto chose as stars, the front as a grey
        staircase.
    """
    panels = _panels(document)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.2 * len(panels) + 0.4, 8.2), layout="constrained")
        axes = figure.subplots(1, len(panels), squeeze=False, sharey=True).flat
        looks = _looks(document)
        for ax, (name, members, leaders) in zip(axes, panels, strict=True):
            _panel(ax, name, members, leaders, looks)
        next(iter(figure.axes)).set_ylabel("µs per nutation period")
        figure.suptitle(_title(document), parse_math=False)
        _legend(figure)
    return figure


def _title(document: Known) -> str:
    scene = document["scene"]
    return f"{(scene['title'] or scene['name'])[:80]}, {document['periods']:g} periods"


def _panels(document: Known) -> list[tuple[str, list[Known], list[Known]]]:
    """Return for each panel which error it shows, its points and those on its front."""
    points = document["points"]
    with_axis = [point for point in points if point["measures"] == "axis"]
    theta = ("theta_error", points, [points[i] for i in document["front_theta"]])
    if not with_axis:
        return [theta]
    return [("error", with_axis, [points[i] for i in document["front"]]), theta]


def _looks(document: Known) -> dict[str, tuple[str, str]]:
    """Return colour and marker by method: ours from cold colours, theirs from warm ones."""
    rival = {point["method"]: point["rival"] for point in document["points"]}
    ours = zip(cycle(OURS), cycle(MARKERS), strict=False)
    theirs = zip(cycle(THEIRS), cycle(MARKERS), strict=False)
    return {name: next(theirs if rival[name] else ours) for name in rival if name != "auto"}


def _panel(
    ax: Axes,
    name: str,
    members: Sequence[Known],
    leaders: Sequence[Known],
    looks: Mapping[str, tuple[str, str]],
) -> None:
    _draw_front(ax, name, leaders)
    for method in dict.fromkeys(point["method"] for point in members):
        points = [p for p in members if p["method"] == method and p[name] > 0]
        if method == "auto":
            _draw_auto(ax, name, points)
            continue
        colour, marker = looks[method]
        rival = any(point["rival"] for point in points)
        ax.loglog(
            [point[name] for point in points],
            [point["us_per_period"] for point in points],
            marker=marker, color=colour, label=method, linewidth=0.9, markersize=4,
            linestyle="--" if rival else "-", markerfacecolor="white" if rival else colour,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.invert_xaxis()
    ax.set_xlabel(LABELS[name])
    ax.grid(True, which="major", linewidth=0.3, color=FAINT)


def _draw_front(ax: Axes, name: str, leaders: Sequence[Known]) -> None:
    """Draw the front: what each time attains, fastest first."""
    drawn = [point for point in leaders if point[name] > 0]
    ax.step(
        [point[name] for point in drawn],
        [point["us_per_period"] for point in drawn],
        where="pre", color="#999999", linewidth=5, alpha=0.5, label="front", zorder=1,
    )  # fmt: skip


def _draw_auto(ax: Axes, name: str, points: Sequence[Known]) -> None:
    """Mark what auto chose for this panel's error: of θ for θ, of the axis for the axis."""
    wants = "theta" if name == "theta_error" else "axis"
    chosen = [point for point in points if point["wants"] == wants]
    ax.plot(
        [point[name] for point in chosen],
        [point["us_per_period"] for point in chosen],
        "*", color="#CC0000", markersize=13, label="auto", zorder=4,
    )  # fmt: skip


def _legend(figure: Figure) -> None:
    """Name every method once, whichever panel it stands in."""
    known = {
        label: handle
        for ax in figure.axes
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
    }
    if known:
        figure.legend(
            known.values(), known.keys(), loc="outside lower center", ncols=4, frameon=False
        )
