"""Time in a unit of the top's own: fast and slow tops keep the digits of ordinary ones."""

import math
import warnings

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.euler_poisson import axis_form
from heavytop.integration import compiled as paces
from heavytop.integration.compiled import FAST, SLOW, Compiled, in_units, paces_of
from heavytop.integration.integrator import continued, not_begun
from heavytop.run.planning import plan
from heavytop.run.propagation import binary_start, integrator_of

ROUNDING = 2.0**-53
UNIT = ht.Top(1, 1, 1)


def scene(start, periods, top=UNIT, **wants):
    wants = {"quantities": ("axis",), "events": (), "samples": 2} | wants
    return ht.Scene(top, start, periods=periods, **wants)


def kicked(spin, periods="99.618", **wants):
    return scene(ht.State("0.5", thetadot=1, phidot=-1, omega3=spin), periods, **wants)


def exact_end(run):
    """The closed form at the very time at which a run ended."""
    end = str(run.decimals.samples[-1].t) if run.decimals else run.orbit.end
    return ht.Motion(run.scene.top, run.scene.start).at(end, digits=30)


def axis_error(run):
    return math.dist(run.samples.axis[-1], map(float, exact_end(run).axis))


@pytest.mark.parametrize("projected", [False, True])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("spin", ["1e4", "1e8", "1e14"])
def test_a_fast_kicked_top_keeps_its_axis(spin, formulation, projected):
    """A hundred periods; the largest state is the spin, the axis is of the size of one."""
    run = ht.propagate(kicked(spin), formulation=formulation, projected=projected)
    exact, rounded = exact_end(run), 100 * ROUNDING * float(spin)
    assert axis_error(run) < 100 * ROUNDING
    assert abs(run.samples.thetadot[-1] - float(exact.thetadot)) < rounded
    assert abs(run.samples.psidot[-1] - float(exact.psidot)) < rounded
    assert abs(np.diff(run.invariants["p_psi"])[0]) < rounded


@pytest.mark.parametrize(("spin", "least", "most"), [("1e6", 1e-11, 1e-10), ("1e8", 1e-9, 1e-8)])
def test_one_number_for_all_states_would_lose_it(spin, least, most, monkeypatch):
    """The same steps, with time in seconds: the claim of the table in the docs."""
    monkeypatch.setattr(paces, "FAST", math.inf)
    wanted = kicked(spin)
    chosen = plan(wanted, "axis")
    parameters, start = binary_start(wanted, chosen)
    motion = ht.Motion(wanted.top, wanted.start)
    end = 99.618 * motion.period
    engine = integrator_of(chosen, parameters, start)
    orbit = continued(not_begun(engine, start), np.array([end]))
    exact = map(float, motion.at(end, digits=30).axis)
    assert least < math.dist(orbit.samples.states[-1, :3], exact) < most


@pytest.mark.parametrize("spin", ["1e4", "1e8", "1e12"])
def test_a_projection_moves_each_state_by_its_own_rounding(spin):
    """Gravity that rivals the spin: put right by the axis alone, l.e would spoil it."""
    start = ht.State(theta="1.9937", phidot=f"1.5*{spin}", psidot=f"-{spin}")
    wanted = scene(start, "50.3", ht.Top(1, "1.9", f"0.1*{spin}"))
    assert axis_error(ht.propagate(wanted, formulation="axis", projected=True)) < 1000 * ROUNDING


@pytest.mark.parametrize("pace", ["1e-4", "1e-13", "1e5", "1e13"])
def test_time_may_be_measured_in_anything(pace):
    """The same motion in another unit of time has the same error, to its luck."""
    start = ht.State(theta="0.5", thetadot=pace, phidot=f"-{pace}", omega3=f"3*{pace}")
    run = ht.propagate(scene(start, "40.618", ht.Top(1, 1, f"{pace}*{pace}")), formulation="axis")
    assert axis_error(run) < 3e-13


def test_a_top_kicked_by_as_much_as_it_spins_has_no_rate_at_a_turning_point():
    """The cubic form starts with wdot = 0, and is soon at 1e9: else it would take 287 steps."""
    start = ht.State(theta="0.5", phidot="-1e9", omega3="1e9")
    run = ht.propagate(scene(start, "20.618", quantities=("theta",)), formulation="cubic")
    assert abs(run.samples.theta[-1] - float(exact_end(run).theta)) < 1e-13
    assert run.statistics.steps < 200


@pytest.mark.parametrize("spin", ["1e8", "1e12"])
def test_more_digits_than_doubles_have(spin):
    """Long doubles, whose last digits a large spin would take as well."""
    run = ht.propagate(kicked(spin, "9.618", digits=15))
    assert run.plan.precision != "double"
    last, exact = run.decimals.samples[-1], exact_end(run)
    assert all(abs(x - y) < 1e-17 for x, y in zip(last.axis, exact.axis, strict=True))


def test_long_doubles_are_held_against_states_of_the_size_of_one():
    """Kicked as it spins: psi, by quadrature, lost more in long doubles than it does in doubles."""
    start = ht.State(theta="0.236", thetadot="267968713548", psidot="-226975346817")
    angles = ("axis", "theta", "phi", "psi")
    run = ht.propagate(scene(start, "-251.967", ht.Top(1, 2, -1), quantities=angles, digits=12))
    assert run.plan.precision == "long double"
    last, exact = run.decimals.samples[-1], exact_end(run)
    assert abs(last.psi - exact.psi) < 1e-15 * abs(exact.psi)
    assert all(abs(x - y) < 1e-15 for x, y in zip(last.axis, exact.axis, strict=True))


def test_a_long_run_is_not_said_to_be_better_than_it_is():
    """A hundred thousand periods: nothing is late, but the motion has turned away."""
    wanted = kicked("1e10", "99999.618", quantities=("axis", "phi"))
    run = ht.propagate(wanted, formulation="axis")
    assert 1e-15 < axis_error(run) < run.plan.estimate.error < 1e-12


def test_many_tops_each_with_a_unit_of_its_own():
    spins = np.array([3.0, 1e5, 1e9, 20.0, 1e13])
    given = {"theta": 0.5, "thetadot": 1.0, "phidot": -1.0}
    motions = [ht.Motion(UNIT, ht.State(**given, omega3=float(w))) for w in spins]
    ends = np.array([40.618 * motion.period for motion in motions])
    given |= {"A": 1.0, "C": 1.0, "gMR": 1.0}
    many = ht.propagate_many(**given, omega3=spins, time=ends, events=("turning",), states=True)
    plain = ht.propagate_many(**given, omega3=spins, time=ends)
    for i, spin in enumerate(spins):
        exact = motions[i].at(float(ends[i]), digits=30)
        for found in (many, plain):
            error = math.dist(found.final.axis[i], map(float, exact.axis))
            assert error < (1e-12 if spin < 100 else 40 * ROUNDING)
            off = abs(found.final.thetadot[i] - float(exact.thetadot))
            assert off < (1e-11 if spin < 100 else 40 * ROUNDING * spin)
        assert many.count("turning")[i] == 81
        if spin > 100:  # the tilt hardly changes
            assert np.allclose(many.met.theta[many.zeros.which == i], 0.5, atol=1e-4)
    ordinary = spins < 100
    alone = ht.propagate_many(**given, omega3=spins[ordinary], time=ends[ordinary])
    assert np.array_equal(plain.states[ordinary], alone.states)


# --- paces ---------------------------------------------------------------------------------------


def pace_of(*rates):
    return float(paces_of(axis_form(), np.array([0, 0, 1, *rates]), {"g": 0.0}))


def test_paces_are_powers_of_two_and_one_for_ordinary_tops():
    rates = np.logspace(-300, 300, 401)
    found = [pace_of(rate, -rate / 3) for rate in rates.tolist()]
    for rate, pace in zip(rates, found, strict=True):
        assert math.frexp(pace)[0] == 0.5
        if SLOW <= rate <= FAST:
            assert pace == 1
        elif 1e-150 < rate < 1e150:
            assert 0.5 <= rate / pace < 1
    states = np.stack((rates, rates, rates, rates, -rates / 3), axis=-1)
    assert np.array_equal(paces_of(axis_form(), states, {"g": np.zeros(401)}), found)
    assert [pace_of(odd, odd) for odd in (math.nan, math.inf, 0.0)] == [1, 1, 1]


@pytest.mark.parametrize("formulation", ["axis", "attitude", "cubic", "subsystem", "routh"])
def test_powers_of_two_change_nothing_but_the_step(formulation):
    """One step of a given length, in units of time from 2^-9 to 2^9 s."""
    wanted = ht.load_scene("sicm-kicked", ['want.quantities=["theta"]'])
    chosen = plan(wanted, formulation)
    form = chosen.equations
    parameters, start = binary_start(wanted, chosen)
    compiled = Compiled(form, ("turning",), 2.0**-52)
    ends = []
    for pace in (1.0, 2.0**-9, 2.0**9, 2.0**3):
        units = np.where(form.is_rate, pace, 1.0)
        compiled.load(in_units(pace, parameters))
        state = start.state[: len(form.states)] / units
        ends.append(compiled.block(state, 1, 1e9, longest=1e-3 * pace).state * units)
    first, *others = ends
    for end in others:  # the order of a series is the same, and so is its sum at the same time
        assert np.allclose(end, first, rtol=4 * ROUNDING, atol=0)
    assert any(np.array_equal(end, first) for end in others)


@pytest.mark.parametrize("rate", ["1e-110", "1e110"])
@pytest.mark.parametrize("formulation", ["axis", "attitude", "cubic", "routh"])
def test_nothing_overflows_or_vanishes(rate, formulation):
    """Times, constants and states as far from one as tops come."""
    start = ht.State(theta="0.5", thetadot=rate, phidot=f"-{rate}", omega3=f"3*{rate}")
    wants = {"quantities": ("theta",), "events": ("turning",), "samples": 7}
    for g in (f"{rate}*{rate}", "1e-230"):
        wanted = ht.Scene(ht.Top(1, 1, g), start, time=f"20.618/{rate}", **wants)
        run = ht.propagate(wanted, formulation=formulation)
        motion = ht.Motion(wanted.top, start)
        for t, theta in zip(run.t.tolist(), run.samples.theta.tolist(), strict=True):
            assert abs(float(motion.at(t, digits=30).theta) - theta) < 1e-13


@pytest.mark.parametrize("spin", ["1e6", "250", "260"])
@pytest.mark.parametrize("projected", [False, True])
def test_neither_samples_nor_splitting_change_a_bit(spin, projected):
    """Also where the pace of some blocks is within the ordinary and of others is not."""
    whole, sampled = (
        ht.propagate(
            kicked(spin, "400.618", events=("turning",), quantities=quantities),
            formulation="axis",
            projected=projected,
        ).orbit
        for quantities in (("axis",), ("axis", "phi"))
    )
    assert np.array_equal(whole.samples.states[-1, :5], sampled.samples.states[-1, :5])
    begun = not_begun(whole.integrator, whole.checkpoints[0])
    part = continued(begun, np.array([whole.end / 3]))
    rest = continued(part, np.array([whole.end]))
    assert np.array_equal(rest.samples.states[-1], whole.samples.states[-1])
    assert np.array_equal(rest.hits[0].t, whole.hits[0].t)
    assert np.array_equal(rest.hits[0].states, whole.hits[0].states)
    assert np.array_equal(whole.at(np.array([whole.end / 3])).states, part.samples.states)


def test_time_of_an_ordinary_top_is_in_seconds():
    assert ht.propagate(ht.load_scene("sicm-kicked")).orbit.integrator.pace == 1
    assert ht.propagate(kicked("1e3")).orbit.integrator.pace == 512


# --- events --------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["auto", "axis", "attitude", "subsystem", "lagrange"])
@pytest.mark.parametrize("power", [5, 7])
def test_a_dropped_fast_top_misses_no_turning_point(power, formulation):
    """Its first step reaches beyond half a period, and begins exactly on a turning point."""
    start, events = ht.State(theta="0.5", psidot=f"1e{power}"), ("turning", "reversal", "cusp")
    wanted = scene(start, "2.618", ht.Top(1, "0.5", 1), events=events, digits=10)
    found = ht.propagate(wanted, formulation=formulation).events
    assert [found.count(event) for event in events] == [6, 0, 3]


@pytest.mark.parametrize("spin", ["1e5", "1e8", "1e12"])
def test_events_come_back_in_true_units_at_true_times(spin):
    run = ht.propagate(kicked(spin, "10.618", events=("turning", "reversal")))
    motion = ht.Motion(run.scene.top, run.scene.start)
    assert run.events.count("turning") == 21
    for t, theta in zip(run.events.t, run.events.theta, strict=True):
        assert abs(float(motion.at(float(t), digits=30).theta) - theta) < 1e-14
    halves = np.diff(run.events.t[run.events.is_turning]) / motion.period
    assert np.allclose(halves, 0.5, atol=2 / float(spin) + 1e-16 * float(spin))


RANDOM = np.random.default_rng(17)


@pytest.mark.parametrize("draw", range(16))
def test_auto_is_never_silently_wrong(draw):
    """Kicked tops of paces from 1e-6 to 1e14, 2.6 to 400 periods."""
    spin = 10 ** RANDOM.uniform(-6, 14)
    pace = float(RANDOM.choice([min(spin, 1.0), spin]))
    g = min(spin, 1.0) ** 2 * float(RANDOM.choice([1.0, -1.0, 100.0]))
    start = ht.State(
        theta=RANDOM.uniform(0.05, 3), thetadot=pace * RANDOM.uniform(-2, 2),
        phidot=pace * RANDOM.uniform(-2, 2), omega3=spin,
    )  # fmt: skip
    top = ht.Top(1, float(RANDOM.choice([0.2, 1.0, 1.9])), g)
    periods = str(round(10 ** RANDOM.uniform(0.4, 2.6), 3))
    wanted = scene(start, periods, top, events=(("turning",), ())[draw % 2], digits=12)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        run = ht.propagate(wanted)
    error = axis_error(run)
    assert error < 1e-12 or said
    assert error < 100 * run.plan.estimate.error or said
