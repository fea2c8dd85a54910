"""A work–precision document as tables for reading; it knows nothing but the document."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from heavytop.report.rows import MISSING, grid, title, two_columns
from heavytop.report.workprec_notes import notes
from heavytop.report.workprec_rows import TARGETS, Known, error, setting, summaries, time, who

HEADINGS: Final = ("method", *TARGETS, "best", "at", "setup")
BESTS: Final = {"best": ", best", "best_in_doubles": ", best in doubles"}


def workprec_table(document: Known) -> Group:
    """The tables of one work–precision diagram.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/workprec/1``.

    Returns
    -------
    rich.console.Group
        Title, what was asked, a row for each method, the front, who is cheapest, what auto did,
        what was left out and why.
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
    if said := [*notes(document)]:
        yield Text()
        yield two_columns(said)
    if document["files"]:
        yield two_columns([("files", ", ".join(map(str, document["files"].values())))])


def _same(document: Known) -> bool:
    """Whether no point measures an axis: the front is that of θ already."""
    return all(point["measures"] == "theta" for point in document["points"])


def _asked(document: Known) -> Iterator[tuple[str, str]]:
    yield "runs", f"{document['periods']:g} nutation periods, all methods in turn in one process"
    yield "times", "µs per period at an error of so much, the best run; setup [s]"
    yield "errors", "of the axis; θ marks those of θ, of states that do not give the axis"


def _methods(points: Sequence[Known]) -> Table:
    table = grid(HEADINGS)
    for row in summaries(points):
        within = [MISSING if point is None else time(point) for point in row.within]
        table.add_row(row.name, *within, error(row.best), time(row.best), f"{row.setup_s:.2g}")
    return table


def _front(words: str, points: Sequence[Known]) -> Table:
    table = grid((words, "setting", "µs/period", "error"))
    for point in points:
        off = point["theta_error"] if "θ" in words else point["error"]
        table.add_row(who(point), setting(point), time(point), f"{off:.1e}")
    return table


def _cheapest(document: Known) -> Iterator[tuple[str, str]]:
    sides = [("θ", "cheapest")] if _same(document) else [
        ("axis", "cheapest"), ("θ alone", "cheapest_theta")
    ]  # fmt: skip
    for label, name in sides:
        for target, found in document[name].items():
            words = f"{label}{BESTS.get(target, f' to {target}')}"
            yield words, MISSING if found is None else _told(found)


def _told(found: Known) -> str:
    words = f"{who(found)} ({setting(found)}), {time(found)} µs"
    words += f", error {found['error']:.1e}"
    if (other := found.get("against")) is None:
        return words
    whose = "the best rival" if other["rival"] else "the Taylor integrator's best"
    return f"{words}; {whose}, {who(other)} ({setting(other)}), takes {found['ratio']:.3g} times"
