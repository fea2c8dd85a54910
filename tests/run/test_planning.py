"""Auto: the least that does, on a small slice of what validation/11_random_tops.py runs in full."""

import random
import re
from dataclasses import replace

import pytest

import heavytop as ht
from heavytop.run.estimates import CostModel
from heavytop.run.verify import misses

from ..commands import document
from ..motions import named


@pytest.mark.parametrize("number", range(18))
def test_auto_meets_the_digits_asked(script, number):
    """Of random scenes, some of which pass close to a pole; of every sixth the rates are wanted."""
    scene = script("11_random_tops").random_scene(random.Random(number), number)
    run = ht.propagate(replace(scene, quantities=scene.quantities if number % 6 else ("rates",)))
    assert misses(run).digits == {}
    assert run.plan.reasons


@pytest.mark.parametrize("name", ["through-top", "through-bottom", "separatrix", "sicm-forward"])
@pytest.mark.parametrize(("samples", "also"), [(401, ("phi", "psi")), (31, ())])
def test_auto_takes_more_bits_where_rates_lose_digits_beside_a_pole(name, samples, also):
    run = ht.propagate(replace(ht.load_scene(name), quantities=("rates", *also), samples=samples))
    assert (run.plan.precision == "double") == (name == "sicm-forward")
    assert misses(run).digits == {}


def test_bits_follow_from_digits_and_span():
    scene = ht.load_scene("sicm-kicked", ["want.samples=7"])
    wanted = {13: "double", 14: "64 bits", 30: "128 bits", 60: "256 bits", 1000: "3392 bits"}
    assert {d: ht.plan(replace(scene, digits=d)).precision for d in wanted} == wanted
    assert ht.plan(replace(scene, digits=60)).tolerance == 2.0**-255
    scene = replace(scene, digits=70)
    motion = ht.Motion(scene.top, scene.start)
    far, near = (CostModel(scene, motion, end).bits("axis") for end in (1e6, 1.0))
    assert far > near


@pytest.mark.parametrize(("scene", "count"), [
    ("sicm-kicked span.periods=1e8", 1), ("separatrix span.time=1e7", 1),
    ("sicm-kicked span.periods=1e4", 0),
])  # fmt: skip
def test_long_runs_are_told_of(scene, count):
    """How long it takes is said, and what would be quicker."""
    name, *changes = scene.split()
    said = [x for x in ht.plan(ht.load_scene(name, changes)).warnings if "long: about" in x]
    assert len(said) == count


HARDLY_STABLE, BESIDE = ht.Top(1, "1.155", "133.8"), ht.State("0.007", omega3="8.948")
LONG = ht.Exact.of(5000)


# what is wanted of which scene, and what the plan has
@pytest.mark.parametrize(("quantities", "changes", "has"), [
    (("class", "period"), {}, {"formulation": "none"}),
    (("theta",), {}, {"formulation": "cubic", "states": 2, "projected": False}),
    (("rates",), {}, {"formulation": "cubic", "states": 2}),
    (("axis",), {}, {"formulation": "axis", "states": 5, "variant": None}),
    (("theta", "phi"), {}, {"variant": "phi", "states": 5}),
    (("psi",), {}, {"variant": "sigma", "states": 6}),
    (("theta",), {"time": LONG, "digits": 11}, {"projected": True, "precision": "double"}),
    (("theta",), {"time": LONG, "digits": 9}, {"projected": False, "precision": "double"}),
    (("theta",), {"top": ht.Top(1, 0, 1), "start": ht.State(1)}, {"formulation": "axis"}),
    (("phi",), {"digits": 40}, {"projected": False, "precision": "192 bits"}),
    (("theta",), {"name": "lie-group-benchmark"}, {"formulation": "axis"}),  # 7e-7 rad past a pole
    (("psi",), {"name": "lie-group-benchmark"}, {"formulation": "axis", "variant": "delta"}),
    (("psi",), {"name": "planar-rotating"}, {"formulation": "attitude"}),  # through both poles
    (("attitude",), {"start": ht.State("0.1", psi="1e5")}, {"formulation": "attitude"}),
    (("attitude",), {"time": None, "periods": LONG}, {"formulation": "attitude"}),
    # let go beside the vertical, hardly stable: rounding of 1 - cos(theta) shifts every fall
    (("theta",), {"top": HARDLY_STABLE, "start": BESIDE, "digits": 6}, {"formulation": "axis"}),
])  # fmt: skip
def test_no_more_model_than_is_wanted(quantities, changes, has):
    """Nothing for the class, two states for theta, five for the axis, the turns only for phi."""
    named = ht.load_scene(changes.get("name", "sicm-kicked"))
    plan = ht.plan(scene := replace(named, quantities=quantities, **changes))
    assert {name: getattr(plan, name) for name in has} == has
    if plan.formulation == "none":
        with pytest.raises(ht.BadScene, match=r"auto: nothing is integrated.* heavytop\.Motion"):
            ht.propagate(scene)


@pytest.mark.parametrize("events", ["[]", '["turning"]'])
@pytest.mark.parametrize("scene", ["sicm-kicked", "separatrix", "steady-betsch"])
def test_turns_that_cannot_be_counted_are_refused(scene, events):
    with pytest.raises(ht.BadScene, match=r"span\.time = 1e300: at most .* turns are not counted"):
        ht.plan(ht.load_scene(scene, ["span.time=1e300", f"want.events={events}"]))


def test_far_along_a_separatrix():
    """A plan that says what is lost; and a refusal of digits that nothing can keep."""
    scene = ht.load_scene("separatrix", ["span.time=1e7"])
    changes = ["span.periods=3e6", "want.quantities=['phi']", "want.digits=13"]
    for far in (scene, ht.load_scene("sicm-kicked", changes)):
        assert any("digits may be missed" in x for x in ht.plan(far).warnings)
    with pytest.raises(ht.BadScene, match=r"want\.digits = 20: .* bits"):
        ht.plan(replace(scene, digits=20), "axis")
    assert ht.plan(replace(scene, digits=20)).formulation == "none"


@pytest.mark.parametrize("end", [6, -6])
@pytest.mark.parametrize("name", ["separatrix", "separatrix, leaving", "separatrix, arriving"])
def test_the_one_turning_point_of_a_motion_that_tends_to_the_vertical(name, end):
    """It is ahead, behind, or at the start."""
    motion = named(name)
    scene = ht.Scene(motion.top, motion.start, time=end)
    plan, run = ht.plan(scene), ht.propagate(scene)
    times = [float(t) for t in motion.events("turning").times(*sorted((0, end)), 20)]
    assert plan.watched == (("turning",) if times else ())
    assert any("theta tends to the vertical: it has no period" in x for x in plan.reasons)
    assert (run.events.count("turning") or 0) == len(times)
    assert list(run.events.t) == pytest.approx(times, abs=1e-12)
    assert list(run.events.theta) == pytest.approx([motion.theta_max] * len(times), abs=1e-12)


def test_the_command_prints_the_plan_that_the_run_has():
    plan, run = (document(verb, "sicm-kicked") for verb in ("plan", "run"))
    assert (plan["schema"], plan["plan"]) == ("heavytop/plan/1", run["plan"])


@pytest.mark.parametrize(("scene", "changes", "form", "keys"), [
    ("sleeping", [], "routh", {"start.theta"}),
    ("sleeping", [], "cubic", {"want.quantities"}),
    ("sleeping", ["top.C=0", 'want.quantities=["phi"]'], "routh", {"start.theta", "top.C"}),
    ("sicm-kicked", ["top.C=0", 'want.quantities=["phi"]'], "attitude", {"top.C"}),
    ("planar-rotating", ['want.quantities=["psi"]'], "axis", {"want.quantities"}),
])  # fmt: skip
def test_a_form_that_cannot_is_refused_by_every_key_and_another_can(scene, changes, form, keys):
    wanted = ht.load_scene(scene, changes)
    with pytest.raises(ht.BadScene) as bad:
        ht.plan(wanted, form)
    assert {fault.key for fault in bad.value.faults} == keys
    for other in re.findall(r"take (.*)", str(bad.value))[-1:]:
        assert all(ht.plan(wanted, name).formulation == name for name in other.split(" or "))


def test_where_the_kind_is_not_proved_reversals_are_watched_for():
    changes = ["start.phidot=0", "start.theta=pi/3", "start.psidot=sqrt(cos(2)^2)+cos(2)"]
    scene = ht.load_scene("sicm-kicked", changes)
    assert ht.Motion(scene.top, scene.start).kind == "undecided"
    assert ht.plan(scene).watched == ("turning", "reversal")
