"""A work–precision diagram, as facts and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from heavytop.report.parts import MISSING, FactRows, Known, Part, Table, files, grouped

TARGETS: Final = ("1e-6", "1e-9", "1e-12")
HEAD: Final = ("method", *TARGETS, "best", "at", "setup")
BESTS: Final = {"best": ", best", "best_in_doubles": ", best in doubles"}
NO_TIME: Final = "not begun: no time was left for it"


def work_precision_parts(document: Known) -> Iterator[Part]:
    """A row for each method, the fronts, who is cheapest, what auto did, what was left out."""
    points = document["points"]
    theta_alone = all(point["measures"] == "theta" for point in points)
    yield FactRows((
        ("runs", f"{document['periods']:g} nutation periods, all methods in turn in one process"),
        ("times", "µs per period at an error of so much, the best run; setup [s]"),
        ("errors", "of the axis; θ marks those of θ, of states that do not give the axis"),
    ))  # fmt: skip
    yield Table(HEAD, tuple(map(_row, summaries(points))))
    if document["front"]:
        yield _front("front", "error", [points[i] for i in document["front"]])
    if document["front_theta"] and not theta_alone:
        some = [points[i] for i in document["front_theta"]]
        yield _front("front in θ alone", "theta_error", some)
    sides = {"θ": "cheapest"} if theta_alone else {"axis": "cheapest", "θ alone": "cheapest_theta"}
    yield FactRows.of(
        (f"{label}{BESTS.get(target, f' to {target}')}", _leader(found))
        for label, name in sides.items()
        for target, found in document[name].items()
    )
    if said := [*_auto(document), *_left_out(document), *files(document)]:
        yield FactRows.of(said)


class Summary(NamedTuple):
    """A method at its cheapest within each of `TARGETS`, and at its best.

    Attributes
    ----------
    name : str
        Of auto, with what was asked.
    within : tuple of mapping or None
    best : mapping
    setup_s : float
        The longest of all its settings [s].
    """

    name: str
    within: tuple[Known | None, ...]
    best: Known
    setup_s: float


def summaries(points: Sequence[Known]) -> Iterator[Summary]:
    """A summary for each method, and for each choice of auto.

    Parameters
    ----------
    points : sequence of mapping
        Those of a document of the schema ``heavytop/workprec/1``.
    """
    for same in grouped(points, "method", "measures", "stands_for", "wants").values():
        yield Summary(
            _name(same),
            tuple(_within(same, float(target)) for target in TARGETS),
            min(same, key=lambda point: point["error"]),
            max(point["setup_s"] for point in same),
        )


def _name(points: Sequence[Known]) -> str:
    """The method; of auto with what was asked, as ``auto, 6, 9, 12 of axis``."""
    if points[0]["digits"] is None:
        return str(points[0]["method"])
    sign = "θ" if points[0]["wants"] == "theta" else "axis"
    return f"auto, {', '.join(str(point['digits']) for point in points)} of {sign}"


def _within(points: Sequence[Known], bound: float) -> Known | None:
    met = [point for point in points if point["error"] <= bound]
    return min(met, key=lambda point: point["us_per_period"], default=None)


def _row(of: Summary) -> tuple[str, ...]:
    within = [MISSING if point is None else time(point) for point in of.within]
    return of.name, *within, error(of.best), time(of.best), f"{of.setup_s:.2g}"


def _front(name: str, measured: str, points: Sequence[Known]) -> Table:
    rows = ((who(p), setting(p), time(p), f"{p[measured]:.1e}") for p in points)
    return Table((name, "setting", "µs/period", "error"), tuple(rows))


def time(point: Known) -> str:
    """The time of a period to three digits [µs], without an exponent."""
    rounded = f"{point['us_per_period']:.3g}"
    return f"{float(rounded):.0f}" if "e" in rounded else rounded


def error(point: Known) -> str:
    """The error of a point, marked where it is that of θ."""
    return f"{point['error']:.1e}{' θ' if point['measures'] == 'theta' else '  '}"


def who(point: Known) -> str:
    """The name of a method, and of auto the method that it chose."""
    return str(point["stands_for"] or point["method"])


def setting(point: Known) -> str:
    """The setting of a point in words."""
    if point["tolerance"] is not None:
        return f"{point['tolerance']:.2g}"
    return f"{point['steps_a_period']:g} steps a period"


def _leader(found: Known | None) -> str:
    """Who is cheapest, and who of the other side comes next."""
    if found is None:
        return MISSING
    words = f"{who(found)} ({setting(found)}), {time(found)} µs, error {found['error']:.1e}"
    if (other := found.get("against")) is None:
        return words
    whose = "the best rival" if other["rival"] else "the Taylor integrator's best"
    return f"{words}; {whose}, {who(other)} ({setting(other)}), takes {found['ratio']:.3g} times"


def _auto(document: Known) -> Iterator[tuple[str, str]]:
    """What auto chose, a line for each choice; what misses the digits asked comes by itself."""
    chosen = [
        {**document["points"][each["point"]], **each, "first": ", ".join(each["ahead"])}
        for each in document["auto"]
    ]
    for same in grouped(chosen, "stands_for", "wants", "missed", "first").values():
        first = same[0]
        words = f"{', '.join(str(each['digits']) for each in same)} digits of {first['wants']}: "
        words += f"{first['stands_for']}, {time(first)} µs, error {first['error']:.1e}"
        missed = ", which MISSES what was asked" if first["missed"] else ""
        ahead = f"ahead of it: {first['first']}" if first["ahead"] else "nothing is ahead of it"
        yield "auto", f"{words}{missed}; {ahead}"


def _left_out(document: Known) -> Iterator[tuple[str, str]]:
    """What was left out: in one line all for which no time was left, then line by line."""
    rivals = document["rivals"]
    if rivals["left_out"] and not rivals["run"]:
        yield "rivals", "NO RIVAL WAS RUN: nothing here compares with other methods"
    elif rivals["left_out"]:
        yield "rivals", f"only these were run: {', '.join(rivals['run'])}"
    begun = [point["method"] for point in document["points"]]
    hurried, others = [], []
    for (name,), same in grouped(document["skipped"], "method").items():
        share = f"{len(same)} of {len(same) + begun.count(name)}" if name in begun else "all"
        if all(each["reason"].startswith(NO_TIME) for each in same):
            hurried.append(f"{name} ({share})")
        else:
            others.append((name, f"{share} settings left out: {_reasons(same)}"))
    if hurried:
        budget = f"{document['budget']:g} s"
        yield "no time left", f"{', '.join(hurried)} settings, in a budget of {budget}"
    yield from others


def _reasons(skipped: Sequence[Known]) -> str:
    """Each reason once, with the first setting that it stopped."""
    first: dict[str, str] = {}
    for each in skipped:
        [(what, value)] = each["setting"].items()
        at = f"{value:.3g} {what}" if what != "tolerance" else f"{value:.3g}"
        first.setdefault(each["reason"], at)
    return "; ".join(f"{reason} (at {at})" for reason, at in first.items())
