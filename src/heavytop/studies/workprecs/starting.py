"""Starting: a method set up for a start and run once, which warms it up and shows its error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from heavytop.comparison.steppers import IntegrationFailed
from heavytop.scene.scene import Scene
from heavytop.studies.drifts.runs import Run, run
from heavytop.studies.methods import Method
from heavytop.studies.workprecs.timing import Clock, Lap, lap
from heavytop.studies.workprecs.work_precision import BEFORE


@dataclass(frozen=True, slots=True, eq=False)
class Started:
    """A method after its first run.

    Attributes
    ----------
    run : Run
    end : (float, float)
        The time at which it is looked at [s].
    first : Lap
    errors : dict from str to float or None
        By the names that a `Point` has.
    setup_s : float
        To derive and to compile [s].
    """

    run: Run
    end: tuple[float, float]
    first: Lap
    errors: dict[str, Any]
    setup_s: float = 0.0


def started(scene: Scene, method: Method, periods: float, patience: float, clock: Clock) -> Started:
    """Return a method after a run of so many nutation periods.

    Raises
    ------
    TooSlow
        It is not there yet after `patience` seconds.
    IntegrationFailed
        It cannot go on, or its numbers are no longer finite.
    HeavyTopError
        It cannot be set up for this start.
    """
    found = run(scene, method)
    end = found.march.output_time((periods - BEFORE) * found.period)
    first = lap(found.march, end, clock, patience)
    errors = _errors(found, end, found.march.states_at(first.last, [end])[0].tolist())
    if not all(math.isfinite(x) for x in errors.values() if x is not None):
        raise IntegrationFailed("its numbers are no longer finite")
    return Started(found, end, first, errors)


def _errors(found: Run, end: tuple[float, float], row: list[float]) -> dict[str, Any]:
    off = found.yardstick(end, row)
    return {
        "axis_error": off.axis,
        "theta_error": abs(found.yardstick.tilt(end, row)),
        "energy_error": abs(off.energy),
    }
