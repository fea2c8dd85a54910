"""What a work–precision table says in words: what auto did, and what was left out and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from heavytop.report.workprec_rows import Known, grouped, time

NO_TIME: Final = "not begun: no time was left for it"


def notes(document: Known) -> Iterator[tuple[str, str]]:
    """Labels and sentences.

    Parameters
    ----------
    document : mapping
        A document of the schema ``heavytop/workprec/1``.
    """
    yield from _auto(document)
    yield from _left_out(document)


def _auto(document: Known) -> Iterator[tuple[str, str]]:
    """What auto chose, a line for each choice; what misses the digits asked comes by itself."""
    chosen = [document["points"][each["point"]] | each for each in document["auto"]]
    for same in grouped(chosen, lambda p: (p["stands_for"], p["wants"], p["missed"], *p["ahead"])):
        first = same[0]
        digits = ", ".join(str(each["digits"]) for each in same)
        off = first["theta_error"] if first["wants"] == "theta" else first["error"]
        words = f"{digits} digits of {first['wants']}: {first['stands_for']}, {time(first)} µs"
        words += f", error {off:.1e}"
        if first["missed"]:
            words += ", which MISSES what was asked"
        yield "auto", f"{words}; {_ahead(first['ahead'])}"


def _ahead(names: Sequence[str]) -> str:
    return f"ahead of it: {', '.join(names)}" if names else "nothing is ahead of it"


def _left_out(document: Known) -> Iterator[tuple[str, str]]:
    """Say what was left out: in one line all for which no time was left, then line by line."""
    rivals = document["rivals"]
    if rivals["left_out"] and not rivals["run"]:
        yield "rivals", "NO RIVAL WAS RUN: nothing here compares with other methods"
    elif rivals["left_out"]:
        yield "rivals", f"only these were run: {', '.join(rivals['run'])}"
    begun = [point["method"] for point in document["points"]]
    hurried, others = [], []
    for same in grouped(document["skipped"], lambda each: each["method"]):
        name, n = same[0]["method"], len(same)
        share = f"{n} of {n + begun.count(name)} settings" if name in begun else "all settings"
        if all(each["reason"].startswith(NO_TIME) for each in same):
            hurried.append(f"{name} ({share.removesuffix(' settings')})")
        else:
            others.append((str(name), f"{share} left out: {_reasons(same)}"))
    if hurried:
        yield "no time left", f"{', '.join(hurried)} settings, in a budget of {_budget(document)}"
    yield from others


def _budget(document: Known) -> str:
    return f"{document['budget']:g} s"


def _reasons(skipped: Sequence[Known]) -> str:
    """Each reason once, with the first setting that it stopped."""
    first: dict[str, str] = {}
    for each in skipped:
        [(what, value)] = each["setting"].items()
        at = f"{value:.3g} {what}" if what != "tolerance" else f"{value:.3g}"
        first.setdefault(each["reason"], at)
    return "; ".join(f"{reason} (at {at})" for reason, at in first.items())
