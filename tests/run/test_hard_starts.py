"""Starts and times where accuracy tests do not look: symmetric, at a pole, exactly on an event."""

import threading
from decimal import Decimal

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import NotANumber
from heavytop.integration.integrator import Checkpoint
from heavytop.integration.outputs import invariants

from ..motions import BOOK

UNIT = ht.Top(A=1, C=1, gMR=1)


def run(start, top=UNIT, formulation="auto", quantities=("theta", "phi"), seconds=20):
    scene = ht.Scene(
        top,
        start,
        time=seconds,
        quantities=quantities,
        events=("turning", "reversal", "cusp"),
    )
    return ht.propagate(scene, formulation=formulation)


@pytest.mark.parametrize(
    ("formulation", "quantities"), [("axis", ("theta", "phi", "psi")), ("cubic", ("theta",))]
)
def test_a_start_whose_taylor_coefficients_vanish(formulation, quantities):
    """Let go from rest at pi/2, three of four coefficients are zero, and the last two with them."""
    swing = run(ht.State(theta="pi/2"), formulation=formulation, quantities=quantities)
    errors = ht.run_errors(swing)
    assert errors.theta < 1e-13
    assert errors.energy < 1e-14
    assert swing.events.count("turning") == 11
    assert swing.events.count("reversal") == 0  # phidot is zero throughout, and reverses nowhere


@pytest.mark.parametrize("formulation", ["lagrange", "routh", "subsystem"])
def test_a_form_with_poles_says_that_it_met_one(formulation):
    with pytest.raises(ht.EndedEarly) as early:
        run(ht.State(theta=2, thetadot=3), formulation=formulation)
    assert early.value.outcome == "singular"


def test_at_rest_without_gravity():
    still = run(ht.State(theta="0.1"), top=ht.Top(A=1, C=1, gMR=0))
    assert still.theta[0] == 0.1  # as the scene has it; the others are those of the states
    assert np.array_equal(still.theta[1:], np.full(400, still.theta[1]))
    assert ht.run_errors(still).theta < 1e-15


def test_force_free_precession_has_its_errors():
    spinning = run(ht.State(theta="0.5", psidot=3), top=ht.Top(A=1, C=1, gMR=0))
    errors = ht.run_errors(spinning)
    assert errors.why_not == ""
    assert errors.axis < 1e-14


@pytest.mark.parametrize("theta", ["pi/3", "2*pi/3"])
def test_turns_at_a_pole_are_no_error(theta):
    sign = 1 if theta == "2*pi/3" else -1
    start = ht.State(theta=theta, thetadot=2 * sign, phidot=-2, omega3=3 * sign)
    through = run(start, quantities=("theta", "phi", "psi"))
    errors = ht.run_errors(through)
    assert max(errors.phi, errors.psi, errors.axis, errors.input_rounding) < 1e-12
    assert through.events.count("reversal") == 0


def test_rates_on_the_vertical_are_numbers():
    end = run(ht.State(theta=0, psidot=3))(7.0)
    assert (end.thetadot, end.phidot, end.psidot) == (0, 0, 3)


def test_times_that_are_no_numbers():
    start = ht.State(theta=1)
    with pytest.raises(ht.HeavyTopError):
        ht.Motion(UNIT, start).at(float("nan"))
    assert run(start)([]).theta.size == 0
    for t in (float("nan"), [0.0, float("inf")], "x", object(), [[1.0]], None, [1, "a"]):
        with pytest.raises(ValueError, match="t: a finite time or a one-dimensional array"):
            run(start)(t)


def test_threads_do_not_share_an_integrator():
    trajectories = [run(ht.State(theta=1, psidot=k)) for k in (1, 5)]
    t = np.linspace(0, 20, 50)
    expected = [trajectory(t).states for trajectory in trajectories]
    failures = []

    def ask(index):
        answers = [trajectories[index](t).states for _ in range(40)]
        failures.extend(a for a in answers if not np.array_equal(a, expected[index]))

    threads = [threading.Thread(target=ask, args=(k % 2,)) for k in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=300)
        assert not thread.is_alive()
    assert failures == []


def test_what_is_no_file_of_a_run_is_foreign(tmp_path):
    """Damage within one is looked for by ``tests/test_hdf5.py``."""
    run(ht.State(theta=1)).save(tmp_path / "whole.nc")
    data = (tmp_path / "whole.nc").read_bytes()
    (tmp_path / "cut.nc").write_bytes(data[: len(data) // 2])
    for name in ("nowhere.nc", "http://localhost/x.nc", tmp_path / "cut.nc"):
        with pytest.raises(ht.ForeignFile):
            ht.load_trajectory(name)


# --- low words of time, the scale of an energy error, rounded starts ----------------------------


def test_times_within_a_block_keep_the_low_word_of_its_start():
    start = Checkpoint((1e5, 3e-12), np.zeros(5), 0)
    assert start.local(np.array([1e5 + 1.0]))[0] == 1.0 - 3e-12


@pytest.mark.parametrize("formulation", ["axis", "attitude", "cubic"])
def test_the_motion_can_be_asked_for_where_a_block_starts(formulation):
    """To a double the time of a checkpoint may be just before it."""
    wants = ["span.periods=700", "want.digits=9", 'want.quantities=["theta"]']
    scene = ht.load_scene("sicm-kicked", wants)
    run = ht.propagate(scene, formulation=formulation)
    checkpoints = run.orbit.checkpoints
    assert any(c.time[1] > 0 for c in checkpoints)
    there = run.orbit.at(np.array([c.time[0] for c in checkpoints]))
    for row, checkpoint in zip(there.states, checkpoints, strict=True):
        assert np.max(np.abs(row - checkpoint.state)) < 1e-12


@pytest.mark.parametrize("formulation", ["axis", "lagrange", "routh", "subsystem"])
def test_energy_error_is_that_of_kinetic_and_potential_energy(formulation):
    """E' = A (thetadot^2 + phidot^2 sin^2)/2 + gMR cos(theta), relative to max(|E'|, gMR)."""
    scene = ht.load_scene("sicm-kicked", overrides=["span.time=40", "want.samples=4001"])
    run = ht.propagate(scene, formulation=formulation)
    A, gMR = float(scene.top.A), float(scene.top.gMR)
    s = run.samples
    kinetic = A * (s.thetadot**2 + (s.phidot * np.sin(s.theta)) ** 2) / 2
    energy = kinetic + gMR * np.cos(s.theta)
    expected = np.max(np.abs(energy - energy[0])) / max(abs(energy[0]), gMR)
    found = ht.run_errors(run).energy
    assert 1e-16 < found < 1e-12
    assert abs(found - expected) < 0.5 * expected + 1e-14  # rounding of what is summed here


@pytest.mark.parametrize("seed", range(25))
def test_a_start_exactly_on_an_event_counts_however_it_is_rounded(seed):
    source = np.random.default_rng(seed)
    start = ht.State(theta=source.uniform(0.2, 2), phi=source.uniform(-3, 3), psidot=20)
    scene = ht.Scene(
        ht.Top(A=1, C="0.5", gMR=1),
        start,
        periods=3,
        quantities=("theta",),
        events=("turning", "reversal", "cusp"),
    )
    events = ht.propagate(scene).events
    assert (events.count("turning"), events.count("reversal"), events.count("cusp")) == (7, 0, 4)
    assert events.t[0] == 0


@pytest.mark.parametrize("formulation", ["auto", "axis", "attitude"])
def test_more_bits_than_a_double_counts_are_too_many(formulation):
    scene = ht.load_scene("planar-asymptotic", ["span.time=1e290", "want.digits=18"])
    with pytest.raises(ht.BadScene, match="bits"):
        ht.plan(scene, formulation)


@pytest.mark.slow
def test_numbers_beyond_all_bits_are_refused_at_once():
    with pytest.raises(ht.BadScene, match="more than 4096 bits"):
        ht.fold(ht.Scene(BOOK, ht.State("1e-300", phidot=1), time="0.01"))
    with pytest.raises(NotANumber, match="magnitude"):
        ht.fold(ht.load_scene("sicm-kicked"))(Decimal("1e-99999999"))


# --- what is asked of a run ----------------------------------------------------------------------


@pytest.fixture(scope="module")
def kicked():
    return ht.propagate(ht.load_scene("sicm-kicked"))


def test_events_of_one_kind(kicked):
    reversals = kicked.events.of("reversal")
    kinds = np.array(kicked.events.kind)
    assert len(reversals) == kicked.events.count("reversal") > 0
    assert np.array_equal(reversals.t, kicked.events.t[kinds == "reversal"])
    assert np.array_equal(kicked(reversals.t).states.shape, reversals.states.shape)
    assert len(kicked.events.of("turning")) == kicked.events.count("turning")
    assert set(kicked.events.of("theta_min").kind) == {"theta_min"}
    with pytest.raises(ValueError, match="kind: one of theta_min"):
        kicked.events.of("reversals")


def test_invariants_are_in_the_units_that_they_say(kicked):
    constants = kicked.motion.constants.floats
    found = kicked.invariants
    assert float(kicked.scene.top.A) * found["energy"][0] == pytest.approx(
        constants["E_prime"], rel=1e-12
    )
    for name in {"p_phi", "p_psi"} & found.keys():
        assert float(kicked.scene.top.A) * found[name][0] == pytest.approx(
            constants[name], rel=1e-12
        )
    for told in (ht.Trajectory.invariants.__doc__, invariants.__doc__):
        assert "p_psi/A" in told.replace("``", "")


def test_a_constant_is_formatted_as_a_float_is_and_shows_more_digits(kicked):
    E = kicked.motion.constants.E
    for spec in (".4f", "", ">12.3e", ".6g"):
        assert float(format(E, spec)) == pytest.approx(float(E), rel=1e-3)
    assert f"{E:.4f}" == f"{float(E):.4f}"
    assert str(E).startswith(f"{E:.40f}"[:40])
    assert f"{E:.40f}"[:30] != f"{float(E):.40f}"[:30]
