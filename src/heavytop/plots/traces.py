"""The paths that the axis of every shipped scene takes, side by side: one panel for each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from heavytop.plots.figures import View
from heavytop.plots.figures.style import STYLE, literal
from heavytop.plots.kinds import kind_panel

ACROSS: Final = 4
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#882255", "#7A4F00", "#333333")


def traces_figure(document: Mapping[str, Any]) -> Figure:
    """The chart of axis traces.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/traces/1``.

    Returns
    -------
    matplotlib.figure.Figure
        A panel for each scene, with its kind; scenes of a kind have a colour.
    """
    traces = document["traces"]
    rows = max(1, math.ceil(len(traces) / ACROSS))
    kinds = list(dict.fromkeys(each["kind"] for each in traces))
    with mpl.rc_context(STYLE | {"path.simplify_threshold": 0.5}):
        figure = Figure(figsize=(2.4 * ACROSS, 2.65 * rows), layout="constrained")
        panels = figure.subplots(rows, ACROSS, squeeze=False).ravel()
        for ax in panels:
            ax.axis("off")
        for ax, each in zip(panels, traces, strict=False):
            path = np.array(each["axis"], float).reshape(-1, 3)
            kind_panel(ax, path, View.of(path), COLOURS[kinds.index(each["kind"]) % len(COLOURS)])
            words = (
                f"{literal(each['name'], 40)}\n{literal(each['kind'], 40)}\n{each['seconds']:.3g} s"
            )
            ax.set_title(words, fontsize=8)
    return figure
