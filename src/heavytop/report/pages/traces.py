"""The path of the axis of every shipped scene, by the closed form: made, and on the page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.report.pages.commands import command, folder
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.pages.tables import Table, shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    from heavytop.analytic.motion import Motion
    from heavytop.report.pages.findings import Finding
    from heavytop.scene.scene import Scene

SCHEMA: Final = "heavytop/traces/1"
POINTS: Final = 601
PERIODS: Final = 3
SECONDS: Final = 2.0  # of a path where nothing nutates, and the scene does not say


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
        axis = motion.at(np.linspace(0.0, seconds, POINTS)).axis
        known = {"name": name, "title": title, "kind": str(motion.kind), "tags": list(motion.tags)}
        places = [[round(x, 6) + 0.0 for x in place] for place in axis.tolist()]
        found.append(known | {"seconds": seconds, "axis": places})
    return {"schema": SCHEMA, "traces": found}


def _seconds(motion: Motion, scene: Scene) -> float:
    """How long a path is drawn: some nutations; where nothing nutates, what the scene spans."""
    return PERIODS * motion.period if motion.period else float(scene.time or SECONDS)


def traces_section(finding: Finding, ident: str) -> Section:
    """Return the section of axis traces."""
    from heavytop.plots.sphere import traces_figure

    traces = finding.document["traces"]
    made = command("report", *folder(ident))  # no other verb draws them
    picture = Picture(
        ident=f"{ident}-chart",
        title="the path of the axis on the unit sphere; dot: start, cross: vertical",
        alt=f"Paths of the axis in {len(traces)} panels. "
        + "; ".join(f"{each['name']}, {each['kind']}: tilt {_reach(each)}" for each in traces)
        + ".",
        svg=drawn(traces_figure(finding.document)),
        table=Table.of(
            {
                "scene": [each["name"] for each in traces],
                "kind": [each["kind"] for each in traces],
                "tags": [", ".join(each["tags"]) or None for each in traces],
                "drawn [s]": [each["seconds"] for each in traces],
                "tilt": [_reach(each) for each in traces],
                "command": [command("classify", each["name"]) for each in traces],
            }
        ),
        data={"traces": traces},
        command=made,
        listed="traces",
    )
    return Section(
        ident=ident,
        heading="Every kind of motion",
        words=f"the axis of {len(traces)} scenes by the closed form; nothing is integrated",
        pictures=(picture,) if traces else (),
        command=made,
    )


def _reach(trace: Mapping[str, Any]) -> str:
    """The tilts between which the axis stays."""
    heights = [min(1.0, max(-1.0, place[2])) for place in trace["axis"]] or [1.0]
    low, high = (shown(math.degrees(math.acos(u)), 3) for u in (max(heights), min(heights)))
    return f"{low}°" if low == high else f"{low}° to {high}°"
