"""The sections of a page: of every result what it says, its pictures, and the numbers in them.

Nothing else on the page reads the documents of results.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import ForeignFile, NoClosedForm
from heavytop.hdf5 import attribute, dataset, opened
from heavytop.report.parts import FactRows, Fitting, Known, Part, Table, called, given, headed
from heavytop.report.run import run_parts
from heavytop.report.studies import (
    atlas_parts,
    check_parts,
    drift_parts,
    energy_momentum_parts,
    stress_parts,
    validate_parts,
    work_precision_parts,
)
from heavytop.scene.scene_file import written
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from heavytop.report.pages.page import LoadedResult
    from heavytop.run.trajectory import Trajectory

Data = dict[str, Any]
Codes = NDArray[np.uint8]

POINTS: Final = 401  # times of the numbers of a run
TILTS: Final = 201
MARKS: Final = 120  # of a curve: more are not told apart
UNSEEN: Final = 1e-6  # rad, in a picture
FINEST: Final = 600  # pixels of a map that are drawn along an axis, and
KEPT: Final = 100  # those behind the picture
MOST_PIXELS: Final = 2_000_000_000


class Picture(NamedTuple):
    """A picture.

    Attributes
    ----------
    name, title : str
        The name is unique in its section.
    svg : str
    data : tuple of str
        What of the section's data is in it; the first is a list, or columns.
    """

    name: str
    title: str
    svg: str
    data: tuple[str, ...]


class Drawn(NamedTuple):
    """The pictures of a result, the data behind them, and the frames of a top."""

    pictures: tuple[Picture, ...] = ()
    data: Mapping[str, Any] = {}
    top: Mapping[str, Any] | None = None


@dataclass(frozen=True, slots=True)
class Section:
    """One result on the page.

    Attributes
    ----------
    result : LoadedResult
    ident, heading : str
    parts : tuple of Part
        What it says.
    pictures : tuple of Picture
    data : mapping
        The numbers in the pictures.
    top : mapping or None
        The frames of its top.
    """

    result: LoadedResult
    ident: str
    heading: str
    parts: tuple[Part, ...]
    pictures: tuple[Picture, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
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

    @property
    def shown(self) -> Iterator[FactRows | Table | str]:
        """Its parts; of tables that come in several forms, the best."""
        for part in self.parts:
            yield from part.forms[0] if isinstance(part, Fitting) else [part]

    def document(self) -> Data:
        """What the document of a page has of it."""
        return {
            "id": self.ident,
            "heading": self.heading,
            "schema": self.result.document["schema"],
            "file": self.result.name,
            "sha256": self.result.sha256,
            "command": self.command,
            "parts": [part if isinstance(part, str) else part._asdict() for part in self.shown],
            "figures": [
                {"id": f"{self.ident}-{name}", "title": title, "data": list(data)}
                for name, title, _, data in self.pictures
            ],
            "data": self.data,
        }


def section_of(result: LoadedResult, number: int) -> Section:
    """The section of a result, which has this number among those of its kind.

    Raises
    ------
    ForeignFile
        A file beside the document is damaged, or belongs to another result.
    """
    study, document = STUDIES[result.path.name], result.document
    drawn = DRAW.get(result.path.name, _charts)(result)
    notes = () if drawn.pictures or not study.absent else (study.absent,)
    head = f"{study.heading}: {called(document)}" if "scene" in document else study.heading
    parts = (*notes, *study.parts(document))
    return Section(result, f"{study.name}-{number}", head, parts, *drawn)


def _charts(result: LoadedResult) -> Drawn:
    """Those figures of a study for which its document has numbers."""
    pictures: list[Picture] = []
    data: Data = {}
    for figure, (title, names) in STUDIES[result.path.name].figures.items():
        known = {name: _within(result.document, name) for name in names.split()}
        if next(iter(known.values())):
            name = figure.partition(".")[2].removesuffix("_figure").replace("_", "-")
            svg = _svg(_function(figure), result.document)
            pictures.append(Picture(name, title, svg, tuple(known)))
            data |= known
    return Drawn(tuple(pictures), data)


def _within(document: Any, name: str) -> Any:
    """What stands at a place in a document, by names with points between them."""
    for key in name.split("."):
        document = (document or {}).get(key)
    return document


def _function(figure: str) -> Callable[..., Figure]:
    """A function of `heavytop.plots`, which takes its time to import."""
    module, _, name = figure.partition(".")
    function: Callable[..., Figure] = getattr(import_module(f"heavytop.plots.{module}"), name)
    return function


def _svg(draw: Callable[..., Figure], *arguments: Any) -> str:
    """What is drawn, its curves with as many marks as can be told apart."""
    from heavytop.plots.style import svg

    drawn = draw(*arguments)
    for axes in drawn.axes:
        for curve in axes.lines:
            curve.set_markevery(max(1, np.size(curve.get_xdata()) // MARKS))
    with warnings.catch_warnings():
        # Of names that leave no room the picture is small; the page is none the worse.
        warnings.filterwarnings("ignore", message="constrained_layout", category=UserWarning)
        return svg(drawn)


def _atlas(result: LoadedResult) -> Drawn:
    """The map of an atlas, which is read from ``atlas.nc``."""
    document, path = result.document, result.path.with_name("atlas.nc")
    if "map" not in document.get("files", {}) or not path.is_file():
        return Drawn()
    kind, names = stored_map(path, document["shape"])
    few = kind[:: -(-kind.shape[0] // KEPT), :: -(-kind.shape[1] // KEPT)]
    data = {name: document[name] for name in ("curves", "axes", "counts")}
    data |= {"names": list(names), "kind_of_every_so_many_pixels": few.tolist()}
    svg = _svg(_function("atlas.map_figure"), document, kind, names)
    x, y = (headed(document["axes"][side]["name"]) for side in "xy")
    title = f"kinds of motion over {x} and {y}, and their boundaries"
    return Drawn((Picture("map", title, svg, tuple(data)),), data)


def stored_map(path: Path, shape: list[int]) -> tuple[Codes, tuple[str, ...]]:
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


# --- a run: its trajectory is drawn ------------------------------------------------------------

RUN_PICTURES: Final = {
    "overview": ("tilt over precession, and the path of the axis on the unit sphere", "motion"),
    "angles": ("tilt, precession and rate of spin over time", "motion"),
    "potential": ("effective potential, energy, and the tilts that they allow", "potential"),
    "phase": ("the plane of tilt and tilt rate, with neighbouring energies", "motion"),
    "errors": ("distance of the run from the closed form over time", "errors"),
}
"""By picture of a run: its title, and the data in it."""


def _run_parts(document: Known) -> Iterator[Part]:
    yield FactRows.of((name, given(document["scene"][name])) for name in ("top", "start"))
    yield from run_parts(document)


def _run(result: LoadedResult) -> Drawn:
    """The pictures of a run, and its top, where its trajectory is there."""
    from heavytop.plots.figures import FIGURES
    from heavytop.report.pages.player import frames
    from heavytop.run.trajectory_file import load_trajectory

    path, scene = result.path.with_name("trajectory.nc"), result.document["scene"]
    if "trajectory" not in result.document.get("files", {}) or not path.exists():
        return Drawn()
    whole = load_trajectory(path)
    own = whole.scene.document()
    if any(own[key] != scene.get(key) for key in ("top", "start", "title", "span")):
        raise ForeignFile(
            f"{harmless(path)}: the trajectory of another scene than run.json is about"
        )
    quick = _in_doubles(whole)
    pictures = (
        Picture(name, title, _svg(draw, whole if of == "errors" else quick), (of,))
        for name, draw in FIGURES.items()
        for title, of in (RUN_PICTURES[name],)
    )
    try:
        top = frames(quick)
    except NoClosedForm:
        top = None
    return Drawn(tuple(pictures), run_data(whole), top)


def _in_doubles(trajectory: Trajectory) -> Trajectory:
    """The run in double precision where pictures show no more: many digits take long to draw."""
    seen = replace(trajectory, decimals=None)
    ours, theirs = seen.samples.axis, trajectory.samples.axis
    return seen if np.allclose(ours, theirs, UNSEEN, UNSEEN, equal_nan=True) else trajectory


def run_data(trajectory: Trajectory) -> Data:
    """The numbers behind the pictures of a run: its motion, its potential and its errors."""
    quick = _in_doubles(trajectory)
    return {"motion": _motion(quick), "potential": _potential(quick), "errors": _errors(trajectory)}


def _motion(trajectory: Trajectory) -> Data:
    """A run at even times over what is drawn of it; what it does not follow is left out."""
    from heavytop.plots.figures import last_shown

    seen = trajectory(np.linspace(0.0, last_shown(trajectory), POINTS))
    names = ("t", "theta", "phi", "psi", "thetadot", "phidot", "psidot")
    columns = {name: getattr(seen, name) for name in names}
    columns |= zip(("axis_x", "axis_y", "axis_z"), seen.axis.T, strict=True)
    return {name: _listed(x) for name, x in columns.items() if np.isfinite(x).any()}


def _potential(trajectory: Trajectory) -> Data:
    from heavytop.analytic.potential import Potential
    from heavytop.plots.figures import tilts_shown

    motion, A = trajectory.motion, float(trajectory.scene.top.A)
    potential = Potential(motion.rising.source)
    theta = np.linspace(*tilts_shown(potential), TILTS + 2)[1:-1]
    return {
        "theta": _listed(theta),
        "potential": _listed(A * potential(theta)),
        "E_prime": float(motion.constants.E_prime),
        "theta_min": float(motion.theta_min),
        "theta_max": float(motion.theta_max),
    }


def _errors(trajectory: Trajectory) -> Data:
    from heavytop.run.verify import deviations

    try:
        return {name: _listed(x) for name, x in deviations(trajectory, POINTS).items()}
    except NoClosedForm:
        return {"t": []}


def _listed(values: Any) -> list[Any]:
    return [float(f"{x:.12g}") if np.isfinite(x) else None for x in np.asarray(values)]


# --- what there is of every kind of result -----------------------------------------------------


class Study(NamedTuple):
    """A kind of result: what it is called on the page, what it says, and what is drawn of it.

    Its figures are functions of `heavytop.plots`, each with a title and the names of what of the
    document is in it; the first is a list, or columns.
    """

    name: str
    heading: str
    parts: Callable[[Known], Iterable[Part]]
    figures: Mapping[str, tuple[str, str]] = {}
    absent: str = "Nothing was measured: there is no figure."


STUDIES: Final = {
    "run.json": Study(
        "run", "Run", _run_parts, absent="trajectory.nc is not beside run.json: no pictures."
    ),
    "traces.json": Study("traces", "Every kind of motion", lambda _: (), {
        "sphere.traces_figure": ("the path of the axis on the unit sphere, in closed form; "
                                 "dot: start, cross: vertical", "traces"),
    }),
    "drift.json": Study("drift", "Drift", drift_parts, {
        "studies.drift_figure": ("errors over nutation periods, both logarithmic", "methods"),
    }),
    "workprec.json": Study("workprec", "Work and precision", work_precision_parts, {
        "studies.workprec_figure": ("time of a period over error, both logarithmic",
                                     "points front front_theta"),
    }),
    "stress.json": Study("stress", "Where methods fail", stress_parts, {
        "studies.stress_figure": ("digits lost at every case by every method", "cases hard"),
    }),
    "atlas.json": Study("atlas", "Atlas", atlas_parts,
                        absent="There is no whole map beside atlas.json: no figure."),
    "energy_momentum.json": Study(
        "energy-momentum", "Energy and momentum", energy_momentum_parts, {
        "theory.energy_momentum_figure": (
            "energy over momentum at the p_ψ of the scene: kinds, and the edge of steady "
            "precession", "edge start standing hanging thread window circuit"),
        "theory.critical_set_figure": (
            "the critical set over all p_ψ: two sheets of steady precession, and the thread",
            "critical_set.sheets critical_set.thread critical_set.sleeping critical_set.hanging"),
    }),
    "check.json": Study("check", "Check", check_parts, {
        "check.check_figure": ("errors of the trajectory over time, and how far it runs ahead",
                               "curves"),
    }),
    "validate.json": Study("claims", "Claims", validate_parts, absent=""),
}  # fmt: skip
"""By the name of a document."""

DRAW: Final = {"run.json": _run, "atlas.json": _atlas}
"""What draws the results whose pictures are of another file than the document."""
