"""Drift studies: how the errors of methods grow over many periods.

The tasks of a study are its runs: one method from one start. Every run is compared with the
closed form of its own binary start, at 40 digits.
"""

from __future__ import annotations

import math
import os
import time
from collections import Counter
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict
from itertools import chain, repeat, takewhile
from typing import Any, Final

import numpy as np

from heavytop.checking.method import LOST_PHASE
from heavytop.comparison import user
from heavytop.comparison.methods import MethodEntry
from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.errors import MissingPackage
from heavytop.exact.decimals import DOUBLE
from heavytop.exact.pairs import DoubleDouble
from heavytop.results.drift import DRIFT_FIELDS, SERIES, Drift, growth, task_name
from heavytop.scene.arguments import JOBS, Range
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.scene import Scene, scene_of
from heavytop.scene.state import State
from heavytop.studies.journal import Chunk, Journal, Parameters
from heavytop.studies.methods import auto_digits, method, parameters_of, plan_auto, read_options
from heavytop.studies.steppers import MethodRun, measured_order, set_up
from heavytop.studies.study import Progress, run
from heavytop.studies.workers import SET_UP_S, TIMED_WORKER, check_how

Series = dict[str, tuple[float | None, ...]]

DEFAULT: Final = (
    "taylor-axis", "taylor-axis-projected", "taylor-cubic",
    "dop853-cyrk", "sofroniou-spaletta10", "gauss8",
)  # fmt: skip
DRIFT_OPTIONS: Final = {
    "periods": Range(1, 1e12),
    "ensemble": Range(1, 10_000, whole=True),
    "samples": Range(2, 10_000, whole=True),
    "seed": Range(0, 2**63 - 1, whole=True),
    "jobs": JOBS,
}
CHUNK_S: Final = 0.5  # of integration between two checkpoints
LIMIT_S: Final = 60.0  # for a chunk of a user's method: a step that takes longer never returns
START_SPREAD: Final = 1e-2  # relative; of tilt, the smaller of its distances from the poles
# of a period: no turning point, where a time error is not seen
SAMPLE_PHASE: Final = 0.6180339887498949
GROWING: Final = {"energy": "energy", "phase": "phase_s"}  # quantities, and columns of errors
VARIED: Final = (*ANGLES, *RATES, "omega3")


def drift(
    scene: Scene,
    *,
    methods: Sequence[str | user.Method | Callable[..., Any]] = DEFAULT,
    periods: float = 10_000,
    ensemble: int = 1,
    samples: int = 25,
    seed: int = 0,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Drift:
    """Integrate over many periods with several methods, and measure how their errors grow.

    Every run is compared with the closed form of its own binary start, at 40 digits.

    Parameters
    ----------
    scene : Scene
        Its top and its start; its span and its wants are not used.
    methods : sequence of str, Method or callable
        ``NAME`` or ``NAME=SETTING``, such as ``taylor-axis-projected`` or ``strang=200``; or your
        own: ``FILE.py:NAME``, ``MODULE:NAME``, in Python a `heavytop.Method` or a function too.
    periods : float
        Nutation periods to go, at least 1.
    ensemble : int
        Starts: the scene's own, and neighbouring ones.
    samples : int
        Times, spread evenly over the decades, at which errors are measured.
    seed : int
        Of the neighbouring starts.
    jobs : int
        Processes; results do not depend on it.
    folder : path, optional
        Where everything is stored, so that a study that was killed goes on from there. It is new,
        or empty, or holds this study.
    executor : concurrent.futures.Executor, optional
        Its workers do the runs, wherever they are, and `jobs` means nothing; results do not
        depend on it. That of a dask cluster is
        `heavytop.studies.workers.executor_at` of its address.
    progress : callable, optional
        It is given a `heavytop.studies.study.Progress` again and again.

    Returns
    -------
    Drift

    Raises
    ------
    BadScene
        Nothing nutates; there is no such method; an option is of the wrong kind or out of its
        bounds. Every fault is listed.
    MissingPackage
        None of the methods can run here.
    ForeignFile
        The folder holds something else, another study, or a damaged file; a worker of the executor
        has other versions than this process.
    InUse
        Another process is writing the folder.
    StoppedEarly
        Ctrl-C; a full disk; a worker that died twice. What was done is in the folder.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = drift(load_scene("sicm-kicked"), methods=["taylor-axis"], periods=100, samples=5)
    >>> found["taylor-axis"].phase_s[-1] < 1e-12
    True

    Notes
    -----
    Accuracy: ``tests/studies/test_drift.py`` finds a shift of 1e-9 s, and one of 3e-12 s, as a
    phase to a millionth of itself.

    References
    ----------
    Brouwer, "On the accumulation of errors in numerical integration", *Astronomical Journal* 46
    (1937), for the powers of the time with which errors grow.
    """
    check_how(progress, executor)
    options = {"periods": periods, "ensemble": ensemble, "samples": samples, "seed": seed}
    parameters, jobs = drift_parameters(scene, methods, **options, jobs=jobs)
    if jobs > 1 or executor is not None:
        user.expect_anywhere(parameters["methods"])
    with Journal.open(folder, parameters) as journal:
        return complete(journal, jobs=jobs, executor=executor, on_progress=progress)


def drift_parameters(scene: Scene, methods: Any, **options: object) -> tuple[Parameters, int]:
    """Return the parameters of a study, for JSON, and the number of processes.

    Raises
    ------
    BadScene
        As of `drift`.
    """

    def checked(text: str) -> str:
        return text if auto_digits(text) else method(text).text

    names, values = read_options(scene, methods, options, DRIFT_OPTIONS, checked)
    jobs, n = values.pop("jobs"), values["periods"]
    names = [_plan_of_auto(name, scene, n) if auto_digits(name) else name for name in names]
    return parameters_of("drift", names, scene=scene.problem(), **values), jobs


def _plan_of_auto(text: str, scene: Scene, periods: float) -> str:
    """Return the method that auto stands for in a run of so many periods."""
    found = plan_auto(text, scene, periods)
    return found.text if found.bits == DOUBLE else f"taylor-{found.formulation}-mpfr"


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the runs: a method and the number of a start."""
    numbers = range(parameters["ensemble"])
    there = [text for text in parameters["methods"] if not method(text).absent]
    return [task_name(text, number) for text in there for number in numbers]


def advance(parameters: Parameters, task: str, checkpoint: Any) -> Iterator[Chunk]:
    """Yield chunks of half a second of a run; their rows are the errors at the sample times.

    A user's method runs in a process that can be killed, unless it was given as a function, which
    runs in this one.
    """
    text, arguments = task.rpartition("/")[0], (parameters, task, checkpoint)
    if (own := user.origins([text])) and not text.startswith(user.HANDED_OVER):
        limits = chain([SET_UP_S], repeat(LIMIT_S))
        chunks = TIMED_WORKER.stages(_chunks, *arguments, own, limits=limits)
    else:
        chunks = _chunks(*arguments)
    next(chunks)  # it is set up
    yield from chunks


def _chunks(
    parameters: Parameters, task: str, checkpoint: Any, own: user.Origins = ()
) -> Iterator[Chunk]:
    """Yield the chunks of a run in this process; first an empty one, once it is set up."""
    user.load(own)
    text, _, number = task.rpartition("/")
    scene, chosen = scene_of(parameters["scene"]), method(text)
    start = perturbed_start(scene.start, parameters["seed"], int(number))
    found = set_up(Scene(scene.top, start, periods=1, name=scene.name), chosen)
    periods = insert_times(_error_times(parameters, chosen))
    times = [found.stepper.output_time(n * found.period) for n in periods]
    if checkpoint is None:
        order: float | None = chosen.published_order
        if chosen.fixed and order is None and int(number) == 0:
            order = measured_order(scene, chosen)
        checkpoint = {"state": asdict(found.stepper.begin()), "sampled": 0, "order": order}
    warned = found.stepper.warned
    warned.update(checkpoint.get("warned", {}))
    state, sampled, ended = StepperState(**checkpoint["state"]), checkpoint["sampled"], ""
    yield Chunk(checkpoint, fraction=0.0)
    while sampled < len(times) and not ended:
        rows, seconds = list[dict[str, Any]](), 0.0
        while sampled < len(times) and seconds < CHUNK_S and not ended:
            try:
                began = time.perf_counter()
                after = found.stepper.block(state)
                seconds += time.perf_counter() - began
                reached = [t for t in times[sampled:] if t <= after.time]
                rows += [*_rows(found, state, reached, periods[sampled:])]
                state, sampled = after, sampled + len(reached)
            except IntegrationFailed as failure:
                ended = str(failure)
        t = state.time[0]
        checkpoint |= {"state": asdict(state), "periods": t / found.period,
                       "sampled": sampled, "ended": ended, "warned": dict(warned)}  # fmt: skip
        done = bool(ended) or sampled == len(times)
        yield Chunk(dict(checkpoint), rows, done, t / times[-1][0], seconds)


def _rows(
    run: MethodRun, before: StepperState, times: Sequence[DoubleDouble], periods: Sequence[float]
) -> Iterator[dict[str, Any]]:
    """Yield rows with the errors at times in the block after a state; `periods` counts them."""
    states = run.stepper.states_at(before, times).tolist() if times else ()
    for n, t, state in zip(periods, times, states, strict=False):
        error = run.reference(t, state)
        numbers = (error.energy, error.phase_s, error.axis or 0.0, *error.invariants.values())
        if not all(map(math.isfinite, numbers)):
            raise IntegrationFailed("its errors are no longer finite")
        lost = abs(error.phase_s) >= LOST_PHASE * run.period
        yield {"periods": n, "t": t, "state": state, "lost": lost, **error._asdict()}


def complete(journal: Journal, **how: Any) -> Drift:
    """Do the runs that are left, and return the result."""
    run(journal, **how)
    return collect(journal)


# --- starts and times ------------------------------------------------------------------------


def perturbed_start(start: State, seed: int, number: int) -> State:
    """Return a start beside the given one; number 0 is that itself.

    Tilt and rates are changed by one per cent at most, and the spin omega3 stays. A start depends
    on seed and number alone, so a larger ensemble contains a smaller one.

    Examples
    --------
    >>> start = State(theta=0.1, phidot=-15, psidot=140)
    >>> perturbed_start(start, 1, 0) is start
    True
    >>> beside = perturbed_start(start, 1, 3)
    >>> beside == perturbed_start(start, 1, 3), abs(float(beside.theta) / 0.1 - 1) < 0.01
    (True, True)
    """
    if number == 0:
        return start
    rng = np.random.default_rng([seed, number])
    tilt, nod, turn = rng.uniform(-START_SPREAD, START_SPREAD, 3).tolist()
    theta, omega3 = float(start.theta), float(start.omega3)
    rates = {"thetadot": float(start.thetadot) * (1 + nod)}
    rates |= {"phidot": float(start.phidot) * (1 + turn), "omega3": omega3}
    theta += tilt * min(theta, math.pi - theta)
    return State(theta, phi=start.phi, psi=start.psi, **rates)


def sample_times(periods: float, samples: int) -> tuple[float, ...]:
    """Return numbers of nutation periods, increasing, the last within one of `periods`.

    They are spread evenly over the decades, all at the same phase of the nutation, away from its
    turning points; where several would fall into the same period, there are fewer.

    Examples
    --------
    >>> [round(n, 3) for n in sample_times(1000, 4)]
    [0.618, 9.618, 99.618, 999.618]
    """
    whole = np.unique(np.rint(np.geomspace(1, max(1, int(periods)), max(1, samples))))
    return tuple(float(n - 1 + SAMPLE_PHASE) for n in whole)


def insert_times(times: Sequence[float]) -> list[float]:
    """Return times of `sample_times` with others in between, to notice when a phase is lost.

    A phase error that grows as t² and is below a twentieth of a period at one of these times is
    below half a period at the next, and so cannot look small there by a whole period.

    >>> [round(n, 3) for n in insert_times(sample_times(10, 2))]
    [0.618, 1.618, 3.618, 7.618, 9.618]
    """
    doubled = (2.0**k - 1 + SAMPLE_PHASE for k in range(int(times[-1] + 1).bit_length()))
    return sorted({*times, *(n for n in doubled if n < times[-1])})


def _error_times(parameters: Parameters, chosen: MethodEntry) -> tuple[float, ...]:
    """Return the times at which errors of a method are wanted [nutation periods]."""
    return sample_times(min(parameters["periods"], chosen.reach), parameters["samples"])


# --- the result ------------------------------------------------------------------------------


def collect(journal: Journal) -> Drift:
    """Return the result of a study whose runs are all at their end."""
    parameters = journal.parameters
    scene, numbers = scene_of(parameters["scene"]), range(parameters["ensemble"])
    states = [perturbed_start(scene.start, parameters["seed"], number) for number in numbers]
    starts = tuple({name: float(getattr(each, name)) for name in VARIED} for each in states)
    methods = tuple(_method(journal, text) for text in parameters["methods"])
    about = {name: parameters[name] for name in ("scene", *DRIFT_FIELDS, "versions")}
    return Drift(**about, spread=START_SPREAD, starts=starts, methods=methods).timed(journal)


def _method(journal: Journal, text: str) -> dict[str, Any]:
    """Return the row of a method in the result."""
    chosen = method(text)
    tasks = [task_name(text, number) for number in range(journal.parameters["ensemble"])]
    lasts = [journal.record(task).last for task in tasks]
    absent = str(MissingPackage(chosen.name, chosen.absent)) if chosen.absent else None
    skipped = absent or next((last.failed for last in lasts if last.failed), None)
    ends = [] if skipped else [last.checkpoint for last in lasts]
    steps = [each["state"]["steps"] for each in ends]
    times = {*_error_times(journal.parameters, chosen)}
    runs = [_columns(journal.rows(task), times) for task in tasks[: len(ends)]]
    members = [_series(x) | {"steps": n} for x, n in zip(runs, steps, strict=True)]
    rms = _series(_rms_over_runs(runs) if ends else _columns(()))
    signs = members[0] if ends else rms
    grows = {name: growth(rms["periods"], rms[c], signs[c]) for name, c in GROWING.items()}
    return {
        "name": chosen.text,
        "formulation": chosen.states,
        "language": chosen.language,
        "setting": {chosen.set_by: chosen.setting},
        "order": ends[0]["order"] if ends else None,
        "us_per_period": None,
        "steps": float(np.mean(steps)) if ends else None,
        "ended": {str(k): each["ended"] for k, each in enumerate(ends) if each["ended"]},
        "warned": sum((Counter(each["warned"]) for each in ends), Counter[str]()),
        "skipped": skipped,
        "members": members,
        **rms,
        **{f"{name}_exponent": each.exponent for name, each in grows.items()},
        "stderr": {name: each.stderr for name, each in grows.items()},
        "growth": {name: each.exponent or each.word or None for name, each in grows.items()},
    }


def _columns(rows: Sequence[Mapping[str, Any]], times: Container[float] = ()) -> Series:
    """Return the errors of a run at times, as columns.

    Momenta that cannot change are None, and so are phases from the first one that is lost.
    """
    names = dict.fromkeys(("periods", *SERIES, *(rows[0]["invariants"] if rows else ())))
    kept = [*takewhile(lambda row: not row["lost"], rows)]
    phases = (*(row["phase_s"] for row in kept), *[None] * (len(rows) - len(kept)))
    every = zip(rows, phases, strict=True)
    flat = [{**x, **x["invariants"], "phase_s": y} for x, y in every if x["periods"] in times]
    return {name: tuple(row.get(name) for row in flat) for name in names}


def _rms_over_runs(members: Sequence[Series]) -> Series:
    """Return root mean squares over all runs, at the times that all of them reached."""
    shortest = min(members, key=lambda columns: len(columns["periods"]))
    found, root = dict(shortest), math.sqrt(len(members))
    for name in shortest.keys() - {"periods"}:
        every = zip(*(each[name] for each in members), strict=False)
        found[name] = tuple(None if None in x else math.hypot(*x) / root for x in every)
    return found


def _series(columns: Series) -> dict[str, Any]:
    """Return columns as a result has them: those of `SERIES`, and other invariants in a mapping."""
    found = {name: columns[name] for name in ("periods", *SERIES)}
    return found | {"invariants": {n: x for n, x in columns.items() if n not in found}}
