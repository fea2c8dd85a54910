"""The verbs of studies: many runs, stored as they end, so that they can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import typer
from typer import Argument, BadParameter, Option

from heavytop import errors
from heavytop.cli.messages import Exit, leave, progress_bar, say, show
from heavytop.cli.options import Common, SceneName, named_folder, names, scene_names, verb
from heavytop.cli.run import is_run, resume_run
from heavytop.results.base import command_of, typed, typing

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from heavytop.studies.runner import Progress

Asked: TypeAlias = dict[str, Any]
Ends: TypeAlias = Iterator[tuple[Exit, str]]
"""What is wrong with a result: an exit code and a sentence for each fault."""


# --- names, which are too slow to import for anything but a list of them --------------------------


def method_names() -> list[str]:
    """The methods of drift and workprec."""
    from heavytop.comparison import METHODS
    from heavytop.studies.methods import AUTO, taylor_methods

    return [AUTO, *taylor_methods(), *METHODS]


def stress_names() -> list[str]:
    """The methods of stress, each with its setting."""
    from heavytop.studies.methods import stress_methods

    return list(stress_methods())


def case_names() -> list[str]:
    """The hard cases."""
    from heavytop.studies.stress_cases import cases

    return list(cases())


def axis_names() -> list[str]:
    """The quantities that can be an axis of an atlas."""
    from heavytop.studies.atlas_plane import ROLES

    return list(ROLES)


NAMES: Final[Mapping[str, Mapping[str, Callable[[], list[str]]]]] = {
    "drift": {"--methods": method_names},
    "workprec": {"--methods": method_names},
    "stress": {"--cases": case_names, "--methods": stress_names},
    "atlas": {"--x and --y": axis_names},
}
"""What the help of a verb lists."""


def _of_list(known: Callable[[], list[str]]) -> Callable[[str], list[str]]:
    """The completion of the last name of a list."""

    def completed(incomplete: str) -> list[str]:
        before, comma, _ = incomplete.rpartition(",")
        return [before + comma + name for name in known()]

    return completed


def _axes(incomplete: str) -> list[str]:
    """The completion of an axis."""
    return [f"{name}=" for name in axis_names()]


# --- options --------------------------------------------------------------------------------------

METHODS: Final = (
    "Methods, each NAME or NAME=SETTING (a tolerance, or steps a period), as in "
    "taylor-axis=1e-9,gauss8=32, or your own, as mine.py:rk4=200; else a selection."
)
SCHEDULER: Final = "Let the workers of a dask scheduler do it, such as tcp://192.168.0.2:8786."
Methods = Annotated[
    str | None, Option(metavar="NAME,…", autocompletion=_of_list(method_names), help=METHODS)
]
Periods = Annotated[float, Option(metavar="N", help="Length, in nutation periods.")]
Seconds = Annotated[float, Option(metavar="S", help="Time for all of it [s].")]
JOBS: Final = Option("--jobs", "-j", metavar="J", min=1, max=1024, help="Processes to work in.")
Jobs = Annotated[int, JOBS]
Scheduler = Annotated[str | None, Option(metavar="ADDRESS", help=SCHEDULER)]
Axis = partial(Option, metavar="NAME=FROM:TO:COUNT", autocompletion=_axes)


def study(kind: str, common: Common, scene: str | None = None, **asked: Any) -> None:
    """Do a study, as the function of its name does it, and finish it."""
    scheduler = asked.pop("scheduler", None)
    if scheduler is not None and (asked["jobs"] or 1) > 1:
        raise BadParameter("a scheduler has its own workers", param_hint="--jobs")
    for option in {"methods", "cases"} & asked.keys():
        asked[option] = names(f"--{option}", asked[option])
    given = {name: value for name, value in asked.items() if value is not None}
    do = getattr(import_module(f"heavytop.studies.{kind}"), kind)
    with ExitStack() as stack:
        if scheduler is not None:
            given["executor"] = stack.enter_context(cluster(scheduler))
        progress = stack.enter_context(progress_bar(not common.quiet))
        about = [] if scene is None else [common.scene(scene)]
        found = do(*about, folder=common.output, progress=progress, **given)
    finish(kind, found, common)


def cluster(address: str) -> AbstractContextManager[Executor]:
    """The workers of a scheduler."""
    from heavytop.studies.executors import executor_at

    return executor_at(address)


# --- results --------------------------------------------------------------------------------------


def finish(kind: str, found: Any, common: Common) -> None:
    """Write and print what a study found, and say what is wrong with it."""
    put_out(found, partial(ENDS[kind], found), common)


def put_out(
    found: Any, ends: Callable[[Mapping[str, Any]], Iterable[tuple[Exit, str]]], common: Common
) -> None:
    """Write files, print the document that names them, then leave with what is wrong with it."""
    from heavytop.report.files import write_study

    files: Mapping[str, str] = {}
    unwritten: list[tuple[Exit, str]] = []
    if common.output is not None:
        try:
            files = write_study(found, common.output, figures=not common.no_figures)
        except errors.StoppedEarly as fault:
            unwritten = [(Exit.ENDED_EARLY, str(fault))]
        for name in files.values():
            common.note(f"wrote {common.output / name}")
    printed = found.document(files=files)
    show(printed, common.json)
    leave([*unwritten, *ends(printed)])


def _drift_ends(found: Any, document: object) -> Ends:
    for each in found.methods:
        for number, why in each.ended.items():
            yield Exit.ENDED_EARLY, f"{each.name}, start {number}, ended early: {why}"
    yield from _missing([each.name for each in found.methods])


def _work_precision_ends(found: Any, document: object) -> Ends:
    if not found.points:
        missing = [*_missing([each.method for each in found.skipped])]
        yield from missing or [(Exit.ENDED_EARLY, "nothing was run")]


def _missing(methods: list[str]) -> Ends:
    """Say what is to be installed, where no method of a study could be run without it."""
    from heavytop.studies.methods import AUTO, method

    needs = [() if name == AUTO else method(name).absent for name in methods]
    if needs and all(needs):
        yield Exit.USAGE, str(errors.MissingPackage(methods[0], needs[0]))


def _atlas_ends(found: Any, document: Mapping[str, Any]) -> Ends:
    if not found.whole:
        part = "a part of an atlas, {done} of {all} tiles".format(**document["tiles"])
        yield Exit.OK, f"{part}: heavytop atlas --merge DIR… -o DIR joins parts"
    if pixels := document.get("unexplained"):
        yield Exit.OUT_OF_BOUND, f"{pixels} pixels differ by more than rounding"


def _stress_ends(found: Any, document: object) -> Ends:
    for run in found.silently_wrong:
        said = f"auto is wrong at {run.case}, and does not say so: {run.outcome}, {run.note}"
        yield Exit.OUT_OF_BOUND, said
    if not found.cases:
        yield Exit.ENDED_EARLY, "nothing was run"


def _validation_ends(found: Any, document: object) -> Ends:
    for each in found.failed:
        why = f": {each.failure}" if each.failure else ""
        yield Exit.OUT_OF_BOUND, f"{each.claim.id} does not hold{why}"


ENDS: Final = {
    "drift": _drift_ends,
    "work_precision": _work_precision_ends,
    "atlas": _atlas_ends,
    "stress": _stress_ends,
}


# --- verbs ----------------------------------------------------------------------------------------


@verb("output", "changes", "no_figures")
def drift(
    scene: SceneName,
    periods: Periods = 10_000,
    methods: Methods = None,
    ensemble: Annotated[int, Option(metavar="K", help="Neighbouring starts, averaged over.")] = 1,
    samples: Annotated[int, Option(metavar="M", help="Times at which errors are measured.")] = 25,
    seed: Annotated[int, Option(metavar="S", help="Seed of the neighbouring starts.")] = 0,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    *,
    common: Common,
) -> None:
    """Integrate over many periods by several methods; plot errors."""
    asked: Asked = {"periods": periods, "methods": methods, "ensemble": ensemble}
    study(
        "drift", common, scene, samples=samples, seed=seed, jobs=jobs, scheduler=scheduler, **asked
    )


@verb("output", "changes", "no_figures")
def workprec(
    scene: SceneName,
    periods: Periods = 100,
    methods: Methods = None,
    budget: Seconds = 240,
    *,
    common: Common,
) -> None:
    """Time every method at every setting; plot times against errors."""
    study("work_precision", common, scene, periods=periods, methods=methods, budget=budget)


@verb("output", "no_figures")
def stress(
    cases: Annotated[
        str | None,
        Option(metavar="NAME,…", autocompletion=_of_list(case_names), help="Cases; else all."),
    ] = None,
    methods: Annotated[
        str | None,
        Option(metavar="NAME,…", autocompletion=_of_list(stress_names), help="Methods; else all."),
    ] = None,
    budget: Seconds = 240,
    time_limit: Annotated[float, Option(metavar="S", help="A run is killed after it [s].")] = 3,
    step_limit: Annotated[int, Option(metavar="N", help="Steps that a run may take.")] = 2_000_000,
    listed: Annotated[bool, Option("--list", help="List cases and methods, with reasons.")] = False,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    *,
    common: Common,
) -> None:
    """Run all methods on known hard cases."""
    if listed:
        from heavytop.studies.stress import listing

        show(listing(), common.json)
        return
    limits: Asked = {"budget": budget, "time_limit": time_limit, "step_limit": step_limit}
    study("stress", common, cases=cases, methods=methods, jobs=jobs, scheduler=scheduler, **limits)


PLACES: Final = "A scene, by its name or the path of a file; with --merge, folders of shards."
ALONG_X: Final = "What changes along x, in SI units: phidot=-20:20:400."
ALONG_Y: Final = "The same along y; evenly in the logarithm: psidot=1:200:300:log."
MOMENTUM: Final = "The diagram of E' and p_phi at the scene's p_psi, and nothing else."
MERGE: Final = "Join the shards that lie in the folders DIR… in the folder of -o."


@verb("output", "changes", "no_figures")
def atlas(
    places: Annotated[
        list[str], Argument(metavar="SCENE", help=PLACES, autocompletion=scene_names)
    ],
    x: Annotated[str | None, Axis(help=ALONG_X)] = None,
    y: Annotated[str | None, Axis(help=ALONG_Y)] = None,
    only: Annotated[str | None, Option(metavar="kind", help="Find kinds alone; faster.")] = None,
    integrate: Annotated[bool, Option("--integrate", help="Compare with runs of all.")] = False,
    shard: Annotated[str | None, Option(metavar="i/n", help="One of n shards, as in 1/4.")] = None,
    merge: Annotated[bool, Option("--merge", help=MERGE)] = False,
    jobs: Annotated[int | None, JOBS] = None,
    scheduler: Scheduler = None,
    energy_momentum: Annotated[bool, Option("--energy-momentum", help=MOMENTUM)] = False,
    *,
    common: Common,
) -> None:
    """Classify every pixel of a plane of tops, and draw the map."""
    asked: Asked = {"x": x, "y": y, "only": only, "integrate": integrate, "shard": shard}
    asked |= {"jobs": jobs, "scheduler": scheduler}
    if merge:
        _alone("--merge", asked | {"set": common.changes, "energy-momentum": energy_momentum})
        _merge([named_folder(each) for each in places], common)
        return
    if len(places) > 1:
        raise BadParameter("one scene; folders of shards go with --merge", param_hint="SCENE")
    if energy_momentum:
        _alone("--energy-momentum", asked)
        _diagram(places[0], common)
        return
    if missing := [f"--{axis}" for axis in "xy" if not asked[axis]]:
        rule = "an axis NAME=FROM:TO:COUNT, such as phidot=-20:20:400"
        raise BadParameter(rule, param_hint=" and ".join(missing))
    _no_clash(common.overrides, (str(x), str(y)))
    study("atlas", common, places[0], **asked)


def _merge(folders: list[Path], common: Common) -> None:
    """Join shards; leave with a code of its own where some are missing."""
    from heavytop.studies.atlas import merge_atlases

    if common.output is None:
        raise BadParameter("the folder to join the shards in", param_hint="-o")
    found, _ = merge_atlases(folders, common.output)
    finish("atlas", found, common)
    if not found.whole:
        raise typer.Exit(Exit.ENDED_EARLY)


def _alone(option: str, others: Mapping[str, object]) -> None:
    """Refuse what says nothing beside an option, rather than pass it over."""
    if given := [f"--{name}" for name, value in others.items() if value]:
        raise BadParameter(f"not together with {option}", param_hint=", ".join(given))


def _no_clash(changes: list[str], axes: tuple[str, str]) -> None:
    """Refuse a change of the scene to what an axis changes pixel by pixel."""
    from heavytop.studies.atlas_plane import ROLES

    varied = {ROLES[n].sets: n for axis in axes if (n := axis.partition("=")[0].strip()) in ROLES}
    for change in changes:
        table, _, key = change.partition("=")[0].strip().partition(".")
        if table in ("top", "start") and key in ROLES and ROLES[key].sets in varied:
            what = ROLES[key].sets
            rule = f"{change!r}: the axis {varied[what]} sets the {what} of every pixel"
            raise BadParameter(rule, param_hint="--set")


def _diagram(scene: str, common: Common) -> None:
    """Write and print the energy–momentum diagram of a scene."""
    from heavytop.results.energy_momentum import diagram_of

    put_out(diagram_of(common.scene(scene)), lambda _: (), common)


CLAIMS: Final = "Claims or scripts, as in betsch-cone 39_flint; else those of a few minutes."
PROOFS: Final = "Run every script: hours, on a quiet machine."


@verb("output")
def validate(
    claims: Annotated[list[str] | None, Argument(metavar="CLAIM", help=CLAIMS)] = None,
    proofs: Annotated[bool, Option("--proofs", help=PROOFS)] = False,
    *,
    common: Common,
) -> None:
    """Measure what is claimed, on authorities outside this project."""
    from heavytop.claims import validate as claimed

    with progress_bar(not common.quiet) as progress:
        try:
            found = claimed.validate(
                tuple(claims or ()), proofs=proofs, progress=progress, note=common.note
            )
        except claimed.UnknownClaim as unknown:
            raise BadParameter(str(unknown), param_hint="CLAIM") from None

    put_out(found, partial(_validation_ends, found), common)


OWN: Final = "Those of your own that the study runs, named again: mine.py:rk4."
BEGUN: Final = "The folder of a study (drift, atlas, stress, workprec) or of a run."


@verb("no_figures")
def resume(
    folder: Annotated[Path, Argument(metavar="DIR", help=BEGUN, parser=named_folder)],
    methods: Annotated[str | None, Option(metavar="NAME,…", help=OWN)] = None,
    jobs: Jobs = 1,
    scheduler: Scheduler = None,
    *,
    common: Common,
) -> None:
    """Go on with a study or a run that was interrupted or killed."""
    files = (folder / name for name in ("study.json", "request.json", "run.json"))
    made = next(filter(None, map(command_of, files)), typed())
    with typing(made):  # the result is that of the command that began it
        if not is_run(folder):
            if made and "--no-figures" in made.split():  # as it was begun
                common = replace(common, no_figures=True)
            _resume_study(folder, names("--methods", methods) or (), jobs, scheduler, common)
        elif scheduler is not None or methods is not None:
            option = "--scheduler" if methods is None else "--methods"
            raise BadParameter("for studies; this is a run", param_hint=option)
        else:
            resume_run(folder, common)


def _resume_study(
    folder: Path, methods: tuple[str, ...], jobs: int, scheduler: str | None, common: Common
) -> None:
    """Go on with a study; of one that has ended, say so and print it."""
    if not (folder / "study.json").exists():
        lacking = "study.json, of a study, nor trajectory.nc or request.json, of a run"
        raise errors.ForeignFile(
            f"{folder}: no folder with anything to go on with: neither {lacking}"
        )
    from heavytop.studies.runner import resume as go_on
    from heavytop.studies.store import Store

    shown: list[Progress] = []
    with ExitStack() as stack:
        executor = None if scheduler is None else stack.enter_context(cluster(scheduler))
        bar = stack.enter_context(progress_bar(not common.quiet))

        def heard(now: Progress) -> None:
            shown.append(now)
            if bar is not None:
                bar(now)

        found = go_on(folder, methods=methods, jobs=jobs, executor=executor, progress=heard)
    if 0 < shown[0].tasks == shown[0].ended:
        say(f"{folder}: this study is finished")
    finish(Store(folder).parameters["kind"], found, replace(common, output=folder))
