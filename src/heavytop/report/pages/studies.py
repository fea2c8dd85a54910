"""Studies on the page: drift, and work and precision, each a chart with its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from heavytop.report.pages.commands import command, exactly, folder, scene_file, scene_word
from heavytop.report.pages.descriptions import NOTHING, called, left_out
from heavytop.report.pages.ladders import methods_asked
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.pages.tables import Table

if TYPE_CHECKING:
    from heavytop.report.pages.findings import Finding

Known = Mapping[str, Any]
Rows = Sequence[Known]


def drift_section(finding: Finding, ident: str) -> Section:
    """Return the section of a drift study."""
    document = finding.document
    names = [each["name"] for each in document["methods"]]
    asked = (
        "--periods", exactly(document["periods"]),
        *(("--methods", ",".join(names)) if names else ()),
        "--ensemble", exactly(document["ensemble"]), "--samples", exactly(document["samples"]),
        "--seed", exactly(document["seed"]),
    )  # fmt: skip
    made = command("drift", scene_word(document["scene"], ident), *asked, *folder(ident))
    pictures = tuple(_drift_picture(document, ident, made))
    return Section(
        ident=ident,
        heading=f"Drift: {called(document)}",
        words=f"{exactly(document['periods'])} nutation periods, errors at "
        f"{document['samples']} times. The power of t is the one with which an error grows, with "
        "the uncertainty of its last digits: 1/2 for a random walk, 1 for a steady drift. Energy "
        "is relative to max(|E′|, |gMR|); a phase is lost that is off by more than a twentieth of "
        "a period",
        source=document["scene"]["source"],
        table=Table.of_rows([_growth(each) for each in document["methods"]], digits=2),
        pictures=pictures,
        command=made,
        scene=scene_file(document["scene"], {"periods": document["periods"]}),
        notes=() if pictures else (NOTHING,),
    )


def _drift_picture(document: Known, ident: str, made: str) -> Iterator[Picture]:
    from heavytop.plots.drift import drift_figure

    rows = [row for each in document["methods"] for row in _marks(each)]
    if rows:
        yield Picture(
            ident=f"{ident}-chart",
            title="errors over nutation periods, both logarithmic",
            alt=_drift_words(document),
            svg=drawn(drift_figure(document)),
            table=Table.of_rows(rows, 400, digits=3),
            data={"methods": document["methods"]},
            command=made,
            listed="methods",
        )


def _marks(method: Known) -> Iterator[dict[str, Any]]:
    for k, periods in enumerate(method["periods"]):
        row = {"method": method["name"], "periods": periods}
        yield row | {
            label: method[name][k]
            for label, name in (
                ("energy", "energy"), ("p_φ", "p_phi"), ("p_ψ", "p_psi"), ("phase [s]", "phase_s"),
                ("axis [rad]", "axis"),
            )
        }  # fmt: skip


def _growth(method: Known) -> dict[str, Any]:
    last = {name: next(reversed(method[name]), None) for name in ("energy", "phase_s", "axis")}
    return {
        "method": method["name"],
        "energy at the end": last["energy"],
        "energy: power of t": _exponent(method, "energy"),
        "phase at the end [s]": "lost"
        if method["periods"] and last["phase_s"] is None
        else last["phase_s"],
        "phase: power of t": _exponent(method, "phase"),
        "axis at the end [rad]": last["axis"],
        "not run": method["skipped"],
    }


def _exponent(method: Known, name: str) -> str | None:
    """An exponent as physicists write it: 1.40(2) is 1.40 ± 0.02."""
    exponent, errors = method[f"{name}_exponent"], method.get("stderr") or {}
    if exponent is None:
        return None
    if (error := errors.get(name)) is None:
        return f"{exponent:.2f}"
    hundredths = max(1, round(100 * error))
    return f"{exponent:.2f}({hundredths})" if hundredths < 100 else f"{exponent:.0f}({error:.0f})"


def _drift_words(document: Known) -> str:
    ends = [
        f"{each['name']} {each['energy'][-1]:.1e}"
        for each in document["methods"]
        if each["energy"] and each["energy"][-1] is not None
    ]
    return (
        f"{called(document)}: errors of {len(document['methods'])} methods over "
        f"{exactly(document['periods'])} nutation periods. Energy at the end: {', '.join(ends)}."
    )


POINT: Final = {
    "method": "method", "tolerance": "tolerance", "steps a period": "steps_a_period",
    "µs a period": "us_per_period", "error of the axis": "error", "of θ [rad]": "theta_error",
    "evaluations": "rhs_evaluations", "language": "language",
}  # fmt: skip
"""The columns of a timed setting."""


def workprec_section(finding: Finding, ident: str) -> Section:
    """Return the section of a work–precision diagram."""
    document = finding.document
    periods, budget = exactly(document["periods"]), exactly(document["budget"])
    asked = (*methods_asked(document), "--periods", periods, "--budget", budget)
    made = command("workprec", scene_word(document["scene"], ident), *asked, *folder(ident))
    points = [{head: each.get(name) for head, name in POINT.items()} for each in document["points"]]
    front = [points[_index(i, points)] for i in document["front"] or document["front_theta"]]
    picture = _workprec_picture(document, ident, made, points, front) if points else None
    return Section(
        ident=ident,
        heading=f"Work and precision: {called(document)}",
        words=f"{periods} periods; every method at every setting that {budget} s sufficed for. "
        "The table is the front: what none beats in both time and error",
        source=document["scene"]["source"],
        table=Table.of_rows(front, 100, digits=2),
        pictures=() if picture is None else (picture,),
        command=made,
        scene=scene_file(document["scene"], {"periods": document["periods"]}),
        notes=(*(() if points else (NOTHING,)), *left_out(document["skipped"])),
    )


def _workprec_picture(document: Known, ident: str, made: str, points: Rows, front: Rows) -> Picture:
    from heavytop.plots.workprec import workprec_figure

    best = ", ".join(dict.fromkeys(point["method"] for point in front))
    return Picture(
        ident=f"{ident}-chart",
        title="time per nutation period over error, both logarithmic",
        alt=f"{called(document)}: {len(points)} timed settings; {len(front)} of them are beaten by "
        f"none in both time and error: {best}.",
        svg=drawn(workprec_figure(document)),
        table=Table.of_rows(points, 400, digits=3),
        data={name: document[name] for name in ("points", "front", "front_theta")},
        command=made,
        listed="points",
    )


def _index(i: float, points: Any) -> int:
    if int(i) != i or not 0 <= i < len(points):
        raise ValueError(f"{i}: no index of a point")
    return int(i)
