"""Found by attack: threads, damaged files, symmetric starts, poles in forms that have them."""

import pickle
import threading
import time

import numpy as np
import pytest

import heavytop as ht
from heavytop.scene.scene import read_scene

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
    motion = ht.Motion(UNIT, ht.State(theta=1))
    with pytest.raises(ht.HeavyTopError):
        motion.at(float("nan"))
    with pytest.raises(ValueError, match="finite"):
        run(ht.State(theta=1))([0.0, float("nan")])
    assert run(ht.State(theta=1))([]).theta.size == 0


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


def test_damaged_files_are_foreign(tmp_path):
    whole = tmp_path / "whole.nc"
    run(ht.State(theta=1)).save(whole)
    data = whole.read_bytes()
    source = np.random.default_rng(2)
    for seed in range(40):
        damaged = bytearray(data)
        for place in source.integers(0, 3000, 3):
            damaged[place] = source.integers(0, 256)
        path = tmp_path / f"{seed}.nc"
        path.write_bytes(damaged)
        with pytest.raises(ht.ForeignFile):
            ht.load_trajectory(path)
    for name in ("nowhere.nc", "http://localhost/x.nc"):
        with pytest.raises(ht.ForeignFile):
            ht.load_trajectory(name)
    (tmp_path / "cut.nc").write_bytes(data[: len(data) // 2])
    with pytest.raises(ht.ForeignFile):
        ht.load_trajectory(tmp_path / "cut.nc")


def test_an_early_end_can_be_pickled():
    with pytest.raises(ht.EndedEarly) as early:
        run(ht.State(theta=2, thetadot=3), formulation="lagrange")
    early.value.trajectory = None  # what it carries cannot be sent: machine code
    again = pickle.loads(pickle.dumps(early.value))
    assert again.outcome == early.value.outcome


def test_a_key_of_many_parts_is_refused_at_once():
    began = time.process_time()
    with pytest.raises(ht.BadScene):
        read_scene("[" + ".".join(["a"] * 400_000) + "]")
    assert time.process_time() - began < 5


def test_a_number_over_two_lines_can_be_written_and_read():
    scene = ht.Scene(UNIT, ht.State(theta=1, phidot="1 +\n 1"), time=1)
    assert read_scene(scene.to_toml()) == scene
