"""Work and precision: what each digit costs, by every method, timed in turn in one process."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, zip_longest
from statistics import median, quantiles
from time import perf_counter
from typing import Any, Final

from heavytop.comparison import own
from heavytop.comparison.methods import METHODS
from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import BadScene, HeavyTopError, Stop, StoppedEarly
from heavytop.exact.pairs import DoubleDouble
from heavytop.machine import versions
from heavytop.results.base import Problem
from heavytop.results.work_precision import Point, SkippedSetting, WorkPrecision
from heavytop.scene.arguments import Range, heard, parse_names, parse_options, path_of
from heavytop.scene.scene import Scene, scene_of
from heavytop.studies.drift import neighbour
from heavytop.studies.methods import (
    AUTO,
    TOLERANCE,
    MethodSetting,
    admitted,
    auto_digits,
    is_auto,
    method,
    planned,
)
from heavytop.studies.steppers import MethodRun, no_nutation, set_up
from heavytop.studies.study import (
    Chunk,
    Journal,
    Parameters,
    Progress,
    keep_budget,
    open_journal,
    stop_signal,
)
from heavytop.studies.workers import SET_UP_S, TIMED_WORKER, Lost, TimedOut

KIND: Final = "work_precision"
BUDGET_S: Final = 240.0
ROUNDS: Final = "rounds"  # the task of timing again
NO_TIME: Final = "not started: no time was left in the budget"
NUMBERS: Final = {"periods": Range(1, 1e6), "budget": Range(1, 1e6)}
STARTS: Final = 8  # the scene's own and neighbouring ones, the same for every method and setting
FIRST_RUNS: Final = 0.6  # of the budget, then no first run is begun; the rest is for the rounds
LIMITS: Final = 240  # in a budget, but a second at least: what a run may take
BEFORE: Final = 0.382  # of a period before the last one ends: no turning point
REPEATS: Final = 3  # rounds of timing again
REPEATS_S: Final = 0.5  # for one setting: what takes longer is repeated in one round only
SHORT_S: Final = 0.01  # a run that is shorter is made twice: the first finds caches cold
clock: Callable[[], float] = perf_counter  # [s]

# --- the grid of settings --------------------------------------------------------------------

DECADES: Final = tuple(10.0**-k for k in range(3, 16))
HALF_DECADES: Final = tuple(10.0 ** (-k / 2) for k in range(6, 31))
OWN_STEPS: Final[Sequence[float]] = tuple(12.5 * 2**k for k in range(8))
LOW_ORDER: Final = tuple(25.0 * 2**k for k in range(10))
STEPS: Final = {  # a period; two or three settings a decade of error, where there are so many
    "strang": LOW_ORDER,
    "implicit-midpoint": LOW_ORDER,
    "bobenko-suris": LOW_ORDER,
    "blanes-moan-rkn6": (6, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68, 80, 96, 114, 136),
    "sofroniou-spaletta10": (3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 20, 22, 25, 28, 32),
    "gauss8": (2, 3, 4, 5, 6, 7, 8, 10, 12, 16),
}
IN_PYTHON: Final = tuple(name for name, row in METHODS.items() if row.language == "python")
DEFAULT: Final = (
    AUTO,
    *(f"taylor-{form}" for form in FORMULATIONS),
    *(f"taylor-{form}-projected" for form in ("axis", "attitude", "cubic")),  # as plans are
    *(f"taylor-{form}-compensated" for form in ("axis", "cubic")),
    *(name for name in METHODS if name not in IN_PYTHON),
    *IN_PYTHON,
    *(f"taylor-{form}-mpfr" for form in FORMULATIONS),
)


def settings(text: str, scene: Scene, periods: float) -> tuple[MethodSetting, ...]:
    """Return what a text asks for: one setting of a method, or all of the grid.

    Parameters
    ----------
    text : str
        ``NAME``, ``NAME=SETTING``, ``auto`` or ``auto=DIGITS``.
    scene : Scene
    periods : float
        How long a run is; auto depends on it.

    Raises
    ------
    NoMethod
        There is none of this name, or the setting is outside its bounds.
    BadScene
        There is no plan for the digits that auto is asked for.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> [method.setting for method in settings("taylor-axis=1e-9", scene, 100)]
    [1e-09]
    >>> [(method.name, method.formulation) for method in settings("auto=6", scene, 100)]
    [('auto=6', 'axis')]
    """
    if is_auto(text):
        return (planned(text, scene, periods),)
    found = method(text)
    if "=" in text:
        return (found,)
    return tuple(method(f"{text}={setting!r}") for setting in grid(found))


def grid(found: MethodSetting) -> Sequence[float]:
    """Return the settings of a method, from the loosest to the tightest."""
    if found.set_by != TOLERANCE:
        usual = OWN_STEPS if ":" in found.name else (found.setting,)
        return STEPS.get(found.name, usual)
    if found.least == found.most:
        return (found.setting,)
    finer = found.is_rival and found.language != "python"  # a decade costs them more than us
    inside = [x for x in (HALF_DECADES if finer else DECADES) if found.least <= x <= found.most]
    return inside if found.is_rival else [*inside, found.least]


# --- measuring -------------------------------------------------------------------------------


def work_precision(
    scene: Scene,
    *,
    methods: Sequence[str | own.Method | Callable[..., Any]] = DEFAULT,
    periods: float = 100,
    budget: float = BUDGET_S,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[float], object] | None = None,
) -> WorkPrecision:
    """Measure what methods cost and what they attain, over a grid of settings.

    Each setting is run from the scene's own start and from seven neighbouring ones, the same for
    all; points are medians. Time is that in the blocks of steps, the best of several runs that are
    taken in turn with all others; the error is that against the closed form of the run's own
    binary start, at 40 digits.

    Parameters
    ----------
    scene : Scene
        Its top and its start; its span and its wants are not used.
    methods : sequence of str, Method or callable
        ``NAME`` for all settings of a method, ``NAME=SETTING`` for one; ``auto`` is what `plan`
        chooses for 12 digits, ``auto=DIGITS`` for so many, up to 30. All names are in
        `heavytop.studies.work_precision.DEFAULT`, which is what is tried when this is left out.
        Those of your own are as in `heavytop.drift`.
    periods : float
        Nutation periods to go, from 1 to 1e6.
    budget : float
        Time after which nothing is begun, at least 1 [s]. What it did not allow is in
        ``skipped``.
    folder : path, optional
        Where every setting is written down when it has been run, so that a diagram that was killed
        goes on from there. It is new, or empty, or holds this diagram.
    progress : callable, optional
        It is given the fraction done.

    Returns
    -------
    WorkPrecision

    Raises
    ------
    BadScene
        Nothing nutates; there is no such method, or no plan for auto; an option is out of its
        bounds. Every fault is listed.
    ForeignFile, InUse, StoppedEarly
        As for `heavytop.drift`.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> found = work_precision(scene, methods=["taylor-axis"], periods=10, budget=60)
    >>> found.cheapest(1e-9).tolerance > found.points[-1].tolerance
    True
    >>> min(point.error for point in found.points) < 1e-13
    True

    Notes
    -----
    Accuracy: ``tests/studies/test_work_precision.py`` holds errors to a thousandth of what the
    closed form says of the same state.
    """
    heard("progress", progress)
    methods = admitted(methods, str(getattr(scene, "name", "workprec")))
    parameters = diagram_parameters(scene, methods, periods=periods, budget=budget)

    def told(now: Progress) -> None:
        if progress is not None:
            progress(now.fraction)

    place = None if folder is None else path_of("folder", folder)
    with open_journal(place, parameters) as journal:
        return complete(journal, budget=float(budget), on_progress=told)


def diagram_parameters(scene: Scene, methods: Any, **options: float) -> Parameters:
    """Return what is asked of a diagram, as JSON.

    Raises
    ------
    BadScene
        As of `work_precision`.
    """
    file = str(getattr(scene, "name", "workprec"))
    values, faults = parse_options(file, options, NUMBERS)
    names, wrong = parse_names(file, "methods", methods, _checked)
    if faults := [*faults, *no_nutation(file, scene, "a work-precision diagram"), *wrong]:
        raise BadScene(tuple(faults))
    parameters = {"kind": KIND, "scene": scene.problem(), "methods": names,
                  "periods": values["periods"], **own.stated(names),
                  "versions": versions()}  # fmt: skip
    tasks(parameters)  # a plan may be refused: before anything is written
    return parameters


def _checked(text: str) -> str:
    """The text, if it names a method or auto."""
    if is_auto(text):
        auto_digits(text)
    else:
        method(text)
    return text


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the settings that are run, and that of timing them again."""
    return [*dict.fromkeys(each.text for each in _asked(parameters)), ROUNDS]


def _asked(parameters: Parameters) -> list[MethodSetting]:
    """Return all that the names of a diagram ask for, each once."""
    scene, periods = scene_of(parameters["scene"]), parameters["periods"]
    every = (settings(text, scene, periods) for text in parameters["methods"])
    return list(dict.fromkeys(chain.from_iterable(every)))


def complete(
    journal: Journal,
    *,
    budget: float | None = None,
    on_progress: Callable[[Progress], object] | None = None,
    **_: Any,
) -> WorkPrecision:
    """Measure what is left and for which there is time, in this process, and return the result."""
    began, parameters = clock(), journal.parameters
    budget = keep_budget(journal, budget, BUDGET_S)
    asked, finished = _asked(parameters), journal.load(ROUNDS).done

    def show(fraction: float) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        done = 1.0 if finished else fraction
        if on_progress is not None:
            count = len(asked)
            on_progress(Progress(done, int(done * count), count, clock() - began, done))

    try:
        with stop_signal(at_once=True) as stop, TIMED_WORKER:
            show(0.0)
            derived = _derived()
            timed, refused = _first_runs(journal, asked, budget, began, show)
            whole = not any(why.startswith(NO_TIME) for why in refused.values())
            _rounds(journal, timed, began + budget, whole, show)
    except KeyboardInterrupt:
        raise StoppedEarly(Stop.INTERRUPTED, "interrupted", journal.path) from None
    points, skipped = [], []
    for each in asked:
        if each in refused:
            skipped.append(_skipped(each, refused[each]))
        else:
            points.append(_point(each, timed[each], derived[each.formulation]))
    return WorkPrecision(
        scene=Problem(**parameters["scene"]),
        periods=parameters["periods"],
        phase=parameters["periods"] - BEFORE,
        budget=budget,
        points=tuple(points),
        skipped=tuple(skipped),
        versions=versions(),
    )


def _derived() -> dict[str, float]:
    """Return how long each formulation takes to derive [s]; next to nothing if it was before."""
    spent = {}
    for name, form in FORMULATIONS.items():
        began = clock()
        form.build()
        spent[name] = clock() - began
    return spent


def _first_runs(
    journal: Journal,
    tried: Sequence[MethodSetting],
    budget: float,
    began: float,
    show: Callable[[float], object],
) -> tuple[dict[MethodSetting, list[Timed]], dict[MethodSetting, str]]:
    """Run every setting once from every start; return those that were run, and why others not."""
    scene, periods = scene_of(journal.parameters["scene"]), journal.parameters["periods"]
    states = [neighbour(scene.start, 0, k) for k in range(STARTS)]
    starts = [Scene(scene.top, state, periods=1, name=scene.name) for state in states]
    limit, deadline = max(1.0, budget / LIMITS), began + FIRST_RUNS * budget
    timed: dict[MethodSetting, list[Timed]] = {}
    refused: dict[MethodSetting, str] = {}
    too_slow: dict[str, str] = {}  # by method, its setting that took too long

    def runs(each: MethodSetting) -> list[Timed]:
        record = journal.load(each.text)
        if record.done:
            rows = zip(starts, record.rows, strict=True)
            return [_ready(start, each, periods, row) for start, row in rows]
        if each.name in too_slow:
            raise IntegrationFailed(f"not started: {too_slow[each.name]} took too long")
        found = []
        _expect_return(starts[0], each, periods, limit)
        for start in starts:
            if clock() > deadline:
                raise IntegrationFailed(f"{NO_TIME} in a budget of {budget:g} s")
            found.append(first_run(start, each, periods, limit))
        journal.append(each.text, Chunk(rows=[one.measured for one in found], done=True))
        return found

    for done, each in enumerate(_in_turn(tried), 1):
        try:
            timed[each] = runs(each)
        except TooSlow as slow:
            too_slow[each.name] = each.label
            refused[each] = f"stopped {slow}: more than {limit:g} s for a run"
        except StoppedEarly:
            raise
        except (IntegrationFailed, HeavyTopError) as refusal:
            refused[each] = " ".join(str(refusal).split())
        show(done / len(tried) / 2)
    return timed, refused


def _expect_return(scene: Scene, each: MethodSetting, periods: float, limit: float) -> None:
    """Let a method of one's own go first in a process that can be killed, if it can be had there.

    Raises
    ------
    IntegrationFailed
        It does not return, or that process dies of it.
    """
    if not (mine := own.passes([each.name])):
        return
    try:
        TIMED_WORKER.call(_set_up_trial, scene, each, mine, timeout=SET_UP_S)
        TIMED_WORKER.call(_run_trial, periods, limit, timeout=2 * limit)
    except TimedOut:
        raise IntegrationFailed(f"it did not return within {2 * limit:g} s") from None
    except Lost as death:
        raise IntegrationFailed(f"its process was lost: {death}") from None


_TRIAL: Final[list[MethodRun]] = []  # in a worker: what is tried


def _set_up_trial(scene: Scene, each: MethodSetting, mine: Sequence[tuple[str, str, str]]) -> None:
    """In a worker: load and set up a method of one's own."""
    own.let_pass(mine)
    _TRIAL[:] = [set_up(scene, each)]


def _run_trial(periods: float, limit: float) -> None:
    """In a worker: run it once; what it raises is raised again where it is measured."""
    [found] = _TRIAL
    with suppress(TooSlow, IntegrationFailed):
        _lap(found, found.stepper.output_time((periods - BEFORE) * found.period), limit)


def _rounds(
    journal: Journal,
    timed: dict[MethodSetting, list[Timed]],
    deadline: float,
    whole: bool,
    show: Callable[[float], object],
) -> None:
    """Time all settings again, or take the times that are stored; they are if all were run."""
    record = journal.load(ROUNDS)
    if not record.done:
        repeat([*timed.values()], deadline, lambda done: show((1 + done) / 2))
        row = {each.text: [one.seconds for one in runs] for each, runs in timed.items()}
        if whole:
            journal.append(ROUNDS, Chunk(rows=[row], done=True))
        return
    [known] = record.rows
    for each, runs in timed.items():
        for one, seconds in zip(runs, known.get(each.text, ()), strict=False):
            one.measured["seconds"] = seconds


def _in_turn(tried: Sequence[MethodSetting]) -> Iterator[MethodSetting]:
    """Yield the loosest setting of each method, then the next one of each, and so on."""
    by_name: dict[str, list[MethodSetting]] = {}
    for each in tried:
        by_name.setdefault(each.name, []).append(each)
    for turn in zip_longest(*by_name.values()):
        yield from filter(None, turn)


def _point(each: MethodSetting, timed: Sequence[Timed], derived_s: float) -> Point:
    """Return the medians and spreads over the starts."""
    own, costs = timed[0], [one.us_per_period for one in timed]
    axis, theta, energy = (
        [one.measured[f"{name}_error"] for one in timed] for name in ("axis", "theta", "energy")
    )
    errors = theta if None in axis else axis
    stepper: Any = own.run.stepper
    by_tolerance = each.set_by == TOLERANCE
    return Point(
        method=each.name,
        formulation=each.states,
        language=each.language,
        tolerance=each.setting if by_tolerance else None,
        steps_a_period=None if by_tolerance else each.setting,
        bits=each.bits,
        measures="theta" if None in axis else "axis",
        rival=each.is_rival,
        us_per_period=median(costs),
        us_spread=_spread(costs),
        rhs_evaluations=own.measured["evaluations"],
        error=median(errors),
        error_spread=_spread(errors),
        starts=len(timed),
        theta_error=median(theta),
        energy_error=median(energy),
        setup_s=derived_s + float(getattr(stepper, "engine", stepper).compile_s),
        runs=min(len(one.seconds) for one in timed),
        periods=own.periods,
        steps=own.measured["steps"],
    )


def _skipped(each: MethodSetting, reason: str) -> SkippedSetting:
    setting = {each.set_by: each.setting}
    return SkippedSetting(method=each.name, setting=setting, rival=each.is_rival, reason=reason)


def _spread(values: Sequence[float]) -> float:
    lower, _, upper = quantiles(values, n=4, method="inclusive")
    return upper - lower


# --- one run -----------------------------------------------------------------------------------


class TooSlow(Exception):
    """A run that was stopped between two blocks."""


@dataclass(eq=False)
class Timed:
    """A method set up for one start, and what its runs gave.

    Attributes
    ----------
    run : MethodRun
    end : (float, float)
        The time at which it is looked at [s].
    measured : dict
        For JSON: ``axis_error``, ``theta_error``, ``energy_error`` as those of a `Point`; the
        ``time`` [s], ``steps`` and ``evaluations`` where its last block ended; and of each run
        the ``seconds`` in the blocks of steps.
    """

    run: MethodRun
    end: DoubleDouble
    measured: dict[str, Any]

    @property
    def seconds(self) -> list[float]:
        """Time in the blocks of steps, of each run [s]."""
        found: list[float] = self.measured["seconds"]
        return found

    @property
    def periods(self) -> float:
        """Nutation periods that the blocks covered."""
        return float(self.measured["time"][0]) / self.run.period

    @property
    def us_per_period(self) -> float:
        """The best of the runs [µs]."""
        return min(self.seconds) / self.periods * 1e6


def _ready(scene: Scene, method: MethodSetting, periods: float, measured: dict[str, Any]) -> Timed:
    """Return a method set up for a start, for so many nutation periods."""
    found = set_up(scene, method)
    return Timed(found, found.stepper.output_time((periods - BEFORE) * found.period), measured)


def first_run(scene: Scene, method: MethodSetting, periods: float, limit: float) -> Timed:
    """Return a method after a run of so many nutation periods, which shows its errors.

    Raises
    ------
    TooSlow
        It is not there yet after `limit` seconds.
    IntegrationFailed
        It cannot go on, or its numbers are no longer finite.
    HeavyTopError
        It cannot be set up for this start.
    """
    timed = _ready(scene, method, periods, {})
    found, end = timed.run, timed.end
    before, last, seconds = _lap(found, end, limit)
    row = found.stepper.states_at(before, [end])[0].tolist()
    off, tilt = found.reference(end, row), found.reference.tilt(end, row)
    if not math.isfinite(off.energy + tilt + (off.axis or 0.0)):
        raise IntegrationFailed("its numbers are no longer finite")
    timed.measured |= {
        "axis_error": off.axis,
        "theta_error": abs(tilt),
        "energy_error": abs(off.energy),
        "time": last.time,
        "steps": last.steps,
        "evaluations": last.evaluations,
        "seconds": [seconds],
    }
    return timed


def repeat(
    settings: Sequence[Sequence[Timed]], deadline: float, show: Callable[[float], object]
) -> None:
    """Time what was run, in rounds, so that what disturbs the machine disturbs all alike.

    A round runs every setting once from each start. Slow settings are in the first round only, and
    nothing is begun after the deadline.
    """
    starts = max(map(len, settings), default=0)
    for turn in range(REPEATS):
        for start in range(starts):
            for setting in settings:
                rare = turn * sum(timed.seconds[0] for timed in setting) > REPEATS_S
                timed = setting[start]
                for _ in range(0 if rare else 1 if timed.seconds[0] > SHORT_S else 2):
                    if clock() < deadline:
                        timed.seconds.append(_lap(timed.run, timed.end)[2])
            show((turn + (start + 1) / starts) / REPEATS)


def _lap(
    found: MethodRun, end: DoubleDouble, limit: float = math.inf
) -> tuple[StepperState, StepperState, float]:
    """Go from the start past a time: where the last block began and ended, seconds in blocks."""
    after, seconds = found.stepper.begin(), 0.0
    while True:
        before, began = after, clock()
        after = found.stepper.block(before)
        seconds += clock() - began
        if after.time >= end:  # double-doubles compare as their words do
            return before, after, seconds
        if seconds > limit:
            raise TooSlow(f"after {after.time[0] / found.period:.3g} periods in {seconds:.3g} s")
