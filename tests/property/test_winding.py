"""The winding of phi, counted from the axis alone, against the closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht

PERIODS = 20


def assert_wound_right(top, start, **span):
    scene = ht.Scene(top, start, quantities=("theta", "phi"), events=("turning",), **span)
    run = ht.propagate(scene)
    errors = ht.run_errors(run)
    assert errors.why_not == ""
    assert errors.phi < 1e-3  # a lost turn is 6.28
    return run


def test_close_passes_of_the_benchmark_over_a_thousand_periods():
    scene = ht.load_scene(
        "lie-group-benchmark", overrides=["span.periods=1000", 'want.quantities=["phi"]']
    )
    run = ht.propagate(scene)
    periods = np.arange(1, 1001)
    motion = ht.Motion(scene.top, scene.start)
    turned = run(periods[:-1] * motion.period).phi - np.pi
    # away from the pole, at the upper turning points, phi is as good as the axis
    assert np.max(np.abs(turned - periods[:-1] * motion.precession)) < 1e-9


def thousandths(low, high):
    return st.integers(round(1000 * low), round(1000 * high)).map(lambda k: k / 1000)


@settings(max_examples=60, deadline=None)
@given(
    theta=thousandths(0.01, 3.13),
    thetadot=thousandths(-8, 8),
    phidot=thousandths(-25, 25),
    psidot=thousandths(-60, 60),
    g=thousandths(-3, 3),
)
def test_turns_of_any_motion(theta, thetadot, phidot, psidot, g):
    top = ht.Top(A=1, C=0.5, gMR=g)
    start = ht.State(theta=theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    motion = ht.Motion(top, start)
    if not motion.nutates or motion.from_top < 1e-9 or motion.from_bottom < 1e-9:
        return  # no turning points, or a pass through a pole within rounding
    try:
        motion.at(0.0)
    except ht.NoClosedForm:
        return
    assert_wound_right(top, start, periods=PERIODS)


@pytest.mark.parametrize("miss", [1e-2, 1e-4, 1e-6, 1e-8, -1e-2, -1e-4, -1e-6, -1e-8])
@pytest.mark.parametrize("spin", [0.0, 3.0, 30.0])
def test_near_passes_of_the_top_turn_the_right_way(miss, spin):
    """Straight at the vertical, and missed by a little: phi turns by nearly pi, one way."""
    top = ht.Top(A=1, C=0.5, gMR=1)
    theta = 1.0
    p_psi = 0.5 * spin  # of a top that moves without precession at first
    phidot = (p_psi * (1 - np.cos(theta)) + miss) / np.sin(theta) ** 2
    start = ht.State.kicked(theta=theta, thetadot=-6.0, omega3=spin, phidot=phidot)
    run = assert_wound_right(top, start, time=30)
    assert run.events.count("turning") >= 10


def test_a_vertical_top_that_hardly_nods_turns_with_its_precession():
    """Tilted by 1e-9 the axis is slow to show in the error norm: steps of many turns."""
    top = ht.Top(A=1, C=0.5, gMR=0.01)
    start = ht.State(theta=1e-9, psidot=40.0)
    assert_wound_right(top, start, periods=PERIODS)
    assert_wound_right(top, ht.State(theta=np.pi - 1e-9, psidot=40.0), periods=PERIODS)


def test_phi_starts_where_the_scene_says():
    top = ht.Top(A=1, C=0.5, gMR=1)
    start = ht.State(theta=1.0, phi=100.0, phidot=0.3, psidot=6)
    run = assert_wound_right(top, start, time=5)
    assert abs(run.phi[0] - 100.0) < 1e-13


@pytest.mark.parametrize("seed", range(40))
def test_passes_through_a_pole_turn_phi_by_pi_forward_in_time(seed):
    source = np.random.default_rng(seed)
    top = ht.Top(A=1, C=source.uniform(0.2, 1.5), gMR=source.uniform(-2, 2))
    start = ht.State(
        theta="pi" if seed % 2 else 0,
        thetadot=source.uniform(-4, 4),
        psidot=source.uniform(-20, 20),
    )
    wants = {"quantities": ("theta", "phi", "psi"), "events": ("turning",)}
    for time in (20, -20):
        run = ht.propagate(ht.Scene(top, start, time=time, **wants))
        exact = ht.Motion(top, start).at(run.t)
        away = np.sin(exact.theta) > 1e-4
        assert np.max(np.abs((run.phi - exact.phi)[away])) < 1e-8
        assert np.max(np.abs((run.psi - exact.psi)[away])) < 1e-8


def test_a_pendulum_that_turns_over_is_wound_alike_however_it_is_sampled():
    """Both poles are passed exactly, and phi' is zero in between."""
    top = ht.Top(A="3.28e-4", C="6.60e-5", gMR="0.0456")
    start = ht.State(theta=2, thetadot=40)
    wants = {"quantities": ("theta", "phi", "psi"), "time": 2}
    fine, coarse = (ht.propagate(ht.Scene(top, start, samples=n, **wants)) for n in (401, 3))
    passes = fine.events.count("turning")
    assert fine.phi[-1] == coarse.phi[-1] == fine(2.0).phi
    assert abs(fine.phi[-1] - np.pi * passes) < 1e-9
