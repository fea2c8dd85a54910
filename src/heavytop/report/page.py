"""One page of results: what folders hold, as HTML that needs nothing else."""

from __future__ import annotations

import os
import re
import warnings
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from numpy.typing import NDArray

from heavytop.errors import ForeignFile, NoClosedForm, NotDrawnWarning
from heavytop.files import write_text
from heavytop.hdf5 import attribute, dataset, opened
from heavytop.machine import version
from heavytop.report.files import UNDRAWABLE, warn_not_drawn
from heavytop.report.player import as_drawn, frames, tops
from heavytop.report.studies import RESULTS, kind_of, parts_of, summary
from heavytop.report.tables import Fitting, Known, Part, called, facts, given, headed
from heavytop.results.base import typed
from heavytop.results.documents import FILES, read_document
from heavytop.scene.scene_file import written
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from heavytop.run.trajectory import Trajectory

LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "matplotlib")
RAN_ON: Final = ("cpu", "python", "heavytop", "heyoka", "numpy", "scipy", "numba", "CyRK")
MARKS: Final = 120  # of a curve: more are not told apart
FINEST: Final = 600  # pixels of a map that are drawn along an axis
MOST_PIXELS: Final = 2_000_000_000

# --- results in folders --------------------------------------------------------------------------


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
        A folder holds none, or a file is not what its name promises.
    """
    paths: dict[Path, None] = {}
    for folder in folders:
        try:
            found = dict.fromkeys(_documents(folder))
        except OSError as fault:
            raise ForeignFile(f"{harmless(folder)}: {fault.strerror or fault}") from fault
        if not found:
            raise ForeignFile(f"{harmless(folder)}: holds no results ({', '.join(FILES)})")
        paths |= found
    root = os.path.commonpath([path.parent.parent for path in paths]) if paths else ""
    order = list(FILES)
    return tuple(
        LoadedResult(path, harmless(path.relative_to(root)), *read_document(path))
        for path in sorted(paths, key=lambda path: order.index(path.name))
    )


def _documents(folder: Path) -> Iterator[Path]:
    """The documents in a folder, and in those directly in it; a link keeps its name."""
    for place in (folder, *sorted(each for each in folder.iterdir() if each.is_dir())):
        for name in FILES:
            if os.path.lexists(place / name):
                yield Path(os.path.abspath(place / name))  # noqa: PTH100


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
    result : LoadedResult
    ident, heading : str
    parts : tuple of Part
        What it says.
    pictures : tuple of Picture
    top : mapping or None
        The frames of its top.
    """

    result: LoadedResult
    ident: str
    heading: str
    parts: tuple[Part, ...] = ()
    pictures: tuple[Picture, ...] = ()
    top: Mapping[str, Any] | None = None

    @property
    def command(self) -> str:
        """The command that made it; empty where it was made in Python."""
        return self.result.document.get("command") or ""

    @property
    def scene(self) -> Known:
        """Its scene; empty where it is about none."""
        return self.result.document.get("scene") or {}

    @property
    def scene_file(self) -> str:
        """Its scene as TOML; empty where it has but a top and a start, as in a study."""
        tables = {name: x for name, x in self.scene.items() if name != "name" and x != ""}
        return written(tables) if "format" in tables else ""


Drawn = tuple[tuple[Picture, ...], Mapping[str, Any] | None]
"""Pictures of a result, and the frames of its top."""


def _section(result: LoadedResult, number: int) -> Section:
    """The section of a result, which has this number among those of its kind."""
    document, name = result.document, kind_of(result.document)
    drawn = DRAW.get(name, _charts)(result)
    parts: list[Part] = []
    if not drawn[0] and name != "validate":
        parts.append(f"No figures: the numbers for them are not in {result.path.parent.name}.")
    if name == "run":
        parts.append(facts((each, given(document["scene"][each])) for each in ("top", "start")))
    for part in parts_of(document):
        parts += part.forms[0] if isinstance(part, Fitting) else [part]
    heading = RESULTS[name].heading
    if "scene" in document:
        heading = f"{heading}: {called(document)}"
    return Section(result, f"{name}-{number}", heading, tuple(parts), *drawn)


def _charts(result: LoadedResult) -> Drawn:
    """The charts of a study for which its document has numbers, and which can be drawn."""
    pictures: list[Picture] = []
    for chart in RESULTS[kind_of(result.document)].charts:
        if result.document[chart.shows]:
            try:
                svg = _svg(chart.draw(result.document))
            except UNDRAWABLE as fault:
                warn_not_drawn(chart.name, fault)
                continue
            pictures.append(Picture(chart.name.replace("_", "-"), chart.title, svg))
    return tuple(pictures), None


def _atlas(result: LoadedResult) -> Drawn:
    """The map of an atlas, which is read from ``atlas.nc``."""
    from heavytop.plots.atlas import map_figure

    document, path = result.document, result.path.with_name("atlas.nc")
    if "map" not in document["files"] or not path.is_file():
        return (), None
    kind, names = stored_map(path, document["shape"])
    x, y = (headed(document["axes"][side]["name"]) for side in "xy")
    title = f"kinds of motion over {x} and {y}, and their boundaries"
    return (Picture("map", title, _svg(map_figure(document, kind, names))),), None


def stored_map(path: Path, shape: list[int]) -> tuple[NDArray[np.uint8], tuple[str, ...]]:
    """Return the codes of a stored map, of at most `FINEST` pixels an axis, and their names.

    Raises
    ------
    ForeignFile
        It is damaged, too large, or of another shape.
    """
    with opened(path) as file:
        kind = dataset(file, "kind")
        if list(kind.shape) != list(shape) or not all(kind.shape):
            raise ValueError(f"a map of {kind.shape}, not of {tuple(shape)}")
        if kind.dtype != np.uint8 or kind.size > MOST_PIXELS:
            raise ValueError("a map of another type, or too large")
        codes = kind[:: -(-kind.shape[0] // FINEST), :: -(-kind.shape[1] // FINEST)]
        return np.asarray(codes), tuple(attribute(kind, "flag_meanings").split())


RUN_TITLES: Final = {
    "overview": "tilt over precession, and the path of the axis on the unit sphere",
    "angles": "tilt, precession and rate of spin over time",
    "potential": "effective potential, energy, and the tilts that they allow",
    "phase": "the plane of tilt and tilt rate, with neighbouring energies",
    "errors": "distance of the run from the closed form over time",
}


def _run(result: LoadedResult) -> Drawn:
    """The pictures of a run, and its top, where its trajectory is there."""
    from heavytop.plots.figures import FIGURES
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory_file import load_exact, load_trajectory

    path, scene = result.path.with_name("trajectory.nc"), result.document["scene"]
    if "trajectory" not in result.document["files"] or not path.exists():
        return (), None
    exact = result.document.get("source") == SceneMotion.source
    whole: Any = load_exact(path) if exact else load_trajectory(path)
    own = whole.scene.document()
    if any(own[key] != scene.get(key) for key in ("top", "start", "title", "span")):
        raise ForeignFile(
            f"{harmless(path)}: the trajectory of another scene than run.json is about"
        )
    shown = as_drawn(whole)
    pictures = tuple(
        Picture(name, RUN_TITLES[name], _svg(draw(whole if name == "errors" else shown)))
        for name, draw in FIGURES.items()
        if name != "errors" or not exact
    )
    try:
        return pictures, frames(shown)
    except NoClosedForm:
        return pictures, None


DRAW: Final[Mapping[str, Callable[[LoadedResult], Drawn]]] = {"run": _run, "atlas": _atlas}
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
        played = [{**each.top, "title": each.heading} for each in self.sections if each.top]
        return rendered(
            "page.html",
            page=self,
            tops=tops(played) if played else None,
            versions={name: version(name) for name in LIBRARIES},
        )


def page_of(results: Sequence[LoadedResult]) -> Page:
    """Return the page of what folders hold.

    Parameters
    ----------
    results : sequence of LoadedResult
        As `load_results` returns them.

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
        else each._replace(heading=f"{each.heading} ({each.result.name})")
        for each in sections
    )  # fmt: skip
    return Page(tuple(apart), typed())


def _sections(results: Sequence[LoadedResult]) -> Iterator[Section]:
    counts: Counter[str] = Counter()
    for result in results:
        counts[result.path.name] += 1
        try:
            with warnings.catch_warnings():
                for kind in (RuntimeWarning, UserWarning):  # of numbers that no picture can show
                    warnings.simplefilter("ignore", kind)
                warnings.simplefilter("always", NotDrawnWarning)
                yield _section(result, counts[result.path.name])
        except ForeignFile:
            raise
        except (LookupError, TypeError, ValueError, ArithmeticError, RuntimeError) as fault:
            why = harmless(f"{type(fault).__name__}: {fault}")[:200]
            raise ForeignFile(f"{harmless(result.path)}: not what was written ({why})") from fault


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


def player_html(trajectory: Trajectory) -> str:
    """A page with the top of a trajectory in three dimensions, to be played, turned and zoomed.

    Parameters
    ----------
    trajectory : Trajectory

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
    return rendered("player_page.html", tops=tops([frames(trajectory)]))


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
    return jinja.get_template(template).render(**own, **values, policy=POLICY.format(allowed))


def _typeset(text: str) -> Markup:
    """A text of ours or of others, with the index of a momentum below the line."""
    signs = {"phi": "φ", "psi": "ψ"}
    return Markup(MOMENTUM.sub(lambda m: f"p<sub>{signs.get(m[1], m[1])}</sub>", str(escape(text))))


def address(svg: str) -> Markup:
    """A picture as an address that an image takes: in an image, no script of it can run."""
    return Markup("data:image/svg+xml;base64," + b64encode(svg.encode()).decode())
