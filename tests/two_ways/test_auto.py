"""Auto: the least that does, on a small slice of what validation/17_auto.py runs in full."""

import json
import math
import random
from dataclasses import replace

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.errors import BadScene
from heavytop.planning import EPSILON
from heavytop.witness import missed_digits, run_errors

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


def want(*quantities, **changes):
    scene = replace(ht.load_scene("sicm-kicked"), quantities=quantities)
    return ht.plan(replace(scene, **changes))


def test_no_more_model_than_is_wanted():
    """Nothing for the class, two states for theta, five for the axis, the turns only for phi."""
    assert want("class", "period").formulation == "none"
    assert (want("theta").formulation, want("theta").states) == ("cubic", 2)
    assert (want("axis").formulation, want("axis").states) == ("axis", 5)
    assert not want("axis").follows_phi
    assert want("theta", "phi").follows_phi
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
