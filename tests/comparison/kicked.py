"""The kicked top of the book, which every method starts from, and its exact motion."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import heavytop as ht
from heavytop.comparison import make_stepper, named, user
from heavytop.comparison.steppers import InitialValueProblem
from heavytop.equations.formulation import FORMULATIONS
from heavytop.run.binary_motion import binary_start

from ..motions import shipped

MOTION = shipped("sicm-kicked")
SPAN = 0.77  # s, not a multiple of the period: an error of phase shows at first order


@cache
def started(formulation="axis"):
    """States and parameters, each rounded once from its exact value."""
    scene = ht.load_scene("sicm-kicked", ["want.quantities=['theta']"])
    constants, start = binary_start(scene, ht.plan(scene, formulation))
    return tuple(start.state.tolist()), constants


def set_up(name, setting=None, period=None, steps=None, start=None, **more):
    """The stepper of a method, or a test that is skipped by name where its packages are missing."""
    method = named(user.register(name))
    if missing := method.absent:
        pytest.skip(f"{name} needs {' and '.join(missing)}")
    if setting is not None:
        method = replace(method, setting=float(setting))
    period = MOTION.period if period is None else period
    start = start or started(method.formulation)
    begun = problem(*start, period, formulation=method.formulation, **more)
    return make_stepper(method, begun, steps)


def problem(start, parameters, period, direction=1, top=None, formulation="axis"):
    form = FORMULATIONS[formulation].build()
    return InitialValueProblem(form, parameters, tuple(start), direction, period, top)


def at(stepper, t):
    """The states at the first output time from t on, and that time."""
    place, time = stepper.begin(), stepper.output_time(t)
    while abs((after := stepper.block(place)).time[0]) < abs(time[0]):
        place = after
    return stepper.states_at(place, [time])[0], time[0]


def axis_error(stepper, t):
    state, time = at(stepper, t)
    if stepper.form is not None:
        state = stepper.form.axis_states(state)
    if state.size == 6:  # theta, phi, …
        theta, phi = state[:2]
        state = [np.sin(theta) * np.sin(phi), -np.sin(theta) * np.cos(phi), np.cos(theta)]
    return float(np.abs(state[:3] - MOTION.at(time).axis).max())
