"""One page with the results in folders, as HTML that needs no other file."""

from __future__ import annotations

import os
import warnings
from base64 import b64encode
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from heavytop.errors import Exit, ForeignFile, NoClosedForm, NotDrawnWarning, resuming
from heavytop.files import expect_intact, write_text
from heavytop.report.files import load_run, scene_text, warn_not_drawn
from heavytop.report.player import frames, tops
from heavytop.results.base import Result, kind_of, load_result, typed
from heavytop.results.drift import Drift
from heavytop.results.registry import RESULTS
from heavytop.results.run import RunResult
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import ANGLES, QUANTITIES
from heavytop.studies.journal import Journal, first_line
from heavytop.text import printable

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

RAN_ON: Final = ("cpu", "python", "heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
SYMBOLS: Final = (
    *ANGLES, "A", "C", "gMR", "E", "E_prime", "p_phi", "p_psi", "period", "precession", "spin",
)  # fmt: skip
LEADING: Final = 4  # facts of a result that are shown above its details

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
        Its name on the page: the path of its document in the folder that all of them are in.
    result : Result
    ident, heading : str
    facts, tables : tuple
        Its facts and its tables.
    pictures : tuple of Picture
    top : mapping or None
        The frames of its top, for the player.
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
    def first_tables(self) -> list[Table]:
        """The tables above the details: the first, or those with FAIL; never a list of events."""
        some = [table for table in self.tables if table.rows and table.first is None]
        return [table for table in some if table.fails] or some[:1]

    @property
    def other_tables(self) -> list[Table]:
        """The tables among the details."""
        return [each for each in self.tables if each.rows and each not in self.first_tables]

    @property
    def not_drawn(self) -> bool:
        """Whether results of its kind have figures, and this one has none."""
        from heavytop.plots.studies import RESULT_PICTURES

        return kind_of(self.result) in RESULT_PICTURES and not self.pictures

    @property
    def problems(self) -> list[str]:
        """The problems of the result, in words."""
        return [why for code, why in self.result.problems() if code != Exit.OK and why]

    @property
    def scene_file(self) -> str:
        """Its scene as TOML; empty where it has only a top and a start, as in a study."""
        scene = getattr(self.result, "scene", None) or {}
        return scene_text(scene) if "format" in scene else ""


def _section(path: Path, name: str, number: int) -> Section:
    """The section of the result with this number among those of its kind."""
    result = load_result(path)
    if isinstance(result, Drift) and first_line(path.parent):
        result = result.timed(Journal.read(path.parent))
    kind, scene = kind_of(result), getattr(result, "scene", None)
    with warnings.catch_warnings(), expect_intact(path):
        for category in (RuntimeWarning, UserWarning):  # about numbers that no picture can show
            warnings.simplefilter("ignore", category)
        warnings.simplefilter("always", NotDrawnWarning)
        heading = f"{result.heading}: {scene.title or scene.name}" if scene else result.heading
        parts = tuple(result.facts()), tuple(result.tables())
        if isinstance(result, RunResult):
            result = replace(result, run=load_run(result, path))
        pictures, top = tuple(_pictures(result)), _top(getattr(result, "run", None))
        return Section(name, result, f"{kind}-{number}", heading, *parts, pictures, top)


def _pictures(result: Result) -> Iterator[Picture]:
    """The pictures of a result, as far as they can be drawn."""
    from heavytop.plots.style import svg_address

    for name, title, draw in result.figures():
        with warn_not_drawn(name):
            if (figure := draw()) is not None:
                yield Picture(name, title, svg_address(figure))


def _top(run: Any) -> Mapping[str, Any] | None:
    """The frames of the top of a run; None without a run, or a closed form."""
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
        The section of each result.
    command : str or None
        The command that made the page.
    """

    sections: tuple[Section, ...]
    command: str | None = None

    @property
    def title(self) -> str:
        """The heading of its only section; else the number of results."""
        alone = len(self.sections) == 1
        return self.sections[0].heading if alone else f"{len(self.sections)} results"

    @property
    def machine(self) -> list[str]:
        """The processor and the programs that the results name."""
        named = [section.result.versions for section in self.sections]
        found = {name: dict.fromkeys(filter(None, (v.get(name) for v in named))) for name in RAN_ON}
        return [f"{name} {' and '.join(some)}" for name, some in found.items() if some]

    def html(self) -> str:
        """The HTML of the page: one file, which needs no network."""
        played = [{**each.top, "title": each.heading} for each in self.sections if each.top]
        about = any(getattr(each.result, "scene", None) for each in self.sections)
        top = tops(played) if played else None
        return render("page.html", page=self, tops=top, leading=LEADING, about_a_top=about)


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
    numbers = defaultdict[str, Iterator[int]](lambda: count(1))
    names = [printable(path.relative_to(root)) for path in paths]
    sections = [_section(p, x, next(numbers[p.name])) for p, x in zip(paths, names, strict=True)]
    headings = Counter(section.heading for section in sections)
    for k, each in enumerate(sections):
        if headings[each.heading] > 1:  # equal headings get the names of their files
            sections[k] = each._replace(heading=f"{each.heading} ({each.name})")
    return Page(tuple(sections), typed())


def _documents(folders: Sequence[Path]) -> dict[Path, None]:
    """The documents in folders, and in those directly in them; a link keeps its name."""
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            places = (folder, *sorted(each for each in folder.iterdir() if each.is_dir()))
        except OSError as fault:
            raise ForeignFile(f"{printable(folder)}: {fault.strerror or fault}") from fault
        found = [each / name for each in places for name in RESULTS if os.path.lexists(each / name)]
        if not found and first_line(folder):
            raise ForeignFile(f"{printable(folder)}: unfinished; {resuming(folder)} goes on")
        if not found:
            raise ForeignFile(f"{printable(folder)}: holds no results ({', '.join(RESULTS)})")
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
    return render("player_page.html", tops=tops([frames(trajectory, **asked)]))


# --- templates: nothing in texts, data or pictures is read as markup or run as a script -----------

TEMPLATES: Final = Path(__file__).parent / "templates"
PAGE_SCRIPTS: Final = ("player.js", "page.js")
STYLES: Final = ("page.css", "explorer.css")
POLICY: Final = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {}; "
    "base-uri 'none'; form-action 'none'"
)


def render(template: str, scripts: Sequence[str] = PAGE_SCRIPTS, **values: Any) -> str:
    """A template with its style and scripts: one file, which needs no network."""
    blocks: Any = {"trim_blocks": True, "lstrip_blocks": True}
    jinja = Environment(autoescape=True, undefined=StrictUndefined, **blocks)
    jinja.loader = PackageLoader("heavytop.report")
    jinja.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    texts = {name: (TEMPLATES / name).read_text("utf-8") for name in (*scripts, *STYLES)}
    values |= {name.replace(".", "_"): Markup(text) for name, text in texts.items()}
    # The policy of the page allows its own scripts alone, by their digests.
    digests = (b64encode(sha256(texts[name].encode()).digest()).decode() for name in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in digests)
    values |= {"symbols": map(QUANTITIES.get, SYMBOLS), "policy": POLICY.format(allowed)}
    return jinja.get_template(template).render(values)
