"""What a period costs against the error that is attained, both logarithmic, with the front."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any, Final, NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots.style import (
    BLACK,
    BLUE,
    FAINT,
    GREEN,
    MARKERS,
    ORANGE,
    PURPLE,
    SKY,
    STYLE,
    YELLOW,
    legend,
    literal,
    title_of,
)

DOUBLE: Final = 53
THEIRS: Final = MARKERS[:7]
FORMS: Final = {
    "cubic": BLUE,
    "axis": GREEN,
    "attitude": SKY,
    "routh": PURPLE,
    "subsystem": YELLOW,
    "lagrange": BLACK,
}
OURS: Final = {"": "o", "-projected": "s", "-longdouble": "^", "-mpfr": "D"}
COLLOCATION, SPLITTING, ADAPTIVE = "#8C510A", ORANGE, "#808080"
FAMILIES: Final = {"numba": SPLITTING, "implicit-midpoint": COLLOCATION, "gauss8": COLLOCATION}
LABELS: Final = {"error": "error of the axis", "theta_error": "error of θ [rad]"}
Known = Mapping[str, Any]


class Look(NamedTuple):
    """How one method is drawn."""

    colour: str
    marker: str
    line: str
    hollow: bool


class Panel(NamedTuple):
    """One pair of axes: which error it shows, of which points, and which are on the front."""

    error: str
    points: Sequence[Known]
    front: Sequence[Known]


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
        all; doubles above, more bits below. A formulation has one colour; rivals are dashed and
        hollow, in a colour for each family; what auto chose are stars with the digits asked; the
        front is a grey staircase.
    """
    rows = _rows(document)
    heights = [1.0, 0.45][: len(rows)]
    with mpl.rc_context(STYLE):
        figure = Figure(
            figsize=(5.6 * len(rows[0]) + 0.4, 6.0 * sum(heights) + 1.8), layout="constrained"
        )
        axes = figure.subplots(
            len(rows), len(rows[0]), squeeze=False, sharey="row", height_ratios=heights
        )
        looks = _looks(document["points"])
        for row, panels in zip(axes, rows, strict=True):
            row[0].set_ylabel("µs per nutation period")
            for ax, panel in zip(row, panels, strict=True):
                _draw(ax, panel, looks)
        figure.suptitle(f"{title_of(document['scene'])}, {document['periods']:g} periods")
        legend(figure, order=["front", "auto", *map(literal, looks)], fontsize=8)
    return figure


def _rows(document: Known) -> list[list[Panel]]:
    """Return the panels of doubles, and those of more bits where there are such points."""
    points = document["points"]
    bits = [[p for p in points if p["bits"] == DOUBLE], [p for p in points if p["bits"] > DOUBLE]]
    with_axis = any(point["measures"] == "axis" for point in points)
    return [list(_panels(document, of, axis=with_axis)) for of in bits if of] or [
        list(_panels(document, [], axis=with_axis))
    ]


def _panels(document: Known, points: Sequence[Known], *, axis: bool) -> Iterator[Panel]:
    fronts = {"theta_error": "front_theta"}
    if axis:
        fronts = {"error": "front"} | fronts
    for error, name in fronts.items():
        front = [document["points"][i] for i in document[name]]
        shown = [p for p in points if error == "theta_error" or p["measures"] == "axis"]
        yield Panel(error, shown, [p for p in front if any(p is each for each in points)])


def _looks(points: Sequence[Known]) -> dict[str, Look]:
    """Return how each method is drawn: ours by formulation, theirs by family."""
    markers = {colour: cycle(THEIRS) for colour in (COLLOCATION, SPLITTING, ADAPTIVE)}
    found: dict[str, Look] = {}
    for point in points:
        name = point["method"]
        if name in found or name == "auto":
            continue
        if not point["rival"]:
            found[name] = _own_look(point)
            continue
        colour = FAMILIES.get(name, FAMILIES.get(point["language"], ADAPTIVE))
        found[name] = Look(colour, next(markers[colour]), "--", hollow=True)
    return found


def _own_look(point: Known) -> Look:
    kind = point["method"].removeprefix(f"taylor-{point['formulation']}")
    line = ":" if kind == "-projected" else "-"
    return Look(FORMS[point["formulation"]], OURS.get(kind, OURS["-mpfr"]), line, hollow=False)


def _draw(ax: Axes, panel: Panel, looks: Mapping[str, Look]) -> None:
    _draw_front(ax, panel)
    for method, look in looks.items():
        points = [p for p in panel.points if p["method"] == method and p[panel.error] > 0]
        if points:
            _line(ax, points, panel.error, method, look)
    _draw_auto(ax, panel)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.invert_xaxis()
    ax.set_xlabel(LABELS[panel.error])
    ax.grid(True, which="major", linewidth=0.3, color=FAINT)


def _line(ax: Axes, points: Sequence[Known], error: str, method: str, look: Look) -> None:
    ax.plot(
        [point[error] for point in points],
        [point["us_per_period"] for point in points],
        marker=look.marker, color=look.colour, label=literal(method), linewidth=0.9, markersize=4,
        linestyle=look.line, markerfacecolor="white" if look.hollow else look.colour,
    )  # fmt: skip


def _draw_front(ax: Axes, panel: Panel) -> None:
    """Draw the front: what each time attains, fastest first."""
    drawn = [point for point in panel.front if point[panel.error] > 0]
    ax.step(
        [point[panel.error] for point in drawn],
        [point["us_per_period"] for point in drawn],
        where="pre", color="#999999", linewidth=5, alpha=0.5, label="front", zorder=1,
    )  # fmt: skip


def _draw_auto(ax: Axes, panel: Panel) -> None:
    """Mark what auto chose for this panel's error, of θ or of the axis, with the digits asked."""
    wants = "theta" if panel.error == "theta_error" else "axis"
    chosen = [p for p in panel.points if p["method"] == "auto" and p["wants"] == wants]
    shown = [point for point in chosen if point[panel.error] > 0]
    if not shown:
        return
    ax.plot(
        [point[panel.error] for point in shown],
        [point["us_per_period"] for point in shown],
        "*", color="#CC0000", markersize=13, label="auto", zorder=4,
    )  # fmt: skip
    for name in dict.fromkeys(point["stands_for"] for point in shown):
        same = [point for point in shown if point["stands_for"] == name]
        at = (same[0][panel.error], same[0]["us_per_period"])
        digits = ", ".join(f"{point['digits']:g}" for point in same)
        words = f"auto: {digits} digits"
        ax.annotate(words, at, xytext=(8, -15), textcoords="offset points", ha="right",
                    color="#CC0000", fontsize=8)  # fmt: skip
