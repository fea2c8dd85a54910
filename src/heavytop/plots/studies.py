"""The growth of errors over a long run, both logarithmic: one panel for each quantity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots.style import COLOURS, FAINT, MARKERS, STYLE, legend, literal, title_of

DASHES: Final = ("-", "--", ":", "-.")  # one for every round of the colours
GUIDES: Final = ((0.5, r"$t^{1/2}$"), (1.0, r"$t$"), (1.5, r"$t^{3/2}$"), (2.0, r"$t^2$"))
LABELS: Final = {
    "energy": "energy E', of max(|E'|, gMR)",
    "p_phi": r"momentum $p_\varphi$, relative",
    "p_psi": r"momentum $p_\psi$, relative",
    "phase_s": "phase of the nutation [s]",
    "axis": "direction of the axis [rad]",
    "length": r"length of the axis, $|e|^2$",
}
Series = tuple[str, list[float], list[float]]


def drift_figure(document: Mapping[str, Any]) -> Figure:
    """The chart of a drift study.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/drift/1``.

    Returns
    -------
    matplotlib.figure.Figure
        Errors against nutation periods, with guides that grow as t^½, t, t^3/2 and t².
    """
    panels = {name: series for name in _quantities(document) if (series := _series(document, name))}
    columns = min(3, max(1, len(panels)))
    rows = max(1, math.ceil(len(panels) / columns))
    with mpl.rc_context(STYLE):
        lines = math.ceil(len(document["methods"]) / 4)
        size = (3.6 * columns + 0.6, 3.2 * rows + 0.7 + 0.2 * lines)
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False).flat
        looks = _looks(document)
        for ax, (name, series) in zip(axes, panels.items(), strict=False):
            _panel(ax, LABELS.get(name, f"{literal(name)}, relative"), series, looks)
        for ax in list(figure.axes)[len(panels) :]:
            ax.set_visible(False)
        count = document["ensemble"]
        starts = "" if count == 1 else f", RMS of {count} starts"
        words = f"{title_of(document['scene'])} — {document['periods']:g} nutation periods{starts}"
        figure.suptitle(words)
        legend(figure)
    return figure


def _quantities(document: Mapping[str, Any]) -> list[str]:
    others = {name: None for each in document["methods"] for name in each["invariants"]}
    return ["energy", "phase_s", "axis", "p_phi", "p_psi", *others]


def _series(document: Mapping[str, Any], name: str) -> list[Series]:
    found = []
    for each in document["methods"]:
        values = each[name] if name in each else each["invariants"].get(name, ())
        points = [(n, e) for n, e in zip(each["periods"], values, strict=False) if e]
        if points:
            found.append((each["name"], [n for n, _ in points], [e for _, e in points]))
    return found


def _looks(document: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return colour, marker and dashes of every method; no two have all of them alike."""
    return {
        each["name"]: {
            "color": COLOURS[k % len(COLOURS)],
            "marker": MARKERS[k % len(MARKERS)],
            "linestyle": DASHES[k // len(COLOURS) % len(DASHES)],
        }
        for k, each in enumerate(document["methods"])
    }


def _panel(
    ax: Axes, label: str, series: Sequence[Series], looks: Mapping[str, Mapping[str, Any]]
) -> None:
    for name, periods, errors in series:
        ax.loglog(
            periods, errors, linewidth=1.0, markersize=3.5, label=literal(name), **looks[name]
        )
    _guides(ax, series)
    ax.set_xlabel("nutation periods")
    ax.set_ylabel(f"error of {label}")
    ax.grid(True, which="major", linewidth=0.3, color=FAINT)


def _guides(ax: Axes, series: Sequence[Series]) -> None:
    """Draw powers of time from the lower left corner; only their slopes mean something."""
    first = min(periods[0] for _, periods, _ in series)
    last = max(periods[-1] for _, periods, _ in series)
    low, high = ax.get_ylim()
    if not last > first:
        return
    for power, label in GUIDES:
        end = min(last, first * (high / low) ** (1 / power))
        ax.plot([first, end], [low, low * (end / first) ** power], color=FAINT, lw=0.8, zorder=0)
        at = first * (end / first) ** 0.93
        place = (at, low * (at / first) ** power)
        ax.annotate(label, place, color="#777777", fontsize=7, ha="right", va="bottom", zorder=0)
    ax.set_ylim(low, high)
