"""One page of results: its sections, as HTML that needs nothing else, and as a document."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from heavytop.errors import ForeignFile
from heavytop.files import as_json, write_text, write_whole
from heavytop.machine import version
from heavytop.report.pages.contents import contents
from heavytop.report.pages.markup import allowed, library, script_data, template
from heavytop.report.pages.summary import summary_of

if TYPE_CHECKING:
    from heavytop.report.pages.findings import Finding, Found
    from heavytop.report.pages.section import Section

SCHEMA: Final = "heavytop/report/1"
MOST_BYTES: Final = 32 * 2**20  # of a page, or its document: with the library that draws, and
MOST_OF_RESULT: Final = 4 * 2**20  # for each result with its pictures, and
MOST_OF_BYTE: Final = 12  # for each byte of a document: a digit on a line of its own
LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "matplotlib", "plotly")


@dataclass(frozen=True, slots=True)
class Page:
    """A page of results.

    Attributes
    ----------
    results : tuple of (Finding, Section)
        What was found, and what the page says of it.
    missing : tuple of (str, str)
        What was to be run and was not, and why.
    command : str
        What makes the page.
    """

    results: tuple[tuple[Finding, Section], ...]
    missing: tuple[tuple[str, str], ...] = ()
    command: str = "heavytop report"

    @property
    def sections(self) -> tuple[Section, ...]:
        """What the page says, in its order."""
        return tuple(section for _, section in self.results)

    @property
    def tops(self) -> list[Mapping[str, Any]]:
        """What the player plays."""
        return [section.top for section in self.sections if section.top is not None]

    @property
    def turns(self) -> bool:
        """Whether anything on it can be turned."""
        pictures = (picture for section in self.sections for picture in section.pictures)
        return bool(self.tops) or any(picture.turns for picture in pictures)

    def html(self) -> str:
        """The page: one file, which asks no network for anything.

        Raises
        ------
        ForeignFile
            It is out of all proportion to what it is made of.
        """
        from jinja2 import Environment, PackageLoader, StrictUndefined
        from markupsafe import Markup

        jinja = Environment(
            loader=PackageLoader("heavytop.report.pages"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        plotly = Markup(library()) if self.turns else Markup()
        own = ("page.css", "player.js", "save.js", "turn.js")
        source = {name.replace(".", "_"): Markup(template(name)) for name in own}
        text = jinja.get_template("page.html").render(
            page=self,
            summary=summary_of(self.results),
            sections=self.sections,
            tops=self.tops,
            plotly=plotly,
            allowed=allowed(plotly, *source.values()),
            data=script_data,
            versions={name: version(name) for name in LIBRARIES},
            **source,
        )
        return self._in_proportion(text)

    def json(self, files: Mapping[str, str] | None = None) -> str:
        """The document as a text.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that are written, by what they are.

        Raises
        ------
        ForeignFile
            As for `html`.
        """
        return self._in_proportion(as_json(self.document(files=files)))

    def _in_proportion(self, text: str) -> str:
        sizes = [finding.size for finding, _ in self.results]
        most = MOST_BYTES + len(sizes) * MOST_OF_RESULT + MOST_OF_BYTE * sum(sizes)
        if len(text) > most:
            size, files = len(text) >> 20, sum(sizes) / 2**20
            raise ForeignFile(f"a page of {size} MB for {files:.1f} MB of documents: not made")
        return text

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/report/1.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that are written, by what they are.
        """
        return {
            "schema": SCHEMA,
            "command": self.command,
            "results": [_told(finding, section) for finding, section in self.results],
            "figures": [
                {"id": p.ident, "title": p.title, "alt": p.alt, "command": p.command,
                 "data": p.data} for section in self.sections for p in section.pictures
            ],
            "missing": [{"study": name, "reason": why} for name, why in self.missing],
            "files": dict(files or {}),
            "versions": {name: version(name) for name in LIBRARIES},
        }  # fmt: skip


def page_of(
    found: Found,
    *,
    missing: Sequence[tuple[str, str]] = (),
    command: str = "heavytop report",
) -> Page:
    """Return the page of what folders hold.

    Parameters
    ----------
    found : Found
        As `heavytop.report.pages.findings.findings` returns it.
    missing : sequence of (str, str)
        What was to be run and was not, and why.
    command : str
        What makes the page.

    Returns
    -------
    Page

    Raises
    ------
    ForeignFile
        A result is not what was written; the message names its file.
    """
    return Page(contents(found.results), (*missing, *found.again), command)


def write_page(page: Page, html: Path) -> dict[str, str]:
    """Write a page, and its document beside it.

    Where one of them cannot be written, neither is: a document that was there before stays.

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
    ForeignFile
        The page is out of all proportion to what it is made of.
    OSError
        A file cannot be written.
    """
    files = {"page": html.name, "document": html.with_suffix(".json").name}
    texts = page.html(), page.json(files) + "\n"
    document = html.with_name(files["document"])
    before = document.read_bytes() if document.is_file() else None

    def both(part: Path) -> None:
        with part.open("w", encoding="utf-8") as file:
            file.write(texts[0])
            file.flush()
            os.fsync(file.fileno())  # a full disk says so before the document is in its place
        write_text(document, texts[1])

    try:
        write_whole(html, both)
    except BaseException:
        _put_back(document, before)
        raise
    return files


def _put_back(path: Path, data: bytes | None) -> None:
    """Let a file be what it was, None where there was none, as far as that can be."""
    with suppress(OSError):
        if data is None:
            path.unlink(missing_ok=True)
        elif path.read_bytes() != data:
            write_whole(path, lambda part: part.write_bytes(data))


def _told(finding: Finding, section: Section) -> dict[str, Any]:
    table = section.table
    return {
        "id": section.ident,
        "heading": section.heading,
        "schema": finding.schema,
        "file": finding.name,
        "sha256": finding.sha256,
        "command": section.command,
        "facts": dict(section.facts),
        "table": table and {"head": list(table.head), "rows": [list(row) for row in table.rows]},
        "figures": [picture.ident for picture in section.pictures],
    }
