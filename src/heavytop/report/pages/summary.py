"""The head of a page: what was run, on which scenes and machine, and how many claims hold."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from heavytop.report.pages.claims import verdicts
from heavytop.report.pages.descriptions import called
from heavytop.report.pages.tables import amount, cell

if TYPE_CHECKING:
    from heavytop.report.pages.findings import Finding
    from heavytop.report.pages.section import Section

Results = Sequence[tuple["Finding", "Section"]]
Known = Mapping[str, Any]

WORDS: Final = {
    "run": "run",
    "traces": "every kind of motion",
    "drift": "drift",
    "workprec": "work and precision",
    "stress": "where methods fail",
    "atlas": "atlas",
    "energy-momentum": "energy and momentum",
    "validate": "claims",
}
"""What a result is called in a list, by its schema."""
CLAIMS: Final = "validate"
NO_SCENE: Final = ("traces", "stress", CLAIMS)
RAN_ON: Final = {
    "cpu": "", "python": "Python ", "heavytop": "heavytop ", "heyoka": "heyoka ",
    "numpy": "numpy ", "scipy": "scipy ", "numba": "numba ", "CyRK": "CyRK ",
}  # fmt: skip
"""What of the machine is named, and the word before it."""
SAME: Final = ("name", "title", "source", "top", "start")  # of two results about one scene


class Link(NamedTuple):
    """A result: its place on the page, and what it is called."""

    ident: str
    words: str


@dataclass(frozen=True, slots=True)
class About:
    """A scene, and the results about it."""

    title: str
    source: str
    links: tuple[Link, ...]


class Verdicts(NamedTuple):
    """The claims of a validation: how many hold, which fail, and how many were skipped."""

    ident: str
    hold: int
    failing: tuple[str, ...]
    skipped: int

    @property
    def words(self) -> str:
        """The counts."""
        return verdicts(self.hold, len(self.failing), self.skipped)


@dataclass(frozen=True, slots=True)
class Summary:
    """The head of a page.

    Attributes
    ----------
    title : str
        The scene, where there is but one; else how much there is.
    scenes : tuple of About
        The scenes, in the order of the page.
    others : tuple of Link
        The results that are about no scene.
    claims : tuple of Verdicts
        One for each validation.
    machine : tuple of str
        The processor and the programs that the results name.
    processor : bool
        Whether they name a processor.
    """

    title: str
    scenes: tuple[About, ...]
    others: tuple[Link, ...]
    claims: tuple[Verdicts, ...]
    machine: tuple[str, ...]
    processor: bool


def summary_of(results: Results) -> Summary:
    """The head of the page of these results."""
    scenes = tuple(_scenes(results))
    others = tuple(_links([each for each in results if _study(each[0]) in NO_SCENE]))
    ran_on = _machine(finding.document for finding, _ in results)
    return Summary(
        title=_title(scenes, others, len(results)),
        scenes=scenes,
        others=others,
        claims=tuple(_verdicts(*each) for each in results if _study(each[0]) == CLAIMS),
        machine=tuple(RAN_ON[name] + " and ".join(each) for name, each in ran_on.items() if each),
        processor=bool(ran_on["cpu"]),
    )


def _title(scenes: Sequence[About], others: Sequence[Link], count: int) -> str:
    """The scene, where there is but one; else how much there is."""
    if len(scenes) == 1:
        return scenes[0].title
    if len(scenes) + len(others) == 1:
        return others[0].words
    results = amount(count, "result")
    return f"{results} about {len(scenes)} scenes" if scenes else results


def _study(finding: Finding) -> str:
    """The name of a study: what is between the strokes of its schema."""
    return finding.schema.split("/")[1]


def _scenes(results: Results) -> Iterator[About]:
    of: dict[str, list[tuple[Finding, Section]]] = {}
    for each in results:
        if _study(each[0]) not in NO_SCENE:
            scene = each[0].document["scene"]
            of.setdefault(json.dumps([scene.get(k) for k in SAME], sort_keys=True), []).append(each)
    titles = Counter(called(some[0][0].document) for some in of.values())
    for some in of.values():
        first = some[0][0]
        title = called(first.document)
        words = cell(title) if titles[title] == 1 else f"{cell(title)} ({first.name})"
        yield About(words, first.document["scene"]["source"], tuple(_links(some)))


def _links(results: Results) -> Iterator[Link]:
    """The results by what they are called; those of one name with the names of their files."""
    counts = Counter(_study(finding) for finding, _ in results)
    for finding, section in results:
        words = WORDS[_study(finding)]
        one = counts[_study(finding)] == 1
        yield Link(section.ident, words if one else f"{words} ({finding.name})")


def _verdicts(finding: Finding, section: Section) -> Verdicts:
    claims = finding.document["claims"]
    passed = [each["passed"] for each in claims]
    failing = tuple(cell(each["id"]) for each in claims if each["passed"] is False)
    return Verdicts(section.ident, passed.count(True), failing, passed.count(None))


def _machine(documents: Iterable[Known]) -> dict[str, dict[str, None]]:
    """The processor, then the programs with their numbers; of results of several, all of them."""
    found: dict[str, dict[str, None]] = {name: {} for name in RAN_ON}
    for document in documents:
        versions: Known = document.get("versions") or {}
        for name in RAN_ON:
            if isinstance(versions.get(name), str):
                found[name][cell(versions[name])] = None
    return found
