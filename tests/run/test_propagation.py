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
from heavytop.errors import EndedEarly, Impossible, MissedDigitsWarning
from heavytop.exact import Exact
from heavytop.run import estimates
from heavytop.run.counts import tally
from heavytop.run.propagation import completed
from heavytop.run.verify import missed_digits

from ..motions import BOOK, KICKED, MOTIONS, named
from ..trajectories import assert_same_run, run_of, same
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
    apart = np.minimum(*(np.abs(ours - sign * theirs).max(axis=1) for sign in (1, -1)))
    assert np.max(apart) < bound * max(1.0, float(np.max(np.abs(exact.psi))))
    away = np.sin(exact.theta) > 1e-4  # at a pole itself phi is what rounding makes it
    assert not away.any() or np.max(np.abs((run.phi - exact.phi)[away])) < 1e-8
    errors = ht.run_errors(run)
    assert errors.why_not == ""
    assert max(errors.axis, errors.energy) < bound
    if not motion.nutates:
        assert tuple(map(run.events.count, EVENTS)) in ((0, 0, 0), ("separatrix" in name, 0, 0))
        return
    for event, (least, most) in tally(motion, run.orbit.end, EVENTS).items():
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
    scene = turning(ht.Top(*top), start, time, digits)
    assert off(propagated(scene, formulation), aside) < 1e-9


def test_the_axis_form_passes_no_two_poles():
    scene = turning(ht.Top(2, 1, 3), ht.State(2, thetadot=5), 7)
    with pytest.raises(ht.BadScene, match="through both poles; the attitude form does"):
        ht.propagate(scene, formulation="axis")


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


# --- more digits than doubles have ---------------------------------------------------------------


DIGITS = [
    (14, "axis"),
    (15, "attitude"),
    (17, "auto"),
    (33, "routh"),
    (60, "lagrange"),
    (100, "auto"),
]


@pytest.mark.parametrize(("digits", "formulation"), DIGITS)
def test_every_digit_asked_for_is_right(digits, formulation):
    """Of every column, at every sample, of a scene whose decimals mean themselves."""
    wants = ("want.samples=7", 'want.quantities=["attitude", "rates"]')
    changes = (f"want.digits={digits}", "span.time=0.7", *wants)
    run = run_of(*changes, formulation=formulation)
    truth = Digits(run.motion, digits + 20)
    ctx = truth.ctx
    bound = ctx.mpf(10) ** -digits
    assert abs(ctx.mpf(run.end.t) - ctx.mpf("0.7")) < bound
    told, vectors = (attrgetter(*x) for x in (NUMBERS, ("axis", "omega", "quaternion")))
    samples = run.in_mpmath()
    for sample in map(samples.at, range(7)):
        exact = truth(ctx.mpf(sample.t))
        columns = ((*told(x), *chain(*vectors(x))) for x in (sample, exact))
        pairs = [*zip(*columns, strict=True)]
        assert all(abs(ctx.mpf(x) - true) <= bound * max(1, abs(true)) for x, true in pairs)
    assert missed_digits(run) == {}


KINDS = """sicm-dropped lie-group-benchmark through-top through-bottom separatrix near-separatrix
    sleeping steady-betsch planar-pendulum inverted-gravity"""


@pytest.mark.parametrize("name", KINDS.split())
def test_every_kind_of_motion_at_thirty_digits(name):
    run = run_of("want.digits=30", "want.samples=7", name=name)
    assert missed_digits(run) == {}
    assert ht.run_errors(run).theta < 1e-30


# --- the same bits -------------------------------------------------------------------------------


BITS = [(form, False) for form in FORMULATIONS] + [("axis", True), ("attitude", True)]


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")
@pytest.mark.parametrize(("formulation", "projected"), BITS)
def test_sampling_continuing_and_storing_change_no_bit(formulation, projected, tmp_path):
    """Of several blocks; a projected run has several legs in each."""
    wanted = '["theta"]' if formulation == "cubic" else '["theta", "phi", "psi"]'
    long = "span.time=400" if formulation in ("axis", "attitude") else "span.time=30"
    scene = ht.load_scene("sicm-kicked", [long, f"want.quantities={wanted}"])
    one, part, few = (
        ht.propagate(replace(scene, **changes), formulation=formulation, projected=projected)
        for changes in ({}, {"time": Exact.of(7)}, {"samples": 3})
    )
    one.save(tmp_path / "run.nc")
    loaded, longer = ht.load_trajectory(tmp_path / "run.nc"), ht.extend(part, scene.time)
    for other in (longer, few, loaded):
        assert_same_run(one, other)
        assert same(other(17.3).states, one(17.3).states)
        assert same(other.samples.states[-1], one.samples.states[-1])
    ends = [ht.extend(x, 1.25 * one.orbit.end).orbit.checkpoints[-1].state for x in (one, loaded)]
    assert same(*ends)


def test_extending_changes_nothing_in_more_digits():
    wants = ["want.digits=30", 'want.quantities=["theta", "phi", "psi", "axis"]']
    scene = ht.load_scene("sicm-kicked", [*wants, "span.time=7", "want.samples=15"])
    whole, part = (ht.propagate(replace(scene, **x)) for x in ({}, {"time": "3.5", "samples": 8}))
    longer, uneven = ht.extend(part, 7), ht.extend(part, 7, samples=2)
    states = [run.in_mpmath().states.tolist() for run in (whole, longer, uneven)]
    assert states[0] == states[1]
    assert states[0][-1] == states[2][-1]
    assert longer.events.t.tolist() == whole.events.t.tolist()
    assert uneven.t.tolist() == [*part.t.tolist(), 5.25, 7.0]


DISTURBED = [each for each in BITS if each[0] in ("axis", "attitude", "cubic", "lagrange")]


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "projected"), DISTURBED)
def test_a_run_inside_the_progress_of_another_changes_neither(formulation, projected):
    """All runs of a thread share the compiled equations; none leaves its constants in another."""
    wants = {"quantities": ("theta",) if formulation == "cubic" else ANGLES, "digits": 10}
    slow = ht.Scene(BOOK, KICKED, time=50, **wants)
    other = replace(slow, top=ht.Top(1, "0.5", -3), start=ht.State(2, phidot=1, psidot=3))
    fast = replace(slow, start=ht.State("0.1", phidot=-15, psidot=10**7), time=Exact.of("1e-4"))

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
    top = ht.Top(1, "0.5", 1)
    away = ht.Motion(top, ht.State(0, thetadot=2, psidot=3)).at(-0.3)
    rates = {name: float(getattr(away, name)) for name in ("thetadot", "phidot", "psidot")}
    scene = ht.Scene(top, ht.State(float(away.theta), **rates), time=5)
    with pytest.raises(EndedEarly, match="the lagrange form is singular at the poles") as early:
        ht.propagate(scene, formulation="lagrange")
    with pytest.warns(MissedDigitsWarning, match="phi"):  # a sample is on the pole within rounding
        whole = ht.propagate(scene)
    partial = early.value.trajectory
    assert early.value.outcome == "singular"
    assert 0.1 < partial.orbit.end < 5
    assert np.max(np.abs(whole.theta[: partial.t.size] - partial.theta)) < 1e-9


BESIDE_THE_BOTTOM = ht.Scene(
    ht.Top(26.620571276135763, 18.401594793183584, 97.45205680113948),
    ht.State(3.141592653538415, phi=-2.50134175824008, psidot=1.893466346075836),
    time=-12.155835251833263, quantities=("theta",), events=(),
)  # fmt: skip


def test_a_form_that_is_singular_where_the_axis_goes_ends_by_a_step_limit():
    """1.7e-11 rad from the bottom, whose reciprocals set Routh's form a pace that leads nowhere."""
    with pytest.raises(EndedEarly, match=r"comes 1\.7e-11 rad near one; the axis form") as early:
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


def test_a_step_limit_ends_early_and_it_can_be_completed():
    scene = replace(ht.load_scene("sicm-kicked"), time=Exact.of(1000))
    with pytest.raises(EndedEarly) as early:
        ht.propagate(scene, step_limit=8000)
    assert early.value.outcome == "step-limit"
    assert 8000 <= early.value.trajectory.statistics.steps < 12000
    whole = completed(early.value.trajectory)
    assert_same_run(whole, ht.propagate(scene))
    assert completed(whole) is whole


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
    assert pstats.Stats(profile).total_calls <= 3700


def test_a_run_is_given_up_that_takes_more_steps_than_any_sound_one(monkeypatch):
    monkeypatch.setattr(estimates, "SPARE_STEPS", 10)
    monkeypatch.setattr(estimates, "STEPS_A_NUTATION", 1)
    with pytest.raises(EndedEarly) as ended:
        ht.propagate(ht.load_scene("sicm-kicked", ["span.periods=1000"]))
    assert ended.value.outcome == "step-limit"
