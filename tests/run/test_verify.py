"""Every run that reaches its end is held against the closed form: its errors, and its digits."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli.command import app
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import EndedEarly, UnboundedAngleWarning
from heavytop.run.planning import Plan
from heavytop.run.propagation import completed
from heavytop.run.verify import (
    ahead,
    deviations,
    forewarned,
    missed_digits,
    phase_error,
    run_errors,
)

from ..motions import BOOK, KICKED

LOSING = {"quantities": ("theta",), "events": (), "samples": 5, "digits": 12}
RATES = ("thetadot", "phidot", "psidot")


def shifted(run, by):
    """A run whose samples are those of so much later [s]."""
    rows = run(np.minimum(run.t + by, run.t[-1])).states
    return replace(run, orbit=replace(run.orbit, samples=run.orbit.samples._replace(states=rows)))


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("name", ["sicm-kicked", "force-free", "inverted-gravity"])
def test_errors_of_rates_are_those_against_the_exact_ones(name, formulation):
    wants = ("theta", "rates") if formulation == "cubic" else ("theta", "phi", "rates")
    scene = replace(ht.load_scene(name), quantities=wants, samples=9, events=())
    run = ht.propagate(scene, formulation=formulation)
    exact = [run.motion.at(t, digits=25) for t in run.t.tolist()]
    off = max(
        abs(getattr(run.samples, rate)[i] - float(getattr(at, rate)))
        for i, at in enumerate(exact)
        for rate in RATES
    )
    found = run_errors(run)
    assert max(off, found.rates) < 1e-10
    late = run_errors(shifted(run, 1e-6)).rates  # planted
    motion, t = run.motion, run.t[:-1]
    moved = [getattr(motion.at(t + 1e-6), r) - getattr(motion.at(t), r) for r in RATES]
    assert late == pytest.approx(np.max(np.abs(moved)), rel=0.3)


def test_digits_asked_of_rates_are_checked():
    """They are wanted, and nothing else is; held to the largest of them, about 140 rad/s."""
    scene = replace(ht.load_scene("sicm-kicked"), quantities=("rates",), events=(), digits=9)
    run = ht.propagate(scene, formulation="axis")
    assert missed_digits(run, run_errors(run)) == {}
    wrong = shifted(run, 1e-8)
    assert set(missed_digits(wrong, run_errors(wrong))) == {"rates"}
    tilt = replace(wrong, scene=replace(scene, quantities=("theta",)))
    assert set(missed_digits(tilt, run_errors(tilt))) == {"theta"}


def test_the_command_says_that_rates_miss_their_digits():
    """Beside the pole doubles lose those of phidot, which auto knows."""
    asked = ["run", "through-top", "--json", "--set", 'want.quantities=["rates"]']
    result = CliRunner().invoke(app, [*asked, "--formulation", "axis"])
    assert result.exit_code == 5
    assert "off the closed form by rates" in result.stderr
    document = json.loads(result.stdout)
    assert document["missed_digits"] == {"rates": document["errors"]["rates"]}
    by_auto = CliRunner().invoke(app, asked)
    assert by_auto.exit_code == 0
    assert json.loads(by_auto.stdout)["plan"]["precision"] != "double"


def test_the_bound_is_not_slack():
    """The errors are those of the bits: a run in fewer bits would be seen."""
    changes = ["want.digits=60", "span.time=3", "want.events=[]", "want.samples=7"]
    wanted = 'want.quantities=["theta", "phi", "psi"]'
    run = ht.propagate(ht.load_scene("sicm-kicked", [*changes, wanted]))
    assert run.plan.precision == "256 bits"
    errors = run_errors(run)
    for error in (errors.theta, errors.phi, errors.psi):
        assert 1e-79 < error < 1e-74
    assert 1e-78 < errors.input_rounding < 1e-73


def test_whole_turns_are_errors_through_a_pole_too():
    start = ht.State(2, thetadot=5, phi="0.4")
    scene = ht.Scene(ht.Top(2, 1, 3), start, time=3, quantities=("theta", "phi", "psi"))
    good = ht.propagate(scene)
    assert max(run_errors(good).phi, run_errors(good).psi) < 1e-11
    rows = good.orbit.samples.states.copy()
    rows[200:, -2] += 2 * np.pi
    rows[200:, -1] -= 2 * np.pi
    orbit = replace(good.orbit, samples=good.orbit.samples._replace(states=rows))
    errors = run_errors(replace(good, orbit=orbit))
    assert abs(errors.phi - 2 * np.pi) < 1e-9
    assert abs(errors.psi - 2 * np.pi) < 1e-9


def test_a_phase_that_is_planted_is_found():
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.events=[]"]), formulation="axis")
    assert abs(phase_error(run)) < 1e-14
    form, t = run.motion.double, np.linspace(0, 2, 9)
    exact, later = form(t), form(t + 1e-6)  # planted
    off = later.u - exact.u, later.udot - exact.udot
    assert ahead(*off, exact, form.frequency) == pytest.approx(1e-6, rel=1e-3)


def test_the_errors_that_are_drawn_are_against_the_numbers_of_more_digits():
    """Doubles round the start, and what that does to this motion is a million times as much."""
    changes = ["want.digits=30", "want.samples=7", "want.events=[]"]
    found = deviations(ht.propagate(ht.load_scene("near-separatrix", changes)))
    assert max(found[name].max() for name in ("theta", "axis")) < 1e-14
    assert "rates" not in found


def test_the_command_says_which_events_are_missed_and_leaves_with_five():
    words = ["start.theta=1e-6", "start.psidot=90", "span.periods=20.3", "want.digits=1"]
    options = [word for change in words for word in ("--set", change)]
    form = ["--formulation", "axis", "--json"]
    result = CliRunner().invoke(app, ["run", "sicm-dropped", *options, *form])
    document = json.loads(result.stdout)
    assert result.exit_code == 5
    assert "events: " in result.stderr
    assert document["missed_events"]["cusp"] == [21, 21]
    assert document["events"]["cusp"] != 21


def test_continued_and_resumed_runs_are_checked():
    short = ht.propagate(ht.Scene(BOOK, KICKED, time=2, **LOSING), formulation="axis")
    with pytest.warns(ht.MissedDigitsWarning, match="off the closed form by theta"):
        long = ht.extend(short, 20_000, samples=4)
    truth = ht.Motion(BOOK, KICKED).at(20_000, digits=30).theta
    assert abs(long.theta[-1] - float(truth)) > 1e-12
    with pytest.raises(EndedEarly) as early:
        ht.propagate(long.scene, formulation="axis", step_limit=10_000)
    with pytest.warns(ht.MissedDigitsWarning, match="off the closed form by theta"):
        completed(early.value.trajectory)


@pytest.mark.slow
def test_a_continued_run_counts_right_or_says_that_it_does_not():
    events = ("turning", "reversal", "cusp")
    scene = ht.Scene(BOOK, ht.State("1e-6", psidot=90), time="0.5", events=events, digits=2)
    with pytest.warns(ht.DoubtfulWarning, match="11 by the exact numbers"):
        ht.extend(ht.propagate(scene, formulation="axis"), 40)
    by_auto = ht.extend(ht.propagate(replace(scene, digits=12)), 40)  # takes more bits
    assert tuple(by_auto.events.count(name) for name in events) == (21, 0, 11)


def test_a_cubic_run_from_the_pole_that_is_farther_is_held_against_its_numbers():
    """From theta = pi, with both poles passed, heights are measured from the top."""
    scene = ht.Scene(
        ht.Top(1, 1, 0), ht.State("pi", thetadot=2), time=1, quantities=("theta",), digits=13
    )
    run = ht.propagate(scene, formulation="cubic")
    assert run.orbit.checkpoints[0].state[0] == 2
    assert run_errors(run).theta < 1e-13


@pytest.mark.parametrize(
    ("name", "kind"), [("lagrange", UnboundedAngleWarning), ("axis", ht.DoubtfulWarning)]
)
def test_what_a_plan_warns_of_has_its_kind(name, kind):
    with pytest.warns(kind, match="it may disappoint"):
        forewarned(Plan(name, warnings=("it may disappoint",)))
