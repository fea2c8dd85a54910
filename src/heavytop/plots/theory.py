"""The energy–momentum diagram of a top at one p_ψ, and Δφ around the thread."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots.atlas import COLOURS
from heavytop.plots.style import FAINT, OTHER, PATH, STYLE, literal, title_of

Known = Mapping[str, Any]
PURPLE: Final = "#CC79A7"
GREEN: Final = "#009E73"
WAVES: Final = COLOURS["waves"]
LOOPS: Final = COLOURS["loops"]
SLOW: Final = PATH
FAST: Final = "#000000"


def energy_momentum_figure(document: Known) -> Figure:
    """The chart of an energy–momentum diagram.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/energy-momentum/1``.

    Returns
    -------
    matplotlib.figure.Figure
        The regions of waves and of loops above the edge of steady precession, the lines between
        them, and the scene's own place; beside it, where there is a thread, Δφ around it.
    """
    circuit = document["circuit"]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10.4 if circuit else 6.6, 5.4), layout="constrained")
        axes = figure.subplots(1, 2 if circuit else 1, squeeze=False).flat
        _diagram(axes[0], document)
        if circuit:
            _around(axes[1], circuit)
        scene, ratio = document["scene"], document["ratio"]
        words = "" if ratio is None else f"p_psi²/4A|gMR| = {ratio:.4g}"
        figure.suptitle(f"{title_of(scene)}\n{words}")
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    return figure


def _diagram(ax: Axes, document: Known) -> None:
    edge, window = document["edge"], document["window"]
    p, least = np.array(edge["p_phi"]), np.array(edge["E_prime"])
    high = window["E_prime"][1]
    ax.fill_between(p, least, np.maximum(high, least), color=WAVES, linewidth=0, label="waves")
    if document["cusps"]:
        _loops(ax, document, p, least, high)
    _edge(ax, p, least, np.array([rate is not None for rate in edge["rate"]]), edge["fast"])
    for name, colour, label in (
        ("through_top", OTHER, "through the top: p$_φ$ = p$_ψ$"),
        ("through_bottom", GREEN, "through the bottom: p$_φ$ = −p$_ψ$"),
    ):
        ax.plot(*_line(document[name]), color=colour, linewidth=1.2, linestyle="--", label=label)
    _places(ax, document)
    ax.set_xlim(*window["p_phi"])
    ax.set_ylim(*window["E_prime"])
    ax.locator_params(axis="x", nbins=5)
    ax.set_xlabel("p$_φ$ [kg m² s⁻¹]")
    ax.set_ylabel("E′ = E − p$_ψ$²/2C [J]")


def _loops(ax: Axes, document: Known, p: Any, least: Any, high: float) -> None:
    """Between p_φ = ∓p_ψ, above the line of cusps."""
    (low, start), (end, stop) = sorted((c["p_phi"], c["E_prime"]) for c in document["cusps"])
    inside = (p >= low) & (p <= end)
    floor = np.maximum(least, start + (stop - start) * (p - low) / (end - low))[inside]
    ax.fill_between(p[inside], floor, high, color=LOOPS, linewidth=0, label="loops")
    ax.plot([low, end], [start, stop], color=PURPLE, linewidth=1.6, label="cusps")


def _edge(ax: Axes, p: Any, least: Any, turns: Any, fast: Any) -> None:
    for which, colour, width, label in (
        (~np.array(fast, bool), SLOW, 2.4, "steady precession, slow"),
        (np.array(fast, bool), FAST, 1.6, "steady precession, fast"),
    ):
        drawn = which & turns
        drawn |= ~turns & (np.roll(drawn, 1) | np.roll(drawn, -1))  # a corner ends both its sides
        ax.plot(p, np.where(drawn, least, np.nan), color=colour, linewidth=width, label=label)


def _places(ax: Axes, document: Known) -> None:
    thread, circuit = document["thread"], document["circuit"]
    if circuit:
        ax.plot(circuit["p_phi"], circuit["E_prime"], color="black", linewidth=0.9,
                label="the way around")  # fmt: skip
        ax.plot(circuit["p_phi"][0], circuit["E_prime"][0], "^", color="black", markersize=4)
    marks = (
        (document["hanging"], "v", "white", "hanging"),
        (document["standing"], "*" if thread else "^", "white",
         "standing, falls: the thread" if thread else "sleeping"),
        (document["start"], "o", OTHER, f"the scene: {literal(document['start']['kind'])}"),
    )  # fmt: skip
    for place, marker, face, label in marks:
        ax.plot(place["p_phi"], place["E_prime"], marker, color="black", markerfacecolor=face,
                markersize=12 if marker == "*" else 6, linestyle="none", zorder=4,
                label=label)  # fmt: skip


def _line(places: Any) -> tuple[list[float], list[float]]:
    return [place["p_phi"] for place in places], [place["E_prime"] for place in places]


def _around(ax: Axes, circuit: Known) -> None:
    """Δφ in turns along the circuit, continuous and as it is defined; Δψ loses what Δφ gains."""
    s, turn = np.array(circuit["s"]), 2 * np.pi
    lifted, jumping = (np.array(circuit[f"{name}precession"]) / turn for name in ("", "principal_"))
    ax.plot(s, lifted, color=PATH, linewidth=1.8, label="Δφ, followed")
    ax.plot(s, jumping, ".", color=OTHER, markersize=3, label="Δφ as it is defined, which jumps")
    ax.annotate(
        "", (1.0, lifted[-1]), (1.0, lifted[0]),
        arrowprops={"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    whole = f"{circuit['winding']:+d} turn" if abs(circuit["winding"]) == 1 else "turns"
    ax.text(0.985, (lifted[0] + lifted[-1]) / 2, whole, ha="right", va="center")
    ax.axhline(lifted[0], color=FAINT, linewidth=0.8, zorder=0)
    ax.set_xlabel("once around the thread")
    ax.set_ylabel("Δφ in a nutation, in turns")
    ax.set_xlim(-0.02, 1.03)
