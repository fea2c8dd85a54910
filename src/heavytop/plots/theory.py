"""Charts of the theory: energy and momentum, and the critical set."""

from __future__ import annotations

from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.plots import style
from heavytop.plots.style import Known, legend, line, literal, title_of

STEADY: Final = style.KINDS["uniform-precession"].colour
UNSTABLE: Final = "sleeping, unstable: focus–focus"

# --- energy and momentum at one p_ψ, and Δφ around the focus–focus point -------------------------


@mpl.rc_context(style.STYLE)
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
        them, and the scene's own place; beside it, where there is a focus–focus point, Δφ around
        it.
    """
    circuit, ratio = document["circuit"], document["ratio"]
    figure = Figure(figsize=(10.4 if circuit else 6.6, 5.4), layout="constrained")
    axes = figure.subplots(1, 2 if circuit else 1, squeeze=False).flat
    energy_momentum(axes[0], document)
    if circuit:
        around_focus(axes[1], document)
    words = "" if ratio is None else rf"$p_\psi^2/4A|gMR|$ = {ratio:.4g}"
    figure.suptitle(f"{title_of(document['scene'])}\n{words}")
    legend(figure, fontsize=8)
    return figure


def energy_momentum(ax: Axes, document: Known, **looks: Any) -> Axes:
    """Draw the diagram; keywords are those of the edge of steady precession.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    document : mapping
    """
    edge, window = document["edge"], document["window"]
    p, least = np.array(edge["p_phi"]), np.array(edge["E_prime"])
    high = window["E_prime"][1]
    ax.fill_between(p, least, np.maximum(high, least), lw=0, **_area("waves"))
    if document["cusps"]:  # loops are between p_φ = ∓p_ψ, above the line of cusps
        (low, start), (end, stop) = sorted((c["p_phi"], c["E_prime"]) for c in document["cusps"])
        inside = (p >= low) & (p <= end)
        floor = np.maximum(least, start + (stop - start) * (p - low) / (end - low))[inside]
        ax.fill_between(p[inside], floor, high, lw=0, **_area("loops"))
        ax.plot([low, end], [start, stop], lw=1.6, **_area("cusps"))
    turns = np.array([rate is not None for rate in edge["rate"]])
    fast = np.array(edge["fast"], bool)
    for which, width, words in ((~fast, 2.6, "slow"), (fast, 1.2, "fast")):
        drawn = which & turns
        drawn |= ~turns & (np.roll(drawn, 1) | np.roll(drawn, -1))  # a corner ends both its sides
        line(ax, p, np.where(drawn, least, np.nan), looks, color=STEADY, lw=width,
             label=f"steady precession, {words}")  # fmt: skip
    for kind, sign in (("through-top", ""), ("through-bottom", "−")):
        places, look = document[kind.replace("-", "_")], style.KINDS[kind]
        ax.plot([place["p_phi"] for place in places], [place["E_prime"] for place in places],
                color=look.colour, lw=1.4, ls=look.marker,
                label=rf"{look.label}: $p_\varphi$ = {sign}$p_\psi$")  # fmt: skip
    if circuit := document["circuit"]:
        around = circuit["p_phi"], circuit["E_prime"]
        ax.plot(*around, color=style.BLACK, lw=0.9, label="the circuit")
        ax.plot(around[0][0], around[1][0], "^", color=style.BLACK, ms=4)
    for place, marker, face, label in (
        (document["hanging"], "v", style.KINDS["hanging"].colour, "hanging"),
        (document["standing"], "*", "white", UNSTABLE) if document["focus_focus"]
        else (document["standing"], "^", style.KINDS["sleeping"].colour, "sleeping"),
        (document["start"], "o", style.OTHER, f"the scene: {literal(document['start']['kind'])}"),
    ):  # fmt: skip
        ax.plot(place["p_phi"], place["E_prime"], marker, color=style.BLACK, mfc=face,
                ms=12 if marker == "*" else 6, ls="none", zorder=4,
                label=label)  # fmt: skip
    ax.set(xlim=window["p_phi"], ylim=window["E_prime"], xlabel=r"$p_\varphi$ [kg m² s⁻¹]",
           ylabel=r"E′ = E − $p_\psi^2/2C$ [J]")  # fmt: skip
    ax.locator_params(axis="x", nbins=5)
    return ax


def _area(kind: str) -> dict[str, Any]:
    return {"color": style.KINDS[kind].colour, "label": style.KINDS[kind].label}


def around_focus(ax: Axes, document: Known, **looks: Any) -> Axes:
    """Draw Δφ in turns around the focus–focus point, followed, and as it is defined.

    Δψ loses what Δφ gains.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    document : mapping
        With a circuit.
    """
    circuit = document["circuit"]
    s, turn = np.array(circuit["s"]), 2 * np.pi
    lifted, jumping = (np.array(circuit[f"{name}precession"]) / turn for name in ("", "principal_"))
    line(ax, s, lifted, looks, color=style.PATH, lw=1.8, label="Δφ, followed")
    ax.plot(s, jumping, ".", color=style.OTHER, ms=3, label="Δφ as it is defined, which jumps")
    ends = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (1.0, lifted[-1]), (1.0, lifted[0]), arrowprops=ends)
    whole = f"{circuit['winding']:+d} turn" if abs(circuit["winding"]) == 1 else "turns"
    ax.text(0.985, (lifted[0] + lifted[-1]) / 2, whole, ha="right", va="center")
    ax.axhline(lifted[0], color=style.FAINT, lw=0.8, zorder=0)
    ax.set(xlim=(-0.02, 1.03), xlabel="once around the focus–focus point",
           ylabel="Δφ in a nutation, in turns")  # fmt: skip
    return ax


# --- the critical set over all p_ψ, in three dimensions ------------------------------------------

CURVES: Final = {
    "hanging": (style.KINDS["hanging"].colour, 1.8, "hanging"),
    "sleeping": (style.KINDS["sleeping"].colour, 1.8, "sleeping, stable"),
    "focus_focus": (style.BLACK, 2.6, UNSTABLE),
}
SHEETS: Final = ((STEADY, "Ω > 0"), ("#66C5AB", "Ω < 0"))
SEEN: Final = (24.0, -68.0)  # from where [°]


@mpl.rc_context(style.STYLE)
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
        an edge of one; and off both the focus–focus line of the unstable sleeping tops.

    Raises
    ------
    ValueError
        There is no gravity, and so no focus–focus line.
    """
    found = document["critical_set"]
    if found is None:
        raise ValueError("critical_set: there is none to draw without gravity")
    momentum = max(found["focus_focus"]["p_psi"]) / 2  # √(A |gMR|)
    units = {
        "p_psi": momentum,
        "p_phi": momentum,
        "E_prime": abs(found["focus_focus"]["E_prime"][0]),
    }
    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    ax: Any = figure.add_subplot(projection="3d", computed_zorder=False)
    for sheet, (colour, sign) in zip(found["sheets"], SHEETS, strict=True):
        x, y, z = (np.array(sheet[name]) / unit for name, unit in units.items())
        ax.plot_surface(x, y, z, color=colour, alpha=0.2, linewidth=0, shade=False, rcount=99,
                        ccount=99)  # fmt: skip
        rows, columns = range(0, x.shape[0], 3), range(0, x.shape[1], 4)
        for part in [(k, slice(None)) for k in rows] + [(slice(None), k) for k in columns]:
            label = f"steady precession, {sign}" if part[0] == 0 else None
            ax.plot(x[part], y[part], z[part], color=colour, lw=0.6, label=label)
    for name, (colour, width, words) in CURVES.items():
        places = np.array([np.array(found[name][each]) / unit for each, unit in units.items()])
        apart = np.flatnonzero(np.diff(places[0]) > 1.0)  # sleeping tops: one part on each side
        for k, some in enumerate(np.split(places, apart + 1, axis=1)):
            ax.plot(*some, color=colour, lw=width, label=None if k else words, zorder=5)
    ax.view_init(*SEEN)
    ax.set_box_aspect((1.0, 1.0, 0.8))
    ax.set(xlabel=r"$p_\psi/\sqrt{A|gMR|}$", ylabel=r"$p_\varphi/\sqrt{A|gMR|}$",
           zlabel="E′/|gMR|")  # fmt: skip
    legend(figure, 3, fontsize=8)
    return figure
