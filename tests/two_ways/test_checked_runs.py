"""Every run that reaches its end is held against the closed form: its events, and its digits."""

import json
import warnings
from dataclasses import replace

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli.command import app
from heavytop.errors import EndedEarly
from heavytop.run.events import schedule
from heavytop.run.propagation import completed

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
LET_GO = ht.State("1e-6", psidot=90)  # cusps, each at 1e-6 rad from the unstable vertical
KICKED = ht.State("0.1", phidot=-15, psidot=140)
ALL = ("turning", "reversal", "cusp")
LOSING = {"quantities": ("theta",), "events": (), "samples": 5, "digits": 12}


def counts(events):
    return tuple(events.count(name) for name in ALL)


def let_go(form, digits=30):
    wants = ("theta",) if form == "cubic" else ("theta", "phi", "psi")
    return ht.Scene(
        BOOK, LET_GO, periods="20.3", quantities=wants, events=ALL, digits=digits, samples=3
    )


@pytest.mark.parametrize("form", ["auto", "axis", "attitude", "cubic", "lagrange"])
def test_no_event_is_missed_where_doubles_count_others(form):
    """In doubles the axis form counts 26, 4 and 1, and the cubic form runs away to infinity."""
    run = ht.propagate(let_go(form), formulation=form)
    exact = ht.Motion(BOOK, LET_GO).form(50)
    assert counts(run.events) == (41, 0, 21)
    assert run.events.kind[:3] == ("cusp", "theta_max", "cusp")
    times = [event.sample.t for event in run.decimals.events]
    late = [abs(t - n * exact.period / 2) for n, t in enumerate(times)]  # let go at a cusp
    assert max(late) < 1e-30
    assert run.orbit.samples.t.size == run.t.size


def test_a_run_whose_doubles_broke_off_is_stored_whole(tmp_path):
    run = ht.propagate(let_go("cubic"), formulation="cubic")
    run.save(tmp_path / "run.nc")
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    assert counts(loaded.events) == (41, 0, 21)
    assert loaded(50.0).theta == pytest.approx(float(ht.Motion(BOOK, LET_GO).at(50.0).theta))


@pytest.mark.parametrize(
    "start",
    [
        KICKED,
        ht.State("0.1", phidot="-1e-30", psidot=140),
        ht.State("3.1", phidot=4, thetadot="-0.2", psidot="-30"),
        ht.State("0.7", phidot="1e-3", thetadot="0.4", psidot=200),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_events_are_looked_for_where_they_are(start, sign):
    """There theta is at a turning point of the exact motion, or phidot changes its sign."""
    motion = ht.Motion(ht.Top(BOOK.A, BOOK.C, sign * BOOK.gMR), start)
    form, end = motion.form(80), -2.3 * motion.period
    found = schedule(motion, form.ctx.mpf(end), ALL, 60)
    assert len(found) == len({t for _, t in found}) >= 4
    little = form.ctx.mpf(10) ** -40
    ways = [bool(form(t + side * little).phidot > 0) for _, t in found for side in (-1, 1)]
    for (kind, t), before, after in zip(found, ways[::2], ways[1::2], strict=True):
        here = form(t)
        assert end <= t <= 0
        if kind == "reversal":
            assert before != after
        else:
            tilt = motion.theta_min if kind == "theta_min" else motion.theta_max
            assert abs(here.thetadot) < 1e-40
            assert float(here.theta) == pytest.approx(tilt, rel=1e-14)


@pytest.mark.parametrize("form", ["axis", "attitude", "lagrange"])
def test_events_miscounted_in_doubles_are_told_whoever_chose_the_form(form):
    scene = replace(let_go(form, digits=2), quantities=("theta",))
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        run = ht.propagate(scene, formulation=form)
    assert run.plan.precision == "double"
    assert counts(run.events) != (41, 0, 21)
    assert any("where there are 21 by the exact numbers" in str(each.message) for each in heard)


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


def test_a_continued_run_is_checked():
    short = ht.propagate(ht.Scene(BOOK, KICKED, time=2, **LOSING), formulation="axis")
    with pytest.warns(ht.MissedDigitsWarning, match="off the closed form by theta"):
        long = ht.extend(short, 20_000, samples=4)
    truth = ht.Motion(BOOK, KICKED).at(20_000, digits=30).theta
    assert abs(long.theta[-1] - float(truth)) > 1e-12


def test_a_continued_run_counts_right_or_says_that_it_does_not():
    scene = ht.Scene(BOOK, LET_GO, time="0.5", events=ALL, digits=2)
    short = ht.propagate(scene, formulation="axis")
    with pytest.warns(ht.DoubtfulWarning, match="11 by the exact numbers"):
        ht.extend(short, 40)
    by_auto = ht.propagate(replace(scene, digits=12))  # takes more bits
    assert counts(ht.extend(by_auto, 40).events) == (21, 0, 11)


def test_a_continued_run_keeps_the_bits_that_auto_took():
    scene = ht.Scene(BOOK, LET_GO, time=20, events=(), digits=12, samples=3)
    short = ht.propagate(scene)
    assert short.plan.precision == "128 bits"
    long = ht.extend(short, 40)
    assert long.plan.precision == "128 bits"
    truth = ht.Motion(BOOK, LET_GO).at(40, digits=30)
    assert abs(long.phi[-1] - float(truth.phi)) < 1e-12 * abs(float(truth.phi))


def test_a_resumed_run_is_checked():
    scene = ht.Scene(BOOK, KICKED, time=20_000, **LOSING)
    with pytest.raises(EndedEarly) as early:
        ht.propagate(scene, formulation="axis", step_limit=10_000)
    with pytest.warns(ht.MissedDigitsWarning, match="off the closed form by theta"):
        completed(early.value.trajectory)


def test_what_would_be_too_many_samples_is_refused_with_the_way_out():
    scene = ht.Scene(BOOK, KICKED, time=2, quantities=("theta",), events=())
    run = ht.propagate(scene)
    with pytest.raises(ValueError, match=r"2e\+11 more samples .* of 10000000 at most; samples="):
        ht.extend(run, 1e9)


def test_a_cubic_run_from_the_pole_that_is_farther_is_held_against_its_numbers():
    """From theta = pi, with both poles passed, heights are measured from the top."""
    scene = ht.Scene(
        ht.Top(1, 1, 0), ht.State("pi", thetadot=2), time=1, quantities=("theta",), digits=13
    )
    run = ht.propagate(scene, formulation="cubic")
    assert run.orbit.checkpoints[0].state[0] == 2
    assert ht.run_errors(run).theta < 1e-13
