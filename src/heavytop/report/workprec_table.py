"""A work–precision document as tables for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import MISSING, title, two_columns

TARGETS: Final = ("1e-6", "1e-9", "1e-12")
HEADINGS: Final = (
    "method", *TARGETS, "best", "at", "evaluations", "setup [s]", "right-hand side in",
)  # fmt: skip
Known = Mapping[str, Any]


def workprec_table(document: Known) -> Group:
    """The tables of one work–precision diagram.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/workprec/1``.

    Returns
    -------
    rich.console.Group
        Title, what was asked, a row for each method, the front, who is cheapest, what was skipped
        and why.
    """
    return Group(*_parts(document))


def _parts(document: Known) -> Iterator[RenderableType]:
    yield title(document["scene"])
    yield two_columns(_asked(document))
    yield Text()
    yield _methods(document["points"])
    for name, words in (("front", "front"), ("front_theta", "front in θ alone")):
        if document[name] and not (name == "front_theta" and _same(document)):
            yield Text()
            yield _front(words, [document["points"][i] for i in document[name]])
    yield Text()
    yield two_columns(_cheapest(document))
    if notes := [*_auto(document), *_skipped(document["skipped"])]:
        yield Text()
        yield two_columns(notes)
    if document["files"]:
        yield two_columns([("files", ", ".join(map(str, document["files"].values())))])


def _same(document: Known) -> bool:
    """Whether no point measures an axis: the front is that of θ already."""
    return all(point["measures"] == "theta" for point in document["points"])


def _asked(document: Known) -> Iterator[tuple[str, str]]:
    yield "runs", f"{document['periods']:g} nutation periods, all methods in turn in one process"
    yield "times", "µs per period, the best run; deriving and compiling apart, in seconds"
    yield "errors", "of the axis, or of θ (marked θ) where the states do not give the axis"


def _methods(points: Sequence[Known]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="cyan")
    for heading in HEADINGS:
        left = heading in (HEADINGS[0], HEADINGS[-1])
        table.add_column(Text(heading), justify="left" if left else "right")
    for row in summaries(points):
        table.add_row(*row)
    return table


def summaries(points: Sequence[Known]) -> Iterator[tuple[str, ...]]:
    """A row of texts for each method, as `HEADINGS` says.

    Parameters
    ----------
    points : sequence of mapping
        Those of a document of the schema ``heavytop/workprec/1``.
    """
    for of_method in _by_method(points):
        best = min(of_method, key=lambda point: point["error"])
        times = (_time(_within(of_method, float(target))) for target in TARGETS)
        each = best["rhs_evaluations"] / best["periods"]
        setup = max(point["setup_s"] for point in of_method)
        yield (
            best["method"], *times, _error(best), _time(best), f"{each:.3g}", f"{setup:.2g}",
            best["language"],
        )  # fmt: skip


def _by_method(points: Iterable[Known]) -> list[list[Known]]:
    found: dict[tuple[str, str], list[Known]] = {}
    for point in points:
        found.setdefault((point["method"], point["measures"]), []).append(point)
    return list(found.values())


def _within(points: Sequence[Known], bound: float) -> Known | None:
    met = [point for point in points if point["error"] <= bound]
    return min(met, key=lambda point: point["us_per_period"], default=None)


def _time(point: Known | None) -> str:
    return MISSING if point is None else f"{point['us_per_period']:.3g}"


def _error(point: Known) -> str:
    return f"{point['error']:.1e}{' θ' if point['measures'] == 'theta' else '  '}"


def _front(words: str, points: Sequence[Known]) -> Table:
    table = Table(box=None, pad_edge=False, header_style="cyan")
    table.add_column(words)
    for heading in ("setting", "µs/period", "error"):
        table.add_column(heading, justify="right")
    for point in points:
        off = point["theta_error"] if "θ" in words else point["error"]
        table.add_row(point["method"], setting(point), _time(point), f"{off:.1e}")
    return table


def setting(point: Known) -> str:
    """The setting of a point in words."""
    if point["tolerance"] is not None:
        return f"{point['tolerance']:.2g}"
    return f"{point['steps_a_period']:g} steps a period"


def _cheapest(document: Known) -> Iterator[tuple[str, str]]:
    for label, name in (("cheapest", "cheapest"), ("cheapest, θ alone", "cheapest_theta")):
        for target, found in document[name].items():
            words = {"best": "best", "best_in_doubles": "best in doubles"}.get(target, target)
            yield f"{label}: {words}", MISSING if found is None else _told(found)


def _told(found: Known) -> str:
    words = f"{found['method']} ({setting(found)}), {found['us_per_period']:.3g} µs"
    words += f", error {found['error']:.1e}"
    if (other := found.get("against")) is None:
        return words
    who = "the best rival" if other["rival"] else "the Taylor integrator's best"
    return f"{words}; {who}, {other['method']} ({setting(other)}), takes {found['ratio']:.2f} times"


def _auto(document: Known) -> Iterator[tuple[str, str]]:
    for each in document["auto"]:
        point = document["points"][each["point"]]
        stands = f"{each['digits']} digits of {each['wants']}: {point['stands_for']}"
        ahead = f"; ahead of it: {', '.join(each['ahead'])}" if each["ahead"] else ""
        yield "auto", f"{stands}, {_time(point)} µs{ahead or '; nothing is ahead of it'}"


def _skipped(skipped: Iterable[Known]) -> Iterator[tuple[str, str]]:
    for each in skipped:
        [(what, value)] = each["setting"].items()
        yield each["method"], f"skipped at {value:.3g} ({what}): {each['reason']}"
