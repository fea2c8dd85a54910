"""The verbs of studies: many runs, stored as they end, so that they can be resumed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from typer import Argument, BadParameter, Option

from heavytop import errors
from heavytop.cli import options
from heavytop.cli.command import (
    Exit,
    leave,
    manner,
    note,
    progress_bar,
    results_folder,
    say,
    show,
    verb,
)
from heavytop.cli.options import option
from heavytop.cli.run import is_run, resume_run
from heavytop.results.base import command_of, typed, typing

if TYPE_CHECKING:
    from heavytop.results.base import Result
    from heavytop.studies.study import Progress


def study(kind: str, output: Path | None, no_figures: bool, **asked: Any) -> None:
    """Do a study, as the function of its name does it, and finish it."""
    scene, changes, scheduler = (asked.pop(n, None) for n in ("scene", "changes", "scheduler"))
    if scheduler is not None and (asked["jobs"] or 1) > 1:
        raise BadParameter(
            "cannot be combined with --scheduler, which has its own workers", param_hint="--jobs"
        )
    for name in {"methods", "cases"} & asked.keys():
        asked[name] = options.names(f"--{name}", asked[name])
    given = {name: value for name, value in asked.items() if value is not None}
    do = getattr(import_module(f"heavytop.studies.{kind}"), kind)
    about = () if scene is None else (options.read(scene, changes),)
    with progress_bar() as bar, _workers(scheduler) as executor:
        found = do(*about, folder=output, progress=bar, **executor, **given)
    finish(found, output, figures=not no_figures)


@contextmanager
def _workers(scheduler: str | None) -> Iterator[dict[str, Any]]:
    """The workers of a scheduler, if there is one."""
    if scheduler is None:
        yield {}
        return
    from heavytop.studies.workers import executor_at

    with executor_at(scheduler) as executor:
        yield {"executor": executor}


def finish(found: Result, output: Path | None, *, figures: bool = True) -> None:
    """Write and print what a verb found, then draw it; leave with what is wrong with it."""
    from heavytop.report.files import draw_study, write_study

    files: Mapping[str, str] = {}
    ends: list[tuple[Exit, str]] = []
    if output is not None:
        with _noted(ends):
            files = write_study(found, output, figures=False)
    if not manner().json:
        show(replace(found, files=files))
    if output is not None and figures and not ends:
        with _noted(ends):
            drawn = draw_study(found, output, files)
            charts = [name for key, name in drawn.items() if key not in files]
            if charts and not manner().json:
                print(f"charts  {', '.join(charts)}")
            files = drawn
    for name in files.values():
        note(f"wrote {Path(output or '') / name}")
    if manner().json:
        show(replace(found, files=files))
    unrun = found.unrun()
    leave([*ends, *((_missing(unrun) if unrun else ()) or found.problems())])


@contextmanager
def _noted(ends: list[tuple[Exit, str]]) -> Iterator[None]:
    """Go on after what cannot be written; it is said at the end."""
    try:
        yield
    except errors.StoppedEarly as fault:
        ends.append((Exit.ENDED_EARLY, str(fault)))


def _missing(methods: Sequence[str]) -> list[tuple[Exit, str]]:
    """What is to be installed, where no method of a study could be run without it."""
    from heavytop.studies.methods import is_auto, method

    needs = [() if is_auto(name) else method(name).absent for name in methods]
    if needs and all(needs):
        return [(Exit.USAGE, str(errors.MissingPackage(methods[0], needs[0])))]
    return []


# --- verbs -----------------------------------------------------------------------------------

ENSEMBLE: Final = "Number of neighbouring starts to average over, such as 16."
SAMPLES: Final = "Number of times at which errors are measured, such as 50."


@verb
def drift(
    scene: options.SceneName,
    periods: options.Periods = 10_000,
    methods: options.Methods = None,
    ensemble: Annotated[int, option("K", ENSEMBLE)] = 1,
    samples: Annotated[int, option("M", SAMPLES)] = 25,
    seed: Annotated[int, option("S", "Random seed of the neighbouring starts, such as 7.")] = 0,
    jobs: options.Jobs = 1,
    scheduler: options.Scheduler = None,
    output: options.Folder = None,
    changes: options.Changes = None,
    no_figures: options.NoFigures = False,
) -> None:
    """Integrate over many periods by several methods; plot errors."""
    study("drift", **locals())


@verb
def workprec(
    scene: options.SceneName,
    periods: options.Periods = 100,
    methods: options.Methods = None,
    budget: options.Budget = 240,
    output: options.Folder = None,
    changes: options.Changes = None,
    no_figures: options.NoFigures = False,
) -> None:
    """Time every method at every setting; plot times against errors."""
    study("work_precision", **locals())


CASES: Final = option("NAME,…", "Cases, such as cusp,lie-group; default: all.")
TRIED: Final = option("NAME,…", "Methods, such as auto,gauss8; default: all.")
LIST: Final = "List the cases, with the reason why each is hard, and the methods."


@verb
def stress(
    cases: Annotated[str | None, CASES] = None,
    methods: Annotated[str | None, TRIED] = None,
    budget: options.Budget = 240,
    time_limit: Annotated[
        float, option("S", "Time limit of a run [s], such as 10; then it is killed.")
    ] = 3,
    step_limit: Annotated[
        int, option("N", "Limit of the steps of a run, such as 10000.")
    ] = 2_000_000,
    listed: Annotated[bool, Option("--list", help=LIST)] = False,
    jobs: options.Jobs = 1,
    scheduler: options.Scheduler = None,
    output: options.Folder = None,
    no_figures: options.NoFigures = False,
) -> None:
    """Run all methods on known hard cases."""
    asked = locals()
    if asked.pop("listed"):
        from heavytop.studies.stress import listing

        show(listing())
    else:
        study("stress", **asked)


AXIS: Final = "NAME=FROM:TO:COUNT"
ALONG_X: Final = "Quantity along x and its range, in SI units: phidot=-20:20:401."
ALONG_Y: Final = "Quantity along y; with log for equal ratios: psidot=1:200:300:log."


@verb
def atlas(
    scene: options.SceneName,
    x: Annotated[str | None, option(AXIS, ALONG_X)] = None,
    y: Annotated[str | None, option(AXIS, ALONG_Y)] = None,
    only: Annotated[str | None, option("kind", "Compute only the kinds; faster.")] = None,
    jobs: Annotated[int | None, options.JOBS] = None,
    scheduler: options.Scheduler = None,
    output: options.Folder = None,
    changes: options.Changes = None,
    no_figures: options.NoFigures = False,
) -> None:
    """Classify every pixel of a plane of tops, and draw the map."""
    asked: dict[str, Any] = {"x": x, "y": y, "only": only, "jobs": jobs}
    asked |= {"scheduler": scheduler}
    if missing := [f"--{axis}" for axis in "xy" if not asked[axis]]:
        rule = "is missing: an axis NAME=FROM:TO:COUNT, such as phidot=-20:20:401"
        raise BadParameter(rule, param_hint=" and ".join(missing))
    _no_clash(changes or [], (str(x), str(y)))
    asked |= {"scene": scene, "changes": changes, "output": output, "no_figures": no_figures}
    study("atlas", **asked)


def _alone(option: str, others: Mapping[str, object]) -> None:
    """Refuse what says nothing beside an option, rather than pass it over."""
    if given := [f"--{name}" for name, value in others.items() if value]:
        raise BadParameter(f"cannot be combined with {option}", param_hint=", ".join(given))


def _no_clash(changes: list[str], axes: tuple[str, str]) -> None:
    """Refuse a change of the scene to what an axis changes pixel by pixel."""
    from heavytop.studies.atlas_plane import ROLES

    varied = {ROLES[n]: n for axis in axes if (n := axis.partition("=")[0].strip()) in ROLES}
    for change in changes:
        table, _, key = change.partition("=")[0].strip().partition(".")
        if table in ("top", "start") and key in ROLES and ROLES[key] in varied:
            what = ROLES[key]
            rule = f"{change!r}: the axis {varied[what]} sets the {what} of every pixel"
            raise BadParameter(rule, param_hint="--set")


PROJECTED: Final = "Project the run onto its invariants."
CERTIFIED: Final = "The folder of a run, or a scene, which is run first."
RUN: Final = Argument(metavar="SCENE", help=CERTIFIED)


@verb
def certify(
    run: Annotated[str, RUN],
    formulation: options.Formulation = options.FormulationName.AUTO,
    projected: Annotated[bool, Option("--projected", help=PROJECTED)] = False,
    jobs: options.Jobs = 1,
    scheduler: options.Scheduler = None,
    output: options.Folder = None,
    changes: options.Changes = None,
) -> None:
    """Prove a bound of a run's error at all times.

    A stored run is integrated again, and must have the same bits.
    """
    from heavytop.report.files import TRAJECTORY
    from heavytop.scene.scene import shipped_names
    from heavytop.studies.certificate import certify as proved

    asked = {"formulation": formulation.value != "auto", "projected": projected, "set": changes}
    with progress_bar() as bar, _workers(scheduler) as executor:
        if (Path(run) / TRAJECTORY).exists():
            from heavytop.run.trajectory_file import load_trajectory

            _alone(f"the folder {run}", asked)
            known: Any = load_trajectory(Path(run) / TRAJECTORY)
        elif (Path(run) / "study.jsonl").exists():
            raise BadParameter(f"{run}: the folder of a study; heavytop resume continues it")
        elif Path(run).is_dir() and run not in shipped_names():
            raise BadParameter(f"{run}: this folder holds no finished run")
        else:
            known = options.read(run, changes)
            if asked["formulation"] or projected:
                from heavytop.run.propagation import propagate

                known = propagate(known, formulation=formulation.value, projected=projected)
        found = proved(known, jobs=jobs, folder=output, progress=bar, **executor)
    finish(found, output)


OWN: Final = "Your own methods that the study uses, named again: mine.py:rk4."
BEGUN: Final = "The folder of a study, such as drift or validate, or of a run."
WAS: Final = Argument(metavar="DIR", help=BEGUN, parser=options.named_folder)


@verb
def resume(
    folder: Annotated[Path, WAS],
    methods: Annotated[str | None, option("NAME,…", OWN)] = None,
    jobs: options.Jobs = 1,
    scheduler: options.Scheduler = None,
    no_figures: options.NoFigures = False,
) -> None:
    """Continue a study or a run that was interrupted or killed."""
    files = (folder / name for name in ("study.jsonl", "request.json", "run.json"))
    made = next(filter(None, map(command_of, files)), typed())
    with typing(made):  # the result is that of the command that began it
        if not is_run(folder):
            drawn = not (no_figures or "--no-figures" in (made or "").split())  # as it was begun
            own = options.names("--methods", methods) or ()
            _resume_study(folder, scheduler, figures=drawn, methods=own, jobs=jobs)
        elif scheduler is not None or methods is not None:
            hint = "--scheduler" if methods is None else "--methods"
            raise BadParameter("is only for studies, and this folder holds a run", param_hint=hint)
        else:
            with results_folder(folder):
                resume_run(folder, figures=not no_figures)


def _resume_study(folder: Path, scheduler: str | None, *, figures: bool, **asked: Any) -> None:
    """Go on with a study; of one that has ended, say so and print it."""
    if not (folder / "study.jsonl").exists():
        lacking = "study.jsonl, of a study, nor trajectory.nc or request.json, of a run"
        raise errors.ForeignFile(
            f"{folder}: no folder with anything to go on with: neither {lacking}"
        )
    from heavytop.studies.study import resume as go_on

    shown: list[Progress] = []
    with progress_bar() as bar, _workers(scheduler) as executor:

        def heard(now: Progress) -> None:
            shown.append(now)
            if bar is not None:
                bar(now)

        found = go_on(folder, progress=heard, **executor, **asked)
    if 0 < shown[0].tasks == shown[0].ended:
        say(f"{folder}: this study is finished")
    finish(found, folder, figures=figures)
