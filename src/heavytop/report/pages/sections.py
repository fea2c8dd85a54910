"""The sections of studies: what each says, and its pictures with the numbers behind them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.report.pages.maps import atlas_section
from heavytop.report.pages.run_section import run_section
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.parts import Part, Table, called
from heavytop.report.studies import (
    drift_parts,
    energy_momentum_parts,
    stress_parts,
    validate_parts,
    work_precision_parts,
)
from heavytop.report.study_files import charted

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.report.pages.load import Result
    from heavytop.scene.scene import Scene

NOTHING: Final = "Nothing was measured: there is no figure."
ERRORS: Final = ("energy", "p_phi", "p_psi", "phase_s", "axis")  # of a drift's numbers
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
    rows = [
        {"method": method["name"], "periods": periods} | {c: method[c][k] for c in ERRORS}
        for method in result.document["methods"]
        for k, periods in enumerate(method["periods"])
    ]
    title = "errors over nutation periods, both logarithmic"
    chart = rows and _chart(result, "drift", title, Table.of(rows, digits=3), ("methods",))
    return _section(result, ident, "Drift", drift_parts(result.document), chart)


def work_precision_section(result: Result, ident: str) -> Section:
    """Return the section of a work–precision diagram."""
    rows = [{name: point[name] for name in TIMED} for point in result.document["points"]]
    title = "time of a period over error, both logarithmic"
    names = ("points", "front", "front_theta")
    chart = rows and _chart(result, "workprec", title, Table.of(rows, digits=3), names)
    parts = work_precision_parts(result.document)
    return _section(result, ident, "Work and precision", parts, chart)


def stress_section(result: Result, ident: str) -> Section:
    """Return the section of a stress test."""
    rows = [{name: run[name] for name in RUN} for run in result.document["cases"]]
    title, names = "digits lost at every case by every method", ("cases", "hard")
    chart = rows and _chart(result, "stress", title, Table.of(rows, digits=2), names)
    return _section(result, ident, "Where methods fail", stress_parts(result.document), chart)


def energy_momentum_section(result: Result, ident: str) -> Section:
    """Return the section of a diagram of energy and momentum."""
    document = result.document
    title = "energy over momentum at the p_ψ of the scene: kinds, and the edge of steady precession"
    table = Table.of_columns(document["edge"])
    pictures = [_chart(result, "energy_momentum", title, table, ("edge", *DIAGRAM))]
    if found := document.get("critical_set"):
        title = "the critical set over all p_ψ: two sheets of steady precession, and the thread"
        table = Table.of_columns(found["thread"])
        critical = _chart(result, "critical_set", title, table, ("critical_set",))
        pictures.append(replace(critical, data=found, listed="sheets", turns=True))
    parts = energy_momentum_parts(document)
    return _section(result, ident, "Energy and momentum", parts, *pictures)


def validate_section(result: Result, ident: str) -> Section:
    """Return the section of a validation."""
    return Section(result, ident, "Claims", tuple(validate_parts(result.document)))


def _chart(result: Result, name: str, title: str, table: Table, data: Sequence[str]) -> Picture:
    """The chart that ``heavytop.plots.NAME`` draws; the first of the data is the list of it."""
    svg = drawn(charted(name, result.document))
    known = {each: result.document.get(each) for each in data}
    return Picture(name.replace("_", "-"), title, svg, table, known, listed=data[0])


def _section(result: Result, ident: str, what: str, parts: Iterable[Part], *charts: Any) -> Section:
    """The section of a study, with those of its charts for which there are numbers."""
    document = result.document
    heading = f"{what}: {called(document)}" if "scene" in document else what
    there = tuple(filter(None, charts))
    return Section(result, ident, heading, (*([] if there else [NOTHING]), *parts), there)


def traces_document() -> dict[str, Any]:
    """Return the axis of every shipped scene over a few nutations; nothing is integrated.

    Of a top that rests, sleeps or hangs it is what it does after a push, ``pushed`` [rad/s].

    Examples
    --------
    >>> first = traces_document()["traces"][0]
    >>> first["name"], first["kind"], first["axis"][0], first["pushed"]
    ('at-rest', 'at-rest', [0.0, 0.0, 1.0], 1.0)
    """
    from heavytop.analytic.motion import Motion
    from heavytop.plots.sphere import PUSH, touched
    from heavytop.scene.scene import load_scene, shipped_scenes

    found = []
    for name, title in shipped_scenes().items():
        scene = load_scene(name)
        motion = Motion(scene.top, scene.start)
        known: dict[str, Any] = {"name": name, "title": title}
        known |= {"kind": str(motion.kind), "tags": list(motion.tags)}
        if neighbour := touched(motion):
            motion, known["pushed"] = neighbour, PUSH
        seconds = _seconds(motion, scene)
        axis = motion.at(np.linspace(0.0, seconds, TRACE_POINTS)).axis
        places = [[round(x, 6) + 0.0 for x in place] for place in axis.tolist()]
        found.append(known | {"seconds": seconds, "axis": places})
    return {"schema": "heavytop/traces/1", "traces": found}


def _seconds(motion: Motion, scene: Scene) -> float:
    """How long a path is drawn: some nutations; where nothing nutates, what the scene spans."""
    return TRACE_PERIODS * motion.period if motion.period else float(scene.time or TRACE_S)


def traces_section(result: Result, ident: str) -> Section:
    """Return the section of axis traces."""
    from heavytop.plots.sphere import traces_figure

    traces = result.document["traces"]
    rows = [
        {name: each[name] for name in ("name", "kind", "tags", "seconds")} | _tilts(each["axis"])
        for each in traces
    ]
    title = "the path of the axis on the unit sphere, in closed form; dot: start, cross: vertical"
    svg, table = drawn(traces_figure(result.document)), Table.of(rows, digits=3)
    chart = Picture("traces", title, svg, table, {"traces": traces}, listed="traces")
    return _section(result, ident, "Every kind of motion", (), chart)


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
