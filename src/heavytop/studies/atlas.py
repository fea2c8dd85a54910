"""Atlases: the kind of motion of every pixel of a plane of tops, and numbers of the motion.

A tile of the plane is a task of the study; it is one chunk, whose one row holds its columns.
"""

from __future__ import annotations

import os
import time
from base64 import b64decode, b64encode
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop import __version__
from heavytop.analytic.many import PROMISED, Motions, motions_many
from heavytop.classification.arrays import (
    IMPOSSIBLE,
    TAG_NAMES,
    VERDICT_DETAILS,
    VERDICT_NAMES,
    Mask,
)
from heavytop.classification.kinds import Kind
from heavytop.classification.many import classify_many
from heavytop.doctor import usable_cpus, versions
from heavytop.errors import Fault, ForeignFile, refuse
from heavytop.results.atlas import Atlas
from heavytop.scene import arguments
from heavytop.scene.arguments import JOBS
from heavytop.scene.quantities import quantity_of
from heavytop.scene.scene import Scene, expect_scene, scene_of
from heavytop.studies.atlas_plane import ROLES, Axis, Plane, curves
from heavytop.studies.journal import Chunk, Journal, Parameters, canonical_json
from heavytop.studies.study import Progress, run
from heavytop.studies.workers import check_how

if TYPE_CHECKING:
    import xarray

Pixels = dict[str, NDArray[Any]]

ACCURACY: Final = f"{PROMISED:g}: of period relative, of angles relative to max(1, |x|)"
"""The accuracy of the numbers of a map."""
KIND: Final = "atlas"
TILE: Final = {"kind": 2**20, "rows": 2**16}
"""Most pixels of a tile: a second of work or less, within the memory of a worker."""
CODES: Final = ("kind", "detail", "certified", "tags", "open_tags")
PIXEL_NUMBERS: Final = ("theta_min", "theta_max", "period", "precession", "spin")
SETS: Final = {"kind": CODES[:3], "rows": (*CODES, *PIXEL_NUMBERS)}
"""The columns with ``only="kind"``, and by default."""
PIXEL_TYPES: Final = dict.fromkeys(CODES, "u1") | dict.fromkeys(PIXEL_NUMBERS, "<f8")
VALUES: Final = {"kind": VERDICT_NAMES, "detail": ("none", *VERDICT_DETAILS[1:])}
TAG_BITS: Final = dict.fromkeys(("tags", "open_tags"), TAG_NAMES)
"""The meanings of codes, and of bits, in the columns that have them."""


# --- the study: parameters and tiles --------------------------------------------------------------


def _plane(parameters: Parameters) -> Plane:
    """Return the plane of a study."""
    if parameters["kind"] != KIND:
        raise ForeignFile(f"a study of {parameters['kind']!r:.40}, no atlas")
    x, y = (Axis.of(parameters[side]) for side in "xy")
    return Plane(scene_of(parameters["scene"]), x, y)


def tasks(parameters: Parameters) -> tuple[str, ...]:
    """Return the names of the tiles of a study."""
    return tuple(_plane(parameters).tiles(parameters["tile"]))


def advance(parameters: Parameters, task: str, checkpoint: object) -> Iterator[Chunk]:
    """Compute a tile, in one chunk."""
    began, plane = time.perf_counter(), _plane(parameters)
    tile = plane.tiles(parameters["tile"])[task]
    columns = _compute(plane.tops(tile), parameters["what"])
    file = BytesIO()  # compressed where that is worth its time
    (np.savez if "period" in columns else np.savez_compressed)(file, **columns)  # type: ignore[arg-type]
    row = {"tile": b64encode(file.getvalue()).decode()}
    yield Chunk(rows=(row,), done=True, seconds=time.perf_counter() - began)


def _compute(tops: dict[str, Any], what: str) -> Pixels:
    """Return the columns of a tile."""
    shape = np.broadcast_shapes(*map(np.shape, tops.values()))
    bottom = np.broadcast_to(np.equal(tops["theta"], np.pi), shape)
    mirrored = _mirror(tops, bottom) if bottom.any() else tops
    rows = None if what == "kind" else motions_many(**mirrored, tags=True)
    verdicts = classify_many(**mirrored) if rows is None else rows.verdicts
    columns = {n: getattr(rows if n in Motions.columns else verdicts, n) for n in SETS[what]}
    if bottom.any():
        columns = _restore(columns, tops, bottom)
    return {name: each.astype(PIXEL_TYPES[name]) for name, each in columns.items()}


# --- θ = π ----------------------------------------------------------------------------------------
# The double nearest π stands for π itself. Mirrored (θ → π − θ, ψ → −ψ, g → −g) such a start is at
# θ = 0, where doubles are exact.

_NEGATED: Final = ("gMR", "thetadot", "psidot", "omega3")


def _mirror(tops: Mapping[str, Any], bottom: Mask) -> dict[str, Any]:
    """Return tops, those at the bottom mirrored."""
    negated = {name: np.where(bottom, -tops[name], tops[name]) for name in _NEGATED if name in tops}
    return {**tops, **negated, "theta": np.where(bottom, 0.0, tops["theta"])}


def _restore(columns: Pixels, tops: Mapping[str, Any], bottom: Mask) -> Pixels:
    """Return the columns of tops as they were before those at the bottom were mirrored."""
    found, kind = dict(columns), columns["kind"]
    swapped = np.arange(len(VERDICT_NAMES), dtype=np.uint8)
    poles = [VERDICT_NAMES.index(each) for each in (Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM)]
    swapped[poles] = poles[::-1]
    found["kind"] = np.where(bottom, swapped[kind], kind)
    if "tags" in found:
        weighted = bottom & np.not_equal(tops["gMR"], 0) & (kind != IMPOSSIBLE)
        inverted = np.uint8(1 << TAG_NAMES.index("inverted-gravity"))
        found["tags"] = np.where(weighted, found["tags"] ^ inverted, found["tags"])
        found["theta_min"] = np.where(bottom, np.pi - columns["theta_max"], columns["theta_min"])
        found["theta_max"] = np.where(bottom, np.pi - columns["theta_min"], columns["theta_max"])
        found["spin"] = np.where(bottom, -found["spin"], found["spin"])
    return found


# --- the result -----------------------------------------------------------------------------------


def collect(journal: Journal, jobs: int = 1) -> Atlas:
    """Return the atlas that all tiles of a study make.

    Raises
    ------
    ForeignFile
        A tile is not there.
    """
    parameters, plane = journal.parameters, _plane(journal.parameters)
    tiles, what = plane.tiles(parameters["tile"]), parameters["what"]
    columns = {name: np.empty(plane.shape, PIXEL_TYPES[name]) for name in SETS[what]}
    pairs = np.zeros((len(VERDICT_NAMES), len(VERDICT_DETAILS)), np.int64)
    for task, tile in tiles.items():
        if not journal.record(task).last.done:
            why = f"not computed yet; heavytop resume {journal.folder} goes on"
            raise ForeignFile(f"tile {task}: {journal.record(task).last.failed or why}")
        [row] = journal.rows(task)
        found = dict(np.load(BytesIO(b64decode(row["tile"]))))
        for name, column in columns.items():
            column[tile] = found[name]
        codes = found["kind"].ravel() * np.int64(len(VERDICT_DETAILS)) + found["detail"].ravel()
        pairs += np.bincount(codes, minlength=pairs.size).reshape(pairs.shape)
    kinds = zip(VERDICT_NAMES, pairs.sum(axis=1).tolist(), strict=True)
    detailed = [(k, d) for k, d in np.argwhere(pairs) if VERDICT_DETAILS[d]]
    details = {f"{VERDICT_NAMES[k]}, {VERDICT_DETAILS[d]}": int(pairs[k, d]) for k, d in detailed}
    seconds = sum(journal.record(task).seconds for task in tiles)
    speed = float(np.prod(plane.shape) / seconds * jobs) if seconds else 0.0
    lines = ({**each, "x": each.x.tolist(), "y": each.y.tolist()} for each in curves(plane))
    return Atlas(
        scene=parameters["scene"],
        axes={"x": plane.x.range, "y": plane.y.range},
        shape=plane.shape,
        what=what,
        counts={name: count for name, count in kinds if count},
        details=details,
        uncertified=int(np.count_nonzero(columns["certified"] == 0)),
        curves=tuple(lines),
        kinds_per_s=speed if what == "kind" else None,
        rows_per_s=speed if what == "rows" else None,
        versions=parameters["versions"],
        map=_dataset(plane, columns, parameters),
    )


def _dataset(plane: Plane, columns: Pixels, parameters: Parameters) -> xarray.Dataset:
    """Return the map as a Dataset, with attributes by the CF conventions."""
    import xarray

    axes = plane.y, plane.x
    places = {a.name: (a.name, a.values, quantity_of(a.name).attributes) for a in axes}
    about = {
        "Conventions": "CF-1.11",
        "title": plane.scene.title or plane.scene.name,
        "source": f"heavytop {__version__}",
        "accuracy": ACCURACY,
        "parameters": canonical_json(parameters),
    }
    found = {name: (tuple(places), each, _attributes(name)) for name, each in columns.items()}
    return xarray.Dataset(found, places, about)


def _attributes(name: str) -> dict[str, Any]:
    """Return the attributes of a column: name, unit, and the meanings of its codes or bits."""
    found: dict[str, Any] = dict(quantity_of(name).attributes)
    if words := (VALUES | TAG_BITS).get(name):
        codes = np.arange(len(words), dtype=np.uint8)
        found |= {"flag_values": codes} if name in VALUES else {"flag_masks": 1 << codes}
        found["flag_meanings"] = " ".join(words)
    return found


# --- making an atlas ------------------------------------------------------------------------------


def atlas(
    scene: Scene,
    x: str,
    y: str,
    *,
    only: str | None = None,
    jobs: int | None = None,
    executor: Executor | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Atlas:
    """Classify every pixel of a plane of tops, each with proof, and compute how it moves.

    Parameters
    ----------
    scene : Scene
        Its top and its start give every number that no axis changes.
    x, y : str
        ``"phidot=-20:20:2000"``: start values, constants (p_phi, p_psi, E) or parameters (A, C,
        gMR), with a last ``:log`` on a logarithmic axis.
    only : {"kind"}, optional
        Only kinds are found, many times as fast.
    jobs : int, optional
        Processes; by default one for each processor. Results do not depend on it.
    executor : concurrent.futures.Executor, optional
        What computes the tiles, in place of own processes.
    folder : path, optional
        Where tiles are written down, so that an atlas that was killed goes on from there. It is
        new, or empty, or holds this atlas.
    progress : callable, optional
        It is given a `heavytop.studies.study.Progress` after every tile.

    Returns
    -------
    Atlas

    Raises
    ------
    BadScene
        No axis, two axes that set the same thing, an option of the wrong kind, or more pixels
        than there is room for. Every fault is listed.
    ForeignFile
        The folder holds something else, another atlas, or a damaged file.
    InUse
        Another process is writing the folder.
    StoppedEarly
        Ctrl-C; a full disk; a worker that died twice. What was done is in the folder.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = atlas(load_scene("sicm-kicked"), "phidot=-20:20:41", "psidot=-150:150:31", jobs=1)
    >>> found.counts, found.uncertified
    ({'planar-pendulum': 1, 'loops': 622, 'cusps': 30, 'waves': 618}, 0)

    Notes
    -----
    Accuracy: ``tests/studies/test_atlas.py`` holds pixels to 1e-13 of `heavytop.Motion` alone.
    """
    check_how(progress, executor)
    expect_scene(scene)
    given = {"x": x, "y": y} | arguments.drop_none(only=only, jobs=jobs)
    values, faults = arguments.parse_options(scene.name, given, _OPTIONS)
    if not faults:
        what = "kind" if only else "rows"
        plane = Plane(scene, values["x"], values["y"])
        faults += _impossible(plane, what, folder is None)
    refuse(faults)
    parameters = {
        "kind": KIND,
        "scene": scene.problem(),
        "x": plane.x.text,
        "y": plane.y.text,
        "what": what,
        "tile": TILE[what],
        # Workers may be several machines: the processor is not among the versions.
        "versions": {key: value for key, value in versions().items() if key != "cpu"},
    }
    how = {"executor": executor, "on_progress": progress}
    with Journal.open(folder, parameters) as journal:
        return complete(journal, jobs=values.get("jobs", usable_cpus()), **how)


def complete(journal: Journal, *, jobs: int, **how: Any) -> Atlas:
    """Compute the tiles of an atlas that are not there yet, and return the atlas."""
    run(journal, jobs=jobs, **how)
    return collect(journal, jobs)


def load_atlas(folder: str | os.PathLike[str]) -> Atlas:
    """Read the atlas in a folder.

    Parameters
    ----------
    folder : path
        What `atlas` wrote into, to its end.

    Returns
    -------
    Atlas

    Raises
    ------
    ForeignFile
        It is none, is not at its end, or is damaged.
    WrongType
        It is no path.

    Notes
    -----
    Accuracy: as of `atlas`; ``tests/studies/test_atlas.py`` holds what is read to be what was
    computed, bit for bit.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from heavytop.scene.scene import load_scene
    >>> with TemporaryDirectory() as place:
    ...     plane = load_scene("sicm-kicked"), "phidot=-20:20:41", "psidot=-150:150:31"
    ...     made = atlas(*plane, jobs=1, folder=place)
    ...     print(load_atlas(place).counts == made.counts)
    True
    """
    return collect(Journal.read(arguments.path_of("folder", folder)))


_OPTIONS: Final[Mapping[str, Callable[[Any], Any]]] = {
    "x": Axis.of, "y": Axis.of, "only": arguments.one_of({"kind": "kind"}), "jobs": JOBS
}  # fmt: skip


def _impossible(plane: Plane, what: str, in_memory: bool) -> Iterator[Fault]:
    """Yield faults: two axes that set the same thing; more pixels than fit into memory."""
    x, y, file = plane.x, plane.y, plane.scene.name
    if ROLES[x.name] == ROLES[y.name]:
        rule = f"x = {x.name} and y = {y.name} both set the {ROLES[x.name]}"
        yield Fault(file, None, "y", y.name, rule)
    with suppress(AttributeError, ValueError, OSError):  # not all systems know it
        free = os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
        pixel = sum(np.dtype(PIXEL_TYPES[name]).itemsize for name in SETS[what])
        needed = x.count * y.count * pixel * (4 / 3 + 1)  # in base 64, and as arrays
        if in_memory and needed > free:
            rule = f"{needed / 1e9:.3g} GB are needed in memory, and {free / 1e9:.3g} GB are free"
            yield Fault(file, None, "x, y", f"{x.count * y.count} pixels", rule)
