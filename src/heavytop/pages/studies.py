"""Studies on the page: drift, work and precision, stress, each a chart with its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from heavytop.pages.commands import command, scene_file, scene_word
from heavytop.pages.section import Picture, Section, Table, drawn

if TYPE_CHECKING:
    from heavytop.pages.findings import Finding

Known = Mapping[str, Any]


def drift_section(finding: Finding, ident: str) -> Section:
    """Return the section of a drift study."""
    from heavytop.report.drift_figure import drift_figure

    document = finding.document
    asked = (
        "--periods", f"{document['periods']:g}",
        "--methods", ",".join(each["name"] for each in document["methods"]),
        "--ensemble", str(document["ensemble"]), "--samples", str(document["samples"]),
        "--seed", str(document["seed"]),
    )  # fmt: skip
    made = command("drift", scene_word(document["scene"]), *asked, "-o", "out")
    rows = [row for each in document["methods"] for row in _marks(each)]
    picture = Picture(
        ident=f"{ident}-chart",
        title="errors over nutation periods, both logarithmic",
        alt=_drift_words(document),
        svg=drawn(drift_figure(document)),
        table=_table(rows),
        data={"methods": document["methods"]},
        command=made,
    )
    return Section(
        ident=ident,
        heading=f"Drift: {_name(document)}",
        words=f"{document['periods']:g} nutation periods, errors at {document['samples']} times",
        source=document["scene"]["source"],
        table=_table([_growth(each) for each in document["methods"]]),
        pictures=(picture,),
        command=made,
        scene=scene_file(document["scene"], {"periods": document["periods"]}),
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
        "phase at the end [s]": last["phase_s"],
        "axis at the end [rad]": last["axis"],
        "energy grows as t^": method["energy_exponent"],
        "phase as t^": method["phase_exponent"],
        "not run": method["skipped"],
    }


def _drift_words(document: Known) -> str:
    ends = [
        f"{each['name']} {each['energy'][-1]:.1e}"
        for each in document["methods"]
        if each["energy"] and each["energy"][-1] is not None
    ]
    return (
        f"{_name(document)}: errors of {len(document['methods'])} methods over "
        f"{document['periods']:g} nutation periods. Energy at the end: {', '.join(ends)}."
    )


def workprec_section(finding: Finding, ident: str) -> Section:
    """Return the section of a work–precision diagram."""
    from heavytop.report.workprec_figure import workprec_figure

    document = finding.document
    periods, budget = f"{document['periods']:g}", f"{document['budget']:g}"
    asked = ("--periods", periods, "--budget", budget)
    made = command("workprec", scene_word(document["scene"]), *asked, "-o", "out")
    names = (
        "method", "tolerance", "steps_a_period", "us_per_period", "error", "theta_error",
        "rhs_evaluations", "language",
    )  # fmt: skip
    points = [
        {name.replace("_", " "): each.get(name) for name in names} for each in document["points"]
    ]
    front = [points[_index(i, points)] for i in document["front"] or document["front_theta"]]
    picture = Picture(
        ident=f"{ident}-chart",
        title="time per nutation period over error, both logarithmic",
        alt=f"{_name(document)}: {len(points)} timed settings; {len(front)} of them are beaten by "
        f"none in both time and error: {', '.join(dict.fromkeys(p['method'] for p in front))}.",
        svg=drawn(workprec_figure(document)),
        table=_table(points, 200),
        data={name: document[name] for name in ("points", "front", "front_theta")},
        command=made,
    )
    return Section(
        ident=ident,
        heading=f"Work and precision: {_name(document)}",
        words=f"{periods} periods; every method at every setting that {budget} s sufficed for. "
        "The table is the front: what none beats in both time and error",
        source=document["scene"]["source"],
        table=_table(front, 100),
        pictures=(picture,),
        command=made,
        scene=scene_file(document["scene"], {"periods": document["periods"]}),
        notes=_left_out(document["skipped"]),
    )


def stress_section(finding: Finding, ident: str) -> Section:
    """Return the section of a stress test."""
    from heavytop.report.stress_figure import stress_figure

    document = finding.document
    runs = document["cases"]
    made = command("stress", *_chosen(document), "-o", "out")
    names = ("case", "method", "outcome", "error", "digits_lost", "note")
    rows = [{name.replace("_", " "): each[name] for name in names} for each in runs]
    counts = _counts(runs)
    picture = Picture(
        ident=f"{ident}-chart",
        title="digits lost at every case by every method",
        alt=f"Digits lost at {len(document['hard'])} cases. Outcomes: "
        + "; ".join(
            f"{row['method']}: " + ", ".join(f"{n} {word}" for word, n in row.items() if n and
                                             word != "method") for row in counts
        ) + ".",
        svg=drawn(stress_figure(document)),
        table=_table(rows, 400),
        data={"hard": document["hard"], "cases": runs},
        command=made,
    )  # fmt: skip
    return Section(
        ident=ident,
        heading="Where methods fail",
        words=f"{len(runs)} runs, each under a limit of {document['limits'].get('time_s', 0):g} s",
        table=_table(counts, 100),
        pictures=(picture,) if runs else (),
        command=made,
        notes=_left_out(document["skipped"]),
    )


def _chosen(document: Known) -> tuple[str, ...]:
    """The options that choose cases and methods; none where all were run."""
    from heavytop.stresses.cases import cases
    from heavytop.stresses.methods import METHODS

    words: list[str] = []
    for option, asked, known in (
        ("--cases", document["hard"], cases()), ("--methods", document["methods"], METHODS),
    ):  # fmt: skip
        words += [] if set(asked) >= set(known) else [option, ",".join(asked)]
    return tuple(words)


def _counts(runs: Any) -> list[dict[str, Any]]:
    """How often each method had each outcome."""
    words = list(dict.fromkeys(each["outcome"] for each in runs))
    found: dict[str, dict[str, Any]] = {}
    for each in runs:
        row = found.setdefault(
            each["method"], {"method": each["method"], **dict.fromkeys(words, 0)}
        )
        row[each["outcome"]] += 1
    return list(found.values())


def _left_out(skipped: Any) -> tuple[str, ...]:
    if not skipped:
        return ()
    reasons: dict[str, int] = {}
    for each in skipped:
        reason = str(each.get("reason", "no reason given"))[:120]
        reasons[reason] = reasons.get(reason, 0) + 1
    words = [f"{reason} ({count})" for reason, count in list(reasons.items())[:8]]
    return (f"Not run: {len(skipped)} settings. {'; '.join(words)}.",)


def _index(i: float, points: Any) -> int:
    if int(i) != i or not 0 <= i < len(points):
        raise ValueError(f"{i}: no index of a point")
    return int(i)


def _name(document: Known) -> str:
    return str(document["scene"]["title"] or document["scene"]["name"])


def _table(rows: list[dict[str, Any]], most: int = 60) -> Table:
    names = list(rows[0]) if rows else []
    return Table.of({name: [row[name] for row in rows] for name in names}, most)
