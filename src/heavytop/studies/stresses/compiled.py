"""Rivals that are compiled, from the start to the end of a case in the axis form.

Those of fixed step take so many that the last one ends with the span: their step is a part of the
nutation period, or of the pendulum's where nothing nutates. They find no events.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from heavytop.comparison.methods import make_stepper
from heavytop.comparison.steppers import FixedStep, IntegrationFailed, Stepper, StepperState
from heavytop.numbers.double_double import Array, DoubleDouble, two_product
from heavytop.run.planning import Plan
from heavytop.run.propagation import binary_start
from heavytop.studies.stresses.cases import Case
from heavytop.studies.stresses.conditioning import Reference
from heavytop.studies.stresses.landing import landed
from heavytop.studies.stresses.methods import Method
from heavytop.studies.stresses.raw import Raw

BLOCK: Final = 1000  # steps of a fixed step between two looks,
CALL: Final = 50  # and of CyRK, whose steps are known by whole blocks only
AXIS: Final = Plan("axis", None, False, (), (), 0)


def compiled(case: Case, method: Method, truth: Reference, step_limit: int) -> Raw:
    """Let a compiled rival go to the end.

    Parameters
    ----------
    case : Case
    method : Method
        Its `rival` has a name and a setting.
    truth : Reference
        Of the case: its end and its period.
    step_limit : int
    """
    parameters, start = binary_start(case.scene, AXIS)
    took = _march(case, method, truth)
    end = _end(took, truth)
    steps = _last(took, end)
    if steps > step_limit:
        return Raw("step-limit", f"its steps would be {steps}", steps=steps)
    try:
        place, state = _walked(took, end, step_limit)
    except IntegrationFailed as stop:
        return Raw("failed", str(stop))
    if state is None:
        return Raw("step-limit", t=place.time[0], steps=place.steps)
    raw = Raw("finished", t=truth.end, steps=steps or place.steps, smallest=_smallest(took))
    return landed(raw, AXIS.equations, np.array([start.state, state]), parameters)


def ready(case: Case, method: Method, truth: Reference) -> None:
    """Compile what a method needs, so that no clock of a run sees it."""
    if method.rival:
        _march(case, method, truth)


def _march(case: Case, method: Method, truth: Reference) -> Stepper:
    parameters, start = binary_start(case.scene, AXIS)
    period = truth.period or math.tau / math.sqrt(abs(parameters["g"]))
    whole, block = period, CALL
    if method.per_period:
        steps = math.ceil(abs(truth.end) / period * method.per_period)
        whole, block = abs(truth.end) / steps * method.per_period, min(steps, BLOCK)
    setting, ahead = method.per_period or method.rtol, 1 if truth.end >= 0 else -1
    return make_stepper(method.rival, start.state, parameters, setting, whole, ahead, steps=block)


def _end(took: Stepper, truth: Reference) -> DoubleDouble:
    if not isinstance(took, FixedStep):
        return took.output_time(truth.end)
    return two_product(took.h, float(round(truth.end / took.h)))


def _last(took: Stepper, end: DoubleDouble) -> int:
    return round(end[0] / took.h) if isinstance(took, FixedStep) else 0


def _walked(took: Stepper, end: DoubleDouble, step_limit: int) -> tuple[StepperState, Array | None]:
    """Go on until a block holds the end: the place after it, and the state there."""
    place, after = took.begin(), took.begin()
    while abs(after.time[0]) < abs(end[0]):
        if after.steps >= step_limit:
            return after, None
        place, after = after, took.block(after)
    return after, took.states_at(place, [end])[0]


def _smallest(took: Stepper) -> float | None:
    return abs(took.h) if isinstance(took, FixedStep) else None
