"""Timing: one method from one start, timed block by block, and again in turn with all others."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Final, Self

from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.numbers.double_double import DoubleDouble
from heavytop.scene.scene import Scene
from heavytop.studies.methods import Method
from heavytop.studies.steppers import MethodRun, set_up

BEFORE: Final = 0.382  # of a period before the last one ends: no turning point
ROUNDS: Final = 3
clock: Callable[[], float] = perf_counter  # [s]
REPEATS_S: Final = 0.5  # for one setting: what takes longer is repeated in one round only
SHORT_S: Final = 0.01  # a run that is shorter is made twice: the first finds caches cold


class TooSlow(Exception):
    """A run that was stopped between two blocks."""


@dataclass(eq=False)
class Timed:
    """A method after a run from one start.

    Attributes
    ----------
    run : MethodRun
    end : (float, float)
        The time at which it is looked at [s].
    last : StepperState
        Where its last block ended.
    axis_error, theta_error, energy_error : float or None
        As those of a `heavytop.studies.work_precision.Point`.
    seconds : list of float
        Time in the blocks of steps, of each run [s].
    """

    run: MethodRun
    end: DoubleDouble
    last: StepperState
    axis_error: float | None
    theta_error: float
    energy_error: float
    seconds: list[float] = field(default_factory=list)

    @classmethod
    def restored(cls, scene: Scene, method: Method, periods: float, row: dict[str, Any]) -> Self:
        """Return what `row` told of, ready to be repeated."""
        found = set_up(scene, method)
        end = found.stepper.output_time((periods - BEFORE) * found.period)
        last = StepperState(
            tuple(row.pop("time")), (), (), row.pop("steps"), row.pop("evaluations")
        )
        return cls(found, end, last, **row)

    @property
    def row(self) -> dict[str, Any]:
        """All that was measured, for JSON."""
        names = ("axis_error", "theta_error", "energy_error", "seconds")
        last = {name: getattr(self.last, name) for name in ("time", "steps", "evaluations")}
        return {name: getattr(self, name) for name in names} | last

    @property
    def periods(self) -> float:
        """Nutation periods that the blocks covered."""
        return self.last.time[0] / self.run.period

    @property
    def us_per_period(self) -> float:
        """The best of the runs [µs]."""
        return min(self.seconds) / self.periods * 1e6


def first_run(scene: Scene, method: Method, periods: float, limit: float) -> Timed:
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
    found = set_up(scene, method)
    end = found.stepper.output_time((periods - BEFORE) * found.period)
    before, last, seconds = _lap(found, end, limit)
    row = found.stepper.states_at(before, [end])[0].tolist()
    off, tilt = found.reference(end, row), found.reference.tilt(end, row)
    if not math.isfinite(off.energy + tilt + (off.axis or 0.0)):
        raise IntegrationFailed("its numbers are no longer finite")
    return Timed(found, end, last, off.axis, abs(tilt), abs(off.energy), [seconds])


def repeat(
    settings: Sequence[Sequence[Timed]], deadline: float, show: Callable[[float], object]
) -> None:
    """Time what was run, in rounds, so that what disturbs the machine disturbs all alike.

    A round runs every setting once from each start. Slow settings are in the first round only, and
    nothing is begun after the deadline.
    """
    starts = max(map(len, settings), default=0)
    for turn in range(ROUNDS):
        for start in range(starts):
            for setting in settings:
                rare = turn * sum(timed.seconds[0] for timed in setting) > REPEATS_S
                timed = setting[start]
                for _ in range(0 if rare else 1 if timed.seconds[0] > SHORT_S else 2):
                    if clock() < deadline:
                        timed.seconds.append(_lap(timed.run, timed.end)[2])
            show((turn + (start + 1) / starts) / ROUNDS)


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
