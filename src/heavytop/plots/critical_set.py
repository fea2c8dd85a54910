"""The critical set of the energy–momentum map in three dimensions: two sheets and the thread."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from heavytop.plots.style import OTHER, PATH, STYLE

Known = Mapping[str, Any]
Units = tuple[float, float, float]
LOOKS: Final = {
    "hanging": ("#009E73", 1.8, "hanging"),
    "sleeping": ("#000000", 1.8, "sleeping, stable"),
    "thread": (OTHER, 2.6, "standing, falls: the thread"),
}
SHEETS: Final = (PATH, "#56B4E9")
SEEN: Final = (24.0, -68.0)  # from where [°]


def critical_set_figure(document: Known) -> Figure:
    """The picture of the critical set over all p_ψ.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/energy-momentum/1``, with gravity.

    Returns
    -------
    matplotlib.figure.Figure
        Both sheets of steady precession, which meet where the axis hangs; the tops that sleep, on
        an edge of one; and off both the thread of the standing tops that fall.

    Raises
    ------
    ValueError
        There is no gravity, and so no thread.
    """
    found = document["critical_set"]
    if found is None:
        raise ValueError("critical_set: there is none to draw without gravity")
    momentum = max(found["thread"]["p_psi"]) / 2  # √(A |gMR|)
    weight = abs(found["thread"]["E_prime"][0])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 6.0), layout="constrained")
        ax: Any = figure.add_subplot(projection="3d", computed_zorder=False)
        for sheet, colour, name in zip(found["sheets"], SHEETS, ("Ω > 0", "Ω < 0"), strict=True):
            _sheet(ax, sheet, colour, name, (momentum, momentum, weight))
        for name, (colour, width, label) in LOOKS.items():
            _curve(ax, found[name], colour, width, label, (momentum, momentum, weight))
        ax.view_init(*SEEN)
        ax.set_box_aspect((1.0, 1.0, 0.8))
        ax.set_xlabel("p$_ψ$/√(A|gMR|)")
        ax.set_ylabel("p$_φ$/√(A|gMR|)")
        ax.set_zlabel("E′/|gMR|")
        figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    return figure


def _scaled(known: Known, units: Units) -> list[Any]:
    """p_ψ, p_φ and E' in natural units."""
    names = ("p_psi", "p_phi", "E_prime")
    return [np.array(known[name]) / unit for name, unit in zip(names, units, strict=True)]


def _sheet(ax: Any, known: Known, colour: str, name: str, units: Units) -> None:
    """Lines of equal p_ψ, and across them, over a pale surface."""
    x, y, z = _scaled(known, units)
    ax.plot_surface(x, y, z, color=colour, alpha=0.2, linewidth=0, shade=False, rcount=99,
                    ccount=99)  # fmt: skip
    for k in range(0, x.shape[0], 3):
        label = f"steady precession, {name}" if k == 0 else None
        ax.plot(x[k], y[k], z[k], color=colour, linewidth=0.6, label=label)
    for k in range(0, x.shape[1], 4):
        ax.plot(x[:, k], y[:, k], z[:, k], color=colour, linewidth=0.6)


def _curve(ax: Any, known: Known, colour: str, width: float, label: str, units: Units) -> None:
    x, y, z = _scaled(known, units)
    apart = np.flatnonzero(np.diff(x) > 1.0)  # the sleeping tops: one part on each side
    for part in np.split(np.arange(len(x)), apart + 1):
        ax.plot(x[part], y[part], z[part], color=colour, linewidth=width, label=label, zorder=5)
        label = ""
