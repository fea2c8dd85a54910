"""A diagram shows what it says: errors are true, runs are in turn, and none beats the front."""

import math
import random
from dataclasses import dataclass
from statistics import median
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest

import heavytop as ht
from heavytop.comparison import METHODS, user
from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.equations.formulation import FORMULATIONS
from heavytop.exact.decimals import bits_of
from heavytop.results.table import Row
from heavytop.results.work_precision import front
from heavytop.studies import steppers
from heavytop.studies import work_precision as timing
from heavytop.studies.drift import perturbed_start
from heavytop.studies.methods import method
from heavytop.studies.steppers import set_up
from heavytop.studies.work_precision import first_run, settings, watch_times

from ..integrators import rk4
from ..results.made import POINT

KICKED = ht.load_scene("sicm-kicked")


# --- errors ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("text", "number"), [("taylor-axis=1e-06", 0), ("strang=25", 5)])
def test_an_error_is_the_distance_from_the_closed_form(text, number):
    """Stepped here by the method's own stepper, and held against the closed form in doubles."""
    scene = ht.Scene(KICKED.top, perturbed_start(KICKED.start, 0, number), periods=1)
    made = set_up(scene, method(text))
    end = made.stepper.output_time(watch_times(20)[-1] * made.period)
    place = made.stepper.begin()
    while (after := made.stepper.block(place)).time < end:
        place = after
    row = made.stepper.states_at(place, [end])[0]
    exact = ht.Motion(scene.top, scene.start).at(np.array([end[0]]))
    axis = row[:3] / np.linalg.norm(row[:3])
    found, off = first_run(set_up(scene, method(text)), 20, 60), made.reference(end, row.tolist())
    assert found["energy_error"] == abs(off.energy) > 0
    assert found["axis_error"] == pytest.approx(np.linalg.norm(axis - exact.axis[0]), rel=1e-3)
    assert found["theta_error"] == pytest.approx(abs(math.acos(axis[2]) - exact.theta[0]), rel=1e-3)
    phase = abs(off.phase_s)
    assert found["phase_error"] == (phase if 0 < phase < made.period / 20 else None)
    last = after.time[0] / made.period, after.steps, after.evaluations
    assert last == (found["periods"], found["steps"], found["evaluations"])


# --- auto ------------------------------------------------------------------------------------


PLANNED = [("auto", 12, 1e5), ("auto=6", 6, 1e4), ("auto=30", 30, 100)]


@pytest.mark.parametrize(("text", "digits", "periods"), PLANNED)
def test_auto_is_the_plan_in_form_bits_tolerance_and_projection(text, digits, periods):
    (found,) = settings(text, KICKED, periods)
    wants = {"periods": periods, "quantities": ("axis",), "events": (), "samples": 2}
    plan = ht.plan(ht.Scene(KICKED.top, KICKED.start, digits=digits, **wants))
    wanted = (text, plan.formulation, plan.projected, bits_of(plan.precision), plan.tolerance)
    assert (found.name, found.formulation, found.projected, found.bits, found.setting) == wanted


# --- the front -------------------------------------------------------------------------------


def made(us, axis, theta=None, name="taylor-axis"):
    theta = axis if theta is None else theta
    numbers = {"method": name, "us_per_period": us, "theta_error": theta}
    return Row(POINT, measures="theta" if axis is None else "axis", error=axis or theta, **numbers)


def test_nothing_beats_a_point_of_the_front_and_something_beats_every_other():
    draw = random.Random(3)
    for _ in range(50):
        works = [draw.choice((1, 2, 3, 5, 8)) for _ in range(12)]
        points = [made(us, 10.0 ** -draw.randint(1, 6)) for us in works]
        known = [(point.us_per_period, point.error) for point in points]
        beaten = {b for b in known for a in known if a != b and a[0] <= b[0] and a[1] <= b[1]}
        assert [known[i] for i in front(points, "axis_error")] == sorted({*known} - beaten)


# --- time ------------------------------------------------------------------------------------


@dataclass
class Toy:
    """A run whose blocks go a second of time, take some of the clock's, and are off by 1e-3."""

    cost: float
    name: str = ""
    compile_s: float = 0.5
    period: float = 1.0
    warned: tuple = ()

    stepper = reference = property(lambda self: self)

    def begin(self):
        Toy.now += 0.25  # not in a block: not counted
        return StepperState((0.0, 0.0), (0.0,))

    def block(self, place):
        Toy.now += self.cost
        Toy.log.append(self.name)
        assert Toy.now < 2000, "it is not stopped"
        if self.cost > 90:
            raise IntegrationFailed("for a test")
        time = (place.time[0] + 1.0, 0.0)
        return StepperState(time, (0.0,), (), place.steps + 1, place.evaluations + 3)

    def output_time(self, t):
        return (t, 0.0)

    def states_at(self, place, times):
        return np.zeros((1, 1))

    def __call__(self, t, row):
        return SimpleNamespace(axis=1e-3, theta=0.0, energy=0.0, phase_s=0.0)


@pytest.fixture
def toys(monkeypatch):
    """Runs of toys: a block takes as long as the setting of the method says."""
    Toy.now, Toy.log = 0.0, []
    for module in (timing, steppers):
        monkeypatch.setattr(module, "clock", lambda: Toy.now)
    monkeypatch.setattr(timing, "set_up", lambda scene, each: Toy(each.setting, each.label))
    return Toy


def measured(costs, periods=2.0, budget=10_000):
    """A diagram of strang at settings that are taken for the seconds of a block."""
    methods = [f"strang={cost!r}" for cost in costs]
    return ht.work_precision(KICKED, methods=methods, periods=periods, budget=budget)


def test_settings_are_run_in_turn_from_every_start_in_every_round(toys):
    """So that what disturbs the machine disturbs all settings alike."""
    found = measured([1.0, 2.0], periods=1.3)
    assert toys.log == ["strang=1", "strang=2"] * 16  # both are slow: two rounds
    assert [(point.runs, point.starts) for point in found.points] == [(2, 8), (2, 8)]
    assert [point.us_per_period for point in found.points] == [1e6, 2e6]
    assert [point.setup_s for point in found.points] == [0.5, 0.5]  # compiling


def test_the_time_is_the_best_of_the_runs_and_the_median_of_the_starts(toys, monkeypatch):
    times = iter([*range(9, 17), 16, 15, 14, 13, 12, 11, 10, 5])

    def block(self, place):
        Toy.now += next(times)
        return StepperState((1.0, 0.0), (0.0,), (), 1, 3)

    monkeypatch.setattr(Toy, "block", block)
    (point,) = measured([1.0], periods=1.3, budget=40_000).points
    assert point.us_per_period == median([9, 10, 11, 12, 12, 11, 10, 5]) * 1e6
    assert point.us_spread == pytest.approx((11.25 - 9.75) * 1e6)


# --- the budget ------------------------------------------------------------------------------


def test_nothing_is_begun_after_the_budget(toys):
    """Runs take 10 s each from 8 starts; the second round ends with the budget."""
    assert measured([10.0], periods=1.3, budget=140.0).points[0].runs == 1
    assert 130 < toys.now < 140 + 10 + 0.5
    assert 8 < len(toys.log) < 16


def test_a_slow_method_is_stopped_and_its_tighter_settings_not_begun(toys):
    found = measured([1.0, 4.0, 5.0, 6.0], periods=5.0, budget=2400.0)
    assert [point.steps_a_period for point in found.points] == [1.0]
    stopped, *others = (each.reason for each in found.skipped)
    assert stopped == "stopped at t = 3 s after 12 s: more than 10 s for a run"
    assert others == ["not started: strang=4 took too long"] * 2


# --- what is asked ---------------------------------------------------------------------------


def test_the_ladder_holds_every_formulation_precision_and_rival():
    wanted = {f"taylor-{form}{end}" for form in FORMULATIONS for end in ("", "-mpfr")}
    assert wanted | set(METHODS) | {"auto"} <= set(timing.WORK_METHODS)
    one = ("mpfr", "compensated")
    for name in set(timing.WORK_METHODS) - {"auto"}:
        known = method(name)
        assert len(known.grid) == 1 if name.endswith(one) else len(known.grid) >= 6
        assert list(known.grid) == sorted(known.grid, reverse=not known.fixed)
        assert all(known.least <= setting <= known.most for setting in known.grid)


GRIDS = [(200, "", [200]), (200, "=50", [50]), (None, "", [12.5 * 2**k for k in range(8)])]


@pytest.mark.parametrize(("setting", "typed", "tried"), GRIDS)
def test_a_method_of_ones_own_has_the_setting_that_it_has_or_a_grid(setting, typed, tried):
    name = user.register(user.Method(rk4, setting=setting))
    assert [each.setting for each in settings(name + typed, KICKED, 20)] == tried


def test_a_package_that_does_not_import_is_skipped_with_what_it_raises(monkeypatch):
    raised = RuntimeError("built for another numpy")
    monkeypatch.setattr("heavytop.comparison.methods.import_module", Mock(side_effect=raised))
    found = ht.work_precision(KICKED, methods=["dop853-cyrk", "taylor-axis=1e-6"], periods=3)
    [reason] = {each.reason for each in found.skipped}
    assert reason == f"dop853-cyrk: CyRK does not import: RuntimeError: {raised}"
    assert [point.method for point in found.points] == ["taylor-axis"]
