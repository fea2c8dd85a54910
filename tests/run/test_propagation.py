"""Runs of every kind of motion, in doubles and in more digits, against the closed form.

And the same bits, however a run is sampled, split, interrupted or run inside another.
"""

import cProfile
import pstats
import warnings
from dataclasses import replace
from functools import partial
from itertools import chain
from operator import attrgetter

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import EndedEarly, Impossible, Outcome
from heavytop.run import propagation
from heavytop.run.counts import count_events
from heavytop.run.verify import misses

from ..motions import BOOK, KICKED, MOTIONS, named
from ..trajectories import angles_of, assert_same_run, run_of, same
from ..views import Digits

ANGLES = ("theta", "phi", "psi")
NUMBERS = (*ANGLES, "thetadot", "phidot", "psidot")
EVENTS = ("turning", "reversal", "cusp")


def propagated(scene, formulation="auto", **options):
    """A run at rounding's mercy beside an unstable pole, of which auto may well speak."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ht.DoubtfulWarning)
        return ht.propagate(scene, formulation=formulation, **options)


# --- every kind of motion ------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("time", "formulation"), [(9, "auto"), (-9, "auto"), (8, "attitude")])
@pytest.mark.parametrize("name", MOTIONS)
def test_attitude_and_events_of_every_motion(name, time, formulation):
    motion = named(name)
    wants = {"quantities": ANGLES, "events": EVENTS, "digits": 9}
    run = propagated(ht.Scene(motion.top, motion.start, time=time, **wants), formulation)
    exact, bound = motion.at(run.t), 1e-8 if "separatrix" in name else 1e-12
    assert np.max(np.abs(run.axis - exact.axis)) < bound
    ours, theirs = run.samples.quaternion, exact.quaternion
    distance = np.minimum(*(np.abs(ours - sign * theirs).max(axis=1) for sign in (1, -1)))
    assert np.max(distance) < bound * max(1.0, float(np.max(np.abs(exact.psi))))
    away = np.sin(exact.theta) > 1e-4  # at a pole itself phi is what rounding makes it
    assert not away.any() or np.max(np.abs((run.phi - exact.phi)[away])) < 1e-8
    errors = ht.run_errors(run)
    assert errors.why_not == ""
    assert max(errors.axis, errors.energy) < bound
    if not motion.nutates:
        assert tuple(map(run.events.count, EVENTS)) in ((0, 0, 0), ("separatrix" in name, 0, 0))
        return
    for event, (least, most) in count_events(motion, run.orbit.end, EVENTS).items():
        assert least <= run.events.count(event) <= most


def off(trajectory, aside=1e-3):
    """The largest errors of phi and psi, away from passes; none may be nan anywhere."""
    scene, seen = trajectory.scene, trajectory.samples
    exact = ht.Motion(scene.top, scene.start).at(seen.t)
    away = np.sin(exact.theta) >= aside * np.max(np.sin(exact.theta))
    for part in (seen.phi, seen.psi, seen.thetadot, seen.phidot, seen.psidot, seen.quaternion):
        assert np.isfinite(part).all()
    assert np.isfinite(trajectory.events.phi).all()
    errors = [np.abs(getattr(seen, x) - getattr(exact, x)) for x in ("phi", "psi")]
    assert max(error[0] for error in errors) < 1e-12  # on a pole too
    return max(float(error[away].max()) for error in errors)


def turning(top, start, time, digits=10):
    return ht.Scene(top, start, time=time, quantities=ANGLES, samples=15, digits=digits)


BESIDE = {  # top, start, time, and how far aside angles are looked at
    "on the top": (("0.5", "0.1", 1), (0, 1, 0, 1), 6, 1e-3),
    "on the bottom": (("0.5", "0.1", -1), ("pi", -1, 0, 1), 6, 1e-3),
    "on the top, backwards": (("0.5", "0.1", -1), (0, -1, 0, 1), -6, 1e-3),
    "staying on the top": ((1, "0.5", -1), (0, 0, 0, 3), 4, 0),
    "staying on the bottom": ((1, "0.5", -1), ("pi", 0, 0, 3), 4, 0),
    # all of the motion is closer than a state that came from afar is known
    "never far from the top": ((1, 2, -1), ("1e-6", 0, 3, 2), 5, 0),
    "never far from the bottom": ((1, 2, 1), ("pi-1e-7", 0, 3, -2), 5, 0),
    # 1e-15 rad beside the top, on the side where phi turns by over pi
    "passing": (
        (1, "0.673876", "2.137209e-3"),
        ("1.96888879e-8", "-4.736e-3", "-1.521e-2", "7.04e-4"), 318, 1e-3,
    ),
}  # fmt: skip


@pytest.mark.parametrize("digits", [10, 15, 20])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("which", BESIDE)
def test_a_start_on_a_pole_or_beside_one_has_its_angles(which, formulation, digits):
    """At every pass phi is that of the side it leaves to."""
    top, (theta, thetadot, phidot, psidot), time, aside = BESIDE[which]
    start = ht.State(theta, thetadot=thetadot, phi=7, phidot=phidot, psi=1, psidot=psidot)
    assert off(propagated(turning(ht.Top(*top), start, time, digits), formulation), aside) < 1e-9


@pytest.mark.parametrize("digits", [10, 17])
@pytest.mark.parametrize("theta", [0, "pi"])
def test_an_axis_that_passes_a_pole_at_the_start_has_its_rates(theta, digits):
    start = ht.State(theta, thetadot=-2, psidot=3)
    scene = replace(turning(ht.Top(1, "0.5", -1), start, 1, digits), quantities=("theta",))
    cubic, axis = (propagated(scene, name).samples.at(0) for name in ("cubic", "axis"))
    limit = (1 if theta == 0 else -1) * 0.5 * 3 / 2  # +- p_psi/2A
    assert abs(cubic.phidot - limit) < 1e-15
    for name in ("thetadot", "phidot", "psidot"):
        assert abs(getattr(cubic, name) - getattr(axis, name)) < 1e-15
    slow = turning(ht.Top(1, "0.5", 0), ht.State(theta, phidot="1e-17"), 1, digits)
    assert not propagated(slow, "axis").samples.phidot.any()  # psi takes all the spin


# --- more digits than doubles have ---------------------------------------------------------------


DIGITS = {14: "axis", 15: "attitude", 17: "auto", 33: "routh", 60: "lagrange", 100: "auto"}


@pytest.mark.parametrize(("digits", "formulation"), DIGITS.items())
def test_every_digit_asked_for_is_right(digits, formulation):
    """Of every column, at every sample, of a scene whose decimals mean themselves."""
    wants = ("want.samples=7", 'want.quantities=["attitude", "rates"]')
    changes = (f"want.digits={digits}", "span.time=0.7", *wants)
    run = run_of(*changes, formulation=formulation)
    truth = Digits(run.motion, digits + 20)
    ctx = truth.ctx
    bound = ctx.mpf(10) ** -digits
    assert abs(ctx.mpf(run.end.t) - ctx.mpf("0.7")) < bound
    numbers, vectors = (attrgetter(*x) for x in (NUMBERS, ("axis", "omega", "quaternion")))
    samples = run.in_mpmath()
    for sample in map(samples.at, range(7)):
        exact = truth(ctx.mpf(sample.t))
        columns = ((*numbers(x), *chain(*vectors(x))) for x in (sample, exact))
        pairs = [*zip(*columns, strict=True)]
        assert all(abs(ctx.mpf(x) - true) <= bound * max(1, abs(true)) for x, true in pairs)
    assert misses(run).digits == {}


# --- the same bits -------------------------------------------------------------------------------


SECONDS = {"axis": 400, "attitude": 400}  # several blocks; others begin with one
BITS = [(form, False, {"time": SECONDS.get(form, 25)}) for form in FORMULATIONS]
BITS += [("attitude", True, {"time": 400})]
BITS = [pytest.param(*each, marks=pytest.mark.slow) for each in BITS]
BITS += [("axis", True, {"time": 400}), ("auto", False, {"time": 7, "samples": 15, "digits": 30})]
OWN_UNIT = ht.State("0.5", thetadot=1, phidot=-1, psidot=10**6)  # of time
FAST = {"start": OWN_UNIT, "time": "1/512", "samples": 257, "digits": 6}
BITS += [("axis", projected, FAST) for projected in (False, True)]


@pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")
@pytest.mark.parametrize(("formulation", "projected", "changes"), BITS)
def test_sampling_continuing_and_storing_change_no_bit(formulation, projected, changes, tmp_path):
    """A projected run has several legs in each block."""
    scene = replace(ht.load_scene("sicm-kicked"), quantities=angles_of(formulation), **changes)
    half = {"time": scene.time / 2, "samples": scene.samples // 2 + 1}
    one, part, few = (
        ht.propagate(replace(scene, **more), formulation=formulation, projected=projected)
        for more in ({}, half, {"samples": 3})
    )
    one.save(tmp_path / "run.nc")
    other = replace(scene, start=ht.State(1, psidot=140))
    ht.propagate(other, formulation=formulation)  # which shares the equations
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    longer, uneven = ht.extend(part, scene.time), ht.extend(part, scene.time, samples=2)
    end = one.orbit.end
    for other in (longer, uneven, few, loaded):
        assert_same_run(one, other)
        assert same(other(0.61 * end).states, one(0.61 * end).states)
        assert same(other.orbit.samples.states[-1], one.orbit.samples.states[-1])
    assert uneven.t.tolist() == [*part.t.tolist(), 0.75 * end, end]
    assert (loaded.scene, loaded.plan) == (one.scene, one.plan)
    assert repr(loaded.events.own) == repr(one.events.own)
    for name in one.samples.COLUMNS:
        whole, *others = (getattr(run.raw_samples, name) for run in (one, longer, loaded))
        assert all(same(each, whole) for each in others), name
    assert same(*[ht.extend(x, 1.25 * end).orbit.checkpoints[-1].state for x in (one, loaded)])


DISTURBED = [(form, False) for form in ("axis", "attitude", "cubic", "lagrange")]
DISTURBED += [(form, True) for form in SECONDS]


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "projected"), DISTURBED)
def test_a_run_inside_the_progress_of_another_changes_neither(formulation, projected):
    """All runs of a thread share the compiled equations; none leaves its constants in another."""
    slow = ht.Scene(BOOK, KICKED, time=50, quantities=angles_of(formulation), digits=10)
    other = replace(slow, top=ht.Top(1, "0.5", -3), start=ht.State(2, phidot=1, psidot=3))
    fast = replace(slow, start=ht.State("0.1", phidot=-15, psidot=10**7), time=ht.Exact.of("1e-4"))

    run = partial(ht.propagate, formulation=formulation, projected=projected)
    alone, alone_other, inside = run(slow), run(other), []

    def disturbed(_done):
        if len(inside) < 2:
            inside.append(run(other))
            if formulation != "lagrange":
                run(fast)  # in units of its own
            alone_other(0.5)

    found = run(slow, progress=disturbed)
    assert_same_run(found, alone)
    assert_same_run(inside[0], alone_other)
    assert same(found(1.234).states, alone(1.234).states)


# --- runs that end early, and go on --------------------------------------------------------------


def test_the_textbook_form_ends_early_at_a_pole_and_keeps_what_it_has():
    motion = named("through the top, from its side")
    scene = ht.Scene(motion.top, motion.start, time=-5)
    with pytest.raises(EndedEarly, match="the lagrange form is singular at the poles") as early:
        ht.propagate(scene, formulation="lagrange")
    partial = early.value.trajectory
    assert early.value.outcome == "singular"
    assert 0.1 < abs(partial.orbit.end) < 5
    assert np.max(np.abs(partial.theta - motion.at(partial.t).theta)) < 1e-9


BESIDE_THE_BOTTOM = ht.Scene(
    ht.Top(27, 18, 97), ht.State("pi-1.7e-11", psidot=2), time=-12, quantities=("theta",), events=()
)


def test_a_form_that_is_singular_where_the_axis_goes_ends_by_a_step_limit():
    """5.6e-12 rad from the bottom, whose reciprocals set Routh's form a pace that leads nowhere."""
    with pytest.raises(EndedEarly, match=r"comes 5\.6e-12 rad near one; the axis form") as early:
        ht.propagate(BESIDE_THE_BOTTOM, formulation="routh")
    assert early.value.outcome == "step-limit"
    assert 0 < abs(early.value.trajectory.orbit.end) < 12.2


def test_time_grows_beside_a_pole():
    """At the Lie-group benchmark's pass, 7e-7 rad beside the bottom."""
    quick, slow = (ht.plan(BESIDE_THE_BOTTOM, form).seconds for form in ("axis", "routh"))
    assert slow > 20 * quick


@pytest.mark.parametrize("digits", [12, 30])
@pytest.mark.parametrize("time", [1e-299, -1e-299])
def test_a_span_may_be_as_short_as_a_number(time, digits):
    """The product of two such times is zero."""
    run = ht.propagate(ht.Scene(BOOK, KICKED, time=time, quantities=("phi",), digits=digits))
    assert run.phi[-1] == pytest.approx(float(KICKED.phidot) * time, rel=1e-12, abs=0)


def test_a_step_limit_ends_a_run_early_resumed_or_not_and_it_can_be_extended(monkeypatch):
    scene = replace(ht.load_scene("sicm-kicked"), time=ht.Exact.of(1000))
    monkeypatch.setattr(propagation, "most_steps", lambda *_: 8000)
    with pytest.raises(EndedEarly, match="step-limit") as early:
        ht.propagate(scene)
    ended = early.value.trajectory
    stopped = replace(ended, orbit=replace(ended.orbit, outcome=Outcome.INTERRUPTED))
    with pytest.raises(EndedEarly, match="step-limit") as again:
        propagation.finish(stopped)
    assert again.value.trajectory.orbit.steps == ended.orbit.steps in range(8000, 12000)
    whole = ht.extend(ended, 1000)
    assert_same_run(whole, ht.propagate(scene, step_limit=10**6))
    assert propagation.finish(whole) is whole


def test_where_a_trajectory_may_end():
    run = ht.propagate(ht.Scene(BOOK, KICKED, time=2, quantities=("theta",), events=()))
    with pytest.raises(Impossible, match=r"2e\+11 more samples .* of 10000000 at most; samples="):
        ht.extend(run, 1e9)
    for end in (1, 2, -3):
        with pytest.raises(Impossible, match="beyond 2"):
            ht.extend(run, end)


def test_a_warm_run_makes_few_calls():
    """Events, samples, check and all: what it costs beside some twenty microseconds of steps."""
    ht.propagate(ht.load_scene("sicm-kicked"))
    scene, profile = ht.load_scene("sicm-kicked"), cProfile.Profile()
    profile.runcall(ht.propagate, scene)
    assert pstats.Stats(profile).total_calls <= 3300
