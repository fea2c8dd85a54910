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
KICKED = {"theta": "0.5", "thetadot": "1", "phidot": "-1"}


def kicked(spin, periods="99.618", events=(), quantities=("axis",), **more):
    start = ht.State(**(KICKED | {"omega3": spin}))
    return ht.Scene(
        ht.Top(1, 1, 1), start, periods=periods, quantities=quantities, events=events,
        samples=2, **more,
    )  # fmt: skip


def slow(pace):
    """A top as slow as that: the kicked one in another unit of time."""
    g = f"{pace}*{pace}"
    start = ht.State(theta="0.5", thetadot=pace, phidot=f"-{pace}", omega3=f"3*{pace}")
    return ht.Scene(
        ht.Top(1, 1, g), start, periods="40.618", quantities=("axis",), events=(), samples=2
    )


def exact_end(run):
    """The closed form at the very time at which a run ended."""
    end = str(run.decimals.samples[-1].t) if run.decimals else run.orbit.end
    return ht.Motion(run.scene.top, run.scene.start).at(end, digits=30)


def axis_error(run):
    return math.dist(run.samples.axis[-1], map(float, exact_end(run).axis))


@pytest.mark.parametrize("projected", [False, True])
@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("spin", ["1e4", "1e6", "1e8", "1e11", "1e14"])
def test_a_fast_kicked_top_keeps_its_axis(spin, formulation, projected):
    """A hundred periods; the largest state is the spin, the axis is of the size of one."""
    run = ht.propagate(kicked(spin), formulation=formulation, projected=projected)
    assert axis_error(run) < 100 * ROUNDING
    exact = exact_end(run)
    rounded = 100 * ROUNDING * float(spin)
    assert abs(run.samples.thetadot[-1] - float(exact.thetadot)) < rounded
    assert abs(run.samples.psidot[-1] - float(exact.psidot)) < rounded
    length = run.invariants["p_psi"]
    assert abs(length[-1] - length[0]) < rounded


@pytest.mark.parametrize(("spin", "least", "most"), [("1e6", 1e-11, 1e-10), ("1e8", 1e-9, 1e-8)])
def test_one_number_for_all_states_would_lose_it(spin, least, most, monkeypatch):
    """The same steps, with time in seconds: the claim of the table in the docs."""
    monkeypatch.setattr(paces, "FAST", math.inf)
    scene = kicked(spin)
    chosen = plan(scene, "axis")
    parameters, start = binary_start(scene, chosen)
    end = 99.618 * ht.Motion(scene.top, scene.start).period
    engine = integrator_of(chosen, parameters, start)
    orbit = continued(not_begun(engine, start), np.array([end]))
    exact = ht.Motion(scene.top, scene.start).at(end, digits=30)
    error = math.dist(orbit.samples.states[-1, :3], [float(x) for x in exact.axis])
    assert least < error < most


@pytest.mark.parametrize("spin", ["1e4", "1e8", "1e12"])
def test_a_projection_moves_each_state_by_its_own_rounding(spin):
    """Gravity that rivals the spin: put right by the axis alone, l.e would spoil it."""
    start = ht.State(theta="1.9937", phidot=f"1.5*{spin}", psidot=f"-{spin}")
    top = ht.Top(1, "1.9", f"0.1*{spin}")
    scene = ht.Scene(top, start, periods="50.3", quantities=("axis",), events=(), samples=2)
    run = ht.propagate(scene, formulation="axis", projected=True)
    assert axis_error(run) < 1000 * ROUNDING


@pytest.mark.parametrize("pace", ["1e-4", "1e-9", "1e-13", "1e5", "1e13"])
def test_time_may_be_measured_in_anything(pace):
    """The same motion in another unit of time has the same error, to its luck."""
    run = ht.propagate(slow(pace), formulation="axis")
    assert axis_error(run) < 3e-13


def test_a_top_kicked_by_as_much_as_it_spins_has_no_rate_at_a_turning_point():
    """The cubic form starts with wdot = 0, and is soon at 1e9: else it would take 287 steps."""
    start = ht.State(theta="0.5", phidot="-1e9", omega3="1e9")
    scene = ht.Scene(
        ht.Top(1, 1, 1), start, periods="20.618", quantities=("theta",), events=(), samples=2
    )
    run = ht.propagate(scene, formulation="cubic")
    assert abs(run.samples.theta[-1] - float(exact_end(run).theta)) < 1e-13
    assert run.statistics.steps < 200


@pytest.mark.parametrize("spin", ["1e8", "1e12"])
def test_more_digits_than_doubles_have(spin):
    """Long doubles, whose last digits a large spin would take as well."""
    scene = kicked(spin, periods="9.618", digits=15)
    run = ht.propagate(scene)
    assert run.plan.precision != "double"
    last, exact = run.decimals.samples[-1], exact_end(run)
    assert all(abs(x - y) < 1e-17 for x, y in zip(last.axis, exact.axis, strict=True))


def test_long_doubles_are_held_against_states_of_the_size_of_one():
    """Kicked as it spins: psi, by quadrature, lost more in long doubles than it does in doubles."""
    start = ht.State(theta="0.236", thetadot="267968713548", psidot="-226975346817")
    scene = ht.Scene(
        ht.Top(1, 2, -1), start, periods="-251.967",
        quantities=("axis", "theta", "phi", "psi"), events=(), samples=2, digits=12,
    )  # fmt: skip
    run = ht.propagate(scene)
    assert run.plan.precision == "long double"
    last, exact = run.decimals.samples[-1], exact_end(run)
    assert abs(last.psi - exact.psi) < 1e-15 * abs(exact.psi)
    assert all(abs(x - y) < 1e-15 for x, y in zip(last.axis, exact.axis, strict=True))


def test_a_long_run_is_not_said_to_be_better_than_it_is():
    """A hundred thousand periods: nothing is late, but the motion has turned away."""
    run = ht.propagate(kicked("1e10", "99999.618", quantities=("axis", "phi")), formulation="axis")
    assert 1e-15 < axis_error(run) < run.plan.estimate.error < 1e-12


def test_many_tops_each_with_a_unit_of_its_own():
    spins = np.array([3.0, 1e5, 1e9, 20.0, 1e13])
    ends = np.array([40.618 * ht.Motion(*_pair(w)).period for w in spins])
    given = {"A": 1.0, "C": 1.0, "gMR": 1.0, "theta": 0.5, "thetadot": 1.0, "phidot": -1.0}
    many = ht.propagate_many(**given, omega3=spins, time=ends, events=("turning",))
    plain = ht.propagate_many(**given, omega3=spins, time=ends)
    for i, spin in enumerate(spins):
        exact = ht.Motion(*_pair(spin)).at(float(ends[i]), digits=30)
        for found in (many, plain):
            error = math.dist(found.final.axis[i], [float(x) for x in exact.axis])
            assert error < (1e-12 if spin < 100 else 40 * ROUNDING)
            off = abs(found.final.thetadot[i] - float(exact.thetadot))
            assert off < (1e-11 if spin < 100 else 40 * ROUNDING * spin)
        assert many.count("turning")[i] == 81
        l_x, l_y = many.zeros.states[many.zeros.which == i, 3:].T
        if spin > 100:  # l stands along the axis, nearly
            assert np.allclose(np.hypot(l_x, l_y) / spin, math.sin(0.5), atol=1e-4)
    ordinary = spins < 100
    alone = ht.propagate_many(**given, omega3=spins[ordinary], time=ends[ordinary])
    assert np.array_equal(plain.states[ordinary], alone.states)


def _pair(spin):
    return ht.Top(1, 1, 1), ht.State(theta=0.5, thetadot=1, phidot=-1, omega3=float(spin))


@pytest.mark.parametrize("formulation", ["axis", "attitude", "cubic", "subsystem", "routh"])
def test_powers_of_two_change_nothing_but_the_step(formulation):
    """One step of a given length, in units of time from 2^-9 to 2^9 s."""
    scene = ht.load_scene("sicm-kicked", ['want.quantities=["theta"]'])
    chosen = plan(scene, formulation)
    form = chosen.equations
    parameters, start = binary_start(scene, chosen)
    compiled = Compiled(form, ("turning",), 2.0**-52)
    ends = {}
    for pace in (1.0, 2.0**-9, 2.0**9, 2.0**3):
        units = np.where(form.is_rate, pace, 1.0)
        compiled.load(in_units(pace, parameters))
        state = start.state[: len(form.states)] / units
        step = 1e-3 * pace
        ends[pace] = compiled.block(state, 1, 1e9, longest=step).state * units
    first = ends.pop(1.0)
    for end in ends.values():
        # the order of a series is the same, and so is its sum at the same time
        assert np.allclose(end, first, rtol=4 * ROUNDING, atol=0)
    assert any(np.array_equal(end, first) for end in ends.values())


def test_paces_are_powers_of_two_and_one_for_ordinary_tops():
    for rate in np.logspace(-300, 300, 400).tolist():
        pace = pace_of(rate, -rate / 3)
        assert math.frexp(pace)[0] == 0.5
        if SLOW <= rate <= FAST:
            assert pace == 1
        elif 1e-150 < rate < 1e150:
            assert 0.5 <= rate / pace < 1


@pytest.mark.parametrize("odd", [math.nan, math.inf, 0.0])
def test_what_has_no_pace_has_none_of_its_own(odd):
    assert pace_of(odd, odd) == 1


def test_many_paces_are_those_of_each():
    rates = np.logspace(-200, 200, 41)
    states = np.stack((rates, rates, rates, rates, -rates), axis=-1)
    many = paces_of(axis_form(), states, {"g": np.zeros(41)})
    assert np.array_equal(many, [pace_of(rate, -rate) for rate in rates.tolist()])


@pytest.mark.parametrize("rate", ["1e-110", "1e110"])
@pytest.mark.parametrize("formulation", ["axis", "attitude", "cubic", "routh"])
def test_nothing_overflows_or_vanishes(rate, formulation):
    """Times, constants and states as far from one as tops come."""
    start = ht.State(theta="0.5", thetadot=rate, phidot=f"-{rate}", omega3=f"3*{rate}")
    for g in (f"{rate}*{rate}", "1e-230"):
        scene = ht.Scene(
            ht.Top(1, 1, g), start, time=f"20.618/{rate}", quantities=("theta",),
            events=("turning",), samples=7,
        )  # fmt: skip
        run = ht.propagate(scene, formulation=formulation)
        motion = ht.Motion(scene.top, scene.start)
        for t, theta in zip(run.t.tolist(), run.samples.theta.tolist(), strict=True):
            assert abs(float(motion.at(t, digits=30).theta) - theta) < 1e-13


def pace_of(*rates):
    return float(paces_of(axis_form(), np.array([0, 0, 1, *rates]), {"g": 0.0}))


@pytest.mark.parametrize("spin", ["1e6", "250", "260"])
@pytest.mark.parametrize("projected", [False, True])
def test_neither_samples_nor_splitting_change_a_bit(spin, projected):
    """Also where the pace of some blocks is within the ordinary and of others is not."""
    scene = kicked(spin, periods="400.618", events=("turning",))
    whole = ht.propagate(scene, formulation="axis", projected=projected)
    sampled = ht.propagate(
        kicked(spin, periods="400.618", events=("turning",), quantities=("axis", "phi")),
        formulation="axis", projected=projected,
    )  # fmt: skip
    orbit = whole.orbit
    assert np.array_equal(orbit.samples.states[-1, :5], sampled.orbit.samples.states[-1, :5])
    engine = orbit.integrator
    first = orbit.checkpoints[0]
    half = continued(not_begun(engine, first), np.array([orbit.end / 3]))
    rest = continued(half, np.array([orbit.end]))
    assert np.array_equal(rest.samples.states[-1], orbit.samples.states[-1])
    assert np.array_equal(rest.hits[0].t, orbit.hits[0].t)
    assert np.array_equal(rest.hits[0].states, orbit.hits[0].states)
    middle = orbit.at(np.array([orbit.end / 3]))
    assert np.array_equal(middle.states, half.samples.states)


def test_time_of_an_ordinary_top_is_in_seconds():
    assert ht.propagate(ht.load_scene("sicm-kicked")).orbit.integrator.pace == 1
    assert ht.propagate(kicked("1e3")).orbit.integrator.pace == 512


@pytest.mark.parametrize("formulation", ["auto", "axis", "attitude", "subsystem", "lagrange"])
@pytest.mark.parametrize("power", [5, 6, 7])
def test_a_dropped_fast_top_misses_no_turning_point(power, formulation):
    """Its first step reaches beyond half a period, and begins exactly on a turning point."""
    scene = ht.Scene(
        ht.Top(1, "0.5", 1), ht.State(theta="0.5", psidot=f"1e{power}"), periods="2.618",
        quantities=("axis",), events=("turning", "reversal", "cusp"), samples=2, digits=10,
    )  # fmt: skip
    events = ht.propagate(scene, formulation=formulation).events
    found = [events.count(event) for event in ("turning", "reversal", "cusp")]
    assert found == [6, 0, 3]


@pytest.mark.parametrize("spin", ["1e5", "1e8", "1e12"])
def test_events_come_back_in_true_units_at_true_times(spin):
    scene = kicked(spin, periods="10.618", events=("turning", "reversal"))
    run = ht.propagate(scene)
    motion = ht.Motion(scene.top, scene.start)
    assert run.events.count("turning") == 21
    for t, theta in zip(run.events.t, run.events.theta, strict=True):
        assert abs(float(motion.at(float(t), digits=30).theta) - theta) < 1e-14
    turning = run.events.t[run.events.is_turning]
    assert np.allclose(
        np.diff(turning) / motion.period, 0.5, atol=2 / float(spin) + 1e-16 * float(spin)
    )


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
    events = (("turning",), ())[draw % 2]
    scene = ht.Scene(
        ht.Top(1, float(RANDOM.choice([0.2, 1.0, 1.9])), g), start,
        periods=str(round(10 ** RANDOM.uniform(0.4, 2.6), 3)), quantities=("axis",),
        events=events, samples=2, digits=12,
    )  # fmt: skip
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        run = ht.propagate(scene)
    error = axis_error(run)
    assert error < 1e-12 or said
    assert error < 100 * run.plan.estimate.error or said
