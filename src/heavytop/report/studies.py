"""A drift study, as facts and a table."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from heavytop.report.parts import MISSING, FactRows, Known, Part, Table, files, number

HEAD: Final = ("method", "µs/\nperiod", "energy", "as t^", "phase\n[s]", "as t^", "axis")


def drift_parts(document: Known) -> Iterator[Part]:
    """What was asked, the errors of every method at the last time, what was skipped and why."""
    done = [each for each in document["methods"] if each["skipped"] is None]
    yield FactRows.of(_asked(document))
    yield Table(HEAD, tuple(map(_row, done)))
    if notes := [*_notes(document), *files(document)]:
        yield FactRows.of(notes)


def _asked(document: Known) -> Iterator[tuple[str, str]]:
    count = document["ensemble"]
    several = f"{count} starts within {document['spread']:.0%} (seed {document['seed']}), RMS"
    starts = "its own start" if count == 1 else several
    yield "drift", f"{document['periods']:g} nutation periods, {starts}"
    yield "errors", "at the last time; energy relative to max(|E'|, gMR)"
    yield "as t^", "grows as this power of time, with its standard error: 1.40(2) means 1.40 ± 0.02"
    yield "lost", "a phase that is off by more than a twentieth of a period"


def _row(method: Known) -> tuple[str, ...]:
    lost = method["periods"] and method["phase_s"][-1] is None
    return (
        method["name"],
        number(method.get("us_per_period"), 3),
        last(method["energy"]),
        _power(method, "energy"),
        "lost" if lost else last(method["phase_s"]),
        _power(method, "phase"),
        last(method["axis"]),
    )


def last(values: list[float | None]) -> str:
    """The last of the errors of a method."""
    return f"{values[-1]:.1e}" if values and values[-1] is not None else MISSING


def _power(method: Known, name: str) -> str:
    """An exponent as physicists write it: 1.40(2) is 1.40 ± 0.02."""
    exponent, error = method[f"{name}_exponent"], method["stderr"].get(name)
    if exponent is None:
        return MISSING
    hundredths = max(1, round(100 * (error or 0)))
    return f"{exponent:.2f}({hundredths})" if hundredths < 100 else f"{exponent:.0f}({error:.0f})"


def _notes(document: Known) -> Iterator[tuple[str, str]]:
    for each in document["methods"]:
        if each["skipped"] is not None:
            yield each["name"], f"skipped: {each['skipped']}"
        elif each["periods"] and each["periods"][-1] < 0.5 * document["periods"]:
            yield each["name"], f"to {each['periods'][-1]:.4g} periods"
        for start, why in each["ended"].items():
            yield each["name"], f"start {start} ended early: {why}"
