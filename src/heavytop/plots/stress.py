"""The digits that every method lost at every case, as a heat map; marks are the table's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots.style import STYLE, literal
from heavytop.results.stress import MARKS, UNTOLD

MOST: Final = 14.0  # digits
ACROSS: Final = 4  # marks explained in a line


def stress_figure(document: Mapping[str, Any]) -> Figure:
    """The chart of a stress test.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/stress/1``.

    Returns
    -------
    matplotlib.figure.Figure
        Cases against methods, coloured by digits lost beyond what conditioning allows.
    """
    runs = document["cases"]
    names = [name for name in document["methods"] if any(name == r["method"] for r in runs)]
    rows = [case for case in document["hard"] if any(case == r["case"] for r in runs)]
    with mpl.rc_context(STYLE):
        heads = [literal(document["methods"][m], 40) for m in names]
        high = 1.2 + 0.07 * max(map(len, heads)) + 0.19 * len(rows)
        size = (max(5.5, 3.2 + 0.42 * len(names)), high)
        figure = Figure(figsize=size, layout="constrained")
        ax = figure.subplots()
        _draw(ax, runs, rows, names)
        ax.set_xticks(range(len(names)), heads, rotation=90)
        ax.set_yticks(range(len(rows)), [literal(case, 40) for case in rows])
        ax.tick_params(length=0, labeltop=True, labelbottom=False)
        ax.set_xlabel(_words(), fontsize=7.5)
        figure.colorbar(ax.images[0], ax=ax, fraction=0.04, aspect=40)
    return figure


def _words() -> str:
    """What the colours and the marks mean."""
    colours = "colours: digits lost beyond what conditioning allows"
    marks = [f"{mark} {word}" for word, mark in MARKS.items()]
    marks += [f"{UNTOLD} nothing to tell", "grey: no number, or not run"]
    lines = (", ".join(marks[i : i + ACROSS]) for i in range(0, len(marks), ACROSS))
    return "\n".join([colours, ",\n".join(lines)])


def _draw(ax: Axes, runs: Any, rows: list[str], names: list[str]) -> None:
    lost = np.full((max(1, len(rows)), max(1, len(names))), np.nan)
    for run in runs:
        i, j = rows.index(run["case"]), names.index(run["method"])
        if run["digits_lost"] is not None:
            lost[i, j] = run["digits_lost"]
        if mark := UNTOLD if run["untold"] else MARKS.get(run["outcome"]):
            dark = run["digits_lost"] is not None and run["digits_lost"] > MOST / 2
            ax.text(j, i, mark, ha="center", va="center", fontsize=6,
                    color="white" if dark else "black")  # fmt: skip
    ax.set_facecolor("#DDDDDD")
    ax.imshow(lost, cmap="YlGnBu", vmin=0.0, vmax=MOST, aspect="auto", interpolation="none")
