"""One page of results: its sections, as HTML that needs nothing else, and as a document."""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from heavytop.files import write_document, write_text
from heavytop.machine import version
from heavytop.pages.claims import claims_section
from heavytop.pages.foreign import reading
from heavytop.pages.maps import atlas_section, energy_momentum_section
from heavytop.pages.runs import run_section
from heavytop.pages.studies import drift_section, stress_section, workprec_section
from heavytop.pages.traces import traces_section

if TYPE_CHECKING:
    from heavytop.pages.findings import Finding
    from heavytop.pages.section import Section

SCHEMA: Final = "heavytop/report/1"
LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "matplotlib", "plotly")

SECTIONS: Final[Mapping[str, tuple[str, Callable[[Finding, str], Section]]]] = {
    "heavytop/validate/1": ("claims", claims_section),
    "heavytop/run/1": ("run", run_section),
    "heavytop/traces/1": ("traces", traces_section),
    "heavytop/drift/1": ("drift", drift_section),
    "heavytop/workprec/1": ("workprec", workprec_section),
    "heavytop/stress/1": ("stress", stress_section),
    "heavytop/atlas/1": ("atlas", atlas_section),
    "heavytop/energy-momentum/1": ("energy-momentum", energy_momentum_section),
}
"""By schema, the name of a section and what makes it."""


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
        """The page: one file, which asks no network for anything."""
        from jinja2 import Environment, PackageLoader, StrictUndefined
        from markupsafe import Markup

        jinja = Environment(
            loader=PackageLoader("heavytop.pages"), autoescape=True, undefined=StrictUndefined,
            trim_blocks=True, lstrip_blocks=True,
        )  # fmt: skip
        plotly = Markup(_plotly()) if self.turns else Markup()
        own = ("page.css", "player.js", "save.js", "turn.js")
        source = {name.replace(".", "_"): Markup(_template(name)) for name in own}
        return jinja.get_template("page.html").render(
            page=self,
            sections=self.sections,
            tops=self.tops,
            plotly=plotly,
            allowed=_allowed(plotly, *source.values()),
            data=_script_data,
            versions={name: version(name) for name in LIBRARIES},
            **source,
        )

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/report/1."""
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
    found: Sequence[Finding],
    *,
    missing: Sequence[tuple[str, str]] = (),
    command: str = "heavytop report",
) -> Page:
    """Return the page of what folders hold.

    Raises
    ------
    ForeignFile
        A result is not what was written; the message names its file.
    """
    return Page(tuple(_sections(found)), tuple(missing), command)


def _sections(found: Sequence[Finding]) -> Iterator[tuple[Finding, Section]]:
    counts: dict[str, int] = {}
    for finding in found:
        name, section = SECTIONS[finding.schema]
        counts[name] = counts.get(name, 0) + 1
        with reading(finding.path):
            yield finding, section(finding, f"{name}-{counts[name]}")


def write_page(page: Page, html: Path) -> dict[str, str]:
    """Write a page, and its document beside it; return their names by what they are.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    files = {"page": html.name, "document": html.with_suffix(".json").name}
    write_text(html, page.html())
    write_document(html.with_name(files["document"]), page.document(files=files))
    return files


def _told(finding: Finding, section: Section) -> dict[str, Any]:
    table = section.table
    return {
        "id": section.ident,
        "heading": section.heading,
        "schema": finding.schema,
        "file": f"{finding.path.parent.name}/{finding.path.name}",
        "sha256": finding.sha256,
        "command": section.command,
        "facts": dict(section.facts),
        "table": table and {"head": list(table.head), "rows": [list(row) for row in table.rows]},
        "figures": [picture.ident for picture in section.pictures],
    }


def _script_data(value: Any) -> Any:
    """JSON for a script element, in which nothing can end that element."""
    from markupsafe import Markup

    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    for letter in "<>&":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)


def _allowed(*scripts: str) -> str:
    """The scripts that may run on the page, by their fingerprints: no other, whoever wrote it."""
    prints = (b64encode(sha256(text.encode("utf-8")).digest()) for text in scripts)
    return " ".join(f"'sha256-{each.decode('ascii')}'" for each in prints)


def _template(name: str) -> str:
    return (Path(__file__).parent / "templates" / name).read_text("utf-8")


def _plotly() -> str:
    """The library that draws what can be turned; whole, so that no network is asked for it."""
    from plotly.offline import get_plotlyjs

    source: str = get_plotlyjs()
    return source.replace("</script", "<\\/script")
