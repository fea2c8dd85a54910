"""One page of results: its sections, as HTML that needs nothing else, and as a document."""

from __future__ import annotations

import json
import warnings
from base64 import b64encode
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from heavytop.errors import ForeignFile
from heavytop.files import as_json, write_text
from heavytop.machine import version
from heavytop.report.pages.sections import SECTIONS
from heavytop.report.parts import called
from heavytop.report.studies import summary
from heavytop.results.command import typed
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.report.pages.load import Result
    from heavytop.report.pages.section import Section

SCHEMA: Final = "heavytop/report/1"
LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "matplotlib", "plotly")
RAN_ON: Final = ("cpu", "python", "heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
OWN: Final = ("page.css", "player.js", "save.js", "turn.js")


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
            loader=PackageLoader("heavytop.report.pages"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        plotly = Markup(_plotly() if self.turns else "")
        folder = Path(__file__).parent / "templates"
        source = {
            name.replace(".", "_"): Markup((folder / name).read_text("utf-8")) for name in OWN
        }
        return jinja.get_template("page.html").render(
            page=self,
            plotly=plotly,
            allowed=_allowed(plotly, *source.values()),
            data=_script_data,
            versions={name: version(name) for name in LIBRARIES},
            **source,
        )

    def json(self, files: Mapping[str, str] | None = None) -> str:
        """The document as a text.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that are written, by what they are.
        """
        return as_json(self.document(files=files))

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
            "results": [section.document() for section in self.sections],
            "figures": [
                {"id": f"{section.ident}-{picture.name}", "title": picture.title,
                 "command": section.command, "data": picture.data}
                for section in self.sections for picture in section.pictures
            ],
            "missing": [{"study": name, "reason": why} for name, why in self.missing],
            "files": dict(files or {}),
            "versions": {name: version(name) for name in LIBRARIES},
        }  # fmt: skip


def page_of(results: Sequence[Result], *, missing: Sequence[tuple[str, str]] = ()) -> Page:
    """Return the page of what folders hold.

    Parameters
    ----------
    results : sequence of Result
        As `heavytop.report.pages.load.load_results` returns them.
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
    apart = (s if counts[s.heading] == 1 else _with_its_file(s) for s in sections)
    return Page(tuple(apart), tuple(missing), typed())


def _sections(results: Sequence[Result]) -> Iterator[Section]:
    counts: Counter[str] = Counter()
    for result in results:
        name, section = SECTIONS[result.path.name]
        counts[name] += 1
        try:
            with warnings.catch_warnings():
                for kind in (RuntimeWarning, UserWarning):  # of numbers that no picture can show
                    warnings.simplefilter("ignore", kind)
                made = section(result, f"{name}-{counts[name]}")
        except ForeignFile:
            raise
        except (LookupError, TypeError, ValueError, ArithmeticError, RuntimeError) as fault:
            why = harmless(f"{type(fault).__name__}: {fault}")[:200]
            raise ForeignFile(f"{harmless(result.path)}: not what was written ({why})") from fault
        yield made


def _with_its_file(section: Section) -> Section:
    """A section whose heading is that of another one too: with its file, in the player as well."""
    heading = f"{section.heading} ({section.result.name})"
    return replace(section, heading=heading, top=section.top and {**section.top, "title": heading})


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


def _plotly() -> str:
    """The library that draws what can be turned; whole, so that no network is asked for it."""
    from plotly.offline import get_plotlyjs

    source: str = get_plotlyjs()
    return source.replace("</script", "<\\/script")
