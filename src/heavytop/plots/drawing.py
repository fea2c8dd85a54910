"""`plot` of results: the pictures that each has, by name, and the axes they are drawn on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final, TypeAlias

from matplotlib.axes import Axes

from heavytop.errors import Impossible
from heavytop.plots import atlas, figures, studies
from heavytop.plots.style import legend
from heavytop.scene.arguments import Refused, expect, one_of, text_of

Draw: TypeAlias = Callable[..., Axes]
Known: TypeAlias = tuple[Any, Mapping[str, Draw]]
"""What is drawn, and how, by name; the first is drawn where no name is given."""


def plotted(thing: Any, what: str | None, ax: Axes | None, looks: Mapping[str, Any]) -> Axes:
    """Draw a picture of a thing, as `heavytop.display.Plotted.plot` says."""
    kind = next(each.__name__ for each in type(thing).__mro__ if each.__name__ in _KNOWN)
    subject, known = _KNOWN[kind](thing)
    if not known:
        raise Impossible([("what", "there is nothing to draw")])
    try:
        draw = one_of(known)(next(iter(known)) if what is None else text_of("what", what))
    except Refused as wrong:
        raise Impossible([("what", str(wrong))]) from None
    if ax is not None:
        return draw(expect("ax", ax, Axes, "of matplotlib"), subject, **looks)
    from matplotlib import pyplot  # which shows it: nothing else here has a global state

    size = studies.stress_size(subject) if kind == "Stress" else None
    figure = pyplot.figure(figsize=size, layout="constrained")
    try:
        ax = draw(figure.subplots(), subject, **looks)
    except Exception:
        pyplot.close(figure)
        raise
    legend(figure, 3, fontsize=8)
    if ax.images:
        figure.colorbar(ax.images[0], ax=ax, fraction=0.04, aspect=40)
    return ax


def _named(draw: Draw, names: Iterable[str]) -> dict[str, Draw]:
    """By name what draws it, for a function that takes the name."""

    def of(name: str) -> Draw:
        return lambda ax, subject, **looks: draw(ax, subject, name, **looks)

    return {name: of(name) for name in names}


# --- what each thing has --------------------------------------------------------------------------

RUN: Final[Mapping[str, Draw]] = {
    "loop": figures.loop,
    "sphere": figures.axis_on_sphere,
    "theta": figures.nutation,
    **_named(figures.over_time, ("phi", "psi", "thetadot", "phidot", "psidot")),
    "potential": figures.effective_potential,
    "phase": figures.phase_plane,
}


def _motion(motion: Any) -> Known:
    return motion, {"theta": figures.nutation, **RUN} if figures.stands(motion) else RUN


def _trajectory(trajectory: Any) -> Known:
    return trajectory, {**_motion(trajectory)[1], "errors": figures.errors}


def _drift(drift: Any) -> Known:
    document = drift.document()
    return document, _named(studies.error_growth, studies.drifting(document))


def _work_precision(found: Any) -> Known:
    document = found.document()
    return document, _named(studies.work_precision, studies.measured(document))


def _check(check: Any) -> Known:
    return check.document(), {"errors": studies.checked_errors, "phase": studies.checked_phase}


_KNOWN: Final[Mapping[str, Callable[[Any], Known]]] = {
    "Motion": _motion, "Trajectory": _trajectory, "Drift": _drift, "Check": _check,
    "WorkPrecision": _work_precision, "CheckResult": _check,
    "Atlas": lambda found: (found, {"map": atlas.kinds_map}),
    "Stress": lambda found: (found.document(), {"digits": studies.digits_lost}),
}  # fmt: skip
"""By the name of a class."""
