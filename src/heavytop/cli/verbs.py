"""Verbs that do more than call one function of the package."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from pkgutil import resolve_name
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from heavytop import errors
from heavytop.cli.command import CommandResult, option, print_error, read_scene
from heavytop.cli.run import run_folder
from heavytop.errors import Exit, Impossible
from heavytop.scene.arguments import Broken, gather
from heavytop.text import printable

if TYPE_CHECKING:
    from heavytop.analytic.reference import Reference
    from heavytop.results.base import Result
    from heavytop.scene.scene import Scene

RUN_DEFAULTS: Final = {"formulation": "auto", "tolerance": None}
TABLE_ENDINGS: Final = (".csv", ".json")


# --- studies ---------------------------------------------------------------------------------


def stress(*, listing: bool = False, **study: Any) -> Result:
    """Run all methods on known hard cases.

    Parameters
    ----------
    listing : bool
        List the cases, with the reason why each is hard, and the methods.
    """
    from heavytop.studies import stress

    return stress.listing() if listing else stress.stress(**study)


def certify(
    run: str,
    *,
    formulation: str = "auto",
    projected: bool = False,
    changes: Sequence[str] = (),
    **study: Any,
) -> Result:
    """Prove a bound of a run's error at all times.

    A stored run is integrated again, and must have the same bits.

    Parameters
    ----------
    run : str
        The folder of a run, or a scene, which is run first.
    formulation : str
        Equations to integrate, such as axis; auto: the fewest.
    projected : bool
        Project the run onto its invariants.
    """
    from heavytop.run.propagation import propagate
    from heavytop.run.trajectory_file import load_trajectory
    from heavytop.studies import certificate

    stored, as_stored = Path(run) / "trajectory.nc", (formulation, projected, *changes)
    if stored.exists() and as_stored == ("auto", False):
        return certificate.certify(load_trajectory(stored), **study)
    scene = read_scene(run, changes)
    if formulation != "auto" or projected:
        scene = propagate(scene, formulation=formulation, projected=projected)
    return certificate.certify(scene, **study)


# --- what a motion has -----------------------------------------------------------------------


def reference(
    scene: Scene, times: str, *, events: Sequence[str] = (), path: Path | None = None, **given: Any
) -> Reference:
    """Print exact values of a motion in SI, every digit proved.

    Parameters
    ----------
    times : str
        Times [s]: 0:10:0.01, or 1,2.5, or a file with a column t.
    events : sequence of str
        Events to add: turning, reversal, cusp; needs --json or -o x.json.
    path : path, optional
        Write x.csv or x.json; default: print.
    """
    from heavytop.analytic import reference

    broken = ending_fault(path, TABLE_ENDINGS)
    if events and not (option("json") or (path is not None and path.suffix.lower() == ".json")):
        broken.append(("events", "needs --json or -o x.json: no table has them"))
    if option("unit"):
        broken.append(("unit", "reference has SI alone, in which every digit is proved"))
    given |= {"times": reference.read_times(times), "events": events}
    with gather(broken) as attempt:
        attempt(reference.read_request, scene, **given)
    return reference.reference(scene, **given)


def sweep(scene: Scene, over: str, facts: Sequence[str], *, path: Path | None = None) -> Result:
    """Tabulate facts of the motion over a range.

    Parameters
    ----------
    path : path, optional
        Write x.csv or x.json, or document and chart to a folder.
    """
    from heavytop.studies import sweep

    with gather(ending_fault(path, ("", *TABLE_ENDINGS))) as attempt:
        attempt(sweep.read_request, scene, over, facts)
    return sweep.sweep(scene, over, facts)


def ending_fault(path: Path | None, endings: Sequence[str]) -> Broken:
    """The fault of a file with another ending; empty where there is none."""
    if path is None or path.suffix.lower() in endings:
        return []
    return [("path", f"{path}: the name of a file in {', '.join(filter(None, endings))}")]


def check(
    data: str,
    scene: str | None = None,
    *,
    changes: Sequence[str] = (),
    digits: float | None = None,
    **given: Any,
) -> Result:
    """Compare your trajectory with the exact motion; name mistakes.

    Parameters
    ----------
    data : str
        A table (.csv, .tsv, .npz, .mat, .nc or .h5), or the folder of a run.
    scene : str, optional
        Scene of the data, such as sicm-kicked, or a file with only a table [top].
    columns : mapping
        Your names of the columns, such as t=Zeit,theta=tilt [deg].
    undone : sequence of str
        Conventions under which the data are judged, such as y-up,degrees.
    digits : float, optional
        Exit with code 5 if the data have fewer digits than this, such as 6.
    """
    from heavytop.checking import judge

    broken: Broken = []
    if digits is not None and not 0 <= digits < math.inf:
        broken.append(("digits", f"{digits:g} is not a number of digits"))
    if changes and scene is None:
        broken.append(("changes", "needs a --scene to change"))
    with gather(broken) as attempt:
        subject = None if scene is None else attempt(judge.subject, scene, changes)
        attempt(judge.expect_conventions, given.get("undone", ()))
    return replace(judge.check(data, subject, **given), digits_required=digits)


# --- pages and texts -------------------------------------------------------------------------


def report(
    places: Sequence[str] = (),
    *,
    path: Path | None = None,
    changes: Sequence[str] = (),
    progress: Callable[[Any], None] | None = None,
) -> CommandResult:
    """Put results on one HTML page that needs no network.

    The page includes the numbers of each result.

    Parameters
    ----------
    places : sequence of str
        Folders of results; or a scene, which is run and studied first; default: sicm-kicked.
    path : path, optional
        Folder for report.html, which keeps a scene's studies too, or FILE.html; default: the
        current folder.
    """
    from heavytop.report.page import page_of, write_page

    folders = [Path(place) for place in places if Path(place).is_dir()]
    broken: Broken = [("changes", "needs a SCENE to change")] * bool(folders and changes)
    if len(folders) < len(places) != 1:
        none = [place for place in places if not Path(place).is_dir()]
        broken.append(("places", f"several folders, or one scene; no folders: {', '.join(none)}"))
    if broken:
        raise Impossible(broken)
    html, kept = path or Path(), path
    if html.suffix.lower() == ".html":
        kept = None
    else:
        html /= "report.html"
    missing: Mapping[str, str] = {}
    with TemporaryDirectory(prefix="heavytop-") as place:
        if not folders:
            scene = read_scene(next(iter(places), None), changes)
            folders, missing = run_all(scene, kept, Path(place), progress)
        page = page_of(folders)
        html.parent.mkdir(parents=True, exist_ok=True)
        write_page(page, html)
    figures = sum(len(section.pictures) for section in page.sections)
    document = {
        "schema": "heavytop/report/2",
        "file": printable(html),
        "results": [section.name for section in page.sections],
        "missing": [{"study": name, "reason": why} for name, why in missing.items()],
    }
    said = f"{printable(html)}: results: {len(page.sections)}, figures: {figures}"
    notes = [(Exit.OK, f"not on the page: {name}: {why}") for name, why in missing.items()]
    return CommandResult(said, notes, document)


def run_all(
    scene: Scene, kept: Path | None, place: Path, progress: Any
) -> tuple[list[Path], dict[str, str]]:
    """Run a scene and its studies, each with its defaults, in folders that are kept or temporary.

    Return these folders, and the reasons by the names of studies that cannot be done.
    """
    from heavytop.report.files import write_result
    from heavytop.results.registry import RESULTS

    done, missing = list[Path](), dict[str, str]()
    studies = {f.removesuffix(".json"): x for f, x in RESULTS.items() if x.study}
    every = ["run", *(name for name, each in studies.items() if each.reported is not None)]
    say = (lambda text: None) if option("quiet") else print_error
    said = f"{scene.name}: {', '.join(every)} with their defaults"
    say(f"no folder of results: {said}; stress and workprec may take four minutes each")
    for number, name in enumerate(every, 1):
        say(f"{name} ({number} of {len(every)})")
        folder = (kept or place) / name
        try:
            if name == "run":
                answer = run_folder(folder, scene, RUN_DEFAULTS, figures=False, progress=progress)
            else:
                given = [scene if x == "scene" else x for x in studies[name].reported or ()]
                study = resolve_name(f"heavytop.{studies[name].function}")
                beside = {"folder": folder, "progress": progress}
                taken = beside.keys() & signature(study).parameters
                answer = CommandResult(study(*given, **{x: beside[x] for x in taken}))
            with answer.held:
                write_result(answer.found, folder, figures=False)
            done.append(folder)
        except errors.StoppedEarly as stop:
            if kept is None:
                stop.folder = None
            else:
                say(f"{kept}: keeps {', '.join(each.name for each in done) or 'nothing else'}")
            raise
        except (errors.ForeignFile, errors.InUse):  # the folder has another scene
            raise
        except errors.HeavyTopError as fault:
            missing[name] = str(fault)
    return done or [place], missing


def scenes(name: str | None = None) -> CommandResult:
    """List the shipped scenes, or print the text of one.

    Parameters
    ----------
    name : str, optional
        Print the text of this scene.
    """
    from heavytop.results.table import Table
    from heavytop.scene.scene_file import shipped_scenes, shipped_text

    document: dict[str, Any] = {"schema": "heavytop/scenes/1"}
    if name is None:
        titles = shipped_scenes()
        return CommandResult(Table.of_facts(titles.items()), document=document | {"scenes": titles})
    text = shipped_text(name)
    return CommandResult(text, document=document | {"name": name, "text": text})


def derive(*, latex: bool = False) -> CommandResult:
    """Derive the integrated equations from the rotation matrix.

    Parameters
    ----------
    latex : bool
        Print a LaTeX document.
    """
    from heavytop.equations import derivation

    steps = derivation.derivation()
    text = derivation.as_latex(steps) if latex else derivation.as_text(steps)
    return CommandResult(text, document=derivation.derive_document(steps))


def doctor() -> CommandResult:
    """Print the versions, the processor, and heyoka's cache."""
    from heavytop.doctor import diagnosis, in_words

    found = diagnosis()
    missing = [(Exit.OUT_OF_BOUND, f"missing: {name}") for name in found["missing"]]
    return CommandResult(in_words(found), missing, found)
