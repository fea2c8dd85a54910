"""What no accuracy test sees: low words of time, the scale of an energy error, rounded starts."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.integration.integrator import Checkpoint


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
