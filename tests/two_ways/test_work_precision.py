"""A diagram shows what it says: errors are true, runs are in turn, and none beats the front."""

import io
import json
import math
import random
from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np
import pytest
from rich.console import Console

import heavytop as ht
from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.integration.bits import bits_of
from heavytop.report.terminal import rendered
from heavytop.studies.drifts.methods import method
from heavytop.studies.drifts.runs import run
from heavytop.studies.workprecs import starting
from heavytop.studies.workprecs.front import ahead_of, axis_error, cheapest, front, theta_error
from heavytop.studies.workprecs.ladder import DEFAULT, FOLDED, STEPS, Trial, trials
from heavytop.studies.workprecs.measuring import _Measuring
from heavytop.studies.workprecs.point import Point, Skipped
from heavytop.studies.workprecs.schedule import LATER, middles, schedule
from heavytop.studies.workprecs.timing import TooSlow, in_turn, lap, shares
from heavytop.studies.workprecs.work_precision import BEFORE, WorkPrecision

KICKED = ht.load_scene("sicm-kicked")


# --- errors ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found():
    methods = (
        "auto", "taylor-axis", "taylor-cubic=1e-9", "taylor-lagrange=1e-9", "strang=25",
        "blanes-moan-rkn6=6", "blanes-moan-rkn6=57", "dop853-cyrk=1e-6",
    )  # fmt: skip
    return ht.work_precision(KICKED, methods=methods, periods=20, budget=60)


def named(found, text):
    return next(p for p in found.points if p.trial.text == text)


@pytest.mark.parametrize("text", ["taylor-axis=1e-06", "taylor-lagrange=1e-09", "strang=25"])
def test_an_error_is_the_distance_from_the_closed_form(found, text):
    """Stepped here by the library's march, and held against the closed form in doubles."""
    made = run(KICKED, method(text))
    end = made.march.output_time((20 - BEFORE) * made.period)
    place = made.march.begin()
    while (after := made.march.block(place)).time < end:
        place = after
    row = made.march.states_at(place, [end])[0]
    exact = ht.Motion(KICKED.top, KICKED.start).at(np.array([end[0]]))
    if "lagrange" in text:
        theta, phi = row[:2]
        axis = [math.sin(theta) * math.sin(phi), -math.sin(theta) * math.cos(phi), math.cos(theta)]
    else:
        axis = row[:3] / np.linalg.norm(row[:3])
        theta = math.acos(axis[2])
    point = named(found, text)
    assert point.measures == "axis"
    assert point.energy_error == abs(made.yardstick(end, row.tolist()).energy) > 0
    assert point.error == pytest.approx(np.linalg.norm(axis - exact.axis[0]), rel=1e-3)
    assert point.theta_error == pytest.approx(abs(theta - exact.theta[0]), rel=1e-3)


def test_the_end_is_no_turning_point_and_is_asked_for(found):
    """At a turning point an error in time would not show: thetadot is no small part there."""
    motion = ht.Motion(KICKED.top, KICKED.start)
    rates = motion.at(np.linspace(0.0, motion.period, 201)).thetadot
    at_end = motion.at(np.array([(20 - BEFORE) * motion.period])).thetadot
    assert abs(at_end[0]) > 0.3 * np.max(np.abs(rates))
    assert all(point.periods >= 20 - BEFORE for point in found.points)


def test_the_tilt_of_a_state_beside_a_pole_is_a_number():
    """A cosine that rounding put above 1 is that of 0."""
    yardstick = run(KICKED, method("taylor-cubic")).yardstick
    row = list(run(KICKED, method("taylor-cubic")).march.begin().state)
    assert yardstick.tilt((0.0, 0.0), row) == pytest.approx(0.0, abs=1e-15)
    assert yardstick.tilt((0.0, 0.0), [-1e-20, *row[1:]]) == pytest.approx(-0.1)
    longer = [row[0] * (1 + 1e-6), *row[1:]]  # 1 - u: theta grows with it
    assert yardstick.tilt((0.0, 0.0), longer) == pytest.approx(0.05e-6, rel=1e-2)


def test_what_is_wrong_is_charted_where_it_is(found):
    """25 Strang steps a period end without a complaint, nowhere near the truth."""
    assert named(found, "strang=25").error > 0.01
    assert 1e-9 < named(found, "blanes-moan-rkn6=6").error < 1e-2


def test_two_states_measure_theta_and_more_measure_the_axis(found):
    assert {p.measures for p in found.points if p.trial.name == "taylor-cubic"} == {"theta"}
    assert {p.measures for p in found.points if p.trial.name == "taylor-axis"} == {"axis"}


def test_tolerances_are_obeyed(found):
    axis = [p for p in found.points if p.trial.name == "taylor-axis"]
    assert len(axis) == 14
    assert axis[0].error > 1e6 * axis[6].error > 1e9 * axis[-1].error
    assert axis[0].trial.method.setting == 1e-3


def test_costs_are_what_the_run_took(found):
    """Evaluations, steps and periods are of one and the same run."""
    for point in found.points:
        assert point.steps / point.periods > 1
        assert point.setup_s >= 0
    assert named(found, "strang=25").rhs_evaluations == named(found, "strang=25").steps
    assert named(found, "strang=25").steps == 16384
    cyrk = named(found, "dop853-cyrk=1e-06")
    assert cyrk.steps % 1000 == 0
    assert cyrk.rhs_evaluations > 11 * cyrk.steps
    assert named(found, "strang=25").periods == pytest.approx(16384 / 25)
    taylor = named(found, "taylor-axis=1e-06")
    assert taylor.rhs_evaluations == taylor.steps


# --- auto ------------------------------------------------------------------------------------


def test_auto_is_what_plan_chooses(found):
    assert [(p.trial.wants, p.trial.digits) for p in found.auto] == [
        (wants, digits) for wants in ("axis", "theta") for digits in (6, 9, 12)
    ]
    for point in found.auto:
        scene = replace(
            KICKED, time=None, periods=ht.Exact.of(20), quantities=(point.trial.wants,), events=(),
            digits=point.trial.digits,
        )  # fmt: skip
        assert point.trial.method.formulation == ht.plan(scene).formulation
        off = point.axis_error if point.trial.wants == "axis" else point.theta_error
        assert off <= 10.0**-point.trial.digits


@pytest.mark.parametrize("periods", [100, 1000, 10_000, 100_000])
@pytest.mark.parametrize("digits", [6, 12, 13, 15, 30])
def test_auto_is_the_plan_in_form_bits_tolerance_and_projection_or_says_that_it_is_folded(
    periods, digits
):
    for trial in trials(KICKED, f"auto={digits}", periods):
        chosen = ht.plan(
            ht.Scene(KICKED.top, KICKED.start, periods=periods, quantities=(trial.wants,),
                     events=(), samples=2, digits=digits)
        )  # fmt: skip
        assert ("folded" in trial.refused) == chosen.folded
        each = trial.method
        assert (each.formulation, each.projected) == (chosen.formulation, chosen.projected)
        assert (each.bits, each.setting) == (bits_of(chosen.precision), chosen.tolerance)


def test_what_auto_runs_in_192_bits_is_run_in_192_bits():
    """Beside a separatrix thirty digits take more than the ladder's 128 bits."""
    scene = ht.Scene(ht.Top(1, 1, 1), ht.State(theta="1e-6", omega3="1.2"), periods=2)
    (axis, _) = trials(scene, "auto=30", 2)
    assert axis.method.bits == 192
    assert axis.method.text == "taylor-axis-mpfr192"
    (point,) = ht.work_precision(scene, methods=["auto=30"], periods=2, budget=60).points[:1]
    assert point.document()["bits"] == 192
    assert point.axis_error < 1e-30
    assert not point.misses


def test_what_is_folded_is_left_out_with_the_reason():
    found = ht.work_precision(KICKED, methods=["auto=15"], periods=1e4, budget=60)
    assert found.points == ()
    assert [each.reason for each in found.skipped] == [FOLDED] * 2
    assert found.document()["skipped"][0]["setting"] == {"digits": 15}


def test_an_auto_that_misses_is_flagged_where_nothing_is_ahead_of_it():
    points = tuple(
        replace(made(1.0, off, name="taylor-axis"), trial=Trial(method("taylor-axis"), 9, wants))
        for wants, off in (("axis", 2e-9), ("axis", 1e-9), ("theta", 2e-9))
    )
    assert [point.misses for point in points] == [True, False, True]
    document = WorkPrecision(KICKED, 5.0, 60.0, points, ()).document()
    assert [each["missed"] for each in document["auto"]] == [True, False, True]
    assert document["auto"][0]["ahead"] == []
    console = Console(width=100, record=True, file=io.StringIO())
    console.print(rendered(document))
    assert console.export_text().count("MISSES what was asked") == 2


def test_the_same_trial_is_timed_once(found):
    """What auto chose for 6, 9 and 12 digits is the last rung of the ladder."""
    axis = [p for p in found.auto if p.trial.wants == "axis"]
    rung = [p for p in found.points if p.trial.name == "taylor-axis"][-1]
    assert {(p.us_per_period, p.error, p.runs) for p in axis} == {
        (rung.us_per_period, rung.error, rung.runs)
    }
    leaders = [found.points[i].trial.name for i in found.front]
    assert "auto" not in leaders
    assert found.cheapest(1e-12).trial.name != "auto"


# --- the front -------------------------------------------------------------------------------


def made(us, axis, theta=None, name="taylor-axis"):
    theta = axis if theta is None else theta
    return Point(Trial(method(name)), us, 2, 10.0, 100, 100, axis, theta, 1e-15, 0.1)


def test_nothing_beats_a_point_of_the_front_and_something_beats_every_other():
    draw = random.Random(3)
    for _ in range(50):
        points = [
            made(draw.choice((1, 2, 3, 5, 8)), 10.0 ** -draw.randint(1, 6)) for _ in range(12)
        ]
        leaders = front(points, axis_error)
        for i, one in enumerate(points):
            beaten = any(
                (p.us_per_period, p.error) != (one.us_per_period, one.error)
                and p.us_per_period <= one.us_per_period
                and p.error <= one.error
                for p in points
            )
            twins = [j for j, p in enumerate(points) if (p.us_per_period, p.error) ==
                     (one.us_per_period, one.error)]  # fmt: skip
            assert (not beaten) == bool(set(twins) & set(leaders)), (i, points)
        assert [points[i].us_per_period for i in leaders] == sorted(
            points[i].us_per_period for i in leaders
        )


def test_who_gives_no_axis_takes_no_part_in_the_front_of_the_axis():
    points = [made(1.0, None, 1e-9, "taylor-cubic"), made(2.0, 1e-9)]
    assert front(points, axis_error) == (1,)
    assert front(points, theta_error) == (0,)
    assert cheapest(points, axis_error, 1e-6) is points[1]
    assert cheapest(points, theta_error, 1e-6) is points[0]
    assert cheapest(points, axis_error, 1e-12) is None


def test_ahead_is_more_accurate_and_faster_beyond_noise():
    auto = made(10.0, 1e-9)
    others = [made(9.5, 1e-12), made(8.5, 1e-12), made(1.0, 1e-8), made(1.0, 1e-9)]
    assert ahead_of([auto, *others], auto, axis_error) == (others[1],)


def test_the_document_holds_what_the_contract_says(found):
    document = json.loads(json.dumps(found.document(), allow_nan=False))
    assert document["schema"] == "heavytop/workprec/1"
    for point in document["points"]:
        assert {"method", "formulation", "language", "tolerance", "us_per_period",
                "rhs_evaluations", "error", "energy_error", "setup_s"} <= point.keys()  # fmt: skip
        assert point["runs"] >= 2
        assert point["us_per_period"] > 0
    assert set(document["cheapest"]) == {"1e-6", "1e-9", "1e-12", "best", "best_in_doubles"}
    leader = document["cheapest"]["1e-9"]
    assert {"method", "tolerance", "us_per_period"} <= leader.keys()
    within = [p for p in document["points"] if p["measures"] == "axis" and p["error"] <= 1e-9]
    assert leader["us_per_period"] == min(p["us_per_period"] for p in within)
    assert document["points"][leader["point"]]["method"] == leader["method"]
    other = leader["against"]
    assert other["rival"] != leader["rival"]
    assert leader["ratio"] == pytest.approx(other["us_per_period"] / leader["us_per_period"])
    best = document["cheapest"]["best"]
    assert best["error"] == min(p["error"] for p in document["points"] if p["measures"] == "axis")
    assert [p["digits"] for p in document["points"] if p["method"] == "auto"] == [6, 9, 12] * 2
    assert document["points"][-1]["steps_a_period"] is None
    strang = next(p for p in document["points"] if p["method"] == "strang")
    assert (strang["tolerance"], strang["steps_a_period"]) == (None, 25)
    assert document["skipped"] == []


# --- time ------------------------------------------------------------------------------------


@dataclass
class Clock:
    """A clock that goes on only when work is done."""

    now: float = 0.0

    def __call__(self):
        return self.now


@dataclass
class Toy:
    """A march whose block takes a second of time, and some of the clock's."""

    clock: Clock
    cost: float
    log: list
    name: str = ""

    def begin(self):
        self.clock.now += 0.25  # not in a block: not counted
        return StepperState((0.0, 0.0), (0.0,))

    def block(self, place):
        self.clock.now += self.cost
        self.log.append(self.name)
        return StepperState(
            (place.time[0] + 1.0, 0.0), (0.0,), (), place.steps + 1, place.evaluations + 3
        )


def test_only_blocks_are_timed_and_a_run_ends_past_its_end():
    clock = Clock()
    done = lap(Toy(clock, 2.0, []), (2.5, 0.0), clock)
    assert done.seconds == 6.0
    assert (done.last.time[0], done.after.time[0]) == (2.0, 3.0)
    assert lap(Toy(clock, 2.0, []), (3.0, 0.0), clock).after.time[0] == 3.0
    assert lap(Toy(clock, 2.0, []), (3.0, 1e-17), clock).after.time[0] == 4.0


def test_what_is_too_slow_is_stopped_between_blocks():
    clock = Clock()
    with pytest.raises(TooSlow) as slow:
        lap(Toy(clock, 2.0, []), (100.0, 0.0), clock, patience=5.0)
    assert slow.value.place.time[0] == 3.0
    assert slow.value.spent == 6.0


def rounds(costs, seconds, most=4):
    """The order in which toys were run, one block each."""
    clock, log = Clock(), []
    toys = [Toy(clock, cost, log, str(i)) for i, cost in enumerate(costs)]
    programs = [lambda toy=toy: lap(toy, (1.0, 0.0), clock).seconds for toy in toys]
    found = in_turn(programs, costs, seconds, clock, most)
    return log, found, clock.now


def test_runs_are_taken_in_turn():
    """Each round runs each method once: no two runs of one method follow each other."""
    log, found, _ = rounds([0.1, 0.1, 0.1], 1000.0)
    assert "".join(log) == "012" * 4
    assert found == [[pytest.approx(0.1)] * 4] * 3


def test_slow_runs_are_rarer_and_spread():
    log, found, _ = rounds([0.1, 30.0], 1000.0)
    assert "".join(log) == "001001"
    assert [len(each) for each in found] == [4, 2]


@pytest.mark.parametrize("budget", [0.5, 3.0, 20.0, 61.0])
def test_the_rounds_end_before_the_deadline(budget):
    draw = random.Random(2)
    for _ in range(20):
        costs = [10.0 ** draw.uniform(-2, 1) for _ in range(8)]
        _, found, end = rounds(costs, budget, most=25)
        assert end <= budget + 0.25
        assert sum(map(sum, found)) <= budget


def test_runs_that_take_longer_than_their_first_end_in_time_too():
    clock, log = Clock(), []
    toys = [Toy(clock, 3.0, log), Toy(clock, 4.0, log)]
    programs = [lambda toy=toy: lap(toy, (1.0, 0.0), clock).seconds for toy in toys]
    in_turn(programs, [0.5, 0.5], 12.0, clock, 25)
    assert 8 < clock.now < 12 + 4
    assert len(log) <= 4


def test_shares_use_the_time_there_is():
    counts = shares([0.01, 0.02, 1.0, 2.0], 10.0, 25)
    assert counts[:2] == [25, 25]
    assert counts[2:] == [2, 2]
    assert shares([0.0, 1.0], 0.5, 25) == [25, 0]
    assert shares([0.1, 0.1, 0.9], 2.0, 10) == [6, 6, 0]
    assert shares([], 1.0, 25) == []


# --- the budget ------------------------------------------------------------------------------


@dataclass
class Toys:
    """Runs whose every block takes as long as the setting of their method says."""

    clock: Clock
    log: list

    def __call__(self, scene, chosen):
        made = run(scene, method("taylor-axis"))
        toy = _ToyRun(made.march, self.clock, chosen.setting, self.log, chosen.text)
        return replace(made, march=toy)


@dataclass
class _ToyRun:
    real: object
    clock: Clock
    cost: float
    log: list
    name: str
    compile_s: float = 0.5

    def begin(self):
        return self.real.begin()

    def output_time(self, t):
        return self.real.output_time(t)

    def states_at(self, place, times):
        return self.real.states_at(place, times)

    def block(self, place):
        self.clock.now += self.cost
        self.log.append(self.name)
        if self.cost > 90:
            raise IntegrationFailed("for a test")
        return self.real.block(place)


def toyed(monkeypatch, settings, budget):
    """Measure strang at settings that are taken for the seconds of a block; one block is a run."""
    clock, log = Clock(), []
    monkeypatch.setattr(starting, "run", Toys(clock, log))
    derived = dict.fromkeys(("axis",), 0.25)
    asked = [Trial(method(f"strang={s!r}")) for s in settings]
    work = _Measuring(KICKED, 2.0, budget, 0.0, derived, clock, None)
    return (*work.of(asked), log, clock.now)


def test_first_runs_then_rounds_within_the_budget(monkeypatch):
    points, skipped, log, spent = toyed(monkeypatch, [1.0, 2.0], 200.0)
    assert (len(points), skipped) == (2, ())
    assert log[:2] == ["strang=2", "strang=1"]  # the middle of two is the second
    assert log[2:4] == ["strang=2", "strang=1"]
    assert spent <= 200.0
    assert points[0].us_per_period * 1e-6 * points[0].periods == pytest.approx(1.0)
    assert [point.runs for point in points] == [2, 2]


def test_setting_up_is_deriving_and_compiling(monkeypatch):
    points, _, _, _ = toyed(monkeypatch, [1.0, 2.0], 200.0)
    assert [point.setup_s for point in points] == [0.75, 0.75]


def test_the_time_is_the_best_of_the_rounds_and_the_warm_up_is_none(monkeypatch):
    times = iter([0.125, 0.5, 0.25, 0.5, 0.5, 0.5, 0.5, 0.5])

    def block(self, place):
        self.clock.now += next(times)
        return self.real.block(place)

    monkeypatch.setattr(_ToyRun, "block", block)
    (point,), _, _, _ = toyed(monkeypatch, [1.0], 3.0)
    assert point.us_per_period * 1e-6 * point.periods == pytest.approx(0.25)
    assert point.periods > 5
    assert point.runs > 2


def test_what_the_budget_does_not_allow_is_named(monkeypatch):
    """A first run that takes most of the budget leaves no time to begin the next."""
    points, skipped, _, spent = toyed(monkeypatch, [1.0, 12.5, 1.5], 20.0)
    assert [point.trial.method.setting for point in points] == [12.5]
    assert [each.trial.method.setting for each in skipped] == [1.0, 1.5]
    assert "no time was left" in skipped[0].reason
    assert points[0].runs == 1
    assert spent <= 20.0


def test_what_is_not_expected_to_end_is_not_begun(monkeypatch):
    """At 10 s of 20 a run like the one before, of 10 s, would end with nothing left for rounds."""
    points, skipped, log, spent = toyed(monkeypatch, [9.0, 10.0], 20.0)
    assert [point.trial.method.setting for point in points] == [10.0]
    assert "no time was left" in skipped[0].reason
    assert "strang=9" not in log
    assert spent <= 20.0


def test_no_first_run_is_begun_when_six_tenths_of_the_budget_are_gone(monkeypatch):
    """After 12.3 s of 20 another like the last, of 3.6 s, would end in time, and is not begun."""
    costs = [1.0, 4.4, 1.1, 4.3, 1.2, 3.6, 1.3]
    points, skipped, log, _ = toyed(monkeypatch, costs, 20.0)
    assert log[:3] == ["strang=4.3", "strang=4.4", "strang=3.6"]
    assert len(points) == 3
    assert all("no time was left" in each.reason for each in skipped)


def test_a_slow_method_is_stopped_and_its_tighter_settings_not_begun(monkeypatch):
    monkeypatch.setattr(_ToyRun, "block", _never_there)
    _, skipped, _, _ = toyed(monkeypatch, [4.0, 5.0, 6.0], 100.0)
    assert [each.trial.method.setting for each in skipped] == [4.0, 5.0, 6.0]
    assert "periods in 8 s" in skipped[0].reason  # looser than what was stopped: it is tried
    assert "stopped after" in skipped[1].reason
    assert skipped[2].reason == "not begun: strang=4 took too long"


def _never_there(self, place):
    self.clock.now += self.cost
    assert self.clock.now < 1000, "it is not stopped"
    return replace(place, time=(place.time[0] + 1e-9, 0.0))


def test_what_cannot_go_on_is_skipped_with_its_reason(monkeypatch):
    points, skipped, _, _ = toyed(monkeypatch, [1.0, 91.0], 1000.0)
    assert len(points) == 1
    assert skipped[0].reason == "for a test"


def test_first_runs_take_the_middle_of_every_ladder_before_any_second_rung():
    tried = [t for name in ("auto", "taylor-axis", "strang", "taylor-cubic-mpfr", "gauss8")
             for t in trials(KICKED, name, 100)]  # fmt: skip
    order = [tried[i] for i in schedule(tried)]
    assert sorted(schedule(tried)) == list(range(len(tried)))
    names = [t.name for t in order]
    assert [t.text for t in order[6:9]] == ["strang=800", "taylor-axis=1e-10", "gauss8=7"]
    assert names[:6] == ["auto"] * 6
    assert names[9:12] == ["strang", "taylor-axis", "gauss8"]
    assert names.index("taylor-cubic-mpfr") == 6 + 3 * LATER + 3
    assert sorted(middles(25)) == list(range(25))


def test_the_rivals_and_ours_alternate_in_every_turn():
    tried = [t for name in DEFAULT for t in trials(KICKED, name, 100)]
    first = [tried[i].method.is_rival for i in schedule(tried)][6:25]
    assert sum(first) == 10  # all of the rivals but Radau's
    assert sum(first[:10]) == 5


def test_that_no_rival_was_run_is_said_and_a_method_is_left_out_in_one_line():
    left = [Skipped(Trial(method(f"strang={n}")), "not begun: no time was left for it in a budget"
                    " of 5 s") for n in (25, 50, 100)]  # fmt: skip
    left += [Skipped(Trial(method("gauss8=4")), "for a test")]
    document = WorkPrecision(KICKED, 5.0, 5.0, (made(1.0, 1e-9),), tuple(left)).document()
    assert document["rivals"] == {"run": [], "left_out": ["strang", "gauss8"]}
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(rendered(document))
    told = console.export_text()
    assert "NO RIVAL WAS RUN" in told
    assert told.count("strang") == told.count("gauss8") == 1
    assert "all settings left out: for a test (at 4 steps a period)" in told


def test_every_row_of_the_table_is_one_line_of_80_columns(found):
    longest = [replace(made(us, off, name="taylor-attitude-longdouble"), us_per_period=us)
               for us, off in ((46_123.4, 1e-12), (1.0, 1e-3))]  # fmt: skip
    document = WorkPrecision(KICKED, 5.0, 5.0, (*found.points, *longest), ()).document()
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(rendered(document))
    rows = [row.split() for row in console.export_text().splitlines()]
    (row,) = [row for row in rows if row[:1] == ["taylor-attitude-longdouble"] and len(row) == 7]
    assert row[1:] == ["46100", "46100", "46100", "1.0e-12", "46100", "0.1"]


def test_what_is_not_measured_is_refused_and_a_diagram_is_shown_in_a_line(found):
    with pytest.raises(ht.HeavyTopError, match="'phi' is not measured; axis and theta are"):
        found.cheapest(1e-9, "phi")
    assert found.cheapest(1e-9, "theta").theta_error <= 1e-9
    assert repr(found) == (
        f"<WorkPrecision of sicm-kicked, 20 periods: {len(found.points)} points, 0 skipped>"
    )


# --- what is asked ---------------------------------------------------------------------------


def test_the_ladder_holds_every_formulation_precision_and_rival():
    from heavytop.comparison import METHODS
    from heavytop.equations.formulation import FORMULATIONS

    wanted = {
        f"taylor-{form}{end}" for form in FORMULATIONS for end in ("", "-longdouble", "-mpfr")
    }
    assert wanted | set(METHODS) | {"auto"} <= set(DEFAULT)
    for name in DEFAULT:
        asked = trials(KICKED, name, 100)
        settings = [trial.method.setting for trial in asked]
        assert len(asked) >= (1 if name.endswith(("longdouble", "mpfr")) else 6)
        if name in STEPS:
            assert settings == sorted(settings)
        elif name != "auto":
            assert settings == sorted(settings, reverse=True)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"methods": ["dop853"]}, "dop853-scipy|dop853-cyrk"),
        ({"methods": ["strang=0"]}, "steps a period from"),
        ({"methods": ["auto=0"]}, "whole digits"),
        ({"methods": ["auto=six"]}, "whole digits"),
        ({"methods": []}, "at least one method"),
        ({"periods": 0.5}, "periods = 0.5: a number from 1 to"),
        ({"periods": float("nan"), "methods": ["auto"]}, "periods = nan"),
        ({"budget": 0}, "budget = 0"),
    ],
)
def test_what_cannot_be_measured_is_refused_by_name(options, said):
    with pytest.raises(ht.BadScene, match=said):
        ht.work_precision(KICKED, **options)


def test_every_fault_is_told_at_once():
    with pytest.raises(ht.BadScene) as bad:
        ht.work_precision(KICKED, methods=["x", "strang=0"], periods=0, budget=0)
    assert len(bad.value.faults) == 4


def test_a_top_without_nutation_is_refused():
    with pytest.raises(ht.BadScene, match="no nutation period"):
        ht.work_precision(ht.load_scene("separatrix"))


def test_a_form_that_cannot_start_there_is_skipped_with_the_reason():
    scene = ht.load_scene("sicm-kicked", ["start.theta=0", "start.thetadot=1"])
    methods = ["taylor-lagrange=1e-9", "taylor-axis=1e-9"]
    found = ht.work_precision(scene, methods=methods, periods=3, budget=60)
    assert [each.trial.name for each in found.skipped] == ["taylor-lagrange"]
    assert "cannot start at a pole" in found.skipped[0].reason
    assert found.points[0].error < 1e-7


def test_a_rival_whose_package_is_missing_is_skipped_by_name(monkeypatch):
    from heavytop.studies.drifts import methods

    monkeypatch.setattr(methods, "find_spec", lambda name: None if name == "numba" else name)
    found = ht.work_precision(
        KICKED, methods=["strang=25", "taylor-axis=1e-6"], periods=3, budget=9
    )
    assert "pip install 'heavytop[rivals]'" in found.skipped[0].reason
    assert [point.trial.name for point in found.points] == ["taylor-axis"]


def test_a_package_that_does_not_import_is_skipped_with_what_it_raises(monkeypatch):
    def raising(name):
        if name == "CyRK":
            raise RuntimeError("built for another numpy")
        return import_module(name)

    monkeypatch.setattr("heavytop.comparison.methods.import_module", raising)
    methods = ["dop853-cyrk", "taylor-axis=1e-6"]
    found = ht.work_precision(KICKED, methods=methods, periods=3, budget=9)
    (reason,) = {each.reason for each in found.skipped}
    assert reason == (
        "dop853-cyrk needs CyRK, which does not import: RuntimeError: built for another numpy"
    )
    assert [point.trial.name for point in found.points] == ["taylor-axis"]


def test_theta_alone_has_a_front_too():
    found = ht.work_precision(KICKED, methods=["taylor-cubic"], periods=3, budget=60)
    assert found.front == found.front_theta != ()
    assert found.document()["cheapest"]["1e-9"]["method"] == "taylor-cubic"
