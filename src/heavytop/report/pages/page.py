"""One page of results: what folders hold, as HTML that needs nothing else, and as a document."""

from __future__ import annotations

import os
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from heavytop.errors import ForeignFile
from heavytop.files import as_json, write_text
from heavytop.machine import version
from heavytop.report.pages.markup import rendered
from heavytop.report.pages.player import tops
from heavytop.report.pages.sections import Section, section_of
from heavytop.report.parts import SYMBOLS, called, headed
from heavytop.report.studies import summary
from heavytop.results.base import typed
from heavytop.results.documents import FILES, read_document
from heavytop.spelling import harmless

SCHEMA: Final = "heavytop/report/1"
LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "matplotlib")
RAN_ON: Final = ("cpu", "python", "heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")


class LoadedResult(NamedTuple):
    """One result.

    Attributes
    ----------
    path : Path
        The file of its document.
    name : str
        What a page calls it: its path below what all of them lie in.
    document : dict
    sha256 : str
        The fingerprint of the file.
    """

    path: Path
    name: str
    document: dict[str, Any]
    sha256: str


def load_results(folders: Sequence[Path]) -> tuple[LoadedResult, ...]:
    """Return what lies in the folders, in the order of a page.

    Parameters
    ----------
    folders : sequence of Path
        Each holds results itself, or folders that do.

    Returns
    -------
    tuple of LoadedResult

    Raises
    ------
    ForeignFile
        Folders hold none, or files are not what their names promise. Every fault has a line.
    """
    faults: list[str] = []
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            found = dict.fromkeys(_within(folder))
        except OSError as fault:
            faults.append(f"{harmless(folder)}: {fault.strerror or fault}")
            continue
        if not found:
            faults.append(f"{harmless(folder)}: holds no results ({', '.join(FILES)})")
        paths |= found
    root = os.path.commonpath([path.parent.parent for path in paths]) if paths else ""
    results = []
    for path in sorted(paths, key=lambda path: list(FILES).index(path.name)):
        try:
            results.append(
                LoadedResult(path, harmless(path.relative_to(root)), *read_document(path))
            )
        except ForeignFile as fault:
            faults.append(str(fault))
    if faults:
        raise ForeignFile("\n".join(faults))
    return tuple(results)


def _within(folder: Path) -> Iterator[Path]:
    """The documents in a folder, and in those directly in it; a link keeps its name."""
    for place in (folder, *sorted(each for each in folder.iterdir() if each.is_dir())):
        for name in FILES:
            if os.path.lexists(place / name):
                yield Path(os.path.abspath(place / name))  # noqa: PTH100


@dataclass(frozen=True, slots=True)
class Page:
    """A page of results.

    Attributes
    ----------
    sections : tuple of Section
        What it says of each result.
    missing : tuple of (str, str)
        What was to be run and was not, and why.
    command : str or None
        What makes the page.
    """

    sections: tuple[Section, ...]
    missing: tuple[tuple[str, str], ...] = ()
    command: str | None = None

    @property
    def title(self) -> str:
        """The heading of its section, where there is but one; else how many there are."""
        if len(self.sections) == 1:
            return self.sections[0].heading
        return f"{len(self.sections)} results"

    @property
    def contents(self) -> dict[str, list[Section]]:
        """The sections by the titles of their scenes; "All tops" for those about none."""
        found: dict[str, list[Section]] = {}
        for section in self.sections:
            title = called({"scene": section.scene}) if section.scene else "All tops"
            found.setdefault(title, []).append(section)
        return found

    @property
    def verdicts(self) -> list[tuple[Section, str, list[str]]]:
        """Of every validation how many claims hold, and which fail."""
        return [
            (each, summary(claims), [claim["id"] for claim in claims if claim["passed"] is False])
            for each in self.sections
            if (claims := each.result.document.get("claims")) is not None
        ]

    @property
    def machine(self) -> list[str]:
        """The processor and the programs that the results name."""
        named = [section.result.document.get("versions") or {} for section in self.sections]
        found = {name: dict.fromkeys(filter(None, (v.get(name) for v in named))) for name in RAN_ON}
        return [f"{name} {' and '.join(some)}" for name, some in found.items() if some]

    def html(self) -> str:
        """The page: one file, which asks no network for anything."""
        played = [{**each.top, "title": each.heading} for each in self.sections
                  if each.top is not None]  # fmt: skip
        return rendered(
            "page.html",
            page=self,
            tops=tops(played) if played else None,
            headings={name: headed(name) for name in SYMBOLS},
            versions={name: version(name) for name in LIBRARIES},
        )

    def json(self, files: Mapping[str, str] | None = None) -> str:
        """The document as a text.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that are written, by what they are.
        """
        return as_json(self.document(files))

    def document(self, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/report/1.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that are written, by what they are.
        """
        return {
            "schema": SCHEMA,
            "command": self.command,
            "results": [section.document() for section in self.sections],
            "missing": [{"study": name, "reason": why} for name, why in self.missing],
            "files": dict(files or {}),
            "versions": {name: version(name) for name in LIBRARIES},
        }


def page_of(results: Sequence[LoadedResult], *, missing: Sequence[tuple[str, str]] = ()) -> Page:
    """Return the page of what folders hold.

    Parameters
    ----------
    results : sequence of LoadedResult
        As `load_results` returns them.
    missing : sequence of (str, str)
        What was to be run and was not, and why.

    Returns
    -------
    Page

    Raises
    ------
    ForeignFile
        A result is not what was written; the message names its file.
    """
    sections = list(_sections(results))
    counts = Counter(section.heading for section in sections)
    apart = (  # of the same heading: with their files
        each if counts[each.heading] == 1
        else replace(each, heading=f"{each.heading} ({each.result.name})")
        for each in sections
    )  # fmt: skip
    return Page(tuple(apart), tuple(missing), typed())


def _sections(results: Sequence[LoadedResult]) -> Iterator[Section]:
    counts: Counter[str] = Counter()
    for result in results:
        counts[result.path.name] += 1
        try:
            with warnings.catch_warnings():
                for kind in (RuntimeWarning, UserWarning):  # of numbers that no picture can show
                    warnings.simplefilter("ignore", kind)
                yield section_of(result, counts[result.path.name])
        except ForeignFile:
            raise
        except (LookupError, TypeError, ValueError, ArithmeticError, RuntimeError) as fault:
            why = harmless(f"{type(fault).__name__}: {fault}")[:200]
            raise ForeignFile(f"{harmless(result.path)}: not what was written ({why})") from fault


def write_page(page: Page, html: Path) -> dict[str, str]:
    """Write a page, and its document beside it, each whole or not at all.

    Parameters
    ----------
    page : Page
        What is written.
    html : Path
        The file of the page; the document's ends in ``.json``.

    Returns
    -------
    dict from str to str
        The names of the files, by what they are.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    files = {"page": html.name, "document": html.with_suffix(".json").name}
    text = page.html()
    write_text(html.with_name(files["document"]), page.json(files) + "\n")
    write_text(html, text)
    return files
