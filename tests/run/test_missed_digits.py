"""No run misses its digits in silence: not between samples, not in the times of its events."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import MissedDigitsWarning
from heavytop.run.propagation import completed
from heavytop.run.trajectory import times_between
from heavytop.run.verify import missed_digits

from ..motions import BOOK

KICKED = ht.load_scene("sicm-kicked", ["want.events=['turning']"])


def test_few_digits_near_a_separatrix_are_met_or_missed_aloud():
    """401 samples of theta(1e5 s), whose period is set by 1e-6 of a pole's height."""
    top, start = ht.Top(1, "0.5", 1), ht.State("0.02", psidot="0.6")
    scene = ht.Scene(top, start, time=1e5, quantities=("theta",), digits=6)
    run = ht.propagate(scene)
    assert missed_digits(run) == {}
    assert (run.plan.formulation, len(run.plan.tried)) == ("axis", 1)
    assert "theta off by" in run.plan.tried[0]
    with pytest.warns(MissedDigitsWarning, match="theta"):
        run = ht.propagate(scene, formulation="cubic", projected=True)
    assert missed_digits(run)["theta"] > 1e-6


@pytest.mark.parametrize("digits", [2, 3, 6])
def test_few_digits_keep_every_turning_point_of_small_nutations(digits):
    """A nutation of 1e-4 rad: what theta allows would move the events by much of a period."""
    start = ht.State("0.001", phidot=5, psidot=200)
    scene = ht.Scene(BOOK, start, periods=300, digits=digits)
    run = ht.propagate(scene)
    found = run.events.of("turning")
    exact = np.arange(found.t.size) * run.motion.period / 2
    assert found.t.size == 601
    assert np.max(np.abs(found.t - exact)) < 10.0**-digits * run.motion.period


def test_samples_at_turning_points_do_not_hide_the_phase():
    """Every sample falls on a turning point, where a late theta is right to the second order."""
    scene = replace(KICKED, quantities=("theta",), periods=ht.Exact.of(2000), time=None)
    with pytest.warns(MissedDigitsWarning, match="theta"):
        run = ht.propagate(scene, formulation="axis")
    at_samples = np.abs(run.theta - run.motion.at(run.t).theta)
    assert at_samples.max() < 1e-12 < missed_digits(run)["theta"]


@pytest.mark.parametrize(("digits", "off"), [(12, (1e-9, 1e-7)), (20, (0, 1e-25))])
def test_beside_a_pole_phi_is_as_uncertain_as_its_rate_makes_it(digits, off):
    """As docs/precision.md says: no compared time falls into the pass, and nothing is named."""
    start = ht.State("1e-6", phidot=10**6, psidot=1 - 10**6)
    run = ht.propagate(ht.Scene(ht.Top(1, "0.5", 2), start, time=20, digits=digits))
    form, events = run.own.closed_form, run.events
    if events.own is None:
        found = abs(events.phi - form.at(events.t, t_lo=events.t_low).phi)
    else:
        exact = form.at(run.numbers(events.own["t"]), 40)
        found = abs(run.numbers(events.own["phi"]) - [each.phi for each in exact])
    assert off[0] < found.max() < off[1]
    assert missed_digits(run) == {}


@pytest.mark.slow
def test_digits_are_met_whose_bound_is_no_double():
    """10^-340 is smaller than any double, and so is how late an event is."""
    run = ht.propagate(replace(KICKED, digits=340, time=ht.Exact.of("0.3"), periods=None))
    assert len(run.events) == 2
    assert missed_digits(run) == {}


def with_late_events(run, late):
    """The run as if it had found its events so much later [s]."""
    found = replace(run)
    vars(found)["events"] = replace(run.events, t=run.events.t + late)
    return found


def test_an_event_may_be_as_late_as_an_error_of_its_rate_makes_it():
    """At a turning point 10^-digits/|thetadd| beside 10^-digits of a period."""
    run = ht.propagate(KICKED)
    at = run.motion.at(run.events.t[2], digits=30)
    bend = abs(float(at.uddot)) / np.sin(float(at.theta))
    allowed = 1e-12 * (run.motion.period + 1 / bend)
    for share, missed in ((0.9, set()), (1.1, {"event_time"})):
        late = share * allowed * (np.arange(len(run.events)) == 2)
        assert set(missed_digits(with_late_events(run, late))) == missed


def test_the_number_of_samples_changes_no_plan():
    for changes in (["span.periods=300", "want.digits=6"], ["want.quantities=['rates']"]):
        plans = {
            ht.plan(ht.load_scene("sicm-kicked", [*changes, f"want.samples={count}"]))
            for count in (2, 401, 1001, 100_001)
        }
        assert len(plans) == 1


def test_few_digits_of_psi_beside_both_poles_do_not_stall():
    """The quadrature of psi meets a pole 5e-11 rad away, and takes 30 000 steps for a period."""
    start = ht.State("1", thetadot=3, phidot="1e-10", psidot="1e-10")
    scene = ht.Scene(ht.Top(1, "0.5", 1), start, periods=7.5, quantities=("theta", "psi"), digits=2)
    assert ht.propagate(scene, step_limit=1000).statistics.steps < 200


def test_times_between_are_spread_whatever_the_samples():
    t = times_between(-100.0, 0.3)
    assert t.size == 80
    assert np.all((t <= 0) & (t >= -100))
    phases = np.sort(np.mod(t[:64] / 100, 1.0))
    assert np.max(np.diff(phases)) < 2 / 64
    assert np.all(t[64:80] <= -100 + 0.3)


def test_one_late_event_among_many_is_said():
    scene = ht.load_scene("sicm-kicked", ["span.periods=6000", "want.events=['turning']"])
    run = ht.propagate(replace(scene, quantities=("theta",), digits=9), formulation="axis")
    assert len(run.events) > 10_000
    assert missed_digits(run) == {}
    late = with_late_events(run, 1e-6 * (np.arange(len(run.events)) == 4321))
    assert missed_digits(late) == {"event_time": pytest.approx(1e-6, rel=1e-2)}


def test_a_run_that_is_extended_keeps_its_plan_and_says_a_miss():
    short = ht.propagate(replace(KICKED, digits=13, time=ht.Exact.of("0.2")))
    assert short.plan.precision == "double"
    with pytest.warns(MissedDigitsWarning):
        long = ht.extend(short, 2000, samples=4)
    assert (long.plan.precision, long.plan.tried) == ("double", ())
    with pytest.raises(ht.EndedEarly) as early:
        ht.extend(short, 2000, samples=4, progress=interrupting)
    with pytest.warns(MissedDigitsWarning):
        assert completed(early.value.trajectory).plan == long.plan


def interrupting(done):
    if done > 0.3:
        raise KeyboardInterrupt
