"""The errors of a trajectory that somebody else computed, over time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from heavytop.plots.style import BLACK, COLOURS, FAINT, STYLE, legend, literal

LABELS: Final = {
    "axis": "axis [rad]",
    "theta": "θ [rad]",
    "phi": "φ [rad]",
    "psi": "ψ [rad]",
    "energy": "E', of max(|E'|, gMR)",
    "p_phi": r"$p_\varphi$, relative",
    "p_psi": r"$p_\psi$, relative",
}


def check_figure(document: Mapping[str, Any]) -> Figure:
    """The chart of a check.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/check/1``.

    Returns
    -------
    matplotlib.figure.Figure
        The magnitude of every error over time above conditioning; below, how far the
        data run ahead.
    """
    curves = {name: np.array(x, dtype=float) for name, x in document["curves"].items()}
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 5.2), layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        for (name, label), colour in zip(LABELS.items(), COLOURS, strict=True):
            if name in curves:
                off = abs(curves[name])
                off[off == 0] = np.nan  # which a logarithm cannot show
                above.plot(curves["t"], off, color=colour, lw=1.0, label=label)
        above.set_yscale("log")
        if document["condition"]:
            above.axhline(document["condition"], color=BLACK, ls=":", lw=1.0,
                          label="conditioning")  # fmt: skip
        above.set_ylabel("error")
        below.plot(curves["phase_t"], curves["phase"], color=COLOURS[0], marker="o", ms=3, lw=1.0)
        below.set_ylabel("runs ahead by [s]")
        below.set_xlabel("t [s]")
        for ax in (above, below):
            ax.grid(True, linewidth=0.3, color=FAINT)
        figure.suptitle(literal(document["data"]))
        legend(figure, columns=3)
    return figure
