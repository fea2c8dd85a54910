"""The sections of studies: what each says, and its pictures with the numbers behind them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.report.drift import drift_parts
from heavytop.report.energy_momentum import energy_momentum_parts
from heavytop.report.pages.maps import atlas_section
from heavytop.report.pages.run_section import run_section
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.parts import Known, Part, Table, called
from heavytop.report.stress import stress_parts
from heavytop.report.validation import validate_parts
from heavytop.report.work_precision import work_precision_parts

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.report.pages.load import Result
    from heavytop.scene.scene import Scene

NOTHING: Final = "Nothing was measured: there is no figure."
COLUMNS: Final = ("energy", "p_phi", "p_psi", "phase_s", "axis")  # of a drift's numbers
TIMED: Final = (
    "method", "tolerance", "steps_a_period", "us_per_period", "error", "theta_error",
    "rhs_evaluations", "language",
)  # fmt: skip
RUN: Final = ("case", "method", "outcome", "error", "digits_lost", "note")
DIAGRAM: Final = ("start", "standing", "hanging", "thread", "edge", "window", "circuit")

TRACE_POINTS: Final = 601
TRACE_PERIODS: Final = 3
TRACE_S: Final = 2.0  # of a path where nothing nutates, and the scene does not say


def drift_section(result: Result, ident: str) -> Section:
    """Return the section of a drift study."""
    from heavytop.plots.drift import drift_figure

    document = result.document
    rows = [
        {"method": method["name"], "periods": periods} | {c: method[c][k] for c in COLUMNS}
        for method in document["methods"]
        for k, periods in enumerate(method["periods"])
    ]
    picture = rows and Picture(
        name="chart",
        title="errors over nutation periods, both logarithmic",
        svg=drawn(drift_figure(document)),
        table=Table.of(rows, digits=3),
        data={"methods": document["methods"]},
        listed="methods",
    )
    return _section(result, ident, "Drift", drift_parts, picture)


def work_precision_section(result: Result, ident: str) -> Section:
    """Return the section of a work–precision diagram."""
    from heavytop.plots.workprec import workprec_figure

    document = result.document
    points = [{name: point.get(name) for name in TIMED} for point in document["points"]]
    picture = points and Picture(
        name="chart",
        title="time per nutation period over error, both logarithmic",
        svg=drawn(workprec_figure(document)),
        table=Table.of(points, digits=3),
        data={name: document[name] for name in ("points", "front", "front_theta")},
        listed="points",
    )
    return _section(result, ident, "Work and precision", work_precision_parts, picture)


def stress_section(result: Result, ident: str) -> Section:
    """Return the section of a stress test."""
    from heavytop.plots.stress import stress_figure

    document = result.document
    runs = [{name: run[name] for name in RUN} for run in document["cases"]]
    picture = runs and Picture(
        name="chart",
        title="digits lost at every case by every method",
        svg=drawn(stress_figure(document)),
        table=Table.of(runs, digits=2),
        data={"hard": document["hard"], "cases": document["cases"]},
        listed="cases",
    )
    return _section(result, ident, "Where methods fail", stress_parts, picture)


def energy_momentum_section(result: Result, ident: str) -> Section:
    """Return the section of a diagram of energy and momentum."""
    from heavytop.plots.critical_set import critical_set_figure
    from heavytop.plots.energy_momentum import energy_momentum_figure

    document = result.document
    diagram = Picture(
        name="diagram",
        title="energy over momentum at the p_ψ of the scene: kinds, and the edge of steady "
        "precession",
        svg=drawn(energy_momentum_figure(document)),
        table=Table.of_columns(document["edge"]),
        data={name: document[name] for name in DIAGRAM},
        listed="edge",
    )
    found = document.get("critical_set")
    critical = found and Picture(
        name="critical-set",
        title="the critical set over all p_ψ: two sheets of steady precession, and the thread of "
        "upright tops that fall",
        svg=drawn(critical_set_figure(document)),
        table=Table.of_columns(found["thread"]),
        data=found,
        listed="sheets",
        turns=True,
    )
    parts = energy_momentum_parts
    return _section(result, ident, "Energy and momentum", parts, diagram, critical)


def validate_section(result: Result, ident: str) -> Section:
    """Return the section of a validation."""
    return Section(result, ident, "Claims", tuple(validate_parts(result.document)))


def _section(
    result: Result,
    ident: str,
    what: str,
    parts: Callable[[Known], Any],
    *pictures: Any,
) -> Section:
    """The section of a study, with those of its pictures for which there are numbers."""
    document = result.document
    heading = f"{what}: {called(document)}" if "scene" in document else what
    there = tuple(picture for picture in pictures if picture)
    notes: tuple[Part, ...] = () if there else (NOTHING,)
    return Section(result, ident, heading, (*notes, *parts(document)), there)


def traces_document() -> dict[str, Any]:
    """Return the axis of every shipped scene over a few nutations; nothing is integrated.

    Examples
    --------
    >>> first = traces_document()["traces"][0]
    >>> first["name"], first["kind"], first["axis"][0]
    ('at-rest', 'at-rest', [0.0, 0.0, 1.0])
    """
    from heavytop.analytic.motion import Motion
    from heavytop.scene.scene import load_scene, shipped_scenes

    found = []
    for name, title in shipped_scenes().items():
        scene = load_scene(name)
        motion = Motion(scene.top, scene.start)
        seconds = _seconds(motion, scene)
        axis = motion.at(np.linspace(0.0, seconds, TRACE_POINTS)).axis
        known = {"name": name, "title": title, "kind": str(motion.kind), "tags": list(motion.tags)}
        places = [[round(x, 6) + 0.0 for x in place] for place in axis.tolist()]
        found.append(known | {"seconds": seconds, "axis": places})
    return {"schema": "heavytop/traces/1", "traces": found}


def _seconds(motion: Motion, scene: Scene) -> float:
    """How long a path is drawn: some nutations; where nothing nutates, what the scene spans."""
    return TRACE_PERIODS * motion.period if motion.period else float(scene.time or TRACE_S)


def traces_section(result: Result, ident: str) -> Section:
    """Return the section of axis traces."""
    from heavytop.plots.traces import traces_figure

    traces = result.document["traces"]
    rows = [
        {name: each[name] for name in ("name", "kind", "tags", "seconds")} | _tilts(each["axis"])
        for each in traces
    ]
    picture = Picture(
        name="chart",
        title="the path of the axis on the unit sphere, by the closed form; dot: start, cross: "
        "vertical",
        svg=drawn(traces_figure(result.document)),
        table=Table.of(rows, digits=3),
        data={"traces": traces},
        listed="traces",
    )
    return Section(result, ident, "Every kind of motion", (), (picture,))


def _tilts(axis: list[list[float]]) -> dict[str, float]:
    """The tilts between which an axis stays."""
    heights = [min(1.0, max(-1.0, place[2])) for place in axis]
    ends = {"theta_min": max(heights), "theta_max": min(heights)}
    return {name: math.acos(height) for name, height in ends.items()}


SECTIONS: Final[Mapping[str, tuple[str, Callable[[Result, str], Section]]]] = {
    "run.json": ("run", run_section),
    "traces.json": ("traces", traces_section),
    "drift.json": ("drift", drift_section),
    "workprec.json": ("workprec", work_precision_section),
    "stress.json": ("stress", stress_section),
    "atlas.json": ("atlas", atlas_section),
    "energy_momentum.json": ("energy-momentum", energy_momentum_section),
    "validate.json": ("claims", validate_section),
}
"""By the name of a document, the name of its sections and what makes them."""
