"""`plot` of a motion, a trajectory or a result: one of its pictures, on axes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from matplotlib.axes import Axes

from heavytop.checking.result import Check
from heavytop.errors import Impossible
from heavytop.plots import figures
from heavytop.plots.style import legend
from heavytop.results.check import CheckResult
from heavytop.scene.arguments import Refused, expect, one_of, text_of

Draw = Callable[..., Axes]


def _over_time(name: str) -> Draw:
    return lambda ax, run, **looks: figures.over_time(ax, run, name, **looks)


RUN: Final[Mapping[str, Draw]] = {
    "loop": figures.loop,
    "sphere": figures.axis_on_sphere,
    "theta": figures.nutation,
    **{name: _over_time(name) for name in ("phi", "psi", "thetadot", "phidot", "psidot")},
    "potential": figures.effective_potential,
    "phase": figures.phase_plane,
}


def plotted(thing: Any, what: str | None, ax: Axes | None, looks: Mapping[str, Any]) -> Axes:
    """Draw a picture of a thing, as `heavytop.display.Plotted.plot` says."""
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
    first = {"theta": figures.nutation} if figures.stands(thing) else {}
    last = {"errors": figures.errors} if hasattr(thing, "plan") else {}

    def bind(draw: Draw) -> Draw:
        return lambda ax, **looks: draw(ax, thing, **looks)

    return {name: bind(draw) for name, draw in {**first, **RUN, **last}.items()}
