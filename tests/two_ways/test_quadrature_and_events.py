"""Times by plain quadrature of the reduced equation, against events and samples."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.potential import quadrature_period, quadrature_time

SCENES = ("sicm-kicked", "sicm-dropped", "sicm-forward", "sicm-forward-spin-held")


@pytest.fixture(params=SCENES)
def run(request):
    return ht.propagate(ht.load_scene(request.param))


def closed_form(run):
    return ht.Motion(run.scene.top, run.scene.start).rising


def test_half_periods_between_turning_points(run):
    t = run.events.t[run.events.is_turning]
    half = float(quadrature_period(closed_form(run))) / 2
    assert np.max(np.abs(np.diff(t) - half)) < 2e-14


def test_time_as_a_function_of_tilt(run):
    """t(theta) = integral of du / sqrt f(u), from the lower turning point upwards."""
    turning = run.events.t[run.events.is_turning]
    kinds = np.array(run.events.kind)[run.events.is_turning]
    first = int(np.flatnonzero(kinds == "theta_max")[0])
    lowest, highest = turning[first], turning[first + 1]
    t = np.linspace(lowest, highest, 23)[1:-1]
    spent = [float(quadrature_time(closed_form(run), theta)) for theta in run(t).theta]
    assert np.max(np.abs(spent - (t - lowest))) < 5e-14
