"""Runs of every kind of motion, in doubles and in more digits, against the closed form.

And the same bits, however a run is sampled, split, interrupted or run inside another.
"""

import time
import warnings
from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import EndedEarly
from heavytop.numbers import Exact
from heavytop.run.propagation import completed
from heavytop.run.verify import missed_digits
from heavytop.studies.methods import method
from heavytop.studies.steppers import set_up

from ..motions import BOOK, KICKED, MOTIONS, named

ANGLES = ("theta", "phi", "psi")
EVENTS = ("turning", "reversal", "cusp")
TIME = 9.0


def propagated(scene, formulation="auto", **options):
    """A run at rounding's mercy beside an unstable pole, of which auto may well speak."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ht.DoubtfulWarning)
        return ht.propagate(scene, formulation=formulation, **options)


# --- every kind of motion ------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("name", MOTIONS)
def test_attitude_and_events_of_every_motion(name, direction):
    motion = named(name)
    scene = ht.Scene(
        motion.top, motion.start, time=direction * TIME, quantities=ANGLES, events=EVENTS, digits=9
    )
    run = propagated(scene)
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
    turning, reversal, cusp = (run.events.count(event) for event in EVENTS)
    if not motion.nutates:
        assert (reversal, cusp) == (0, 0)
        assert turning <= ("separatrix" in name)
        return
    periods = TIME / motion.period
    assert abs(turning - 2 * periods) <= 1
    if motion.kind != "force-free":
        assert (abs(reversal - 2 * periods) <= 1.5) if motion.kind == "loops" else reversal == 0
    assert abs(cusp - periods - 0.5) <= 0.5 if motion.kind == "cusps" else cusp == 0


LOW, HIGH = {3: "2*pi/3", -3: "pi/3"}, {3: "pi", -3: 0}  # where V is lower, and where lowest
PLANAR = {
    "swinging": lambda g: (LOW[g], "0.5"),
    "let go": lambda g: (LOW[g], 0),
    "turning over": lambda _: (2, 5),
    "turning over, the other way": lambda _: (2, -5),
    "over from the top": lambda _: (0, 5),
    "over from the bottom": lambda _: ("pi", -5),
    "up to the pole": lambda g: (LOW[g], "1.5*sqrt(2)"),
    "down, and up to the pole": lambda g: (LOW[g], "-1.5*sqrt(2)"),
    "up to the pole, from the other": lambda g: (HIGH[g], "sqrt(6)"),
}


def off(trajectory, aside=1e-3):
    """The largest errors of phi and psi, away from passes; none may be nan anywhere."""
    scene, seen = trajectory.scene, trajectory.samples
    exact = ht.Motion(scene.top, scene.start).at(seen.t)
    away = np.sin(exact.theta) > aside * np.max(np.sin(exact.theta))
    for part in (seen.phi, seen.psi, seen.thetadot, seen.phidot, seen.psidot, seen.quaternion):
        assert np.isfinite(part).all()
    assert np.isfinite(trajectory.events.phi).all()
    errors = [np.abs(getattr(seen, x) - getattr(exact, x)) for x in ("phi", "psi")]
    assert max(error[0] for error in errors) < 1e-12  # on a pole too
    return max(float(error[away].max()) for error in errors)


def turning(top, start, time, digits=10, samples=15):
    return ht.Scene(top, start, time=time, quantities=ANGLES, samples=samples, digits=digits)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "digits"), [("auto", 10), ("axis", 10), ("attitude", 10), ("attitude", 15)]
)
@pytest.mark.parametrize("time", [7, -7])
@pytest.mark.parametrize("g", [3, -3])
@pytest.mark.parametrize("name", PLANAR)
def test_planar_motions_turn_as_the_closed_form(name, g, time, formulation, digits):
    theta, thetadot = PLANAR[name](g)
    start = ht.State(theta, phi="0.4", psi="-0.3", thetadot=thetadot)
    scene = turning(ht.Top(2, 1, g), start, time, digits, 29)
    if formulation == "axis" and "over" in name:
        with pytest.raises(ht.BadScene, match="through both poles; the attitude form does"):
            ht.propagate(scene, formulation=formulation)
        return
    assert off(propagated(scene, formulation)) < 1e-9


@pytest.mark.parametrize("digits", [10, 15, 20])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize(
    ("theta", "time", "thetadot", "g"), [(0, 6, 1, 1), ("pi", 6, -1, -1), (0, -6, -1, -1)]
)
def test_a_start_on_a_pole_has_its_angles(theta, time, thetadot, g, formulation, digits):
    """At every pass phi is that of the side it leaves to."""
    start = ht.State(theta, thetadot=thetadot, phi=7, psi=1, psidot=1)
    scene = turning(ht.Top("0.5", "0.1", g), start, time, digits)
    assert off(propagated(scene, formulation)) < 1e-9


@pytest.mark.parametrize("digits", [10, 17])
@pytest.mark.parametrize("theta", [0, "pi"])
def test_an_axis_on_a_pole_has_its_angles_and_rates(theta, digits):
    top = ht.Top(1, "0.5", -1)
    for formulation in ("axis", "attitude"):
        start = ht.State(theta, phi=7, psi=1, psidot=3)  # it stays there
        seen = propagated(turning(top, start, 4, digits, 3), formulation).samples
        assert np.max(np.abs(seen.phi - 7)) < 1e-15
        assert np.max(np.abs(seen.psi - 1 - 3 * seen.t)) < 1e-14
        assert np.isfinite(seen.quaternion).all()
    start = ht.State(theta, thetadot=-2, psidot=3)  # it passes
    scene = replace(turning(top, start, 1, digits), quantities=("theta",))
    cubic, axis = (propagated(scene, name).samples.at(0) for name in ("cubic", "axis"))
    limit = (1 if theta == 0 else -1) * 0.5 * 3 / 2  # +- p_psi/2A
    assert abs(cubic.phidot - limit) < 1e-15
    for name in ("thetadot", "phidot", "psidot"):
        assert abs(getattr(cubic, name) - getattr(axis, name)) < 1e-15


@pytest.mark.parametrize("digits", [10, 15])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("tilt", ["1e-6", "1e-9", "1e-13"])
def test_a_motion_that_stays_close_to_a_pole_turns_as_the_closed_form(tilt, formulation, digits):
    """All of it closer than a state that came from afar is known; this one has its digits."""
    for pole, g in (("", -1), ("pi-", 1)):
        start = ht.State(f"{pole}{tilt}", phidot=3, psidot=2 if g < 0 else -2)
        scene = turning(ht.Top(1, 2, g), start, 5, digits)
        assert off(propagated(scene, formulation), aside=0) < max(1e-9, 1e-16 / float(tilt))


@pytest.mark.parametrize("formulation", ["axis", "attitude"])
def test_a_state_that_knows_its_pass_is_believed(formulation):
    """1e-15 rad beside the top straight from the start, on the side where phi turns by over pi."""
    start = ht.State("1.96888879e-8", thetadot="-4.736e-3", phidot="-1.521e-2", psidot="7.04e-4")
    scene = turning(ht.Top(1, "0.673876", "2.137209e-3"), start, 318, samples=12)
    assert off(propagated(scene, formulation)) < 1e-9


# --- more digits than doubles have ---------------------------------------------------------------


def precise(digits, *changes, name="sicm-kicked"):
    wanted = 'want.quantities=["theta", "phi", "psi", "axis"]'
    return ht.load_scene(name, [f"want.digits={digits}", "want.samples=7", wanted, *changes])


@pytest.mark.parametrize("digits", [14, 15, 17, 33, 60, 100])
def test_every_digit_asked_for_is_right(digits):
    """Of angles, axis and rates, at every sample, of a scene whose decimals mean themselves."""
    run = ht.propagate(precise(digits, "span.time=0.7", 'want.quantities=["attitude", "rates"]'))
    truth = run.motion.form(digits + 20)
    ctx = truth.ctx
    bound = ctx.mpf(10) ** -digits
    assert len(run.decimals.samples) == 7
    assert abs(ctx.mpf(run.decimals.samples[-1].t) - ctx.mpf("0.7")) < bound
    for sample in run.decimals.samples:
        exact = truth(ctx.mpf(sample.t))
        names = (*ANGLES, "thetadot", "phidot", "psidot")
        pairs = [(getattr(sample, n), getattr(exact, n)) for n in names]
        for mine, true in (*pairs, *zip(sample.axis, exact.axis, strict=True)):
            assert abs(ctx.mpf(mine) - true) <= bound * max(1, abs(true))
    assert missed_digits(run, ht.run_errors(run)) == {}


@pytest.mark.slow
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_every_formulation_at_forty_digits(formulation):
    only = ['want.quantities=["theta", "rates"]'] if formulation == "cubic" else []
    run = ht.propagate(precise(40, "span.time=1", *only), formulation=formulation)
    assert missed_digits(run, ht.run_errors(run)) == {}
    assert ht.run_errors(run).energy < 1e-50
    assert run.events.kind[:3] == ("theta_min", "reversal", "theta_max")


KINDS = """sicm-dropped lie-group-benchmark through-top through-bottom separatrix near-separatrix
    sleeping steady-betsch planar-pendulum inverted-gravity"""


@pytest.mark.parametrize("name", KINDS.split())
def test_every_kind_of_motion_at_thirty_digits(name):
    run = ht.propagate(ht.load_scene(name, ["want.digits=30", "want.samples=7"]))
    errors = ht.run_errors(run)
    assert missed_digits(run, errors) == {}
    assert errors.theta < 1e-30
    if len(run.events):
        assert errors.event_time < 1e-30


def test_close_passes_turn_the_right_way():
    """Past the bottom at 7e-7 rad: phi turns by half a turn in 1e-7 s, hundreds of times."""
    changes = "span.periods=300.3", "want.events=[]"
    run = ht.propagate(precise(30, *changes, name="lie-group-benchmark"))
    assert missed_digits(run, ht.run_errors(run)) == {}


def test_periods_end_where_they_began_and_both_ways_meet():
    run = ht.propagate(precise(40, "span.periods=2", "want.events=[]"))
    assert abs(run.decimals.samples[-1].theta - run.decimals.samples[0].theta) < 1e-40
    there, back = (ht.propagate(precise(30, f"span.time={t}")) for t in (1, -1))
    ends = [run.decimals.samples[-1] for run in (there, back)]  # released at a turning point
    assert abs(ends[0].theta - ends[1].theta) < 1e-35
    assert abs(ends[0].phi + ends[1].phi) < 1e-35


def test_projection_is_for_doubles():
    with pytest.raises(ht.BadScene, match="only in double precision"):
        ht.propagate(precise(30), projected=True)


# --- the same bits -------------------------------------------------------------------------------

LONG = 400.0  # seconds: several blocks of steps


@pytest.fixture(scope="module")
def scene():
    return ht.load_scene("sicm-kicked", [f"span.time={LONG}"])


@pytest.fixture(scope="module")
def whole(scene):
    return ht.propagate(scene)


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


def assert_same_run(one, other):
    assert one.orbit.steps == other.orbit.steps
    for a, b in zip(one.orbit.checkpoints, other.orbit.checkpoints, strict=True):
        assert a.time == b.time
        assert same(a.state, b.state)
    assert one.events.kind == other.events.kind
    for name in ("t", "t_low", "phi", "states", "residual"):
        assert same(getattr(one.events, name), getattr(other.events, name)), name


@pytest.mark.parametrize("samples", [2, 1000, 20011])
def test_sampling_changes_nothing(scene, whole, samples):
    other = ht.propagate(replace(scene, samples=samples))
    assert_same_run(whole, other)
    assert same(whole.samples.states[-1], other.samples.states[-1])
    assert whole.samples.phi[-1] == other.samples.phi[-1]


@pytest.mark.parametrize("first", [0.3, 100.0, 399.999])
def test_splitting_changes_nothing(scene, whole, first):
    """A part is made as the whole is: over so long a span auto projects, over a short one not."""
    assert whole.plan.projected
    short = replace(scene, time=Exact.of(first))
    other = ht.extend(propagated(short, "axis", projected=True), LONG, samples=17)
    assert_same_run(whole, other)
    assert same(other(whole.t).states, whole.samples.states)


@pytest.mark.parametrize("formulation", ["cubic", "routh", "subsystem", "lagrange"])
def test_every_formulation_keeps_its_bits(formulation, tmp_path):
    wanted = '["theta"]' if formulation == "cubic" else '["theta", "phi", "psi"]'
    scene = ht.load_scene("sicm-kicked", ["span.time=30", f"want.quantities={wanted}"])
    one = ht.propagate(scene, formulation=formulation)
    part = ht.propagate(replace(scene, time=Exact.of(7)), formulation=formulation)
    assert_same_run(one, ht.extend(part, 30))
    assert_same_run(one, ht.propagate(replace(scene, samples=3), formulation=formulation))
    one.save(tmp_path / "run.nc")
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    assert_same_run(one, loaded)
    assert same(loaded(17.3).states, one(17.3).states)


def test_extending_changes_nothing_in_more_digits():
    scene = precise(30, "span.time=7", "want.samples=15")
    whole, part = (ht.propagate(replace(scene, **x)) for x in ({}, {"time": "3.5", "samples": 8}))
    longer, uneven = ht.extend(part, 7), ht.extend(part, 7, samples=2)
    states = [[s.states for s in run.decimals.samples] for run in (whole, longer)]
    assert states[0] == states[1]
    assert longer.events.t.tolist() == whole.events.t.tolist()
    assert uneven.t.tolist() == [*part.t.tolist(), 5.25, 7.0]
    assert uneven.decimals.samples[-1].states == whole.decimals.samples[-1].states
    few = ht.propagate(replace(scene, samples=3))
    assert few.decimals.samples[1].states == whole.decimals.samples[7].states


def test_other_events_are_another_run_of_the_same_motion_and_both_ways_meet(scene, whole):
    other = ht.propagate(replace(scene, events=()))
    assert np.max(np.abs(other.samples.axis - whole.samples.axis)) < 1e-9
    there = ht.propagate(replace(scene, time=Exact.of(-LONG)))
    assert there.t[-1] == -LONG
    assert there.events.t[0] == 0
    assert (np.diff(there.events.t) < 0).all()
    assert np.max(np.abs(there.theta - whole.theta)) < 1e-9  # released at a turning point
    assert np.max(np.abs(there.phi + whole.phi)) < 1e-9


DISTURBED = [
    *((form, {"projected": p}) for form in ("axis", "attitude") for p in (False, True)),
    *((form, {}) for form in ("cubic", "routh", "subsystem", "lagrange")),
    *((form, {"digits": 14}) for form in ("axis", "attitude")),
]


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "options"), DISTURBED)
def test_a_run_inside_the_progress_of_another_changes_neither(formulation, options):
    """All runs of a thread share the compiled equations; none leaves its constants in another."""
    options = {"digits": 10} | options
    digits = options.pop("digits")
    slow = ht.Scene(
        BOOK, KICKED, time="50" if digits == 10 else "6", digits=digits,
        quantities=("theta",) if formulation == "cubic" else ANGLES,
    )  # fmt: skip
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


# --- runs that end early, and go on --------------------------------------------------------------


def test_the_textbook_form_ends_early_at_a_pole_and_keeps_what_it_has():
    top = ht.Top(1, "0.5", 1)
    away = ht.Motion(top, ht.State(0, thetadot=2, psidot=3)).at(-0.3)
    rates = {name: float(getattr(away, name)) for name in ("thetadot", "phidot", "psidot")}
    scene = ht.Scene(top, ht.State(float(away.theta), **rates), time=5)
    with pytest.raises(EndedEarly, match="the lagrange form is singular at the poles") as early:
        ht.propagate(scene, formulation="lagrange")
    partial = early.value.trajectory
    assert early.value.outcome == "singular"
    assert 0.1 < partial.orbit.end < 5
    assert 0 < partial.t.size < scene.samples
    assert np.isfinite(partial.theta).all()
    whole = ht.propagate(scene)
    assert np.max(np.abs(whole.theta[: partial.t.size] - partial.theta)) < 1e-9


def test_a_step_limit_ends_early():
    scene = replace(ht.load_scene("sicm-kicked"), time=Exact.of(1000))
    with pytest.raises(EndedEarly) as early:
        ht.propagate(scene, step_limit=8000)
    assert early.value.outcome == "step-limit"
    assert 8000 <= early.value.trajectory.statistics.steps < 12000
    assert 320 < early.value.trajectory.orbit.end < 500
    whole = completed(early.value.trajectory)
    assert_same_run(whole, ht.propagate(scene))
    assert completed(whole) is whole


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
def test_an_interrupt_is_answered_within_a_block_and_keeps_what_it_has():
    scene, seen = replace(ht.load_scene("sicm-kicked"), time=Exact.of(10_000)), []

    def interrupt(fraction):
        seen.append(fraction)
        if len(seen) == 3:
            raise KeyboardInterrupt

    with pytest.raises(EndedEarly) as early:
        ht.propagate(scene, formulation="axis", progress=interrupt)
    assert early.value.outcome == "interrupted"
    assert len(seen) == 3
    partial, whole = early.value.trajectory, ht.propagate(scene, formulation="axis")
    assert np.array_equal(partial.samples.states, whole.samples.states[: partial.t.size])


def test_a_continued_run_keeps_the_bits_that_auto_took():
    start = ht.State("1e-6", psidot=90)
    scene = ht.Scene(BOOK, start, time=20, events=(), digits=12, samples=3)
    short = ht.propagate(scene)
    long = ht.extend(short, 40)
    assert short.plan.precision == long.plan.precision == "128 bits"
    truth = float(ht.Motion(BOOK, start).at(40, digits=30).phi)
    assert abs(long.phi[-1] - truth) < 1e-12 * abs(truth)


def test_where_a_trajectory_may_end():
    run = ht.propagate(ht.Scene(BOOK, KICKED, time=2, quantities=("theta",), events=()))
    with pytest.raises(ValueError, match=r"2e\+11 more samples .* of 10000000 at most; samples="):
        ht.extend(run, 1e9)
    for end in (1, 2, -3):
        with pytest.raises(ValueError, match="beyond 2"):
            ht.extend(run, end)


def test_what_a_run_took_includes_its_events():
    scene, heard = ht.load_scene("sicm-kicked", ["span.periods=30", "want.digits=14"]), []
    ht.propagate(scene)  # which imports, derives and compiles
    began = time.perf_counter()
    run = ht.propagate(scene, progress=heard.append)
    whole, spent = time.perf_counter() - began, run.statistics
    assert len(run.events) == 121
    assert spent.integrate_s > 0.7 * (whole - spent.compile_s - spent.derive_s)
    assert heard == sorted(heard)
    assert 0.5 <= heard[-1] <= 1


def test_steppers_of_two_tops_may_take_turns():
    scene, taylor = ht.load_scene("sicm-kicked"), method("taylor-axis")
    other = replace(scene, start=ht.State(1, phidot=1, psidot=3))

    def after_two(scene, between=lambda: None):
        stepper = set_up(scene, taylor).stepper
        at = stepper.block(stepper.begin())
        between()
        return stepper.block(at)

    assert after_two(scene, lambda: after_two(other)) == after_two(scene)
