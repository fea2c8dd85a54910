"""One page of results: what folders hold, as HTML that needs nothing else."""

from __future__ import annotations

import os
import re
import warnings
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from heavytop.errors import ForeignFile, NoClosedForm, NotDrawnWarning
from heavytop.files import write_text
from heavytop.machine import version
from heavytop.report.files import UNDRAWABLE, kind_of, warn_not_drawn
from heavytop.report.player import frames, tops
from heavytop.results.base import (
    FILES,
    Fact,
    Result,
    Table,
    as_rows,
    load_result,
    not_as_written,
    typed,
)
from heavytop.results.run import PICTURES
from heavytop.results.validation import summary
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene_file import written
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.run.trajectory import Trajectory

LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "matplotlib")
RAN_ON: Final = ("cpu", "python", "heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
SYMBOLS: Final = (
    "theta", "phi", "psi", "A", "C", "gMR", "E", "E_prime", "p_phi", "p_psi", "period",
    "precession", "spin",
)  # fmt: skip
MARKS: Final = 120  # of a curve: more are not told apart

# --- a result as a section -----------------------------------------------------------------------


class Picture(NamedTuple):
    """A picture.

    Attributes
    ----------
    name, title : str
        The name is unique in its section.
    svg : str
    """

    name: str
    title: str
    svg: str


class Section(NamedTuple):
    """One result on the page.

    Attributes
    ----------
    path : Path
        The file of its document.
    name : str
        What a page calls it: its path below what all of them lie in.
    result : Result
    ident, heading : str
    facts, tables : tuple
        What it says.
    pictures : tuple of Picture
    top : mapping or None
        The frames of its top.
    """

    path: Path
    name: str
    result: Result
    ident: str
    heading: str
    facts: tuple[Fact, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()
    top: Mapping[str, Any] | None = None

    @property
    def scene(self) -> Mapping[str, Any]:
        """Its scene; empty where it is about none."""
        return getattr(self.result, "scene", None) or {}

    @property
    def scene_file(self) -> str:
        """Its scene as TOML; empty where it has but a top and a start, as in a study."""
        tables = {name: x for name, x in self.scene.items() if name != "name" and x != ""}
        return written(tables) if "format" in tables else ""

    @property
    def sha256(self) -> str:
        """The fingerprint of the file."""
        return sha256(self.path.read_bytes()).hexdigest()


Drawn = tuple[tuple[Picture, ...], Mapping[str, Any] | None]
"""Pictures of a result, and the frames of its top."""


def _section(path: Path, name: str, number: int) -> Section:
    """The section of a result, which has this number among those of its kind."""
    result = load_result(path)
    kind, scene = kind_of(result), getattr(result, "scene", None)
    heading = f"{result.heading}: {called(scene)}" if scene else result.heading
    with warnings.catch_warnings(), not_as_written(path):
        for odd in (RuntimeWarning, UserWarning):  # of numbers that no picture can show
            warnings.simplefilter("ignore", odd)
        warnings.simplefilter("always", NotDrawnWarning)
        parts = tuple(result.facts()), tuple(result.tables())
        drawn = DRAW.get(kind, _chart)(result, path)
    return Section(path, name, result, f"{kind}-{number}", heading, *parts, *drawn)


def called(scene: Mapping[str, Any]) -> str:
    """What the scene of a result is called: by its title, else by its name."""
    return str(scene["title"] or scene["name"])


def _chart(result: Result, _: Path) -> Drawn:
    """The chart of a study, if its document has numbers for it, and it can be drawn."""
    try:
        figure = result.figure()
        if figure is not None and result.chart is not None:
            return (Picture(kind_of(result), result.chart.title, _svg(figure)),), None
    except UNDRAWABLE as fault:
        warn_not_drawn(kind_of(result), fault)
    return (), None


def _run(run: Any, path: Path) -> Drawn:
    """The pictures of a run, and its top, where its trajectory is there."""
    from heavytop.plots.figures import as_drawn, run_figures
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory_file import load_exact, load_trajectory

    path = path.with_name("trajectory.nc")
    if "trajectory" not in run.files or not path.exists():
        return (), None
    exact = run.source == SceneMotion.source
    whole: Any = load_exact(path) if exact else load_trajectory(path)
    scene = as_rows(whole.scene.document())
    if any(scene[key] != run.scene.get(key) for key in ("top", "start", "title", "span")):
        raise ForeignFile(
            f"{harmless(path)}: the trajectory of another scene than run.json is about"
        )
    pictures = tuple(
        Picture(name, PICTURES[name].title, _svg(draw())) for name, draw in run_figures(whole)
    )
    try:
        return pictures, frames(as_drawn(whole))
    except NoClosedForm:
        return pictures, None


DRAW: Final[Mapping[str, Callable[[Any, Path], Drawn]]] = {"run": _run}
"""What draws the results whose pictures are of another file than the document."""


def _svg(figure: Figure) -> str:
    """The SVG of a figure, its curves with as many marks as can be told apart."""
    from heavytop.plots.style import svg

    for axes in figure.axes:
        for curve in axes.lines:
            curve.set_markevery(max(1, np.size(curve.get_xdata()) // MARKS))
    return svg(figure)


# --- the page ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Page:
    """A page of results.

    Attributes
    ----------
    sections : tuple of Section
        What it says of each result.
    command : str or None
        What makes the page.
    """

    sections: tuple[Section, ...]
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
            title = called(section.scene) if section.scene else "All tops"
            found.setdefault(title, []).append(section)
        return found

    @property
    def verdicts(self) -> list[tuple[Section, str, list[str]]]:
        """Of every validation how many claims hold, and which fail."""
        return [
            (each, summary(claims), [claim["id"] for claim in claims if claim["passed"] is False])
            for each in self.sections
            if (claims := getattr(each.result, "claims", None)) is not None
        ]

    @property
    def machine(self) -> list[str]:
        """The processor and the programs that the results name."""
        named = [section.result.versions for section in self.sections]
        found = {name: dict.fromkeys(filter(None, (v.get(name) for v in named))) for name in RAN_ON}
        return [f"{name} {' and '.join(some)}" for name, some in found.items() if some]

    def html(self) -> str:
        """The page: one file, which asks no network for anything."""
        played = [{**each.top, "title": each.heading} for each in self.sections if each.top]
        return rendered(
            "page.html",
            page=self,
            tops=tops(played) if played else None,
            versions={name: version(name) for name in LIBRARIES},
        )


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
    paths = sorted(_documents(folders), key=lambda path: [*FILES].index(path.name))
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
    return Page(tuple(apart), typed())


def _documents(folders: Sequence[Path]) -> dict[Path, None]:
    """The documents in folders, and in those directly in them; a link keeps its name."""
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            places = (folder, *sorted(each for each in folder.iterdir() if each.is_dir()))
        except OSError as fault:
            raise ForeignFile(f"{harmless(folder)}: {fault.strerror or fault}") from fault
        named = [place / name for place in places for name in FILES]
        found = [Path(os.path.abspath(x)) for x in named if os.path.lexists(x)]  # noqa: PTH100
        if not found:
            raise ForeignFile(f"{harmless(folder)}: holds no results ({', '.join(FILES)})")
        paths |= dict.fromkeys(found)
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
    return rendered("player_page.html", tops=tops([frames(trajectory, **asked)]))


# --- templates: nothing in a text, in data or in a picture is taken for markup or a script --------

TEMPLATES: Final = Path(__file__).parent / "templates"
SCRIPTS: Final = ("player.js", "page.js")
STYLES: Final = ("page.css", "explorer.css")
POLICY: Final = (
    "default-src 'none'; img-src data: blob:; style-src 'unsafe-inline'; script-src {}; "
    "base-uri 'none'; form-action 'none'"
)
MOMENTUM: Final = re.compile(r"\bp_(phi|psi|φ|ψ)(?![a-z_])")


def rendered(template: str, scripts: Sequence[str] = SCRIPTS, **values: Any) -> str:
    """A template with its style and scripts: one file, which asks no network for anything."""
    jinja = Environment(
        loader=PackageLoader("heavytop.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    jinja.filters |= {"typeset": _typeset, "address": address}
    jinja.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    texts = {name: (TEMPLATES / name).read_text("utf-8") for name in (*scripts, *STYLES)}
    own = {name.replace(".", "_"): Markup(text) for name, text in texts.items()}
    # No script may run on a page but its own, told by their fingerprints, whoever wrote another.
    prints = (b64encode(sha256(texts[name].encode()).digest()).decode() for name in scripts)
    allowed = " ".join(f"'sha256-{each}'" for each in prints)
    values |= own | {"symbols": map(QUANTITIES.get, SYMBOLS), "policy": POLICY.format(allowed)}
    return jinja.get_template(template).render(values)


def _typeset(text: str) -> Markup:
    """A text of ours or of others, with the index of a momentum below the line."""
    signs = {"phi": "φ", "psi": "ψ"}
    return Markup(MOMENTUM.sub(lambda m: f"p<sub>{signs.get(m[1], m[1])}</sub>", str(escape(text))))


def address(svg: str) -> Markup:
    """A picture as an address that an image takes: in an image, no script of it can run."""
    return Markup("data:image/svg+xml;base64," + b64encode(svg.encode()).decode())
