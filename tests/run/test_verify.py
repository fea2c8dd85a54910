"""Every run that reaches its end is held against the closed form: its errors, and its digits.

None misses its digits in silence: not between samples, not in the times of its events.
"""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.run.propagation import finish
from heavytop.run.trajectory import times_between
from heavytop.run.verify import invariant_drift, misses, warn_of_plan

from ..trajectories import angles_of, planted, run_of, with_states

RATES = ("thetadot", "phidot", "psidot")
RATES_ALONE = "want.quantities=['rates']"


def shifted(run, by):
    """A run whose samples are those of so much later [s]."""
    return with_states(run, run(np.minimum(run.t + by, run.t[-1])).states)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("name", ["sicm-kicked", "force-free", "inverted-gravity"])
def test_errors_of_rates_are_those_against_the_exact_ones(name, formulation):
    wants = (*angles_of(formulation)[:2], "rates")
    scene = replace(ht.load_scene(name), quantities=wants, samples=9, events=(), digits=9)
    run = ht.propagate(scene, formulation=formulation)
    exact = run.motion.at(run.t, digits=25)
    off = [getattr(run.samples, x) - [float(getattr(at, x)) for at in exact] for x in RATES]
    assert max(np.max(np.abs(off)), ht.run_errors(run).rates) < 1e-10
    late = ht.run_errors(shifted(run, 1e-6)).rates  # planted
    sooner, later = run.motion.at(run.t[:-1]), run.motion.at(run.t[:-1] + 1e-6)
    moved = [getattr(later, rate) - getattr(sooner, rate) for rate in RATES]
    assert late == pytest.approx(np.max(np.abs(moved)), rel=0.3)


def test_rates_are_held_to_the_largest_of_them():
    """Beside a pole the axis turns with 1600 rad/s: 12 digits of that, not of 2 at the end."""
    start = ht.State("1/2", thetadot=-2, phidot=0, psidot="1/100")
    run = ht.propagate(ht.Scene(ht.Top(1, "1/2", 1), start, time=3, quantities=("rates",)))
    assert abs(run.samples.phidot).max() > 1000 > 10 > abs(run.samples.phidot[-1])
    assert (run.plan.precision, run.plan.tried, misses(run).digits) == ("double", (), {})


def test_digits_asked_of_rates_are_checked():
    """They are wanted, and nothing else is; held to the largest of them, about 140 rad/s."""
    scene = replace(ht.load_scene("sicm-kicked"), quantities=("rates",), events=(), digits=9)
    run = ht.propagate(scene, formulation="axis")
    assert misses(run).digits == {}
    wrong = shifted(run, 1e-8)
    assert set(misses(wrong).digits) == {"rates"}
    tilt = replace(wrong, scene=replace(scene, quantities=("theta",)))
    assert set(misses(tilt).digits) == {"theta"}


def test_the_bound_is_not_slack():
    """The errors are those of the bits: a run in fewer bits would be seen."""
    wanted = 'want.quantities=["theta", "phi", "psi"]'
    run = run_of("want.digits=60", "span.time=3", "want.events=[]", "want.samples=7", wanted)
    assert run.plan.precision == "256 bits"
    turned = replace(run, scene=replace(run.scene, quantities=("attitude",)))  # needs all three
    errors, same = ht.run_errors(run), ht.run_errors(turned).input_rounding
    assert all(1e-79 < x < 1e-73 for x in (errors.theta, errors.phi, errors.psi, same))
    assert same == errors.input_rounding


def test_whole_turns_are_errors_through_a_pole_too():
    start = ht.State(2, thetadot=5, phi="0.4")
    scene = ht.Scene(ht.Top(2, 1, 3), start, time=3, quantities=("theta", "phi", "psi"))
    good = ht.propagate(scene)
    assert max(ht.run_errors(good).phi, ht.run_errors(good).psi) < 1e-11
    rows = good.orbit.samples.states.copy()
    rows[200:, :2] *= -1  # planted
    assert ht.run_errors(with_states(good, rows)).phi > 0.5


def test_what_a_plan_says_may_disappoint_is_doubtful():
    with pytest.warns(ht.DoubtfulWarning, match="it may disappoint"):
        warn_of_plan(ht.Plan("lagrange", warnings=("it may disappoint",)))


WITH_PSI = {"quantities": ("theta", "psi"), "events": ("turning", "reversal")}
TILT = {"quantities": ("theta",)}


# top, start, form, and what is wanted
@pytest.mark.parametrize(("top", "start", "form", "wants"), [
    # let go from rest at pi/2, three of four coefficients are zero, and the last two with them
    (ht.Top(1, 1, 1), ht.State("pi/2"), "axis", WITH_PSI),
    (ht.Top(1, 1, 1), ht.State("pi/2"), "cubic", WITH_PSI | TILT),
    # through both poles from theta = pi, heights are measured from the pole that is farther
    (ht.Top(1, 1, 0), ht.State("pi", thetadot="0.1"), "cubic", TILT),
    (ht.Top(1, 0, 1), ht.State(1), "axis", TILT),  # a point mass
])  # fmt: skip
def test_a_special_start_is_run_as_any_other(top, start, form, wants):
    """Events that are miscounted would be warned of: at rest phidot is zero, and never reverses."""
    run = ht.propagate(ht.Scene(top, start, time=20, **wants), formulation=form)
    assert ht.run_errors(run).theta < 1e-13
    assert ht.run_errors(run).energy < 1e-14


def test_changes_are_relative_to_the_start_and_that_of_energy_to_the_weight_at_least():
    values = {"energy": np.array([0.5, 0.75]), "p_psi": np.array([-4.0, -5.0, -3.5])}
    values |= {"p_phi": np.array([0.0, 0.125])}
    assert invariant_drift(values, {"g": 2.0}) == {"energy": 0.125, "p_psi": 0.25, "p_phi": 0.125}
    assert invariant_drift(values, {"gMR": 2.0, "A": 2.0})["energy"] == 0.25


# --- digits that are missed ----------------------------------------------------------------------


KICKED = ht.load_scene("sicm-kicked", ["want.events=['turning']"])


def test_few_digits_near_a_separatrix_are_met_or_missed_aloud():
    """401 samples of theta(1e5 s), whose period is set by 1e-6 of a pole's height."""
    top, start = ht.Top(1, "0.5", 1), ht.State("0.02", psidot="0.6")
    scene = ht.Scene(top, start, time=1e5, quantities=("theta",), digits=6)
    run = ht.propagate(scene)
    assert misses(run).digits == {}
    assert (run.plan.formulation, len(run.plan.tried)) == ("axis", 1)
    assert "theta off by" in run.plan.tried[0]
    with pytest.warns(ht.MissedDigitsWarning, match="theta"):
        run = ht.propagate(scene, formulation="cubic", projected=True)
    assert misses(run).digits["theta"] > 1e-6


def test_samples_at_turning_points_do_not_hide_the_phase():
    """Every sample falls on a turning point, where a late theta is right to the second order."""
    scene = replace(KICKED, quantities=("theta",), periods=ht.Exact.of(2000), time=None)
    with pytest.warns(
        ht.MissedDigitsWarning, match="theta .*allowed: 1e-12 max.*event_time: at least 1e-12 p"
    ):
        run = ht.propagate(scene, formulation="axis")
    at_samples = np.abs(run.theta - run.motion.at(run.t).theta)
    assert at_samples.max() < 1e-12 < misses(run).digits["theta"]


@pytest.mark.parametrize(("digits", "off"), [(12, (1e-9, 1e-7)), (20, (0, 1e-25))])
def test_beside_a_pole_phi_is_as_uncertain_as_its_rate_makes_it(digits, off):
    """As docs/precision.md says: no compared time falls into the pass, and nothing is named."""
    start = ht.State("1e-6", phidot=10**6, psidot=1 - 10**6)
    run = ht.propagate(ht.Scene(ht.Top(1, "0.5", 2), start, time=20, digits=digits))
    form, events = run.binary_motion.closed_form, run.events
    if events.own is None:
        found = abs(events.phi - form.at(events.t, t_lo=events.t_low).phi)
    else:
        exact = form.at(run.numbers(events.own["t"]), 40)
        found = abs(run.numbers(events.own["phi"]) - [each.phi for each in exact])
    assert off[0] < found.max() < off[1]
    assert misses(run).digits == {}


@pytest.mark.slow
def test_digits_are_met_whose_bound_is_no_double():
    """10^-340 is smaller than any double, and so is how late an event is."""
    run = ht.propagate(replace(KICKED, digits=340, time=ht.Exact.of("0.3"), periods=None))
    assert len(run.events) == 2
    assert misses(run).digits == {}


def test_an_event_may_be_as_late_as_an_error_of_its_rate_makes_it():
    """At a turning point 10^-digits/|thetadd| beside that of a period: one among 1400 is said."""
    run = ht.propagate(replace(KICKED, digits=9, time=None, periods=ht.Exact.of(700)))
    at = run.motion.at(run.events.t[432], digits=30)
    bend = abs(float(at.uddot)) / np.sin(float(at.theta))
    allowed = 1e-9 * (run.motion.period + 1 / bend)
    for share, missed in ((0.99, set()), (1.01, {"event_time"})):
        late = share * allowed * (np.arange(len(run.events)) == 432)
        found = planted(run, events=replace(run.events, t=run.events.t + late))
        assert set(misses(found).digits) == missed


@pytest.mark.parametrize("changes", [("span.periods=300", "want.digits=6"), (RATES_ALONE,)])
def test_the_number_of_samples_changes_no_plan(changes):
    counts = (f"want.samples={n}" for n in (2, 401, 1001, 100_001))
    assert len({ht.plan(ht.load_scene("sicm-kicked", [*changes, each])) for each in counts}) == 1


def test_few_digits_of_psi_beside_both_poles_do_not_stall():
    """The quadrature of psi meets a pole 5e-11 rad away, and takes 30 000 steps for a period."""
    start = ht.State("1", thetadot=3, phidot="1e-10", psidot="1e-10")
    scene = ht.Scene(ht.Top(1, "0.5", 1), start, periods=7.5, quantities=("theta", "psi"), digits=2)
    assert ht.propagate(scene, step_limit=1000).statistics.steps < 200


def test_times_between_are_spread_whatever_the_samples():
    t = times_between(-100.0, 0.3)
    assert t.size == 80
    assert np.all((t <= 0) & (t >= -100))
    assert np.max(np.diff(np.sort(np.mod(t[:64] / 100, 1.0)))) < 2 / 64
    assert np.all(t[64:80] <= -100 + 0.3)


def test_a_run_that_is_extended_keeps_its_plan_and_says_a_miss():
    short = ht.propagate(replace(KICKED, digits=13, time=ht.Exact.of("0.2")))
    assert short.plan.precision == "double"
    with pytest.warns(ht.MissedDigitsWarning):
        long = ht.extend(short, 2000, samples=4)
    assert (long.plan.precision, long.plan.tried) == ("double", ())
    with pytest.raises(ht.EndedEarly) as early:
        ht.extend(short, 2000, samples=4, progress=Mock(side_effect=KeyboardInterrupt))
    with pytest.warns(ht.MissedDigitsWarning):
        assert finish(early.value.trajectory).plan == long.plan
