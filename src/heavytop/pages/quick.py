"""The quick studies, which a report runs where it is given no results."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from heavytop.errors import EndedEarly, HeavyTopError
from heavytop.files import write_document

if TYPE_CHECKING:
    from heavytop.scene import Scene

BOOK: Final = ("sicm-kicked", "sicm-dropped", "sicm-forward", "sicm-forward-spin-held")
LIMIT_S: Final = 290.0  # of all of them; what checks the claims gets what is left
WORKPREC_S: Final = 40.0
STRESS_S: Final = 40.0
PERIODS: Final = 1000
DRIFTING: Final = ("taylor-axis", "dop853-scipy", "strang", "gauss8")
CASES: Final = (
    "through-top", "through-bottom", "near-top-1e-4", "near-top-1e-8", "lie-group",
    "beside-the-top", "sleeping-1+1e-4", "sleeping-1-1e-4", "falling-1e-6", "separatrix-20",
    "near-separatrix", "cusp", "kick+1e-6", "kick-1e-6",
)  # fmt: skip
PIXELS: Final = 300
KICKS: Final = (-30, 40)  # rad/s of φ̇ across the atlas, and
TILTS: Final = ("0.02", "1.5")  # rad of θ


class Study(NamedTuple):
    """One of them: its name, and what writes its files into a folder."""

    name: str
    write: Callable[[Path], object]


def quick(
    place: Path, scene: Scene | None = None, *, heard: Callable[[str], object] = lambda _: None
) -> list[tuple[str, str]]:
    """Run the quick studies, each into a folder of its own.

    Parameters
    ----------
    place : Path
        It exists.
    scene : Scene, optional
        What they are about; the book's tops where there is none.
    heard : callable, optional
        It is told the name of each before it begins.

    Returns
    -------
    list of (str, str)
        What was not run, and why.
    """
    missing = []
    for study in (*_studies(scene), _claims(time.monotonic() + LIMIT_S)):
        heard(study.name)
        folder = place / study.name
        folder.mkdir()
        try:
            study.write(folder)
        except HeavyTopError as why:
            missing.append((study.name, " ".join(str(why).split())[:300]))
    return missing


def _studies(scene: Scene | None) -> Iterator[Study]:
    from heavytop.scene import load_scene

    scenes = [load_scene(name) for name in BOOK] if scene is None else [scene]
    about = scenes[0]
    for k, each in enumerate(scenes, start=1):
        yield Study(f"run-{k}-{_harmless(each.name)}", partial(_run, each))
    if scene is None:
        yield Study("traces", _traces)
    yield Study("drift", partial(_drift, about))
    yield Study("workprec", partial(_workprec, about))
    yield Study("stress", _stress)
    yield Study("atlas", partial(_atlas, about))
    upright = load_scene("sleeping-unstable") if scene is None else scene
    yield Study("energy-momentum", partial(_energy_momentum, upright))


def _harmless(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in name)[:60]


def _run(scene: Scene, folder: Path) -> None:
    from heavytop.planning import plan

    chosen = plan(scene)
    if chosen.formulation == "none" or chosen.folded:
        write_document(folder / "run.json", {**_at_once(scene, chosen), "files": {}})
        return
    from heavytop.propagation import propagate
    from heavytop.results import write_results

    try:
        trajectory = propagate(scene)
    except EndedEarly as early:
        trajectory = early.trajectory
    write_results(trajectory, folder, figures=False)


def _at_once(scene: Scene, chosen: Any) -> dict[str, Any]:
    """The document of a scene that is known at once, or from one nutation."""
    if not chosen.folded:
        from heavytop.document import known_document

        return known_document(scene, chosen)
    from heavytop.folded import fold
    from heavytop.folded_document import folded_document

    return folded_document(fold(scene), chosen)


def _traces(folder: Path) -> None:
    from heavytop.pages.traces import traces_document

    write_document(folder / "traces.json", traces_document())


def _drift(scene: Scene, folder: Path) -> None:
    from heavytop.drifts.drifting import drift
    from heavytop.study_results import write_drift

    found = drift(scene, methods=DRIFTING, periods=PERIODS, folder=folder)
    write_drift(found, folder, figures=False)


def _workprec(scene: Scene, folder: Path) -> None:
    from heavytop.study_results import write_work_precision
    from heavytop.workprecs.measuring import work_precision

    write_work_precision(work_precision(scene, budget=WORKPREC_S), folder, figures=False)


def _stress(folder: Path) -> None:
    from heavytop.stresses.stressing import stress
    from heavytop.study_results import write_stress

    write_stress(stress(cases=CASES, budget=STRESS_S), folder, figures=False)


def _atlas(scene: Scene, folder: Path) -> None:
    from heavytop.atlases.mapping import atlas
    from heavytop.study_results import write_atlas

    x = f"phidot={KICKS[0]}:{KICKS[1]}:{PIXELS}"
    y = f"theta={TILTS[0]}:{TILTS[1]}:{PIXELS}"
    write_atlas(atlas(scene, x, y, folder=folder), folder, figures=False)


def _energy_momentum(scene: Scene, folder: Path) -> None:
    from heavytop.energy_momentum_document import energy_momentum_document
    from heavytop.study_results import write_energy_momentum

    write_energy_momentum(energy_momentum_document(scene), folder, figures=False)


class NotRun(HeavyTopError):
    """A study that this installation cannot run, or that had no time left."""


def _claims(until: float) -> Study:
    """The check of the claims, in a process of its own, which ends when time is up."""
    return Study("claims", partial(_validate, until))


def _validate(until: float, folder: Path) -> None:
    command = [sys.executable, "-m", "heavytop", "validate", "-q", "-o", str(folder)]
    left = until - time.monotonic()
    if left <= 0:
        raise NotRun("no time was left; heavytop validate has it all")
    try:
        done = _ended(command, left)
    except subprocess.TimeoutExpired:
        raise NotRun(f"it took more than {left:.0f} s; heavytop validate waits") from None
    if not (folder / "validate.json").is_file():
        said = " ".join(done.split())[-200:]
        raise NotRun(f"heavytop validate wrote nothing ({said})")


def _ended(command: Sequence[str], limit_s: float) -> str:
    done = subprocess.run(command, capture_output=True, text=True, timeout=limit_s, check=False)
    return done.stderr
