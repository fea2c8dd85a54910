"""`plot` of a motion, a trajectory or a result: one of its pictures, on axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from matplotlib.axes import Axes

from heavytop.checking.result import Check
from heavytop.errors import Impossible
from heavytop.plots import figures
from heavytop.plots.style import legend
from heavytop.results.check import CheckResult
from heavytop.scene.arguments import Refused, expect, one_of, text_of
from heavytop.scene.quantities import UNITS_SHOWN, read_units, showing

Draw = Callable[..., Axes]


def plotted(
    thing: Any, what: str | None, ax: Axes | None, unit: str | None, looks: Mapping[str, Any]
) -> Axes:
    """Draw a picture of a thing, as `heavytop.text.Plotted.plot` says."""
    units = UNITS_SHOWN.get() if unit is None else read_units(text_of("unit", unit))
    with showing(units):
        return _drawn(thing, what, ax, looks)


def _drawn(thing: Any, what: str | None, ax: Axes | None, looks: Mapping[str, Any]) -> Axes:
    """Draw a picture on axes, or on those of a new figure that pyplot shows."""
    charts = _charts(thing)
    if not charts:
        raise Impossible([("what", "there is nothing to draw")])
    try:
        draw = one_of(charts)(next(iter(charts)) if what is None else text_of("what", what))
    except Refused as wrong:
        raise Impossible([("what", str(wrong))]) from None
    if ax is not None:
        return draw(expect("ax", ax, Axes, "of matplotlib"), **looks)
    from matplotlib import pyplot  # which shows it: nothing else here has a global state

    size = getattr(thing, "figure_size", None)
    figure = pyplot.figure(figsize=size, layout="constrained")
    try:
        ax = draw(figure.subplots(), **looks)
    except Exception:
        pyplot.close(figure)
        raise
    legend(figure, 3, fontsize=8)
    if ax.images:
        figure.colorbar(ax.images[0], ax=ax, fraction=0.04, aspect=40)
    return ax


def _charts(thing: Any) -> Mapping[str, Draw]:
    """By name what draws a thing on axes; the first is drawn where no name is given."""
    if isinstance(thing, Check):
        thing = CheckResult.from_document(thing.document())
    if hasattr(thing, "charts"):
        charts: Mapping[str, Draw] = thing.charts()
        return charts
    first = ["theta"] if figures.stands(thing) else []
    names = dict.fromkeys([*first, *figures.DRAW])
    if not hasattr(thing, "plan"):
        del names["errors"]
    return {name: partial(_drawn_run, thing, figures.DRAW[name]) for name in names}


def _drawn_run(thing: Any, draw: Draw, ax: Axes, events: bool = True, **looks: Any) -> Axes:
    """Draw a picture of a run; without the marks of its events where these are not wanted."""
    before = {*ax.lines}
    draw(ax, thing, **looks)
    for mark in () if events else {*ax.lines} - before:
        if mark.get_gid() == figures.MARK:
            mark.remove()
    return ax
