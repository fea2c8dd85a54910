"""Measuring: every method set up once, run once to see its error, and then timed in turn."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

from heavytop.comparison.methods import imported
from heavytop.comparison.methods import named as rival
from heavytop.comparison.steppers import IntegrationFailed
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import HeavyTopError, MissingPackage
from heavytop.run.planning import closed_form_of
from heavytop.scene.arguments import heard
from heavytop.scene.scene import Scene
from heavytop.studies.drifts.runs import Run
from heavytop.studies.methods import Method
from heavytop.studies.workprecs.asked import asked
from heavytop.studies.workprecs.ladder import DEFAULT, Trial
from heavytop.studies.workprecs.point import Point, Skipped
from heavytop.studies.workprecs.schedule import schedule
from heavytop.studies.workprecs.starting import Started, started
from heavytop.studies.workprecs.timing import Clock, TooSlow, in_turn, lap
from heavytop.studies.workprecs.work_precision import WorkPrecision

FIRST_RUNS: Final = 0.6  # of the budget: then no first run is begun,
ALL_BUT_ROUNDS: Final = 0.8  # nor one that is not expected to end before this,
PATIENCE: Final = 0.05  # nor gone on with that takes this
UNKNOWN: Final = {"numba": 1.0, "compiled by CyRK": 8.0}  # to set up what was never set up [s],
USUAL: Final = 0.3  # and of all others: a first run that is not expected to end is not begun

Show = Callable[[float], object]


def work_precision(
    scene: Scene,
    *,
    methods: Sequence[str] = DEFAULT,
    periods: float = 100,
    budget: float = 240.0,
    progress: Show | None = None,
) -> WorkPrecision:
    """Measure what methods cost and what they attain, over a ladder of settings.

    Time is that in the blocks of steps, the best of several runs that are taken in turn with all
    others; the error is that against the closed form of the run's own binary start, at 40 digits.

    Parameters
    ----------
    scene : Scene
        Its top and its start; its span and its wants are not used.
    methods : sequence of str
        ``NAME`` for all settings of a method, ``NAME=SETTING`` for one; ``auto`` is what `plan`
        chooses for 6, 9 and 12 digits, ``auto=DIGITS`` for others up to 30. All names are in
        `heavytop.studies.workprecs.ladder.DEFAULT`, which is what is tried when this is left out.
    periods : float
        Nutation periods to go, from 1 to 1e6.
    budget : float
        Time to take in all, at least 1 [s]: importing the libraries and deriving the equations
        are in it. What it does not allow is in ``skipped``.
    progress : callable, optional
        It is given the fraction done.

    Returns
    -------
    WorkPrecision

    Raises
    ------
    BadScene
        Nothing nutates; there is no such method; an option is out of its bounds. Every fault is
        listed.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> found = work_precision(scene, methods=["taylor-axis"], periods=10, budget=60)
    >>> found.cheapest(1e-9).trial.method.setting > found.points[-1].trial.method.setting
    True
    >>> min(point.error for point in found.points) < 1e-13
    True

    Notes
    -----
    Accuracy: ``tests/two_ways/test_work_precision.py`` holds errors to a thousandth of what the
    closed form says of the same state.
    """
    heard("progress", progress)
    clock = time.perf_counter
    began = clock()
    derived = _derived(clock)
    tried = asked(scene, methods, {"periods": periods, "budget": budget})
    periods, budget = float(periods), float(budget)  # of any kind of number
    measuring = _Measuring(scene, periods, budget, began, derived, clock, progress)
    points, skipped = measuring.of(tried)
    return WorkPrecision(scene, periods, budget, points, skipped)


def _derived(clock: Clock) -> dict[str, float]:
    """Return how long each formulation takes to derive [s]; next to nothing if it was before."""
    spent = {}
    for name, form in FORMULATIONS.items():
        began = clock()
        form.build()
        spent[name] = clock() - began
    return spent


class _Measuring:
    """A diagram in the making."""

    def __init__(
        self,
        scene: Scene,
        periods: float,
        budget: float,
        began: float,
        derived: Mapping[str, float],
        clock: Clock,
        progress: Show | None,
    ) -> None:
        self.scene, self.periods, self.budget = scene, periods, budget
        self.began, self.clock, self.progress = began, clock, progress
        self.stopped: dict[str, tuple[int, str]] = {}  # by method, its rung that took too long
        self.useless: dict[str, str] = {}  # by method, the package that is not to be had
        self.derived = derived
        self.taken: dict[str, float] = {}  # by method and by language, the last first run [s]

    def of(self, tried: Sequence[Trial]) -> tuple[tuple[Point, ...], tuple[Skipped, ...]]:
        """Return the points and what was skipped, both in the order in which they were asked."""
        begun: dict[Method, Started | str] = {}  # what is asked of auto may be on a ladder too
        for done, i in enumerate(schedule(tried)):
            trial = tried[i]
            if not trial.refused and trial.method not in begun:
                begun[trial.method] = self._why_not(i, trial) or self._started(i, trial)
            self._show(0.5 * (done + 1) / len(tried))
        found = {m: one for m, one in begun.items() if isinstance(one, Started)}
        seconds = dict(zip(found, self._timed([*found.values()]), strict=True))
        points = [
            _point(trial, found[trial.method], seconds[trial.method])
            for trial in tried
            if trial.method in found and not trial.refused
        ]
        skipped = [
            Skipped(trial, trial.refused or str(begun[trial.method]))
            for trial in tried
            if trial.refused or trial.method not in found
        ]
        return tuple(points), tuple(skipped)

    def _why_not(self, i: int, trial: Trial) -> str:
        """Return why the trial at an index is not begun; empty where it is."""
        name = trial.method.name
        if name in self.useless:
            return self.useless[name]
        if trial.method.absent:
            return str(MissingPackage(name, trial.method.absent))
        if trial.method.is_rival and (lacking := _unimportable(name)):
            self.useless[name] = lacking
            return lacking
        if name in self.stopped and i > self.stopped[name][0]:
            return f"not begun: {self.stopped[name][1]} took too long"
        gone = self.clock() - self.began
        late = gone + self._expected(trial.method) > ALL_BUT_ROUNDS * self.budget
        if late or gone > FIRST_RUNS * self.budget:
            return f"not begun: no time was left for it in a budget of {self.budget:g} s"
        return ""

    def _expected(self, method: Method) -> float:
        """Return how long a first run is expected to take, with all that it compiles [s]."""
        return self.taken.get(method.name, self.taken.get(method.language, _guessed(method)))

    def _started(self, i: int, trial: Trial) -> Started | str:
        """Return a trial after its first run, or why there is none."""
        began, method = self.clock(), trial.method
        try:
            one = started(self.scene, method, self.periods, PATIENCE * self.budget, self.clock)
            return replace(one, setup_s=self._setup_s(method, one.run))
        except TooSlow as slow:
            self.stopped[method.name] = (i, trial.text)
            gone = slow.place.time[0] / float(closed_form_of(self.scene).period or math.inf)
            return f"stopped after {gone:.3g} of {self.periods:g} periods in {slow.spent:.3g} s"
        except (IntegrationFailed, HeavyTopError) as refusal:
            return " ".join(str(refusal).split())
        finally:
            known = method.language in self.taken  # the first one imports what all of them need
            self.taken[method.name] = spent = self.clock() - began
            self.taken[method.language] = spent if known else _guessed(method)

    def _setup_s(self, method: Method, found: Run) -> float:
        """Return what deriving and compiling took [s]."""
        march: Any = found.march
        compiled = march if method.is_rival else march.engine
        return self.derived[method.formulation] + float(compiled.compile_s)

    def _timed(self, begun: Sequence[Started]) -> Iterator[list[float]]:
        """Time what was started, in turn: the seconds of its runs, or of the first where none."""
        spent = in_turn(
            [_program(one, self.clock) for one in begun],
            [one.first.seconds for one in begun],
            self.began + self.budget,
            self.clock,
            on_round=lambda done: self._show(0.5 + 0.5 * done),
        )
        for one, seconds in zip(begun, spent, strict=True):
            yield seconds or [one.first.seconds]

    def _show(self, done: float) -> None:
        if self.progress is not None:
            self.progress(done)


def _unimportable(name: str) -> str:
    """Return why a package that a rival needs does not import, if so: whatever time is left."""
    try:
        imported(rival(name))
    except MissingPackage as lacking:
        return str(lacking)
    return ""


def _guessed(method: Method) -> float:
    return UNKNOWN.get(method.language, USUAL)


def _program(one: Started, clock: Clock) -> Callable[[], float]:
    return lambda: lap(one.run.march, one.end, clock).seconds


def _point(trial: Trial, one: Started, seconds: Sequence[float]) -> Point:
    after = one.first.after
    gone = after.time[0] / one.run.period
    return Point(
        trial=trial,
        us_per_period=min(seconds) / gone * 1e6,
        runs=len(seconds),
        periods=gone,
        steps=after.steps,
        rhs_evaluations=after.evaluations,
        setup_s=one.setup_s,
        **one.errors,
    )
