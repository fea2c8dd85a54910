"""Tolerance from the digits: what truncation is expected to lose, against runs that lose it."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import MissedDigitsWarning
from heavytop.run.estimates import Forecast
from heavytop.run.planning import EPSILON, LADDER
from heavytop.run.propagation import carried_out
from heavytop.run.truncation import Truncation, order_of
from heavytop.run.verify import missed_digits, missed_events, run_errors

from .test_planning import drawn

BOOK = ht.load_scene("sicm-kicked", ["span.periods=1000", "want.events=[]"])


def asked(digits, **changes):
    return replace(BOOK, digits=digits, **changes)


@pytest.mark.parametrize("digits", [3, 6, 9])
@pytest.mark.parametrize("seed", [1, 2, 4, 5, 7])
def test_what_is_chosen_meets_the_digits_and_the_least_is_not_taken(seed, digits):
    scene = replace(drawn(seed), periods=ht.Exact.of(40 * 4**digits % 997 + 800), digits=digits)
    run = ht.propagate(scene)
    errors = run_errors(run)
    assert missed_digits(run, errors) == {}
    assert (run.plan.tolerance > EPSILON) == (run.plan.formulation == "axis")


@pytest.mark.parametrize("tolerance", LADDER[:4])
def test_a_forecast_is_what_a_run_loses(tolerance):
    """Steps, and errors from above, by hardly more than a hundred times."""
    for periods in (30, 1000):
        scene = replace(BOOK, periods=ht.Exact.of(periods), quantities=("axis",))
        motion = ht.Motion(scene.top, scene.start)
        chosen = replace(ht.plan(scene, "axis"), tolerance=tolerance)
        with pytest.warns(MissedDigitsWarning):
            run = carried_out(scene, motion, chosen)
        lost = Truncation(motion, None)(order_of(tolerance))
        expected = Forecast(scene, motion, periods * motion.period).truncated(lost)
        assert run.statistics.order == order_of(tolerance)
        assert run.statistics.steps / periods == pytest.approx(lost.steps, rel=0.03)
        assert 1 <= expected / run_errors(run).axis < 200


def test_drift_grows_as_the_square_of_the_time_and_no_faster_than_it_where_it_is_put_back():
    scene = asked(6, quantities=("axis",))
    motion = ht.Motion(scene.top, scene.start)
    lost = Truncation(motion, None)(order_of(1e-7))
    near, far = (Forecast(scene, motion, t) for t in (1e3, 1e4))
    assert far.truncated(lost) > 90 * near.truncated(lost)
    assert far.truncated(lost, projected=True) < 11 * near.truncated(lost, projected=True)


KEEP = [
    {"digits": 12},
    {"digits": 6, "events": ("turning", "reversal")},
    {"digits": 6, "quantities": ("theta",)},
    {"digits": 6, "periods": ht.Exact.of(300)},
]


@pytest.mark.parametrize("changes", KEEP)
def test_the_least_tolerance_is_kept(changes):
    """By a scene that says nothing, that asks what rounding tells, or that is soon over."""
    assert ht.plan(replace(BOOK, **changes)).tolerance == EPSILON


def test_the_least_tolerance_is_kept_by_name_and_where_cusps_are_told():
    assert ht.plan(asked(6), "axis").tolerance == EPSILON
    dropped = ht.load_scene("sicm-dropped", ["span.periods=1000", "want.digits=6"])
    assert ht.plan(dropped).tolerance == EPSILON
    assert ht.plan(replace(dropped, events=())).tolerance > EPSILON


def test_more_digits_take_a_smaller_tolerance_and_more_time():
    plans = [ht.plan(asked(digits, quantities=("axis",))) for digits in range(1, 13)]
    tolerances = [each.tolerance for each in plans]
    assert tolerances == sorted(tolerances, reverse=True)
    assert len({*tolerances}) > 4
    assert [p.estimate.seconds for p in plans] == sorted(p.estimate.seconds for p in plans)
    assert "one more digit takes" in plans[5].reasons[-1]


def test_events_are_counted_and_their_times_have_the_digits():
    for periods in ("1000.3", "2000", "3000.1"):
        scene = replace(asked(5), periods=ht.Exact.of(periods), events=("turning",), samples=3)
        run = ht.propagate(scene)
        assert run.plan.tolerance > EPSILON
        assert missed_events(run) == {}
        assert run_errors(run).event_time < 1e-5 * run.motion.period


def test_what_goes_on_keeps_its_tolerance(tmp_path):
    """Continued, stored and read, to the same bits."""
    whole = ht.propagate(asked(6))
    whole.save(tmp_path / "run.nc")
    read = ht.load_trajectory(tmp_path / "run.nc")
    assert read.plan.tolerance == whole.plan.tolerance > EPSILON
    end = 1.25 * float(whole.t[-1])
    longer, again = (ht.extend(each, end, samples=100) for each in (whole, read))
    assert longer.plan.tolerance == again.plan.tolerance == whole.plan.tolerance
    assert np.array_equal(longer.phi, again.phi)
    assert np.array_equal(longer.phi[: whole.t.size], whole.phi)


def test_digits_that_a_longer_run_misses_are_missed_aloud():
    """Its samples are whole periods apart, at turning points, where an error in time hides."""
    scene = asked(7, periods=ht.Exact.of(1200), samples=2)
    run = ht.propagate(scene)
    assert run.plan.tolerance > EPSILON
    with pytest.warns(MissedDigitsWarning):
        ht.extend(run, 40 * run.t[-1], samples=40)
