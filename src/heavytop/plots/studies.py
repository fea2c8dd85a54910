"""Charts of studies: growth of errors, cost against error, where methods fail, data of others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle, zip_longest
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.equations.registry import FORMULATIONS
from heavytop.plots import style
from heavytop.plots.style import Known, gridded, line, literal, title_of
from heavytop.results.base import error_of
from heavytop.results.drift import columns_of, error_names
from heavytop.results.stress import UNTOLD, StressOutcome
from heavytop.results.work_precision import ERROR_KEYS, error_of_point, front
from heavytop.scene.quantities import SI, quantity_of, showing
from heavytop.studies.find import fact_quantity

Found = Any  # a result, whose fields are read by their names
Looks = dict[str, dict[str, Any]]

# --- sweep: what is of one unit in one panel -----------------------------------------------------


def sweep_figure(found: Found) -> Figure:
    """The chart of a sweep: facts over the number that is varied, a panel for each unit.

    Parameters
    ----------
    found : Sweep

    Returns
    -------
    matplotlib.figure.Figure
    """
    columns = {name: fact_quantity(name) for name in found.rows[0] if name != "kind"}
    panels = [*dict.fromkeys(x.unit for name, x in columns.items() if name != found.over)]
    size, grid = (7.0, 1.4 + 2.2 * len(panels)), {"nrows": len(panels), "sharex": True}
    values = {
        name: x.shown[1] * np.array([row[name] for row in found.rows], float)
        for name, x in columns.items()
    }
    along = columns.pop(found.over)
    with style.sheet(title_of(found.scene), size, 3, **grid) as (figure, axes):
        for (name, about), colour in zip(columns.items(), cycle(style.COLOURS), strict=False):
            ax, dashed = axes[panels.index(about.unit), 0], "--" * name.endswith("_estimate")
            line(ax, values[found.over], values[name], {}, color=colour, ls=dashed or "-", lw=1.0,
                 label=about.symbol)  # fmt: skip
            gridded(ax, "", f"[{about.shown[0] or '1'}]")
        axes[-1, 0].set_xlabel(literal(along._replace(symbol=found.over).heading))
    return figure


# --- drift: one panel for each quantity, both logarithmic ----------------------------------------

DASHES: Final = ("-", "--", ":", "-.")  # one for every round of the colours
GUIDES: Final = ((0.5, r"$t^{1/2}$"), (1.0, r"$t$"), (1.5, r"$t^{3/2}$"), (2.0, r"$t^2$"))
DIVERGED: Final = 1e9  # error: beyond it a method has diverged, and the others could not be read
Series = dict[str, list[tuple[float, float]]]
"""By method: nutation periods and errors."""


def drift_figure(found: Found) -> Figure:
    """The chart of a drift study.

    Parameters
    ----------
    found : Drift

    Returns
    -------
    matplotlib.figure.Figure
        Errors against nutation periods, with guides that grow as t^½, t, t^3/2 and t²; of a
        method that diverges those up to 1e9.
    """
    methods, count = found.methods, found.ensemble
    panels = [name for name in error_names(methods) if _series(methods, name)]
    columns = min(2, max(1, len(panels)))
    rows = max(1, math.ceil(len(panels) / columns))
    size = (3.6 * columns + 0.6, 3.2 * rows + 0.7 + 0.2 * math.ceil(len(methods) / 4))
    starts = "" if count == 1 else f", RMS of {count} starts"
    title = f"{title_of(found.scene)} — {found.periods:g} nutation periods{starts}"
    with style.sheet(title, size, nrows=rows, ncols=columns) as (figure, axes):
        for ax, name in zip_longest(axes.ravel(), panels):
            error_growth(ax, found, name) if name else ax.set_visible(False)
    return figure


def error_growth(ax: Axes, found: Found, name: str = "energy", /, **looks: Any) -> Axes:
    """Draw the error of a quantity against nutation periods, both logarithmic, of every method.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Drift
    name : str
        ``energy``, ``phase_s``, ``axis``, a momentum or an invariant.
    """
    series, colours, marks = _series(found.methods, name), style.COLOURS, style.MARKERS
    about = error_of(name)
    ax.set(xscale="log", yscale="log")
    for k, method in enumerate(each["name"] for each in found.methods):  # no two are alike
        if method in series:
            n, error = zip(*series[method], strict=True)
            shown = about.shown[1] * np.array(error)
            line(ax, n, shown, looks, color=colours[k % len(colours)], marker=marks[k % len(marks)],
                 ls=DASHES[k // len(colours) % len(DASHES)], lw=1.0, ms=3.5,
                 label=literal(method))  # fmt: skip
    _guides(ax, [n for points in series.values() for n, _ in points])
    return gridded(ax, "nutation periods", literal(f"error of {about.heading}"))


def _series(methods: Sequence[Known], name: str) -> Series:
    found = {}
    for each in methods:
        errors = zip(each["periods"], columns_of(each).get(name, ()), strict=False)
        if points := [(n, error) for n, error in errors if error and abs(error) <= DIVERGED]:
            found[each["name"]] = points
    return found


def _guides(ax: Axes, periods: Sequence[float]) -> None:
    """Draw powers of time from the lower left corner; only their slopes mean something."""
    (low, high), first, last = ax.get_ylim(), min(periods), max(periods)
    if not last > first:
        return
    for power, label in GUIDES:
        end = min(last, first * (high / low) ** (1 / power))
        heights = [low, low * (end / first) ** power]
        ax.plot([first, end], heights, color=style.FAINT, lw=0.8, zorder=0)
        at = first * (end / first) ** 0.93
        place = (at, low * (at / first) ** power)
        ax.annotate(label, place, color="#777777", fontsize=7, ha="right", va="bottom", zorder=0)
    ax.set_ylim(low, high, auto=None)


# --- work and precision: what a period costs against the error, with the front -------------------

DOUBLE: Final = 53  # bits
TAYLOR_COLOURS = style.BLUE, style.PURPLE, style.YELLOW, style.GREEN, style.SKY, style.BLACK
FORM_COLOURS: Final = dict(zip(FORMULATIONS, TAYLOR_COLOURS, strict=False))
TAYLOR_MARKS: Final = {"": "o", "-projected": "s", "-mpfr": "D"}
FAMILIES: Final = {"collocation": "#8C510A", "splitting": style.ORANGE, "adaptive": "#808080"}
AWAY: Final = 10.0  # error: a method has left the top, and the others could not be read
OWN_COLOURS: Final = ("#E7298A", "#00A3A3", "#7A3DF0", "#A6761D", "#5A8F00")  # of one's own methods
PER: Final = {
    "us_per_period": "µs per nutation period",
    "rhs_evaluations": "evaluations per period",
}


def workprec_figure(found: Found) -> Figure:
    """The chart of a work–precision diagram.

    Parameters
    ----------
    found : WorkPrecision

    Returns
    -------
    matplotlib.figure.Figure
        Time, and below it evaluations of the right-hand side, against the errors of axis, phase and
        energy; last the time of methods of more bits. A formulation has one colour; rivals are
        dashed and hollow, in a colour for each family; one's own are thick, each in its colour;
        auto is a star; the front is a grey staircase.
    """
    points = found.points
    axis = any(point["measures"] == "axis" for point in points)
    columns = ["axis" if axis else "theta", "phase", "energy"]
    doubles, more = ([p for p in points if (p["bits"] > DOUBLE) == x] for x in (False, True))
    rows = [("us_per_period", doubles), ("rhs_evaluations", doubles)]
    rows += [("us_per_period", more)] * bool(more)
    heights = (1.0, 1.0, 0.6)[: len(rows)]
    size = (3.9 * len(columns) + 0.4, 3.7 * sum(heights) + 1.8)
    title = f"{title_of(found.scene)}, {found.periods:g} periods"
    grid = {"ncols": len(columns), "sharey": "row", "height_ratios": heights}
    with style.sheet(title, size, nrows=len(rows), **grid) as (figure, axes):
        for row, (work, some) in zip(axes, rows, strict=True):
            for ax, name in zip(row, columns, strict=True):
                work_precision(ax, found, name, work, some)
                ax.set_visible(bool(np.isfinite(ax.dataLim.x0)))  # of some errors there are none
            for ax in row[1:]:
                ax.set_ylabel("")
    return figure


def _looks(points: Sequence[Known]) -> Looks:
    """How each method is drawn: ours by formulation and precision, theirs hollow, by family."""
    markers = {colour: cycle(style.MARKERS[:7]) for colour in FAMILIES.values()}
    colours = cycle(OWN_COLOURS)
    found: Looks = {}
    for point in points:
        name = point["method"]
        if name in found:
            continue
        if name.startswith("auto"):
            found[name] = {"color": "#CC0000", "marker": "*", "linestyle": "none", "ms": 13}
        elif ":" in name:
            found[name] = {"color": next(colours), "marker": "o", "lw": 2.0, "ms": 5, "zorder": 5}
        elif point["rival"]:
            colour = FAMILIES[point.get("family", "adaptive")]
            found[name] = {"color": colour, "marker": next(markers[colour]), "linestyle": "--",
                           "markerfacecolor": "white"}  # fmt: skip
        else:
            precision = name.removeprefix(f"taylor-{point['formulation']}")
            found[name] = {"color": FORM_COLOURS.get(point["formulation"], style.FAINT),
                           "marker": TAYLOR_MARKS.get(precision, TAYLOR_MARKS["-mpfr"]),
                           "linestyle": ":" if precision == "-projected" else "-"}  # fmt: skip
    return found


def work_precision(
    ax: Axes,
    found: Found,
    name: str = "axis",
    work: str = "us_per_period",
    some: Sequence[Known] | None = None,
    /,
    **looks: Any,
) -> Axes:
    """Draw the work of a nutation period against an error, both logarithmic, of every method.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : WorkPrecision
    name : str
        One of `heavytop.results.work_precision.ERROR_KEYS`.
    work : str
        ``us_per_period`` or ``rhs_evaluations``.
    some : sequence, optional
        Those of its points that are drawn.
    """
    about = quantity_of("phase_s" if name == "phase" else name)
    rows = [
        {"method": p["method"], "error": off * about.shown[1], "us_per_period": p["us_per_period"],
         "rhs_evaluations": (p["rhs_evaluations"] or 0) / p["periods"]}
        for p in (found.points if some is None else some)
        if (off := error_of_point(p, ERROR_KEYS[name])) and off < AWAY
    ]  # fmt: skip
    if work == "us_per_period":
        leading = [rows[i] for i in front(rows, "error")]
        ax.step(*_xy(leading, work), where="pre", color="#999999", lw=5, alpha=0.5, label="front",
                zorder=1)  # fmt: skip
    for method, look in _looks(found.points).items():
        if same := [row for row in rows if row["method"] == method and row[work]]:
            line(ax, *_xy(same, work), looks, label=literal(method), **{"lw": 0.9, "ms": 4} | look)
    ax.set(xscale="log", yscale="log")
    if not ax.xaxis_inverted():  # by what was drawn there before
        ax.invert_xaxis()
    return gridded(ax, f"error of {about.heading}", PER[work])


def _xy(rows: Sequence[Known], work: str) -> tuple[list[float], list[float]]:
    return [row["error"] for row in rows], [row[work] for row in rows]


# --- where methods fail: the digits that every method lost at every case -------------------------

MOST_LOST_DIGITS: Final = 14.0  # digits
LEGEND_COLUMNS: Final = 4  # marks explained in a line
READING: Final = (
    "columns: one of our formulations, or another solver and its equations (a: the axis form,",
    "l: Lagrange's, 1: of first order), then the tolerance or the steps in a period",
    "colours: digits lost beyond what conditioning allows",
)


@mpl.rc_context(style.STYLE)
def stress_figure(found: Found) -> Figure:
    """The chart of a stress test.

    Parameters
    ----------
    found : Stress

    Returns
    -------
    matplotlib.figure.Figure
        Cases against methods, coloured by digits lost beyond what conditioning allows; below it
        what columns, colours and marks mean. The marks are the table's.
    """
    figure = Figure(figsize=stress_size(found), layout="constrained")
    ax = digits_lost(figure.subplots(), found)
    figure.colorbar(ax.images[0], ax=ax, fraction=0.04, aspect=40)
    return figure


def stress_size(found: Found) -> tuple[float, float]:
    """Width and height of a figure that has room for every case and every method [inches]."""
    names, rows, heads = _table(found)
    high = 1.6 + 0.07 * max(map(len, heads)) + 0.19 * len(rows)
    return max(6.4, 3.2 + 0.42 * len(names)), high


def _table(found: Found) -> tuple[list[str], list[str], list[str]]:
    """The methods and the cases of which there are runs, and what stands above the columns."""
    heads = found.methods
    rows = [*dict.fromkeys(run["case"] for run in found.cases)]
    known = dict.fromkeys(run["method"] for run in found.cases)
    names = [*(name for name in heads if name in known), *(n for n in known if n not in heads)]
    return names, rows, [literal(heads.get(name, name), 40) for name in names]


def digits_lost(ax: Axes, found: Found, **looks: Any) -> Axes:
    """Draw the digits that every method lost at every case; keywords are those of the image.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Stress
    """
    runs, (names, rows, heads) = found.cases, _table(found)
    lost = np.full((max(1, len(rows)), max(1, len(names))), np.nan)
    for run in runs:
        i, j, digits = rows.index(run["case"]), names.index(run["method"]), run["digits_lost"]
        lost[i, j] = np.nan if digits is None else digits
        if mark := UNTOLD if run["untold"] else StressOutcome(run["outcome"]).mark:
            colour = "white" if lost[i, j] > MOST_LOST_DIGITS / 2 else "black"
            ax.text(j, i, mark, ha="center", va="center", fontsize=6, color=colour)
    ax.set_facecolor("#DDDDDD")
    ours: dict[str, Any] = {"cmap": "YlGnBu", "vmin": 0.0, "vmax": MOST_LOST_DIGITS}
    ours |= {"aspect": "auto", "interpolation": "none"}
    ax.imshow(lost, **ours | looks)
    ax.set_xticks(range(len(names)), heads, rotation=90)
    ax.set_yticks(range(len(rows)), [literal(case, 40) for case in rows])
    ax.tick_params(length=0, labeltop=True, labelbottom=False)
    marks = [f"{each.mark} {each}" for each in StressOutcome if each.mark]
    marks += [f"{UNTOLD} undetermined", "grey: no number, or not run"]
    lines = (", ".join(marks[i : i + LEGEND_COLUMNS]) for i in range(0, len(marks), LEGEND_COLUMNS))
    ax.set_xlabel("\n".join([*READING, ",\n".join(lines)]), fontsize=7.5)
    return ax


# --- the errors of a trajectory that somebody else computed, over time ---------------------------

CHECKED_ERRORS: Final = ("axis", "theta", "phi", "psi", "energy", "p_phi", "p_psi")


def check_figure(found: Found) -> Figure:
    """The errors of a check over time above conditioning; below, how far the data run ahead."""
    grid = {"nrows": 2, "sharex": True, "height_ratios": (3, 2)}
    with style.sheet(literal(found.data["file"]), (7.0, 5.2), 3, **grid) as (figure, axes):
        checked_errors(axes[0, 0], found).set_xlabel("")
        checked_phase(axes[1, 0], found)
    return figure


def checked_errors(ax: Axes, found: Found, **looks: Any) -> Axes:
    """Draw the magnitude of every error against time, logarithmic, above conditioning.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Check
    """
    curves = found.thinned
    ax.set_yscale("log")
    with showing(SI):  # which are of several units, as conditioning is
        labels = {name: error_of(name).heading for name in CHECKED_ERRORS}
    for name, colour in zip(CHECKED_ERRORS, style.COLOURS, strict=True):
        if name in curves:
            off = np.where(curves[name], abs(curves[name]), np.nan)  # a logarithm shows no zero
            line(ax, curves["t"], off, looks, color=colour, lw=1.0, label=labels[name])
    if limit := found.condition:
        ax.axhline(limit, color=style.BLACK, ls=":", lw=1.0, label="conditioning")
    return gridded(ax, "t [s]", "error")


def checked_phase(ax: Axes, found: Found, **looks: Any) -> Axes:
    """Draw by how much the data run ahead of the exact motion [s] against time.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Check
    """
    curves = found.thinned
    line(ax, curves["phase_t"], curves["phase"], looks, color=style.BLUE, marker="o", ms=3, lw=1.0)
    return gridded(ax, "t [s]", "runs ahead by [s]")
