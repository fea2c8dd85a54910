"""Auto: the least that does, on a small slice of what validation/17_auto.py runs in full."""

import json
import math
import random
import re
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.errors import BadScene
from heavytop.numbers import PI, sqrt
from heavytop.numbers.decimals import context
from heavytop.run.estimates import Forecast
from heavytop.run.planning import EPSILON
from heavytop.run.verify import missed_digits, run_errors

WANTS = (("theta",), ("theta", "phi"), ("axis",), ("phi", "psi"), ("attitude",))


def drawn(seed):
    """A scene at random; every third one passes close to a pole."""
    draw = random.Random(seed)
    A = draw.choice((1.0, 3.28e-4))
    C, gMR = A * draw.uniform(0.1, 1.9), A * draw.uniform(0.5, 200) * draw.choice((1, 1, -1))
    rate, sleeps = abs(gMR / A) ** 0.5, 2 * (A * abs(gMR)) ** 0.5 / C
    near = seed % 3 == 0
    start = ht.State(
        10 ** draw.uniform(-6, -1) if near else draw.uniform(0.05, 3.0),
        phidot=0.0 if near else draw.uniform(-2, 2) * rate,
        omega3=sleeps * draw.uniform(-3, 3),
    )
    return ht.Scene(
        ht.Top(A, C, gMR), start, periods=round(10 ** draw.uniform(0, 2.5), 3),
        quantities=WANTS[seed % len(WANTS)], events=(), samples=33, digits=draw.randint(5, 12),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(15))
def test_auto_meets_the_digits_asked(seed):
    run = ht.propagate(drawn(seed))
    assert missed_digits(run, run_errors(run)) == {}
    assert run.plan.estimate.error > 0
    assert run.plan.reasons


def round_periods(count, *changes):
    overrides = [f"span.periods={count}", *changes]
    return ht.load_scene("sicm-kicked", overrides)


@pytest.mark.parametrize("quantities", [("theta",), ("axis",), ("theta", "phi", "psi")])
@pytest.mark.parametrize("projected", [False, True])
def test_more_periods_lose_more_also_where_their_number_is_round(quantities, projected):
    """At every end, and 65 evenly spread times before it, theta would stand still."""
    scenes = (replace(round_periods(f"1e{n}"), quantities=quantities) for n in range(3, 16))
    errors = [ht.plan(s, "axis", projected=projected).estimate.error for s in scenes]
    assert all(2 < later / sooner < 40 for sooner, later in pairwise(errors))
    assert 1e-13 < errors[0] < 1e-10


@pytest.mark.parametrize("angle", ["phi", "psi"])
def test_what_turns_is_held_against_how_far_it_has_turned(angle):
    """By the mean rate, which the closed form at the end confirms."""
    scene = round_periods("1e6")
    motion = ht.Motion(scene.top, scene.start)
    end = 1e6 * motion.period
    rates = getattr(motion.double(np.linspace(0, motion.period, 1000)), f"{angle}dot")
    turned = abs(getattr(motion.double([end]), angle)[0])
    expected = Forecast(replace(scene, quantities=(angle,)), motion, end)
    assert expected.quickest == pytest.approx(abs(rates).max() / turned, rel=0.02)


@pytest.mark.parametrize("seed", range(1, 30))
def test_rates_by_the_height_are_those_by_the_time(seed):
    """By energy and momenta at a height, against the closed form in doubles at a thousand times."""
    scene = drawn(seed)
    motion = ht.Motion(scene.top, scene.start)
    end = 100.37 * motion.period
    seen = motion.double(np.linspace(0, motion.period, 1001))
    turned = motion.double([end])
    across = np.hypot(seen.thetadot, seen.phidot * np.sin(seen.theta))
    rates = {"theta": seen.thetadot, "axis": across, "phi": seen.phidot, "psi": seen.psidot}
    for name, rate in rates.items():
        if name in ("phi", "psi") and min(motion.from_top, motion.from_bottom) < 0.05:
            continue  # a close pass is over before anybody looks
        far = max(1, abs(getattr(turned, name)[0])) if name in ("phi", "psi") else 1
        found = Forecast(replace(scene, quantities=(name,)), motion, end).quickest
        assert found == pytest.approx(abs(rate).max() / far, rel=0.02)


@pytest.mark.parametrize("count", ["1e3", "1e4"])
@pytest.mark.parametrize("quantities", [("axis",), ("theta", "phi", "psi")])
def test_auto_meets_its_digits_after_a_round_number_of_periods(count, quantities):
    scene = replace(round_periods(count, "want.events=[]"), quantities=quantities)
    run = ht.propagate(scene)
    assert run.plan.precision != "double" or run.plan.projected
    assert missed_digits(run, run_errors(run)) == {}


@pytest.mark.parametrize("count", range(3))
def test_round_numbers_of_periods_of_any_top(count):
    """From rest to rest, with every sample at rest."""
    scene = drawn(5 * count + 2)
    many = 10 ** (count + 1)
    assert scene.start.thetadot.sign() == 0
    scene = replace(scene, periods=ht.Exact.of(many), samples=many // 5 + 1)
    run = ht.propagate(replace(scene, digits=12))
    assert missed_digits(run, run_errors(run)) == {}


def test_events_beyond_doubles_are_counted_in_what_a_run_takes():
    """40 001 of them cost seconds to polish; projected doubles give the digits without."""
    scene = round_periods("1e4")
    chosen = ht.plan(scene)
    assert chosen.projected
    assert chosen.estimate.error < 1e-12
    assert not chosen.warnings
    watched, alone = (
        ht.plan(replace(scene, digits=14, events=events), "axis").estimate.seconds
        for events in (scene.events, ())
    )
    assert watched - alone > 20


def test_what_a_run_took_includes_its_events():
    scene, heard = round_periods(30, "want.digits=14"), []
    ht.propagate(scene)  # which imports, derives and compiles
    began = time.perf_counter()
    run = ht.propagate(scene, progress=heard.append)
    whole = time.perf_counter() - began
    spent = run.statistics
    assert run.plan.precision != "double"
    assert len(run.events) == 121
    assert spent.integrate_s > 0.7 * (whole - spent.compile_s - spent.derive_s)
    assert heard == sorted(heard)
    assert 0.5 <= heard[-1] <= 1


def want(*quantities, **changes):
    scene = replace(ht.load_scene("sicm-kicked"), quantities=quantities)
    return ht.plan(replace(scene, **changes))


def test_no_more_model_than_is_wanted():
    """Nothing for the class, two states for theta, five for the axis, the turns only for phi."""
    assert want("class", "period").formulation == "none"
    assert (want("theta").formulation, want("theta").states) == ("cubic", 2)
    assert (want("axis").formulation, want("axis").states) == ("axis", 5)
    assert want("axis").variant is None
    assert want("theta", "phi").variant == "phi"
    assert want("psi").states == 6


def test_beside_a_pole():
    """The benchmark passes 7e-7 rad from theta = pi: theta has no digits left in the cubic form."""
    scene = ht.load_scene("lie-group-benchmark")
    assert ht.plan(replace(scene, quantities=("theta",))).formulation == "axis"
    assert ht.plan(replace(scene, quantities=("psi",))).formulation == "attitude"


def test_long_spans_are_projected_and_digits_beyond_doubles_are_not_doubles():
    assert not want("theta", time=ht.Exact.of(20)).projected
    long = want("theta", time=ht.Exact.of(5000), digits=11)
    assert long.projected
    assert long.precision == "double"
    fine = want("phi", digits=40)
    assert not fine.projected
    assert int(fine.precision.split()[0]) > 40 / math.log10(2)
    assert fine.tolerance < EPSILON


def test_by_name_nothing_is_added():
    scene = replace(ht.load_scene("sicm-kicked"), time=ht.Exact.of(20_000))
    plan = ht.plan(scene, "axis")
    assert not plan.projected
    assert plan.reasons[0] == "axis: asked for by name"
    assert plan.estimate.error > 1e-12


def test_nothing_to_integrate():
    scene = replace(ht.load_scene("sicm-kicked"), quantities=("period",))
    with pytest.raises(BadScene, match=r"heavytop\.Motion"):
        ht.propagate(scene)


def test_a_very_long_span_is_folded():
    """1e9 s and a tenth, which no double is: one nutation answers, in Python by `fold`."""
    changes = ["span.time=1000000000.1", "want.events=[]", 'want.quantities=["theta", "phi"]']
    scene = ht.load_scene("sicm-kicked", changes)
    assert ht.plan(scene).folded
    with pytest.raises(BadScene, match="fold"):
        ht.propagate(scene)
    found = document("run", "sicm-kicked", *(x for c in changes for x in ("--set", c)))
    assert found["plan"]["folded"]
    assert found["final"]["phi_turns"] == 1165068846
    assert found["missed_digits"] == {}
    assert max(found["errors"][name] for name in ("theta", "phi", "psi", "axis")) < 1e-13
    assert not ht.plan(ht.load_scene("separatrix", changes)).folded


@pytest.mark.parametrize("count", ["1e12", "1e15"])
def test_no_span_is_too_long_to_be_folded(count):
    """Twenty digits at the end, as decimal texts, and held to as many."""
    options = [f"span.periods={count}", "want.events=[]", "want.digits=20"]
    found = document("run", "sicm-kicked", *(x for c in options for x in ("--set", c)))
    assert found["plan"]["folded"]
    assert found["plan"]["precision"] == ("128 bits" if count == "1e12" else "192 bits")
    assert 0 < found["plan"]["tolerance"] < 1e-30
    assert found["missed_digits"] == {}
    final, ctx = found["final"], context(60)
    truth = ht.Motion(*(getattr(ht.load_scene("sicm-kicked"), n) for n in ("top", "start")))
    form = truth.form(60)
    end = form(ctx.mpf(count) * form.period)
    for name in ("phi", "psi"):
        turns, rest = final[f"{name}_turns"], ctx.mpf(final[f"{name}_mod"])
        assert abs(turns * 2 * ctx.pi + rest - getattr(end, name)) < 1e-20
        assert abs(ctx.mpf(final[name]) - getattr(end, name)) < 1e-20
    assert abs(ctx.mpf(final["theta"]) - end.theta) < 1e-20
    assert isinstance(final["axis"][0], str)


def test_turns_and_what_is_beyond_them_are_printed():
    options = ["--set", "span.periods=1e12", "--set", "want.events=[]", "--digits", "20"]
    result = CliRunner().invoke(app, ["run", "sicm-kicked", *options])
    assert result.exit_code == 0, result.output
    assert "632510655081 turns and 4.5258345274635249608 rad" in result.output
    told = CliRunner().invoke(app, ["plan", "sicm-kicked", *options])
    assert "128 bits, 6 states, tolerance 5.88e-39" in told.output


def test_a_folded_document_in_doubles_is_of_numbers():
    found = document("run", "sicm-kicked", "--set", "span.periods=1e9", "--set", "want.events=[]")
    assert isinstance(found["final"]["phi_mod"], float)
    assert found["missed_digits"] == {}


def test_long_runs_are_told_of():
    """With events nothing is folded: how long it takes is said, and what would be quicker."""
    scene = round_periods("1e9")
    (told,) = (x for x in ht.plan(scene).warnings if x.startswith("long"))
    assert re.fullmatch(
        r"long: about [\d.]+ h in all; without events \(want\.events = \[\]\) it would be folded "
        "and take a second",
        told,
    )
    by_name = ht.plan(replace(scene, events=()), "axis").warnings[-1]
    assert "by auto it would be folded" in by_name
    far = ht.load_scene("separatrix", ["span.time=1e7"])
    assert re.fullmatch(r"long: about [\d.]+ min in all", ht.plan(far).warnings[-1])
    assert not any("long" in x for x in ht.plan(round_periods("1e4")).warnings)
    shown = CliRunner().invoke(app, ["plan", "sicm-kicked", "--set", "span.periods=1e9"])
    assert re.search(r"expected +[\d.]+ h", shown.output)


def test_run_tells_of_a_long_run_before_it_takes_it(monkeypatch):
    monkeypatch.setattr("heavytop.run.planning.LONG_S", 1e-9)
    result = CliRunner().invoke(app, ["run", "sicm-kicked"])
    assert "warning: long: about" in result.stderr
    assert "want.events = []" in result.stderr


@pytest.mark.parametrize("events", ["[]", '["turning"]'])
@pytest.mark.parametrize("scene", ["sicm-kicked", "separatrix", "steady-betsch"])
def test_turns_that_cannot_be_counted_are_refused(scene, events):
    overrides = ["span.time=1e300", f"want.events={events}"]
    with pytest.raises(BadScene, match=r"span\.time = 1e300: at most .* turns are not counted"):
        ht.plan(ht.load_scene(scene, overrides))
    with pytest.raises(BadScene, match="turns are not counted"):
        ht.plan(ht.load_scene("sicm-kicked", ["span.periods=1e300"]))


def test_far_along_a_separatrix():
    """A plan that says what is lost; and a refusal of digits that nothing can keep."""
    scene = ht.load_scene("separatrix", ["span.time=1e7"])
    plan = ht.plan(scene)
    assert math.isfinite(plan.estimate.error)
    assert any("every digit will be lost" in x for x in plan.warnings)
    assert (
        "no digit right"
        in CliRunner().invoke(app, ["plan", "separatrix", "--set", "span.time=1e7"]).output
    )
    with pytest.raises(BadScene, match=r"want\.digits = 20: .* bits"):
        ht.plan(replace(scene, digits=20))


@pytest.mark.parametrize("end", [6, -6])
@pytest.mark.parametrize("side", [-1, 0, 1])
def test_the_one_turning_point_of_a_motion_that_tends_to_the_vertical(end, side):
    """1/cos(theta) = 1 + sech(t) turns where theta is pi/3: ahead, behind, or at the start."""
    scene = ht.load_scene("separatrix")
    height, spin = sqrt(2) / 2, sqrt(3)
    thetadot = sqrt((1 - height) * (2 - spin * spin / (1 + height)))
    leaving = ht.State(
        PI / 4, thetadot=side * thetadot, phidot=spin / (1 + height), omega3=2 * spin
    )
    start = leaving if side else scene.start
    scene = replace(scene, start=start, time=ht.Exact.of(end))
    plan, run = ht.plan(scene), ht.propagate(scene)
    ahead = side * end >= 0
    assert ht.Motion(scene.top, start).kind == "separatrix"
    assert plan.watched == (("turning",) if ahead else ())
    assert any("theta tends to the vertical: it has no period" in x for x in plan.reasons)
    assert "constant" not in " ".join(plan.reasons)
    assert (run.events.count("turning") or 0) == ahead
    if ahead:
        expected = math.copysign(math.acosh(1 / (math.sqrt(2) - 1)), end) if side else 0.0
        assert run.events.t[0] == pytest.approx(expected, abs=1e-12)
        assert run.events.theta[0] == pytest.approx(math.pi / 3, abs=1e-12)


def document(*arguments):
    result = CliRunner().invoke(app, [*arguments, "--json"])
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def test_the_command():
    """Plan prints what run then does; a run that integrates nothing has no end."""
    told = document("plan", "sicm-kicked")
    assert told["schema"] == "heavytop/plan/1"
    assert told["plan"] == document("run", "sicm-kicked")["plan"]
    assert told["plan"]["cost_s"] > 0
    known = document("run", "sicm-kicked", "--set", 'want.quantities=["class"]')
    assert known["final"] is None
    assert known["plan"]["formulation"] == "none"
    assert known["motion"]["kind"] == "loops"
    text = CliRunner().invoke(app, ["plan", "sicm-kicked", "--set", 'want.quantities=["theta"]'])
    assert "cubic" in text.output
    bad = CliRunner().invoke(app, ["plan", "sicm-kicked", "--formulation", "cubik"])
    assert bad.exit_code == 2


def test_the_cubic_is_left_where_its_height_sets_the_period():
    """Let go beside the vertical, hardly stable: rounding of 1 - cos(theta) shifts every fall."""
    top = ht.Top(1, "1.155", "133.8")
    start = ht.State("0.007", omega3="8.948")
    scene = ht.Scene(top, start, periods=23, quantities=("theta",), events=(), samples=2, digits=6)
    assert ht.plan(scene).formulation == "axis"
    assert ht.run_errors(ht.propagate(scene)).theta < 1e-6
    assert ht.run_errors(ht.propagate(scene, formulation="cubic")).theta > 1e-6
