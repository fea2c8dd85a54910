"""A stress test on the page: where methods fail, and what the words for it mean."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from heavytop.report.pages.commands import changed, command, folder
from heavytop.report.pages.descriptions import NOTHING, left_out
from heavytop.report.pages.section import Picture, Section, drawn
from heavytop.report.pages.tables import Table

if TYPE_CHECKING:
    from heavytop.report.pages.findings import Finding

Known = Mapping[str, Any]

FEW: Final = 20  # cases, of which it is said why each is hard


def stress_section(finding: Finding, ident: str) -> Section:
    """Return the section of a stress test."""
    document = finding.document
    runs = document["cases"]
    made = command("stress", *_chosen(document), *_limits(document["limits"]), *folder(ident))
    counts = _counts(runs, document["skipped"])
    return Section(
        ident=ident,
        heading="Where methods fail",
        words=f"{len(runs)} runs, each under a limit of {document['limits'].get('time_s', 0):g} s. "
        "Digits lost are those beyond what the conditioning of the motion allows",
        facts=tuple(document["hard"].items()) if len(document["hard"]) <= FEW else (),
        table=Table.of_rows(counts, 100),
        pictures=(_picture(document, ident, made, counts),) if runs else (),
        command=made,
        notes=(_outcomes(runs) or NOTHING, *left_out(document["skipped"])),
    )


def _picture(document: Known, ident: str, made: str, counts: Sequence[Known]) -> Picture:
    from heavytop.plots.stress import stress_figure

    names = ("case", "method", "outcome", "error", "digits_lost", "note")
    rows = [{name.replace("_", " "): each[name] for name in names} for each in document["cases"]]
    ended = "; ".join(f"{row['method']}: {_ended(row)}" for row in counts)
    return Picture(
        ident=f"{ident}-chart",
        title="digits lost at every case by every method",
        alt=f"Digits lost at {len(document['hard'])} cases. Outcomes: {ended}.",
        svg=drawn(stress_figure(document)),
        table=Table.of_rows(rows, 400, digits=2),
        data={"hard": document["hard"], "cases": document["cases"]},
        command=made,
        listed="cases",
    )


def _ended(row: Known) -> str:
    """How often the runs of a method ended in which way."""
    return ", ".join(f"{n} {word}" for word, n in row.items() if n and word != "method")


def _outcomes(runs: Any) -> str:
    """What the words mean with which runs ended."""
    from heavytop.studies.stress import RULES

    ended = {each["outcome"] for each in runs}
    return " ".join(f"{word}: {rule}." for word, rule in RULES.items() if word in ended)


def _chosen(document: Known) -> tuple[str, ...]:
    """The options that choose cases and methods; none where all were run."""
    from heavytop.studies.methods import stress_methods
    from heavytop.studies.stress_cases import cases

    words: list[str] = []
    for option, asked, known in (
        ("--cases", document["hard"], cases()),
        ("--methods", document["methods"], stress_methods()),
    ):
        words += [] if set(asked) >= set(known) else [option, ",".join(asked)]
    return tuple(words)


def _limits(limits: Known) -> Iterator[str]:
    """The options that bound a test; none where it had the usual bounds."""
    from heavytop.studies.stress import BUDGET_S, STEPS, TIME_S

    return changed({
        "--time-limit": (limits.get("time_s"), TIME_S),
        "--step-limit": (limits.get("steps"), STEPS),
        "--budget": (limits.get("budget_s"), BUDGET_S),
    })  # fmt: skip


def _counts(runs: Any, skipped: Any) -> list[dict[str, Any]]:
    """How often each method had each outcome, and how often it was not run."""
    ended = [(each["method"], each["outcome"]) for each in runs]
    ended += [(each["method"], "not run") for each in skipped]
    words = dict.fromkeys(word for _, word in ended)
    found: dict[str, dict[str, Any]] = {}
    for method, word in ended:
        row = found.setdefault(method, {"method": method, **dict.fromkeys(words, 0)})
        row[word] += 1
    return list(found.values())
