"""The same trajectory, bit for bit, however it is sampled, split, resumed or stored."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.numbers import Exact

LONG = 400.0  # seconds: several blocks of steps


@pytest.fixture(scope="module")
def scene():
    return ht.load_scene("sicm-kicked", overrides=[f"span.time={LONG}"])


@pytest.fixture(scope="module")
def whole(scene):
    return ht.propagate(scene)


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


def assert_same_run(one, other):
    assert one.orbit.steps == other.orbit.steps
    assert len(one.orbit.checkpoints) == len(other.orbit.checkpoints)
    for a, b in zip(one.orbit.checkpoints, other.orbit.checkpoints, strict=True):
        assert a.time == b.time
        assert same(a.state, b.state)
    assert one.events.kind == other.events.kind
    for name in ("t", "t_low", "phi", "states", "residual"):
        assert same(getattr(one.events, name), getattr(other.events, name)), name


@pytest.mark.parametrize("samples", [2, 3, 1000, 20011])
def test_sampling_changes_nothing(scene, whole, samples):
    other = ht.propagate(replace(scene, samples=samples))
    assert_same_run(whole, other)
    assert same(whole.samples.states[-1], other.samples.states[-1])
    assert whole.samples.phi[-1] == other.samples.phi[-1]


def test_dense_output_is_the_samples(whole):
    shuffled = np.random.default_rng(7).permutation(whole.t)
    again = whole(shuffled)
    order = np.argsort(shuffled)
    for name in ("states", "theta", "phi", "psi", "phidot", "axis"):
        assert same(getattr(again, name)[order], getattr(whole.samples, name)), name


@pytest.mark.parametrize("first", [0.3, 100.0, 399.999])
def test_splitting_changes_nothing(scene, whole, first):
    """A part is made as the whole is: over so long a span auto projects, over a short one not."""
    assert whole.plan.projected
    short = replace(scene, time=Exact.of(first))
    part = ht.propagate(short, formulation="axis", projected=True)
    other = ht.extend(part, LONG, samples=17)
    assert_same_run(whole, other)
    assert same(other(whole.t).states, whole.samples.states)


def test_a_stored_run_is_the_run(whole, tmp_path):
    path = tmp_path / "run.nc"
    whole.save(path)
    loaded = ht.load_trajectory(path)
    assert_same_run(whole, loaded)
    assert loaded.scene == whole.scene
    assert same(loaded.samples.states, whole.samples.states)
    between = np.linspace(0, LONG, 77)
    assert same(loaded(between).states, whole(between).states)
    assert_same_run(ht.extend(whole, 2 * LONG), ht.extend(loaded, 2 * LONG))


@pytest.mark.parametrize("formulation", ["cubic", "routh", "subsystem", "lagrange"])
def test_every_formulation_keeps_its_bits(formulation, tmp_path):
    wanted = '["theta"]' if formulation == "cubic" else '["theta", "phi", "psi"]'
    scene = ht.load_scene("sicm-kicked", overrides=["span.time=30", f"want.quantities={wanted}"])
    one = ht.propagate(scene, formulation=formulation)
    part = ht.propagate(replace(scene, time=Exact.of(7)), formulation=formulation)
    assert_same_run(one, ht.extend(part, 30))
    assert_same_run(one, ht.propagate(replace(scene, samples=3), formulation=formulation))
    one.save(tmp_path / "run.nc")
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    assert_same_run(one, loaded)
    assert same(loaded(17.3).states, one(17.3).states)


def test_another_set_of_events_is_another_run_of_the_same_motion(scene, whole):
    other = ht.propagate(replace(scene, events=()))
    assert np.max(np.abs(other.samples.axis - whole.samples.axis)) < 1e-9


def test_backwards_and_forwards_meet(scene):
    there = ht.propagate(replace(scene, time=Exact.of(-LONG)))
    assert there.t[-1] == -LONG
    assert there.events.t[0] == 0
    assert (np.diff(there.events.t) < 0).all()
    mirrored = ht.propagate(scene)  # released at a turning point: even in time
    assert np.max(np.abs(there.theta - mirrored.theta)) < 1e-9
    assert np.max(np.abs(there.phi + mirrored.phi)) < 1e-9


@pytest.mark.parametrize(
    ("formulation", "options"),
    [
        ("axis", {}),
        ("axis", {"projected": True}),
        ("attitude", {}),
        ("attitude", {"projected": True}),
        ("cubic", {}),
        ("routh", {}),
        ("subsystem", {}),
        ("lagrange", {}),
        ("axis", {"digits": 14}),
        ("attitude", {"digits": 14}),
    ],
)
def test_a_run_inside_the_progress_of_another_changes_neither(formulation, options):
    """All runs of a thread share the compiled equations; none leaves its constants in another."""
    wanted = ("theta",) if formulation == "cubic" else ("theta", "phi", "psi")
    options = dict(options)
    span, digits = ("6", options.pop("digits")) if "digits" in options else ("50", 10)
    slow = ht.Scene(
        ht.Top("3.28e-4", "6.60e-5", "0.0456"),
        ht.State("0.1", phidot=-15, psidot=140),
        time=span,
        quantities=wanted,
        digits=digits,
    )
    other = replace(slow, top=ht.Top(1, "0.5", -3), start=ht.State(2, phidot=1, psidot=3))
    fast = replace(slow, start=ht.State("0.1", phidot=-15, psidot=10**7), time=Exact.of("1e-4"))

    def run(scene, **also):
        return ht.propagate(scene, formulation=formulation, **options, **also)

    alone, alone_other = run(slow), run(other)
    inside = []

    def disturbed(_done):
        if len(inside) == 2:
            return
        inside.append(run(other))
        if formulation != "lagrange":
            run(fast)  # in units of its own
        alone_other(0.5)
        ht.extend(alone_other, float(other.time) + 1)

    found = run(slow, progress=disturbed)
    assert len(inside) > 1
    assert_same_run(found, alone)
    assert_same_run(inside[0], alone_other)
    assert same(found.samples.theta, alone.samples.theta)
    assert same(found(1.234).states, alone(1.234).states)


def test_steppers_of_two_tops_may_take_turns():
    from heavytop.studies.methods import method
    from heavytop.studies.steppers import set_up

    scene = ht.load_scene("sicm-kicked")
    other = replace(scene, start=ht.State(1, phidot=1, psidot=3))
    taylor = method("taylor-axis")

    def after_two(stepper, between=lambda: None):
        at = stepper.block(stepper.begin())
        between()
        return stepper.block(at)

    alone = after_two(set_up(scene, taylor).stepper)
    assert (
        after_two(set_up(scene, taylor).stepper, lambda: after_two(set_up(other, taylor).stepper))
        == alone
    )
