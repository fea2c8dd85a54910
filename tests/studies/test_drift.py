"""A drift measures how errors grow; its members are its runs; `drift` and `resume` on their own.

The reference solution of every run is exact; the Taylor steppers are the package's own runs.
"""

import json
import math
from dataclasses import asdict

import numpy as np
import pytest

import heavytop as ht
from heavytop.comparison import IntegrationFailed
from heavytop.comparison.steppers import StepperState
from heavytop.results.drift import growth, order_of
from heavytop.studies import drift
from heavytop.studies.drift import DEFAULT, advance, drift_parameters, tasks
from heavytop.studies.methods import method, taylor_methods
from heavytop.studies.steppers import TaylorStepper, set_up

from ..comparison.kicked import at

KICKED = ht.load_scene("sicm-kicked")
METHODS = ("taylor-axis", "taylor-cubic", "strang")


def parameters(methods=DEFAULT, periods=10_000, samples=25):
    """The parameters of a study."""
    options = {"periods": periods, "ensemble": 1, "samples": samples, "seed": 0}
    return drift_parameters(KICKED, methods, **options, jobs=1)[0]


# --- what is asked ---------------------------------------------------------------------------


def test_a_power_law_is_found_with_its_error():
    n = np.geomspace(1e3, 1e6, 13)
    draw = np.random.default_rng(0)
    slopes = [growth(n, 1e-16 * n**1.5 * np.exp(0.3 * draw.normal(size=13))) for _ in range(400)]
    exponents = np.array([g.exponent for g in slopes])
    assert abs(exponents.mean() - 1.5) < 0.01
    off = (exponents - 1.5) / [g.stderr for g in slopes]
    assert 0.9 < np.std(off) < 1.3  # the stated error is the error that is made


def test_only_a_power_law_has_an_exponent():
    n = np.geomspace(1e3, 1e6, 13)
    draw = np.random.default_rng(1)
    noise = 1e-9 * np.exp(0.1 * draw.normal(size=13))
    steady = 1e-16 * n * (1 + 0.01 * draw.normal(size=13))
    turning = np.cos(np.arange(13.0)) ** 5 * n
    assert growth(n, noise, noise).word == "bounded"
    assert growth(n, steady, steady).exponent == pytest.approx(1, abs=0.02)
    assert growth(n, abs(turning), turning).word == "changes sign"
    assert growth(n, abs(turning), abs(turning)) == (None, None, 13, "")


def test_an_order_is_told_only_where_errors_fall():
    steps = np.array([25.0, 50, 100, 200, 400])
    assert order_of(dict.fromkeys(steps, 1e-3)) is None
    assert order_of(dict(zip(steps, [1e-3, 1e-8, 1e-4, 1e-9, 1e-5], strict=True))) is None
    assert order_of({25.0: 1e-3, 50.0: 1e-13, 100.0: None}) is None  # one is clear of rounding


def test_a_phase_that_is_lost_is_no_number_and_does_not_come_back():
    found = ht.drift(KICKED, methods=["strang"], periods=20_000, samples=25)["strang"]
    known = [x for x in found.phase_s if x is not None]
    assert max(known) < 0.05 * ht.Motion(KICKED.top, KICKED.start).period
    assert found.phase_s == (*known, *[None] * (len(found.phase_s) - len(known)))
    assert 10 < len(known) < len([x for x in found.axis if x is not None])
    assert ht.drift(KICKED, methods=["strang"], samples=2)["strang"].phase_s[1] is None  # but 2.54
    assert abs(found.phase_exponent - 1) < 0.2  # as a method of its kind loses it


def test_a_setting_is_used_and_keeps_all_its_digits():
    texts = ["strang=1234.5671", "strang=1234.5673", "taylor-axis=0.00123456789", "strang=200"]
    assert [method(text).text for text in texts] == texts
    study = parameters(["strang", "strang=100.0000001"], 3, samples=2)
    assert [method(text).setting for text in study["methods"]] == [100.0, 100.0000001]
    found = ht.drift(KICKED, methods=["taylor-axis", "taylor-axis=1e-6"], periods=100, samples=3)
    tight, loose = found.methods
    assert loose.axis[-1] > 1e6 * tight.axis[-1]
    assert loose.name == "taylor-axis=1e-06"


def test_auto_is_the_least_form_for_so_long_a_run():
    planned = parameters(methods=["auto", "auto=6", "auto=20"], periods=1e5)["methods"]
    assert planned == ["taylor-axis-projected", "taylor-axis", "taylor-axis-mpfr"]


def test_a_slow_method_goes_no_farther_than_ten_thousand_periods(monkeypatch):
    whole, spans = drift.sample_times, []
    monkeypatch.setattr(drift, "sample_times", lambda *of: spans.append(of[0]) or whole(*of))
    study = parameters(methods=["dop853-scipy", "taylor-axis"], periods=1e6, samples=9)
    for task in tasks(study):
        next(advance(study, task, None))
    assert spans == [1e4, 1e6]


# --- members ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def three():
    return ht.drift(KICKED, methods=METHODS, periods=60, samples=6, ensemble=3)


def columns(each):
    """Every list of errors of a document, by its name."""
    found = {name: each[name] for name in ("energy", "p_phi", "p_psi", "phase_s", "axis")}
    return {**found, **each["invariants"]}


def test_what_stands_for_all_starts_follows_from_the_members(three):
    for method_ in three.document()["methods"]:
        members = method_["members"]
        assert len(members) == 3
        assert np.mean([each["steps"] for each in members]) == method_["steps"]
        for key, values in columns(method_).items():
            alone = [columns(each)[key] for each in members]
            if values[0] is None:
                assert {x for each in alone for x in each} == {None}
                continue
            again = [math.sqrt(np.mean(np.array(x) ** 2)) for x in zip(*alone, strict=True)]
            assert values == pytest.approx(again, rel=1e-13, abs=1e-30)
            assert len({tuple(each) for each in alone}) == 3


def test_the_initial_conditions_of_a_member_are_those_it_was_run_from(three):
    """A study of that start alone gives its errors, bit for bit."""
    starts = three.document()["starts"]
    for name in ("theta", "phidot", "psidot"):
        assert starts[0][name] == float(getattr(KICKED.start, name))
    for each in starts:
        spin = each["psidot"] + each["phidot"] * math.cos(each["theta"])
        assert each["omega3"] == starts[0]["omega3"] == pytest.approx(spin, rel=1e-15)
        for name in ("theta", "phidot"):
            assert 0 < abs(each[name] / starts[0][name] - 1) <= 0.01 or each is starts[0]
    given = {name: x for name, x in starts[2].items() if name != "psidot"}
    scene = ht.Scene(KICKED.top, ht.State(**given), periods=1)
    alone = ht.drift(scene, methods=METHODS, periods=60, samples=6)
    for name in METHODS:
        assert alone[name].members[0] == three[name].members[2]


@pytest.mark.parametrize("first", [0, 100])
def test_a_member_that_ends_early_keeps_what_it_has_and_the_others_keep_all(monkeypatch, first):
    order, whole = {}, TaylorStepper.block

    def block(self, place):
        number = order.setdefault(self.start, len(order))
        if place.steps >= (math.inf, first, 2000)[number]:
            raise IntegrationFailed("for a test")
        return whole(self, place)

    monkeypatch.setattr(TaylorStepper, "block", block)
    study = ht.drift(KICKED, methods=["taylor-axis"], periods=400, samples=9, ensemble=3)
    found = study["taylor-axis"]
    assert found.ended == {"1": "for a test", "2": "for a test"}
    every, short, long = (len(each.periods) for each in found.members)
    assert short < long < every == 9
    assert (short == 0) == (first == 0)
    assert len(found.periods) == len(found.energy) == short
    data = study.to_xarray().sel(scheme="taylor-axis")
    assert np.isfinite(data["member_energy"]).sum("periods").values.tolist() == [every, short, long]


# --- the reference solution ------------------------------------------------------------------


def own(name, scene=KICKED):
    return set_up(scene, method(name))


def exact_row(reference, t):
    """The states e, l of the axis form at a time, from the closed form at 60 digits."""
    ctx = reference.ctx
    at, r = reference.exact.at(ctx.mpf(t), 60), reference.exact.reduced
    s, c, sine, u = ctx.sin(at.phi), ctx.cos(at.phi), ctx.sin(at.theta), ctx.cos(at.theta)
    # l = e x e' + n e, e' = thetadot e_theta + phidot sin(theta) e_phi
    e_theta, e_phi = (u * s, -u * c, -sine), (c, s, 0)  # e x e_theta = e_phi
    parts = zip(e_phi, e_theta, at.axis, strict=True)
    momentum = [at.thetadot * p - at.phidot * sine * q + r.b * e for p, q, e in parts]
    return [*at.axis, *momentum[:2]]


@pytest.fixture(scope="module")
def axis():
    """The reference of a start whose axis has length 1 exactly: nothing is rounded in it."""
    start = ht.State("pi/2", phidot="0.25", psidot=2)
    return own("taylor-axis", ht.Scene(ht.Top(A=1, C="0.5", gMR=1), start, periods=1)).reference


@pytest.mark.parametrize("ahead", [0.0, 1e-9, -3e-12])
def test_a_shift_in_time_is_a_phase_error(axis, ahead):
    t = 3.7
    off = axis((t, 0.0), exact_row(axis, axis.ctx.mpf(t) + axis.ctx.mpf(ahead)))
    assert off.phase_s == pytest.approx(ahead, rel=1e-6, abs=1e-28)
    assert abs(off.energy) < 1e-28
    assert all(abs(x) < 1e-28 for x in off.invariants.values())
    back, on = (np.array(axis.exact.at(t + s, 60).axis, float) for s in (-1e-6, 1e-6))
    speed = np.linalg.norm(on - back) / 2e-6
    assert off.axis == pytest.approx(abs(ahead) * speed, rel=1e-6, abs=1e-28)


def test_energy_and_momentum_are_told_apart(axis):
    """A longer axis has another length, another p_psi and another height."""
    ctx, t = axis.ctx, 1.3
    row = exact_row(axis, t)
    longer = [*(x * (1 + ctx.mpf("1e-10")) for x in row[:3]), *row[3:]]
    off = axis((t, 0.0), longer)
    assert off.invariants["length"] == pytest.approx(2e-10, rel=1e-6)
    r, l_z = axis.exact.reduced, ctx.mpf(axis.parameters["l_z"])
    momentum = sum(x * y for x, y in zip(row[:3], [*row[3:], l_z], strict=True)) / 10**10
    assert off.invariants["p_psi"] * float(abs(r.b)) == pytest.approx(float(momentum), rel=1e-6)
    scale = max(abs(float(r.h)), abs(float(r.g)))
    assert off.energy * scale == pytest.approx(float(r.g * row[2]) * 1e-10, rel=1e-6)


def test_errors_of_momenta_do_not_depend_on_the_unit_of_time():
    start = ht.State("pi/2", phidot="0.25e-13", psidot="2e-13")
    slow = ht.Scene(ht.Top(A=1, C="0.5", gMR="1e-26"), start, periods=1)
    slow = own("taylor-axis", slow).reference
    row = exact_row(slow, 0)
    off = slow((0.0, 0.0), [*(x * (1 + slow.ctx.mpf("1e-10")) for x in row[:3]), *row[3:]])
    assert off.invariants["p_psi"] == pytest.approx(1e-10, rel=1e-6)


@pytest.mark.parametrize("name", [n for n in taylor_methods() if "-" not in n[7:]])
def test_every_form_starts_on_its_own_closed_form(name):
    found = own(name)
    off = found.reference((0.0, 0.0), found.stepper.begin().state)
    assert abs(off.phase_s) < 1e-30
    assert off.energy == 0
    assert off.axis is None or off.axis < 1e-30


def test_the_tilt_of_a_state_beside_a_pole_is_a_number():
    """A cosine that rounding put above 1 is that of 0."""
    found = own("taylor-cubic")
    row = list(found.stepper.begin().state)
    assert found.reference((0.0, 0.0), row).theta == pytest.approx(0.0, abs=1e-15)
    assert found.reference((0.0, 0.0), [-1e-20, *row[1:]]).theta == pytest.approx(-0.1)
    longer = [row[0] * (1 + 1e-6), *row[1:]]  # 1 - u: theta grows with it
    assert found.reference((0.0, 0.0), longer).theta == pytest.approx(0.05e-6, rel=1e-2)


# --- the runs --------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
@pytest.mark.parametrize("name", ["taylor-axis", "taylor-cubic", "taylor-axis-projected"])
def test_a_stepper_takes_the_steps_of_the_trajectory_that_propagate_integrates(name):
    """Bit for bit, through several blocks."""
    found = own(name)
    chosen, t = method(name), 700.618 * found.period
    scene = ht.Scene(KICKED.top, KICKED.start, time=t, quantities=("theta",), events=())
    trajectory = ht.propagate(scene, formulation=chosen.formulation, projected=chosen.projected)
    assert at(found.stepper, t)[0].tolist() == trajectory(t).states.tolist()


def test_more_bits_are_written_down_without_loss():
    """A stepper that goes on from stored texts is the one that was never interrupted."""
    stepper = own("taylor-axis-mpfr").stepper
    one = stepper.block(stepper.begin())
    assert stepper.block(StepperState(**json.loads(json.dumps(asdict(one))))) == stepper.block(one)
    digits = int(128 * math.log10(2))
    assert all(len(x) > digits for x in (*one.state, one.carry[0]))
