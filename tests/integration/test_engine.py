"""Time in a unit of the top's own: fast and slow tops keep the digits of ordinary ones."""

import math
from itertools import product

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.euler_poisson import axis_form
from heavytop.equations.registry import FORMULATIONS
from heavytop.integration import engine, system
from heavytop.integration.system import FASTEST_PACE, SLOWEST_PACE, paces_of

from ..processes import begin, surroundings
from ..trajectories import angles_of

ROUNDING = 2.0**-53
UNIT = ht.Top(1, 1, 1)


def scene(start, periods, top=UNIT, **wants):
    wants = {"quantities": ("axis",), "events": (), "samples": 2} | wants
    return ht.Scene(top, start, periods=periods, **wants)


def kicked(spin, periods="99.618", **wants):
    return scene(ht.State("0.5", thetadot=1, phidot=-1, omega3=spin), periods, **wants)


RUNS = [*product(("axis", "attitude"), (False, True), (12,)), ("auto", False, 15)]


@pytest.mark.parametrize(("formulation", "projected", "digits"), RUNS)
@pytest.mark.parametrize("spin", ["1e4", "1e8", "1e14"])
def test_a_fast_kicked_top_keeps_its_axis(spin, formulation, projected, digits):
    """A hundred periods; the largest state is the spin, the axis is of the size of one."""
    run = ht.propagate(kicked(spin, digits=digits), formulation=formulation, projected=projected)
    errors = ht.run_errors(run)
    assert run.in_doubles == (digits == 12)
    for error in (errors.axis, errors.rates / float(spin), errors.invariants["p_psi"]):
        assert error < {12: 100 * ROUNDING, 15: 1e-17}[digits]


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
@pytest.mark.parametrize(("spin", "least", "most"), [("1e6", 1e-11, 1e-10), ("1e8", 1e-9, 1e-8)])
def test_one_number_for_all_states_would_lose_it(spin, least, most, monkeypatch):
    """The same steps, with time in seconds: a claim of docs/precision.md."""
    monkeypatch.setattr(system, "FASTEST_PACE", math.inf)
    assert least < ht.run_errors(ht.propagate(kicked(spin), formulation="axis")).axis < most


@pytest.mark.parametrize("spin", ["1e4", "1e8", "1e12"])
def test_a_projection_moves_each_state_by_its_own_rounding(spin):
    """Gravity that rivals the spin: put right by the axis alone, l.e would spoil it."""
    start = ht.State(theta="1.9937", phidot=f"1.5*{spin}", psidot=f"-{spin}")
    wanted = scene(start, "50.3", ht.Top(1, "1.9", f"0.1*{spin}"))
    run = ht.propagate(wanted, formulation="axis", projected=True)
    assert ht.run_errors(run).axis < 1000 * ROUNDING


def test_many_tops_each_with_a_unit_of_its_own():
    spins = np.array([3.0, 1e5, 1e9, 20.0, 1e13])
    given = {"theta": 0.5, "thetadot": 1.0, "phidot": -1.0}
    motions = [ht.Motion(UNIT, ht.State(**given, omega3=float(w))) for w in spins]
    ends, slow = np.array([40.618 * motion.period for motion in motions]), spins < 100
    given |= {"A": 1.0, "C": 1.0, "gMR": 1.0}
    many = ht.propagate_many(**given, omega3=spins, time=ends, events=("turning",))
    assert many.count("turning").tolist() == [81] * 5
    exact = [motion.at(float(end), digits=30) for motion, end in zip(motions, ends, strict=True)]
    off = np.linalg.norm(many.final.axis - np.array([at.axis for at in exact], float), axis=1)
    assert (off < np.where(slow, 1e-12, 40 * ROUNDING)).all()
    off = np.abs(many.final.thetadot - np.array([at.thetadot for at in exact], float))
    assert (off < np.where(slow, 1e-11, 40 * ROUNDING * spins)).all()


# --- paces ---------------------------------------------------------------------------------------


def pace_of(*rates):
    return float(paces_of(axis_form(), np.array([0, 0, 1, *rates]), {"g": 0.0}))


def test_paces_are_powers_of_two_and_one_for_ordinary_tops():
    rates = np.logspace(-300, 300, 401)
    found = np.array([pace_of(rate, -rate / 3) for rate in rates.tolist()])
    ordinary = (rates >= SLOWEST_PACE) & (rates <= FASTEST_PACE)
    size = (rates / found)[~ordinary & (rates > 1e-150) & (rates < 1e150)]
    assert (np.frexp(found)[0] == 0.5).all()
    assert (found[ordinary] == 1).all()
    assert 0.5 <= size.min() <= size.max() < 1
    states = np.stack((rates, rates, rates, rates, -rates / 3), axis=-1)
    assert np.array_equal(paces_of(axis_form(), states, {"g": np.zeros(401)}), found)
    assert [pace_of(odd, odd) for odd in (math.nan, math.inf, 0.0)] == [1, 1, 1]


@pytest.mark.parametrize("rate", ["1e-110", "1e110"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_nothing_overflows_or_vanishes(rate, formulation):
    """Times, constants and states as far from one as tops come, in the unit of time of each."""
    start = ht.State(theta="0.5", thetadot=rate, phidot=f"-{rate}", omega3=f"3*{rate}")
    angles = angles_of(formulation)
    wants = {"quantities": angles, "events": ("turning",), "samples": 7}
    for g in (f"{rate}*{rate}", "1e-230"):
        wanted = ht.Scene(ht.Top(1, 1, g), start, time=f"20.618/{rate}", **wants)
        errors = ht.run_errors(ht.propagate(wanted, formulation=formulation))
        assert errors.theta < 1e-13
        assert all(getattr(errors, angle) < 1e-12 for angle in angles)


# --- events --------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", ["auto", "axis", "attitude", "subsystem", "lagrange"])
@pytest.mark.parametrize("power", [5, 7])
def test_a_dropped_fast_top_misses_no_turning_point(power, formulation):
    """Its first step reaches beyond half a period, and begins exactly on a turning point."""
    start, events = ht.State(theta="0.5", psidot=f"1e{power}"), ("turning", "reversal", "cusp")
    wanted = scene(start, "2.618", ht.Top(1, "0.5", 1), events=events, digits=13 - power)
    found = ht.propagate(wanted, formulation=formulation).events
    assert [found.count(event) for event in events] == [6, 0, 3]


# --- what is compiled ----------------------------------------------------------------------------


BEFORE = "import heyoka as hy; hy.llvm_state.set_diskcache_limit(12345); "
LIMIT = "import heavytop.integration.engine as e; print(e.hy.llvm_state.get_diskcache_limit())"


@pytest.mark.parametrize(("before", "bytes_"), [("", 256 * 2**20), (BEFORE, 12345)])
def test_what_is_compiled_has_a_bound_unless_the_user_set_one(before, bytes_, tmp_path):
    process = begin("-c", before + LIMIT, env=surroundings(HEYOKA_CACHE_DIR=str(tmp_path)))
    assert int(process.communicate()[0]) == bytes_


def test_threads_change_no_bit_of_a_step(monkeypatch):
    """The products of a step in many digits are shared out; each is one thread's alone."""
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=160", "span.time=0.1"]))
    form, start = run.orbit.integrator.formulation, run.orbit.checkpoints[0].state
    ends = []
    for least in (run.bits, math.inf):
        monkeypatch.setattr(engine, "PARALLEL_BITS", least)
        alone = engine.Engine(form, (), 0.0, run.bits)
        alone.load(run.orbit.parameters)
        ends.append(alone.leg(start, 2, 1.0).state)
    assert run.bits >= 512
    assert (ends[0] == ends[1]).all()


@pytest.mark.parametrize("changes", [["span.periods=1000"], ["want.digits=310", "span.time=1"]])
def test_no_step_is_taken_twice(changes, monkeypatch):
    """Samples far ahead are left out of a block, but none that it reaches."""
    taken, step = [], engine.Engine._step

    def counted(self, *given, **how):
        found = step(self, *given, **how)
        taken.append(found[3])
        return found

    monkeypatch.setattr(engine.Engine, "_step", counted)
    run = ht.propagate(ht.load_scene("sicm-kicked", changes), formulation="axis")
    assert sum(taken) == run.statistics.steps
