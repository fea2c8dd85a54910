"""Errors of the formulas for steady precession, against the spin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter
from numpy.typing import ArrayLike

MARKERS: Final = ("o", "s", "^", "D", "v")
COLOURS: Final = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#000000")  # Okabe and Ito


def steady_errors(ax: Axes, omega3: ArrayLike, errors: Mapping[str, ArrayLike]) -> None:
    """Draw |relative error| of each formula against the spin ω3 [rad/s], both logarithmic.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    omega3 : array_like, shape (n,)
    errors : mapping from str to array_like, shape (n,)
        Relative errors by the name of the formula; a zero is drawn as the rounding of doubles.
    """
    rounding = np.finfo(np.float64).eps / 2
    for (name, values), marker, colour in zip(errors.items(), MARKERS, COLOURS, strict=False):
        sizes = np.maximum(np.abs(np.asarray(values, dtype=np.float64)), rounding)
        ax.loglog(omega3, sizes, marker=marker, color=colour, linewidth=1.0, label=name)
    ax.set_xlabel("spin ω₃ [rad/s]")
    ax.set_ylabel("relative error of the precession")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(ScalarFormatter())
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.grid(True, which="major", linewidth=0.4, color="#BBBBBB")
    ax.legend(frameon=False, fontsize="small")
