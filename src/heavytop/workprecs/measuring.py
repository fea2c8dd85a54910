"""Measuring: every method set up once, run once to see its error, and then timed in turn."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from heavytop.drifts.runs import Run, run
from heavytop.errors import HeavyTopError, MissingPackage
from heavytop.march import Stopped
from heavytop.models.ladder import LADDER
from heavytop.planning import closed_form_of
from heavytop.scene import Scene
from heavytop.workprecs.asked import asked
from heavytop.workprecs.ladder import DEFAULT, Trial
from heavytop.workprecs.point import Point, Skipped
from heavytop.workprecs.timing import Clock, Lap, TooSlow, in_turn, lap
from heavytop.workprecs.work_precision import BEFORE, WorkPrecision

FIRST_RUNS: Final = 0.6  # of the budget may go to setting up and first runs,
PATIENCE: Final = 0.05  # and to one of them

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
        chooses for 6, 9 and 12 digits.
    periods : float
        Nutation periods to go, from 1 to 1e6.
    budget : float
        Time to take in all, at least 1 [s]. What it does not allow is in ``skipped``.
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
    >>> from heavytop.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> found = work_precision(scene, methods=["taylor-axis"], periods=10, budget=60)
    >>> found.cheapest(1e-9).trial.method.setting > found.points[-1].trial.method.setting
    True
    >>> min(point.error for point in found.points) < 1e-13
    True
    """
    clock = time.perf_counter
    began = clock()
    derived = _derived(clock)
    tried = asked(scene, methods, {"periods": periods, "budget": budget})
    measuring = _Measuring(scene, periods, budget, began, derived, clock, progress)
    points, skipped = measuring.of(tried)
    return WorkPrecision(scene, periods, budget, points, skipped)


def _derived(clock: Clock) -> dict[str, float]:
    """Return how long each formulation takes to derive [s]; next to nothing if it was before."""
    spent = {}
    for name, form in LADDER.items():
        began = clock()
        form.build(None)
        spent[name] = clock() - began
    return spent


@dataclass(frozen=True, slots=True, eq=False)
class _Started:
    """A trial after its first run."""

    trial: Trial
    run: Run
    end: tuple[float, float]
    first: Lap
    errors: dict[str, Any]
    setup_s: float


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
        self.stopped: dict[str, str] = {}  # by method, what took too long
        self.derived = derived
        self.compiled: dict[int, float] = {}

    def of(self, tried: Sequence[Trial]) -> tuple[tuple[Point, ...], tuple[Skipped, ...]]:
        """Return the points and what was skipped."""
        started, skipped = [], []
        for i, trial in enumerate(tried):
            reason = self._why_not(trial)
            if not reason:
                one = self._started(trial)
                if isinstance(one, _Started):
                    started.append(one)
                    self._show(0.5 * (i + 1) / len(tried))
                    continue
                reason = one
            skipped.append(Skipped(trial, reason))
        return tuple(self._timed(started)), tuple(skipped)

    def _why_not(self, trial: Trial) -> str:
        if trial.method.absent:
            return str(MissingPackage(trial.method.name, trial.method.absent))
        if self.clock() - self.began > FIRST_RUNS * self.budget:
            return f"not begun: no time was left for it in a budget of {self.budget:g} s"
        if before := self.stopped.get(trial.method.name):
            return f"not begun: {before} took too long"
        return ""

    def _started(self, trial: Trial) -> _Started | str:
        """Return a trial after its first run, or why there is none."""
        try:
            return self._first_run(trial)
        except TooSlow as slow:
            self.stopped[trial.method.name] = trial.text
            gone = slow.place.time[0] / float(closed_form_of(self.scene).period or math.inf)
            return f"stopped after {gone:.3g} of {self.periods:g} periods in {slow.spent:.3g} s"
        except (Stopped, HeavyTopError) as refusal:
            return " ".join(str(refusal).split())

    def _first_run(self, trial: Trial) -> _Started:
        found = run(self.scene, trial.method)
        end = found.march.offered((self.periods - BEFORE) * found.period)
        first = lap(found.march, end, self.clock, PATIENCE * self.budget)
        errors = _errors(found, end, found.march.seen(first.last, [end])[0].tolist())
        if not all(math.isfinite(x) for x in errors.values() if x is not None):
            raise Stopped("its numbers are no longer finite")
        return _Started(trial, found, end, first, errors, self._setup_s(trial, found))

    def _setup_s(self, trial: Trial, found: Run) -> float:
        """Return what deriving and compiling took; rivals with one kernel compile it once."""
        march: Any = found.march
        if hasattr(march, "engine"):
            spent = float(march.engine.compile_s)
        else:
            kernel = getattr(march, "kernel", None) or march.right_hand_side
            spent = self.compiled.setdefault(id(kernel), march.compile_s)
        return self.derived[trial.method.formulation] + spent

    def _timed(self, started: Sequence[_Started]) -> Iterator[Point]:
        """Time what was started, in turn, and make its points."""
        spent = in_turn(
            [_program(one, self.clock) for one in started],
            [one.first.seconds for one in started],
            self.began + self.budget,
            self.clock,
            on_round=lambda done: self._show(0.5 + 0.5 * done),
        )
        for one, seconds in zip(started, spent, strict=True):
            yield _point(one, seconds or [one.first.seconds])

    def _show(self, done: float) -> None:
        if self.progress is not None:
            self.progress(done)


def _program(one: _Started, clock: Clock) -> Callable[[], float]:
    return lambda: lap(one.run.march, one.end, clock).seconds


def _errors(found: Run, end: tuple[float, float], row: list[float]) -> dict[str, Any]:
    off = found.yardstick(end, row)
    return {
        "axis_error": off.axis,
        "theta_error": abs(found.yardstick.tilt(end, row)),
        "energy_error": abs(off.energy),
    }


def _point(one: _Started, seconds: Sequence[float]) -> Point:
    after = one.first.after
    gone = after.time[0] / one.run.period
    return Point(
        trial=one.trial,
        us_per_period=min(seconds) / gone * 1e6,
        runs=len(seconds),
        periods=gone,
        steps=after.steps,
        rhs_evaluations=after.evaluations,
        setup_s=one.setup_s,
        **one.errors,
    )
