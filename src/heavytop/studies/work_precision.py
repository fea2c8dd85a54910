"""Work–precision diagrams: time and error of methods over grids of settings, in one process."""

from __future__ import annotations

import math
import os
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import closing, suppress
from functools import cache
from itertools import chain, product, zip_longest
from statistics import median, quantiles
from typing import Any, Final

from heavytop.checking.method import LOST_PHASE
from heavytop.comparison import user
from heavytop.comparison.methods import METHODS, MethodEntry
from heavytop.comparison.steppers import IntegrationFailed, NotFinite
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import HeavyTopError, Stop, StoppedEarly
from heavytop.results.stress import AUTO
from heavytop.results.work_precision import ERROR_KEYS, WorkPrecision
from heavytop.scene.arguments import Range, check_callable
from heavytop.scene.scene import Scene, scene_of
from heavytop.studies.drift import insert_times, perturbed_start, sample_times
from heavytop.studies.journal import Chunk, Journal, Parameters, keep_budget
from heavytop.studies.methods import expect_method, method, parameters_of, read_options, settings
from heavytop.studies.steppers import MethodRun, TooSlow, advance, clock, set_up, walk
from heavytop.studies.study import Progress
from heavytop.studies.workers import SET_UP_S, TIMED_WORKER, TimedOut, stop_signal

BUDGET_S: Final = 240.0
ROUNDS: Final = "rounds"  # the task of timing again
WORK_LIMITS: Final = {"periods": Range(1, 1e6), "budget": Range(1, 1e6)}
NEIGHBOURS: Final = 8  # starts, the scene's own among them, the same for every method and setting
RUN_LIMITS: Final = 240  # a run may take this part of the budget, or a second
REPEATS: Final = 3  # rounds after the first
REPEATS_S: Final = 0.5  # a setting is repeated in further rounds while these took less
SHORT_RUN_S: Final = 0.01  # a shorter run is made twice: the first finds caches cold

Report = Callable[[Progress], object]

# --- the grid of settings --------------------------------------------------------------------

WORK_METHODS: Final = (
    AUTO,
    *(f"taylor-{form}" for form in FORMULATIONS),
    *(f"taylor-{form}-projected" for form in ("axis", "attitude", "cubic")),  # as plans are
    *(f"taylor-{form}-compensated" for form in ("axis", "cubic")),
    *sorted(METHODS, key=lambda name: METHODS[name].language == "python"),  # which are slow
    *(f"taylor-{form}-mpfr" for form in FORMULATIONS),
)


# --- measuring -------------------------------------------------------------------------------


def work_precision(
    scene: Scene,
    *,
    methods: Sequence[str | user.Method | Callable[..., Any]] = WORK_METHODS,
    periods: float = 100,
    budget: float = BUDGET_S,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> WorkPrecision:
    """Measure the time and the error of methods over a grid of settings.

    All settings are run in turn, from the scene's own start and then from each of seven
    neighbouring ones, in several rounds; points are medians over the starts. Time is that in the
    blocks of steps, the best of the rounds; the error is that against the closed form of the run's
    own binary start, at 40 digits.

    Parameters
    ----------
    scene : Scene
        Its top and its start; its span and its wants are not used.
    methods : sequence of str, Method or callable
        ``NAME`` for all settings of a method, ``NAME=SETTING`` for one; ``auto`` is what `plan`
        chooses for 12 digits, ``auto=DIGITS`` for so many, up to 30. All in
        `heavytop.studies.work_precision.WORK_METHODS` are tried when this is left out. Those of
        your own are as in `heavytop.drift`, with the setting that they have, if any.
    periods : float
        Nutation periods to go, from 1 to 1e6.
    budget : float
        Time after which nothing is begun, at least 1 [s]. What it did not allow is in
        ``skipped``.
    folder : path, optional
        Where every setting is written down when it has been run, so that a diagram that was killed
        goes on from there. It is new, or empty, or holds this diagram.
    progress : callable, optional
        It is given a `heavytop.studies.study.Progress` again and again.

    Returns
    -------
    WorkPrecision

    Raises
    ------
    BadScene
        Nothing nutates; there is no such method, or no plan for auto; an option is out of its
        bounds. Every fault is listed.
    MissingPackage, ForeignFile, InUse, StoppedEarly
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
    check_callable("progress", progress)
    options = {"periods": periods, "budget": budget}
    names, values = read_options(scene, methods, options, WORK_LIMITS, expect_method)
    about = {"scene": scene.problem(), "periods": values["periods"]}
    parameters = parameters_of("work_precision", names, **about)
    tasks(parameters)  # it refuses a plan, if any, before anything is written
    with Journal.open(folder, parameters) as journal:
        return complete(journal, budget=float(budget), on_progress=progress)


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the tasks: a setting from a start, and `ROUNDS`."""
    texts = dict.fromkeys(each.text for each in _requested(parameters))
    return [*(f"{text}/{start}" for text in texts for start in range(NEIGHBOURS)), ROUNDS]


def _requested(parameters: Parameters) -> list[MethodEntry]:
    """Return all methods, with settings, of a diagram, each once."""
    scene, periods = scene_of(parameters["scene"]), parameters["periods"]
    every = (settings(text, scene, periods) for text in parameters["methods"])
    return list(dict.fromkeys(chain.from_iterable(every)))


def complete(
    journal: Journal, *, budget: float | None = None, on_progress: Report | None = None, **_: Any
) -> WorkPrecision:
    """Measure in this process what is left, as the budget allows, and return the result."""
    began, parameters = clock(), journal.parameters
    budget, methods = keep_budget(journal, budget, BUDGET_S), _requested(parameters)

    def show(fraction: float) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        if on_progress is not None:
            done, count = (1.0 if journal.record(ROUNDS).ended else fraction), len(methods)
            on_progress(Progress(done, int(done * count), count))

    with stop_signal() as stop, closing(TIMED_WORKER):
        show(0.0)
        (runs := Rounds(journal, methods, budget, began)).take(show)
    if stop.is_set():
        raise StoppedEarly(Stop.INTERRUPTED, "interrupted", journal.folder)
    points = tuple(_point(each, [*rows.values()]) for each, rows in runs.rows.items() if rows)
    skipped = tuple(_skip(each, runs.refused[each]) for each in methods if not runs.rows[each])
    periods = parameters["periods"]
    about = {"scene": parameters["scene"], "periods": periods, "phase": watch_times(periods)[-1]}
    about |= {"budget": budget, "versions": parameters["versions"]}
    return WorkPrecision(**about, points=points, skipped=skipped)


class Rounds:
    """Runs of all settings in turn, from one start after the other, in several rounds.

    Whatever disturbs the timing so disturbs all of them. First comes the loosest setting of each
    method, then the next one of each. The first round measures errors too; slow settings are in at
    most two rounds. `rows` has the results; a setting that fails from one start has none, and
    `refused` says why.
    """

    def __init__(
        self, journal: Journal, settings: Sequence[MethodEntry], budget: float, began: float
    ) -> None:
        scene, self.periods = scene_of(journal.parameters["scene"]), journal.parameters["periods"]
        states = [perturbed_start(scene.start, 0, k) for k in range(NEIGHBOURS)]
        self.starts = [Scene(scene.top, state, periods=1, name=scene.name) for state in states]
        self.journal, self.budget, self.deadline = journal, budget, began + budget
        self.limit = max(1.0, budget / RUN_LIMITS)
        names = dict.fromkeys(each.name for each in settings)
        grids = ([each for each in settings if each.name == name] for name in names)
        in_turn = (each for turn in zip_longest(*grids) for each in turn if each)
        self.turns = [*product(range(NEIGHBOURS), in_turn)]
        self.rows: dict[MethodEntry, dict[int, dict[str, Any]]] = {each: {} for each in settings}
        self.refused: dict[MethodEntry, str] = {}
        self.too_slow: dict[str, str] = {}  # by method, its setting that took too long
        self.ready = cache(lambda start, each: set_up(self.starts[start], each))

    def take(self, show: Callable[[float], object]) -> None:
        """Do all rounds, unless their times are stored."""
        stored, count = self.journal.record(ROUNDS).ended, (1 + REPEATS) * len(self.turns)
        for done, (turn, place) in enumerate(product(range(1 + REPEATS), self.turns)):
            show(done / count)
            if turn == 0:
                self._first(*place)
            elif not stored:
                self._repeat(*place, turn)
        if not stored and clock() <= self.deadline:
            times = {x.text: {k: y["seconds"] for k, y in z.items()} for x, z in self.rows.items()}
            self.journal.append(ROUNDS, Chunk(rows=[times], done=True))
        for known in self.journal.rows(ROUNDS):
            for each, runs in self.rows.items():
                for start, row in runs.items():
                    row["seconds"] = known[each.text][str(start)]

    def _first(self, start: int, each: MethodEntry) -> None:
        """Do the first run of a setting from a start, or read it from the journal."""
        known, task, late = self.rows[each], f"{each.text}/{start}", clock() > self.deadline
        if self.journal.record(task).ended:
            [known[start]] = self.journal.rows(task)
            return
        if each in self.refused or (late and known):
            return
        try:
            if late:
                raise IntegrationFailed(f"not started: no time was left in {self.budget:g} s")
            if (slow := self.too_slow.get(each.name)) and not known:
                raise IntegrationFailed(f"not started: {slow} took too long")
            if start == 0:
                self._expect_return(each)
            known[start] = first_run(self.ready(start, each), self.periods, self.limit)
        except (IntegrationFailed, HeavyTopError) as refusal:
            known.clear()
            self.refused[each] = " ".join(str(refusal).split())
            if isinstance(refusal, TooSlow | TimedOut):
                self.too_slow[each.name] = each.label
                self.refused[each] += f": more than {self.limit:g} s for a run"
            return
        if known[start]["seconds"][0] <= SHORT_RUN_S:
            self._time(start, each)
        self.journal.append(task, Chunk(rows=[known[start]], done=True))

    def _expect_return(self, each: MethodEntry) -> None:
        """Try a user's method in a process that can be killed, where that can load it.

        Setting it up may take half of the time that is left: others need some too.
        """
        if own := user.origins([each.name]):
            ready_s = min(SET_UP_S, max(self.limit, (self.deadline - clock()) / 2))
            arguments = self.starts[0], each.text, own, self.periods, self.limit
            TIMED_WORKER.call(_try, *arguments, timeout=ready_s + 2 * self.limit)

    def _repeat(self, start: int, each: MethodEntry, turn: int) -> None:
        """Time a run again, twice if it is short, while its setting and the budget have time."""
        spent = (turn - 1) * sum(row["seconds"][0] for row in self.rows[each].values())
        if start in self.rows[each] and spent <= REPEATS_S and clock() <= self.deadline:
            for _ in range(1 if self.rows[each][start]["seconds"][0] > SHORT_RUN_S else 2):
                self._time(start, each)

    def _time(self, start: int, each: MethodEntry) -> None:
        """Do a run and keep its time."""
        run, end = self.ready(start, each), watch_times(self.periods)[-1]
        *_, seconds = deque(walk(run, end), maxlen=1).pop()
        self.rows[each][start]["seconds"].append(seconds)


def _try(scene: Scene, text: str, own: user.Origins, periods: float, limit: float) -> None:
    """In a worker: run a method once; where it fails it fails again when it is measured."""
    user.load(own)
    with suppress(IntegrationFailed):
        deque(walk(set_up(scene, method(text)), watch_times(periods)[-1], limit), maxlen=0)


def watch_times(periods: float) -> list[float]:
    """Return the times of a run [nutation periods]: the last for its error, others for its phase.

    >>> [round(n, 3) for n in watch_times(10)]
    [0.618, 1.618, 3.618, 7.618, 9.618]
    """
    return insert_times(sample_times(periods, 2))


def first_run(run: MethodRun, periods: float, limit: float) -> dict[str, Any]:
    """Run over so many nutation periods, and return errors, costs and seconds, for JSON.

    It fails where it takes more than `limit` seconds, or its numbers are no longer finite.
    """
    stepper: Any = run.stepper
    every, last, seconds = advance(run, watch_times(periods), limit)
    off, lost = every[-1], LOST_PHASE * run.period
    if not math.isfinite(off.energy + off.theta + (off.axis or 0.0)):
        raise NotFinite
    kept = all(abs(each.phase_s) < lost for each in every)
    return {
        "axis_error": off.axis,
        "theta_error": abs(off.theta),
        "phase_error": abs(off.phase_s) if kept else None,
        "energy_error": abs(off.energy),
        "periods": last.time[0] / run.period,
        "steps": last.steps,
        "evaluations": last.evaluations,
        "compile_s": float(stepper.compile_s),
        "warned": dict(stepper.warned),
        "seconds": [seconds],
    }


def _point(each: MethodEntry, runs: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the point of a setting: medians and spreads over the starts, the scene's own first."""
    costs = [min(run["seconds"]) / run["periods"] * 1e6 for run in runs]
    errors = {name: [run[name] for run in runs] for name in ERROR_KEYS.values()}
    medians = {name: None if None in x else median(x) for name, x in errors.items()}
    measures = "theta" if medians.pop("axis_error") is None else "axis"
    error, first = errors[ERROR_KEYS[measures]], runs[0]
    tolerance, steps = (None, each.setting) if each.fixed else (each.setting, None)
    about: dict[str, Any] = {"method": each.name, "formulation": each.states}
    about |= {"language": each.language, "tolerance": tolerance, "steps_a_period": steps}
    about |= {"bits": each.bits, "measures": measures, "rival": each.is_rival}
    return {
        **about,
        "has_order": each.is_rival and (each.order is not None or not each.source),
        "us_per_period": median(costs),
        "us_spread": _spread(costs),
        "rhs_evaluations": first["evaluations"],
        "error": median(error),
        "error_spread": _spread(error),
        "starts": len(runs),
        **medians,
        "setup_s": first["compile_s"],
        "runs": min(len(run["seconds"]) for run in runs),
        **{name: first[name] for name in ("periods", "steps", "warned")},
    }


def _skip(each: MethodEntry, reason: str) -> dict[str, Any]:
    """Return the row of a setting that gave no point."""
    setting = {each.set_by: each.setting}
    return {"method": each.name, "setting": setting, "rival": each.is_rival, "reason": reason}


def _spread(values: Sequence[float]) -> float:
    """Return the distance between the quartiles; 0 of one value."""
    if len(values) < 2:
        return 0.0
    lower, _, upper = quantiles(values, n=4, method="inclusive")
    return upper - lower
