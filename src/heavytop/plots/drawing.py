"""`plot` of a motion, a trajectory or a result: one of its pictures, on axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from matplotlib.axes import Axes

from heavytop.errors import Impossible
from heavytop.plots.drawn_run import DrawnRun
from heavytop.plots.figures import pictures_of
from heavytop.plots.style import fill
from heavytop.results.base import Result, kind_of
from heavytop.scene.arguments import expect, one_of, read_argument
from heavytop.scene.quantities import UNITS_SHOWN, read_units, show_units

Draw = Callable[..., Axes]


def plot_picture(
    thing: Any, what: str | None, ax: Axes | None, unit: str | None, looks: Mapping[str, Any]
) -> Axes:
    """Draw a picture of a thing, as `heavytop.text.Plotted.plot` says."""
    charts = _charts(thing)
    if not charts:
        raise Impossible([("what", "there is nothing to draw")])
    units = UNITS_SHOWN.get() if unit is None else read_units(expect("unit", unit, str))
    name = next(iter(charts)) if what is None else expect("what", what, str)
    draw: Draw = read_argument("what", name, one_of(charts))
    with show_units(units):
        if ax is not None:
            return draw(expect("ax", ax, Axes, "of matplotlib"), **looks)
        return _draw_in_pyplot(draw, _size(thing), looks)


def _draw_in_pyplot(draw: Draw, size: Any, looks: Mapping[str, Any]) -> Axes:
    """Draw on the axes of a new figure that pyplot shows, with a legend."""
    from matplotlib import pyplot  # here alone: it has a global state

    figure = pyplot.figure(figsize=size, layout="constrained")
    try:
        return fill(figure, partial(draw, **looks))
    except Exception:
        pyplot.close(figure)
        raise


def _charts(thing: Any) -> Mapping[str, Draw]:
    """The functions that draw a thing on axes, by name; the first is the default."""
    if isinstance(thing, Result):
        return thing.charts()
    run = DrawnRun.of(thing)
    pictures = pictures_of(run)
    names = dict.fromkeys([*["theta"] * run.has_no_loop, *pictures])
    return {name: partial(_draw_run, run, pictures[name].draw) for name in names}


def _size(thing: Any) -> tuple[float, float] | None:
    """The size of a figure with one picture [inches]; None for the size of matplotlib."""
    if not isinstance(thing, Result):
        return None
    from heavytop.plots.studies import RESULT_PICTURES

    return RESULT_PICTURES[kind_of(thing)].size(thing)


def _draw_run(run: DrawnRun, draw: Draw, ax: Axes, /, events: bool = True, **looks: Any) -> Axes:
    """Draw a picture of a run, with or without the marks of its events."""
    return draw(ax, run if events else replace(run, marked=False), **looks)
