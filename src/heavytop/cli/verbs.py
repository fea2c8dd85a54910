"""Verbs that do something beside the function that they call, and those that call none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from click import BadParameter

from heavytop import errors
from heavytop.cli.command import (
    Ended,
    exit_with,
    find_function,
    note,
    option,
    print_error,
    print_result,
    read_scene,
    results_folder,
)
from heavytop.errors import Exit
from heavytop.text import harmless

if TYPE_CHECKING:
    from heavytop.results.base import Result
    from heavytop.results.validation import Validation
    from heavytop.scene.scene import Scene

CHARTS: Final = (".svg", ".png", ".pdf")
CHECK_FILES: Final = {"check.json", "check.svg", "check.png"}
PLANE: Final = ("phidot=-30:40:300", "theta=0.02:1.5:300")


# --- studies ---------------------------------------------------------------------------------


def atlas(scene: Scene, x: str, y: str, *, changes: Sequence[str] = (), **study: Any) -> Result:
    """Classify every pixel of a plane of tops, and draw the map."""
    from heavytop.studies import atlas, atlas_plane

    roles = atlas_plane.ROLES
    axes = [axis.partition("=")[0].strip() for axis in (x, y)]
    varied = {roles[name]: name for name in axes if name in roles}
    for change in changes:
        table, _, key = change.partition("=")[0].strip().partition(".")
        if table in ("top", "start") and (what := roles.get(key)) in varied:
            rule = f"{change!r}: the axis {varied[what]} sets the {what} of every pixel"
            raise BadParameter(rule, param_hint="--set")
    return atlas.atlas(scene, x, y, **study)


def stress(*, listing: bool = False, **study: Any) -> Result | Ended:
    """Run all methods on known hard cases.

    Parameters
    ----------
    listing : bool
        List the cases, with the reason why each is hard, and the methods.
    """
    from heavytop.studies import stress

    return Ended(stress.listing()) if listing else stress.stress(**study)


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
    from heavytop.scene.scene import shipped_names
    from heavytop.studies import certificate

    beside = {"--formulation": formulation != "auto", "--projected": projected, "--set": changes}
    known: Any
    if (Path(run) / "trajectory.nc").exists():
        if given := [flag for flag, value in beside.items() if value]:
            rule = f"cannot be combined with the folder {run}"
            raise BadParameter(rule, param_hint=", ".join(given))
        known = load_trajectory(Path(run) / "trajectory.nc")
    elif Path(run).is_dir() and run not in shipped_names():
        raise BadParameter(
            f"{run}: this folder holds no finished run (heavytop resume continues it)"
        )
    else:
        known = read_scene(run, changes)
        if formulation != "auto" or projected:
            known = propagate(known, formulation=formulation, projected=projected)
    return certificate.certify(known, **study)


def validate(names: Sequence[str] = (), *, folder: str | None = None, **study: Any) -> Validation:
    """Measure the package's claims against outside authorities.

    Parameters
    ----------
    names : sequence of str
        Claims or scripts, such as betsch-cone 39_flint; default: all claims.
    folder : path, optional
        Write results to this folder.
    """
    from heavytop import claims

    if study.get("proofs") and not option("quiet"):
        study["note"] = print_error
    return claims.validate(names, folder=folder, **study)


# --- what a motion has -----------------------------------------------------------------------


def reference(
    scene: Scene, times: str, *, events: Sequence[str] = (), path: Path | None = None, **given: Any
) -> None:
    """Print exact values of a motion, every digit proved.

    Parameters
    ----------
    times : str
        Times [s]: 0:10:0.01, or a file with a column t.
    events : sequence of str
        Events to add: turning, reversal, cusp; needs --json or -o x.json.
    path : path, optional
        Write x.csv or x.json; default: print.
    """
    from heavytop.analytic import reference

    expect_ending(path, ".csv", ".json")
    if events and not (option("json") or (path is not None and path.suffix.lower() == ".json")):
        raise BadParameter("with --json or -o x.json: no table", param_hint="--events")
    if option("unit"):
        raise BadParameter(
            "reference has SI alone, in which every digit is proved", param_hint="--unit"
        )
    found = reference.reference(scene, reference.read_times(times), events=events, **given)
    save_or_print(found, path, found.to_csv())


def sweep(scene: Scene, over: str, facts: Sequence[str], *, path: Path | None = None) -> None:
    """Tabulate facts of the motion over a range.

    Parameters
    ----------
    path : path, optional
        Write x.csv, x.json or a picture: x.png, x.svg, x.pdf.
    """
    from heavytop.studies import sweep

    expect_ending(path, ".csv", ".json", *CHARTS)
    found = sweep.sweep(scene, over, facts)
    save_or_print(found, path, found)


def save_or_print(found: Any, path: Path | None, shown: Any) -> None:
    """Write what was found to the file of -o; print it without one, or for a program."""
    if path is not None and path.suffix.lower() in CHARTS:
        from heavytop.plots.style import save

        save(found.figure(), path)
    elif path is not None:
        found.save(path)
    if path is not None:
        note(f"wrote {path}")
    if path is None or option("json"):
        print_result(found.document(), shown)


def expect_ending(path: Path | None, *endings: str) -> None:
    """Refuse a file whose name ends otherwise."""
    if path is not None and path.suffix.lower() not in endings:
        rule = f"{path}: the name of a file in {', '.join(endings)}"
        raise BadParameter(rule, param_hint="-o")


def check(
    data: str,
    scene: str | None = None,
    *,
    changes: Sequence[str] = (),
    digits: float | None = None,
    path: Path | None = None,
    **given: Any,
) -> Ended:
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
    path : path, optional
        Write a chart of the errors (x.svg, x.png or x.pdf), or chart and document to a folder.
    """
    from heavytop.checking import judge

    if digits is not None and not 0 <= digits < math.inf:
        raise BadParameter(f"{digits:g} is not a number of digits", param_hint="--digits")
    if changes and scene is None:
        raise BadParameter("needs a --scene to change", param_hint="--set")
    if path is not None and path.is_dir() and {x.name for x in path.iterdir()} - CHECK_FILES:
        raise BadParameter(f"{path} contains files that are not of a check", param_hint="-o")
    chart = path is not None and path.suffix and not path.is_dir()
    if chart:
        expect_ending(path, *CHARTS)
    subject = None if scene is None else judge.subject(scene, changes)
    found = replace(judge.check(data, subject, **given), digits_required=digits)
    return Ended(found, chart=path) if chart else Ended(found, folder=path)


# --- pages and texts -------------------------------------------------------------------------


def report(
    places: Sequence[str] = (), *, path: Path | None = None, changes: Sequence[str] = ()
) -> None:
    """Put results on one HTML page that needs no network.

    The page includes the numbers of each result.

    Parameters
    ----------
    places : sequence of str
        Folders of results; or a scene, which is run and studied first; default: sicm-kicked.
    path : path, optional
        Folder for report.html, or FILE.html; default: the current folder.
    """
    from heavytop.report.page import page_of, write_page

    folders = [Path(place) for place in places if Path(place).is_dir()]
    others = [place for place in places if not Path(place).is_dir()]
    if folders and changes:
        raise BadParameter("needs a SCENE to change", param_hint="--set")
    if others and len(places) > 1:
        rule = f"give several folders or one scene; these are not folders: {', '.join(others)}"
        raise BadParameter(rule, param_hint="PLACES")
    html = path or Path()
    if html.suffix.lower() != ".html" or html.is_dir():
        html /= "report.html"
    missing: dict[str, str] = {}
    with results_folder(html.parent), TemporaryDirectory(prefix="heavytop-") as place:
        if not folders:
            folders = [Path(place)]
            missing = run_all(read_scene(next(iter(others), None), changes), Path(place))
        page = page_of(folders)
        write_page(page, html)
    figures = sum(len(section.pictures) for section in page.sections)
    document = {
        "schema": "heavytop/report/2",
        "file": harmless(html),
        "results": [section.name for section in page.sections],
        "missing": [{"study": name, "reason": why} for name, why in missing.items()],
    }
    print_result(document, f"{harmless(html)}: results: {len(page.sections)}, figures: {figures}")
    exit_with((Exit.OK, f"not on the page: {name}: {why}") for name, why in missing.items())


STUDIES_OF_REPORT: Final = {
    "run": "run.propagation:propagate",
    "drift": "studies.drift:drift",
    "workprec": "studies.work_precision:work_precision",
    "stress": "studies.stress:stress",
    "atlas": "studies.atlas:atlas",
    "validate": "claims:validate",
}
"""What a report of a scene has, by the folder."""


def run_all(scene: Scene, place: Path) -> dict[str, str]:
    """Run a scene and its studies, each with its defaults; return what cannot be done, and why."""
    from heavytop.report.files import write_results, write_study

    missing, given = {}, {"stress": (), "validate": (), "atlas": (scene, *PLANE)}
    for name, module in STUDIES_OF_REPORT.items():
        note(f"running {name}")
        study, folder = find_function(module), place / name
        folder.mkdir()
        try:
            found = study(*given.get(name, (scene,)))
            (write_results if name == "run" else write_study)(found, folder, figures=False)
        except errors.StoppedEarly:
            raise
        except errors.HeavyTopError as fault:
            missing[name] = str(fault)
    return missing


def scenes(name: str | None = None) -> None:
    """List the shipped scenes, or print the text of one.

    Parameters
    ----------
    name : str, optional
        Print the text of this scene.
    """
    from heavytop.results.base import Table
    from heavytop.scene.scene import shipped_scenes, shipped_text

    document: dict[str, Any] = {"schema": "heavytop/scenes/1"}
    if name is None:
        titles = shipped_scenes()
        print_result(document | {"scenes": titles}, Table.of_facts(titles.items()))
        return
    try:
        text = shipped_text(name)
    except errors.BadScene as unknown:
        raise BadParameter(str(unknown), param_hint="NAME") from None
    print_result(document | {"name": name, "text": text}, text)


def derive(*, latex: bool = False) -> None:
    """Derive the integrated equations from the rotation matrix.

    Parameters
    ----------
    latex : bool
        Print a LaTeX document.
    """
    from heavytop.equations import derivation

    if latex and option("json"):
        rule = "cannot be combined with --json, which contains the LaTeX"
        raise BadParameter(rule, param_hint="--latex")
    steps = derivation.derivation()
    text = derivation.as_latex(steps) if latex else derivation.as_text(steps)
    print_result(derivation.derive_document(steps), text)


def doctor() -> None:
    """Print the versions, the processor, and heyoka's cache."""
    from heavytop.doctor import diagnosis, in_words

    found = diagnosis()
    print_result(found, in_words(found))
    if found["missing"]:
        exit_with([(Exit.OUT_OF_BOUND, "missing: " + ", ".join(found["missing"]))])
