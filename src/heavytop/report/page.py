"""One page of results: what folders hold, as HTML that needs nothing else."""

from __future__ import annotations

import json
import os
import warnings
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from heavytop.errors import Exit, ForeignFile, NoClosedForm, NotDrawnWarning
from heavytop.files import write_text
from heavytop.report.files import kind_of, load_run, scene_text, warn_not_drawn
from heavytop.report.player import frames, tops
from heavytop.results.base import Fact, Result, Table, load_result, not_as_written
from heavytop.results.registry import RESULTS
from heavytop.results.run import PICTURES, RunResult
from heavytop.scene.quantities import QUANTITIES
from heavytop.text import harmless

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

RAN_ON: Final = ("cpu", "python", "heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
SYMBOLS: Final = (
    "theta", "phi", "psi", "A", "C", "gMR", "E", "E_prime", "p_phi", "p_psi", "period",
    "precession", "spin",
)  # fmt: skip
LEADING: Final = 4  # facts of a result that are read first
MOST_ROWS: Final = 500  # of a table

# --- a result as a section -----------------------------------------------------------------------


class Picture(NamedTuple):
    """A picture: its name, which is unique in its section, its title, and its address as SVG."""

    name: str
    title: str
    address: str


class Section(NamedTuple):
    """One result on the page.

    Attributes
    ----------
    name : str
        What a page calls it: the path of its document below what all of them lie in.
    result : Result
    ident, heading : str
    facts, tables : tuple
        What it says.
    pictures : tuple of Picture
    top : mapping or None
        The frames of its top.
    """

    name: str
    result: Result
    ident: str
    heading: str
    facts: tuple[Fact, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()
    top: Mapping[str, Any] | None = None

    @property
    def problems(self) -> list[str]:
        """What is wrong with it."""
        return [why for code, why in self.result.problems() if code != Exit.OK and why]

    @property
    def scene_file(self) -> str:
        """Its scene as TOML; empty where it has but a top and a start, as in a study."""
        scene = getattr(self.result, "scene", None) or {}
        return scene_text(scene) if "format" in scene else ""

    def html(self) -> str:
        """The section in HTML: what is read first, and below it all else."""
        tables = [table_html(x) for x in sorted(self.tables, key=lambda x: not x.fails) if x.rows]
        about = {"ident": self.ident, "heading": self.heading}
        figures = [fill("figure.html", {}, **about, **x._asdict()) for x in self.pictures]
        facts = [facts_html(some) for some in (self.facts[:LEADING], self.facts[LEADING:])]
        scene = f"<h3>The scene, as a file</h3>{_code(self.scene_file)}" if self.scene_file else ""
        first = _code(self.result.command), facts[0], *tables[:1], *figures[:1]
        parts = {
            "first": "".join(first),
            "others": "".join((facts[1], *tables[1:], *figures[1:], scene)),
            "document": json_html(self.result.document()),
        }
        return fill("section.html", parts, **about, name=self.name)


def _section(path: Path, name: str, number: int) -> Section:
    """The section of a result, which has this number among those of its kind."""
    result = load_result(path)
    kind, scene = kind_of(result), getattr(result, "scene", None)
    with warnings.catch_warnings(), not_as_written(path):
        for odd in (RuntimeWarning, UserWarning):  # of numbers that no picture can show
            warnings.simplefilter("ignore", odd)
        warnings.simplefilter("always", NotDrawnWarning)
        heading = f"{result.heading}: {scene.title or scene.name}" if scene else result.heading
        parts = tuple(result.facts()), tuple(result.tables())
        run = load_run(result, path) if isinstance(result, RunResult) else None
        pictures = tuple(_pictures(result, run))
        return Section(name, result, f"{kind}-{number}", heading, *parts, pictures, _top(run))


def _pictures(result: Result, run: Any) -> Iterator[Picture]:
    """The pictures of a run, or the chart of another result, as far as they can be drawn."""
    from heavytop.plots.figures import run_figures
    from heavytop.plots.style import svg_address

    figures = {kind_of(result): (result.chart.title, result.figure)} if result.chart else {}
    if run is not None:
        figures = {name: (PICTURES[name], draw) for name, draw in run_figures(run)}
    for name, (title, draw) in figures.items():
        with warn_not_drawn(name):
            if (figure := draw()) is not None:
                yield Picture(name, title, svg_address(figure))


def _top(run: Any) -> Mapping[str, Any] | None:
    """The frames of the top of a run, where its motion has them."""
    try:
        return None if run is None else frames(run)
    except NoClosedForm:
        return None


# --- the page ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Page:
    """A page of results.

    Attributes
    ----------
    sections : tuple of Section
        What it says of each result.
    """

    sections: tuple[Section, ...]

    @property
    def title(self) -> str:
        """The heading of its section, where there is but one; else how many there are."""
        alone = len(self.sections) == 1
        return self.sections[0].heading if alone else f"{len(self.sections)} results"

    @property
    def machine(self) -> list[str]:
        """The processor and the programs that the results name."""
        named = [section.result.versions for section in self.sections]
        found = {name: dict.fromkeys(filter(None, (v.get(name) for v in named))) for name in RAN_ON}
        return [f"{name} {' and '.join(some)}" for name, some in found.items() if some]

    def html(self) -> str:
        """The page: one file, which asks no network for anything."""
        played = [{**each.top, "title": each.heading} for each in self.sections if each.top]
        parts = {
            "contents": "".join(map(_entry, self.sections)),
            "player": f"<h2>The top that moves</h2>{player_part(tops(played))}" if played else "",
            "sections": "".join(section.html() for section in self.sections),
            "symbols": symbols_html(),
        }
        machine = ", ".join(self.machine)
        return fill_page("page.html", PAGE_SCRIPTS, parts, title=self.title, machine=machine)


def _entry(section: Section) -> str:
    """A section in the contents, with what is wrong with it."""
    wrong = (f'<br><span class="bad">{escape(why)}</span>' for why in section.problems)
    link = f'<a href="#{section.ident}">{escape(section.heading)}</a>'
    return f"<li>{link}{''.join(wrong)}</li>"


def page_of(folders: Sequence[Path]) -> Page:
    """Return the page of what folders hold.

    Parameters
    ----------
    folders : sequence of Path
        Each holds results itself, or folders that do.

    Returns
    -------
    Page

    Raises
    ------
    ForeignFile
        A folder holds none, or a file is not what its name promises; the message names it.
    """
    paths = sorted(_documents(folders), key=lambda path: [*RESULTS].index(path.name))
    root = os.path.commonpath([path.parent.parent for path in paths]) if paths else ""
    numbers: Counter[str] = Counter()
    sections = []
    for path in paths:
        numbers[path.name] += 1
        sections.append(_section(path, harmless(path.relative_to(root)), numbers[path.name]))
    headings = Counter(section.heading for section in sections)
    apart = (  # of the same heading: with their files
        each if headings[each.heading] == 1
        else each._replace(heading=f"{each.heading} ({each.name})")
        for each in sections
    )  # fmt: skip
    return Page(tuple(apart))


def _documents(folders: Sequence[Path]) -> dict[Path, None]:
    """The documents in folders, and in those directly in them; a link keeps its name."""
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            places = (folder, *sorted(each for each in folder.iterdir() if each.is_dir()))
        except OSError as fault:
            raise ForeignFile(f"{harmless(folder)}: {fault.strerror or fault}") from fault
        found = [each / name for each in places for name in RESULTS if os.path.lexists(each / name)]
        if not found:
            raise ForeignFile(f"{harmless(folder)}: holds no results ({', '.join(RESULTS)})")
        paths |= dict.fromkeys(Path(os.path.abspath(each)) for each in found)  # noqa: PTH100
    return paths


def write_page(page: Page, html: Path) -> None:
    """Write a page, whole or not at all.

    Parameters
    ----------
    page : Page
        What is written.
    html : Path
        The file of the page.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    write_text(html, page.html())


def player_html(trajectory: Trajectory, **asked: float | None) -> str:
    """A page with the top of a trajectory in three dimensions, to be played, turned and zoomed.

    Parameters
    ----------
    trajectory : Trajectory
    **asked
        ``rounds``, ``time`` or ``speed``, as of `heavytop.Motion.play`.

    Returns
    -------
    str
        A whole HTML document, which needs no network; a notebook shows it as the ``srcdoc`` of an
        ``iframe``.

    Raises
    ------
    NoClosedForm
        The run does not follow the attitude, and its motion has no closed form that would.

    Examples
    --------
    >>> import heavytop as ht
    >>> page = player_html(ht.propagate(ht.load_scene("sicm-kicked")))
    >>> page.startswith("<!doctype html>"), len(page) < 400_000
    (True, True)
    """
    played = tops([frames(trajectory, **asked)])
    title, parts = played["runs"][0]["title"], {"player": player_part(played)}
    return fill_page("player_page.html", PAGE_SCRIPTS[:1], parts, title=title)


# --- parts in HTML: no text, number or picture is taken for markup or a script --------------------

TEMPLATES: Final = Path(__file__).parent / "templates"
PAGE_SCRIPTS: Final = ("player.js", "page.js")
PAGE_STYLES: Final = ("page.css",)
POLICY: Final = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {}; "
    "base-uri 'none'; form-action 'none'"
)


def fill(template: str, parts: Mapping[str, str], **texts: str) -> str:
    """A template with its parts, which are HTML, and its texts, which are not."""
    escaped = {name: escape(text) for name, text in texts.items()}
    return Template((TEMPLATES / template).read_text("utf-8")).substitute(parts, **escaped)


def fill_page(
    template: str,
    scripts: Sequence[str],
    parts: Mapping[str, str],
    styles: Sequence[str] = PAGE_STYLES,
    **texts: str,
) -> str:
    """A page with its style and scripts: one file, which asks no network for anything.

    No other script may run on it: they are told by their fingerprints.
    """
    found = [(TEMPLATES / name).read_text("utf-8") for name in scripts]
    prints = (b64encode(sha256(text.encode()).digest()).decode() for text in found)
    own = {
        "policy": POLICY.format(" ".join(f"'sha256-{each}'" for each in prints)),
        "style": "".join((TEMPLATES / name).read_text("utf-8") for name in styles),
        "scripts": "".join(f"<script>{text}</script>" for text in found),
    }
    return fill(template, own | {**parts}, **texts)


def player_part(played: Mapping[str, Any]) -> str:
    """The player of some tops."""
    return fill("player.html", {"data": json_html(played)})


def table_html(table: Table) -> str:
    """A table in a region that scrolls, with so many rows that a page stays small."""
    more = table.more + max(0, len(table.rows) - MOST_ROWS)
    left = f"{more} more rows are not shown." if more else ""
    parts = {"table": table._replace(rows=table.rows[:MOST_ROWS]).html}
    return fill("table.html", parts, title=table.title or "numbers", left=left)


def facts_html(facts: Iterable[Fact]) -> str:
    """Labels, and what they say, as a list."""
    lines = (f"<dt>{escape(label)}</dt><dd>{escape(text)}</dd>" for label, text in facts)
    return f"<dl>{''.join(lines)}</dl>"


def symbols_html() -> str:
    """The symbols of quantities, their names and their units, as a list."""
    found = [QUANTITIES[name] for name in SYMBOLS]
    units = [f" [{each.unit}]" if each.unit != "1" else "" for each in found]
    lines = ((each.symbol, each.name + unit) for each, unit in zip(found, units, strict=True))
    return facts_html(lines)


def json_html(value: Any) -> str:
    """A value as JSON that no browser takes for markup."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("&", r"\u0026").replace("<", r"\u003c").replace(">", r"\u003e")


def _code(text: str | None) -> str:
    return f"<pre><code>{escape(text)}</code></pre>" if text else ""
