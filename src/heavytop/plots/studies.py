"""Charts of studies: facts over a range, growth of errors, cost against error, failures."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import cycle, zip_longest
from typing import Any, Final, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heavytop.exact.decimals import DOUBLE
from heavytop.plots import style
from heavytop.plots.atlas import atlas_charts, atlas_figure
from heavytop.plots.check import check_charts, check_figure
from heavytop.plots.style import Known, label_axes, line, literal, title_of
from heavytop.results.base import error_of, kind_of
from heavytop.results.drift import error_names, errors_of
from heavytop.results.stress import UNTOLD, StressOutcome
from heavytop.results.work_precision import ERROR_KEYS, error_of_point, front
from heavytop.scene.quantities import quantity_of
from heavytop.studies.find import fact_quantity

Found = Any  # a result, whose fields are read by their names
Charts = Mapping[str, Callable[..., Axes]]  # what draws a result on axes, by the names of pictures

# --- sweep: what is of one unit in one panel -----------------------------------------------------


def sweep_charts(found: Found) -> Charts:
    """The pictures of a sweep: each fact over the number that is varied."""
    facts = [name for row in found.rows[:1] for name in row if name not in (found.over, "kind")]
    pairs = zip(facts, cycle(style.COLOURS), strict=False)
    return {name: partial(fact_over_range, name, colour) for name, colour in pairs}


def sweep_figure(found: Found) -> Figure:
    """The chart of a sweep: facts over the number that is varied, a panel for each unit.

    Parameters
    ----------
    found : Sweep

    Returns
    -------
    matplotlib.figure.Figure
    """
    charts = sweep_charts(found)
    units = [fact_quantity(name).unit for name in charts]
    panels = [*dict.fromkeys(units)]
    size, grid = (7.0, 1.4 + 2.2 * len(panels)), {"nrows": len(panels), "sharex": True}
    with style.sheet(title_of(found.scene), size, 3, **grid) as (figure, axes):
        for unit, draw in zip(units, charts.values(), strict=True):
            draw(axes[panels.index(unit), 0], found).label_outer()
    return figure


def fact_over_range(name: str, colour: str, ax: Axes, /, found: Found, **looks: Any) -> Axes:
    """Draw a fact against the number that is varied."""
    along, about = map(fact_quantity, (found.over, name))
    x, y = (
        of.shown[1] * np.array([row[key] for row in found.rows], float)
        for key, of in ((found.over, along), (name, about))
    )
    dashed = "--" if name.endswith("_estimate") else "-"
    line(ax, x, y, looks, color=colour, ls=dashed, lw=1.0, label=about.symbol)
    heading = literal(along._replace(symbol=found.over).heading)
    return label_axes(ax, heading, f"[{about.shown[0] or '1'}]")


# --- drift: one panel for each quantity, both logarithmic ----------------------------------------

GUIDES: Final = ((0.5, r"$t^{1/2}$"), (1.0, r"$t$"), (1.5, r"$t^{3/2}$"), (2.0, r"$t^2$"))
DIVERGED: Final = 1e9  # larger errors, of a method that has diverged, are not drawn


def drift_charts(found: Found) -> Charts:
    """The pictures of a drift: the growth of each error that is not always 0."""
    grown = {name for each in found.methods for name, x in errors_of(each).items() if any(x)}
    names = [name for name in error_names(found.methods) if name in grown]
    return {name: partial(error_growth, name) for name in names}


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
    panels = [name for name in error_names(methods) if any(_growth_rows(x, name) for x in methods)]
    columns = min(2, max(1, len(panels)))
    rows = max(1, math.ceil(len(panels) / columns))
    size = (3.6 * columns + 0.6, 3.2 * rows + 0.7 + 0.2 * math.ceil(len(methods) / 4))
    starts = "" if count == 1 else f", RMS of {count} starts"
    title = f"{title_of(found.scene)} — {found.periods:g} nutation periods{starts}"
    with style.sheet(title, size, nrows=rows, ncols=columns) as (figure, axes):
        for ax, name in zip_longest(axes.ravel(), panels):
            error_growth(name, ax, found) if name else ax.set_visible(False)
    return figure


def error_growth(name: str, ax: Axes, /, found: Found, **looks: Any) -> Axes:
    """Draw the error of a quantity against nutation periods, both logarithmic, of every method.

    Parameters
    ----------
    name : str
        ``energy``, ``phase_s``, ``axis``, a momentum or an invariant.
    ax : matplotlib.axes.Axes
    found : Drift
    """
    about = error_of(name)
    ax.set(xscale="log", yscale="log")
    for k, method in enumerate(found.methods):
        if points := _growth_rows(method, name):
            periods, errors = np.array(points).T
            line(ax, periods, about.shown[1] * errors, looks, lw=1.0, ms=3.5,
                 label=literal(method["name"]), **style.look_of(k))  # fmt: skip
    _draw_guides(ax)
    return label_axes(ax, "nutation periods", literal(f"error of {about.heading}"))


def _growth_rows(method: Known, name: str) -> list[tuple[float, float]]:
    """Nutation periods and errors of a method, as far as a logarithm shows them."""
    errors = zip(method["periods"], errors_of(method).get(name, ()), strict=False)
    return [(n, error) for n, error in errors if error and abs(error) <= DIVERGED]


def _draw_guides(ax: Axes) -> None:
    """Draw powers of time from the lower left corner, for comparison of slopes."""
    (low, high), (first, last) = ax.get_ylim(), ax.dataLim.intervalx
    for power, label in GUIDES if last > first else ():
        end = min(last, first * (high / low) ** (1 / power))
        x = np.array([first, first * (end / first) ** 0.93, end])
        y = low * (x / first) ** power
        ax.plot(x, y, color=style.FAINT, lw=0.8, zorder=0)
        ax.annotate(label, (x[1], y[1]), color="#777777", fontsize=7, ha="right", va="bottom")
    ax.set_ylim(low, high, auto=None)


# --- work and precision: what a period costs against the error, with the front -------------------

AWAY: Final = 10.0  # larger errors, of a method that has diverged, are not drawn
PER: Final = {
    "us_per_period": "µs per nutation period",
    "rhs_evaluations": "evaluations (Taylor: steps) per period",
}


def workprec_charts(found: Found) -> Charts:
    """The pictures of a work–precision diagram: times, and evaluations, against each error."""
    names = [name for name, error in ERROR_KEYS.items() if front(found.points, error)]
    ends = {"": "us_per_period", "-evaluations": "rhs_evaluations"}
    return {
        f"{name}{end}": partial(work_precision, name, work)
        for end, work in ends.items()
        for name in names
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
        energy; last the time of methods of more bits. Projected formulations are dotted, rivals
        dashed and hollow, one's own methods thick; auto is a star; the front is a grey staircase.
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
                work_precision(name, work, ax, found, some)
                ax.set_visible(bool(np.isfinite(ax.dataLim.x0)))  # of some errors there are none
            for ax in row[1:]:
                ax.set_ylabel("")
    return figure


def _look_of(number: int, name: str, rival: bool) -> dict[str, Any]:
    """The style of a method's line: of a formulation, a rival, one's own method, or auto."""
    look = style.look_of(number)
    if name.startswith("auto"):
        return look | {"color": "#CC0000", "marker": "*", "ls": "none", "ms": 13}
    if ":" in name:
        return look | {"lw": 2.0, "zorder": 5}
    if rival:
        return look | {"ls": "--", "mfc": "white"}
    return look | {"ls": ":" if name.endswith("-projected") else "-"}


def work_precision(
    name: str,
    work: str,
    ax: Axes,
    /,
    found: Found,
    some: Sequence[Known] | None = None,
    **looks: Any,
) -> Axes:
    """Draw the work of a nutation period against an error, both logarithmic, of every method.

    Parameters
    ----------
    name : str
        One of `heavytop.results.work_precision.ERROR_KEYS`.
    work : str
        ``us_per_period`` or ``rhs_evaluations``.
    ax : matplotlib.axes.Axes
    found : WorkPrecision
    some : sequence, optional
        Those of its points that are drawn.
    """
    key, about = ERROR_KEYS[name], quantity_of("phase_s" if name == "phase" else name)
    timed = work == "us_per_period"

    def draw(points: Sequence[Known], how: Callable[..., Any], *given: Any, **style: Any) -> None:
        errors = [about.shown[1] * error_of_point(point, key) for point in points]
        spent = [point[work] if timed else point[work] / point["periods"] for point in points]
        how(ax, errors, spent, *given, **style)

    shown = found.points if some is None else some
    points = [p for p in shown if 0 < error_of_point(p, key) < AWAY and p[work]]
    if timed:
        leading = [points[i] for i in front(points, key)]
        draw(leading, Axes.step, where="pre", color="#999999", lw=5, alpha=0.5, label="front",
             zorder=1)  # fmt: skip
    rivals = {point["method"]: point["rival"] for point in found.points}
    for k, (method, rival) in enumerate(rivals.items()):
        if same := [point for point in points if point["method"] == method]:
            ours = {"lw": 0.9, "ms": 4} | _look_of(k, method, rival)
            draw(same, line, looks, label=literal(method), **ours)
    ax.set(xscale="log", yscale="log")
    if not ax.xaxis_inverted():  # by what was drawn there before
        ax.invert_xaxis()
    return label_axes(ax, f"error of {about.heading}", PER[work])


# --- where methods fail: the digits that every method lost at every case -------------------------

MOST_LOST_DIGITS: Final = 14.0  # digits
LEGEND_COLUMNS: Final = 4  # marks explained in a line
READING: Final = (
    "columns: one of our formulations, or another solver and its equations (a: the axis form,",
    "l: Lagrange's, 1: of first order), then the tolerance or the steps in a period",
    "colours: digits lost beyond what conditioning allows",
)


def stress_charts(found: Found) -> Charts:
    """The picture of a stress test, if it has runs: digits lost by each method at each case."""
    return {"digits": digits_lost} if found.cases else {}


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
    style.fill(figure, partial(digits_lost, found=found))
    return figure


def stress_size(found: Found) -> tuple[float, float]:
    """Width and height of a figure that has room for every case and every method [inches]."""
    heads, cases = _heads_and_cases(found)
    high = 1.6 + 0.07 * max(map(len, heads.values()), default=0) + 0.19 * len(cases)
    return max(6.4, 3.2 + 0.42 * len(heads)), high


def _heads_and_cases(found: Found) -> tuple[dict[str, str], list[str]]:
    """The headings of columns by method, and the names of cases, of those that have runs."""
    used = {run["method"] for run in found.cases}
    heads = {name: literal(head, 40) for name, head in found.methods.items() if name in used}
    return heads, [*dict.fromkeys(run["case"] for run in found.cases)]


def digits_lost(ax: Axes, /, found: Found, **looks: Any) -> Axes:
    """Draw the digits that every method lost at every case; keywords are those of the image.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    found : Stress
    """
    heads, cases = _heads_and_cases(found)
    lost = np.full((max(1, len(cases)), max(1, len(heads))), np.nan)
    for run in found.cases:
        i, j, digits = cases.index(run["case"]), [*heads].index(run["method"]), run["digits_lost"]
        lost[i, j] = np.nan if digits is None else digits
        if mark := UNTOLD if run["untold"] else StressOutcome(run["outcome"]).mark:
            colour = "white" if lost[i, j] > MOST_LOST_DIGITS / 2 else "black"
            ax.text(j, i, mark, ha="center", va="center", fontsize=6, color=colour)
    ax.set_facecolor("#DDDDDD")
    ours: dict[str, Any] = {"cmap": "YlGnBu", "vmin": 0.0, "vmax": MOST_LOST_DIGITS}
    ax.imshow(lost, **ours | {"aspect": "auto", "interpolation": "none"} | looks)
    ax.set_xticks(range(len(heads)), heads.values(), rotation=90)
    ax.set_yticks(range(len(cases)), [literal(case, 40) for case in cases])
    ax.tick_params(length=0, labeltop=True, labelbottom=False)
    marks = [f"{each.mark} {each}" for each in StressOutcome if each.mark]
    marks += [f"{UNTOLD} undetermined", "grey: no number, or not run"]
    lines = (", ".join(marks[i : i + LEGEND_COLUMNS]) for i in range(0, len(marks), LEGEND_COLUMNS))
    ax.set_xlabel("\n".join([*READING, ",\n".join(lines)]), fontsize=7.5)
    return ax


# --- which result has which: a new study is a row here --------------------------------------------


class Pictures(NamedTuple):
    """The figure and the pictures of a kind of result.

    Attributes
    ----------
    title : str
        The title of its figure.
    figure : callable
        The function that makes its figure.
    charts : callable
        The function that returns its pictures for axes of one's own; without any it has no figure.
    size : callable
        The function that returns the size of a figure with one picture [inches]; None is that of
        matplotlib.
    """

    title: str
    figure: Callable[[Found], Figure]
    charts: Callable[[Found], Charts]
    size: Callable[[Found], tuple[float, float] | None] = lambda _: None


RESULT_PICTURES: Final = {
    "drift": Pictures("errors over nutation periods", drift_figure, drift_charts),
    "workprec": Pictures("time of a period over error", workprec_figure, workprec_charts),
    "stress": Pictures("digits lost by every method", stress_figure, stress_charts, stress_size),
    "atlas": Pictures("kinds of motion, and their boundaries", atlas_figure, atlas_charts),
    "check": Pictures("errors and phase over time", check_figure, check_charts),
    "sweep": Pictures("facts over the range", sweep_figure, sweep_charts),
}
"""Figure and pictures by the kind of a result."""


def charts_of(found: Found) -> Charts:
    """The functions that draw a result on axes, by the names of its pictures."""
    if (row := RESULT_PICTURES.get(kind_of(found))) is None:
        return {}
    return {name: partial(draw, found=found) for name, draw in row.charts(found).items()}


def result_figures(found: Found) -> Iterator[tuple[str, str, Callable[[], Figure]]]:
    """Yield name, title and drawing function of the figure of a result, if it has one."""
    if charts_of(found):
        row = RESULT_PICTURES[kind_of(found)]
        yield kind_of(found), row.title, partial(row.figure, found)
