"""Starts and times where accuracy tests do not look: symmetric, at a pole, exactly on an event."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht

UNIT = ht.Top(A=1, C=1, gMR=1)
EVENTS = ("turning", "reversal", "cusp")


def run(start, top=UNIT, formulation="auto", quantities=("theta", "phi"), seconds=20):
    asked = {"time": seconds, "quantities": quantities, "events": EVENTS}
    return ht.propagate(ht.Scene(top, start, **asked), formulation=formulation)


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


def test_threads_do_not_share_an_integrator():
    trajectories = [run(ht.State(theta=1, psidot=k)) for k in (1, 5)] * 3
    t = np.linspace(0, 20, 50)
    expected = [trajectory(t).states for trajectory in trajectories]

    def same(trajectory, states):
        return all(np.array_equal(trajectory(t).states, states) for _ in range(40))

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(same, trajectories, expected, timeout=300))


# --- low words of time, the scale of an energy error, rounded starts ----------------------------


@pytest.mark.parametrize("projected", [False, True])
def test_just_before_a_checkpoint_the_motion_is_not_yet_there(projected):
    """The double of its time may be before its start by what the axis moves 1e-12 in."""
    wants = {"quantities": ("axis", "phi"), "events": (), "digits": 6, "samples": 2}
    scene = replace(ht.load_scene("sicm-kicked"), time=None, periods=ht.Exact.of(30_000), **wants)
    run = ht.propagate(scene, formulation="axis", projected=projected)
    late = [c for c in run.orbit.checkpoints if c.time[1] > 3e-13]
    assert late
    there = run(np.array([c.time[0] for c in late]))
    low = np.array([c.time[1] for c in late])[:, None]
    begun = np.array([c.state[:3] for c in late])
    moved = -low * np.cross(there.omega, begun)
    off = there.axis - begun - moved
    assert np.all(np.linalg.norm(off, axis=1) < 0.3 * np.linalg.norm(moved, axis=1))


@pytest.mark.parametrize("periods", ["700", "-700"])
def test_times_about_checkpoints_each_have_a_state(periods):
    wants = [
        f"span.periods={periods}",
        "want.digits=9",
        'want.quantities=["axis"]',
        "want.events=[]",
    ]
    run = ht.propagate(ht.load_scene("sicm-kicked", wants), formulation="axis")
    t = np.array([c.time[0] for c in run.orbit.checkpoints[1:]])
    times = np.concatenate([t * (1 + k * 2.0**-53) for k in range(-6, 7)])
    assert np.max(np.abs(run(times).axis - np.tile(run(t).axis, (13, 1)))) < 1e-11
    assert np.array_equal(run(times[7:8]).axis[0], run(times).axis[7])


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


@pytest.mark.parametrize("seed", range(10))
def test_a_start_exactly_on_an_event_counts_however_it_is_rounded(seed):
    source = np.random.default_rng(seed)
    start = ht.State(theta=source.uniform(0.2, 2), phi=source.uniform(-3, 3), psidot=20)
    asked = {"periods": 3, "quantities": ("theta",), "events": EVENTS}
    events = ht.propagate(ht.Scene(ht.Top(A=1, C="0.5", gMR=1), start, **asked)).events
    assert tuple(map(events.count, EVENTS)) == (7, 0, 4)
    assert events.t[0] == 0


# --- what is asked of a run ----------------------------------------------------------------------


def test_a_point_mass_is_run_by_the_axis_form():
    swing = run(ht.State("1"), ht.Top(1, 0, 1))
    assert swing.plan.formulation == "axis"
    assert ht.run_errors(swing).theta < 1e-12


def test_invariants_are_in_the_units_that_they_say():
    run = ht.propagate(ht.load_scene("sicm-kicked"))
    constants = run.motion.constants.floats
    for name, known in (("energy", "E_prime"), ("p_phi", "p_phi"), ("p_psi", "p_psi")):
        if name in run.invariants:
            found = float(run.scene.top.A) * run.invariants[name][0]
            assert found == pytest.approx(constants[known], rel=1e-12)
