"""A run begins at its start and ends with its last event; what is compiled has a bound."""

import cProfile
import os
import pstats
import subprocess
import sys

import pytest

import heavytop as ht


@pytest.mark.parametrize("name", ["sicm-kicked", "lie-group-benchmark"])
@pytest.mark.parametrize("formulation", ["axis", "attitude", "lagrange"])
@pytest.mark.filterwarnings("ignore")
def test_the_first_sample_is_the_start(name, formulation):
    scene = ht.load_scene(name, ["span.time=0.1"])
    trajectory = ht.propagate(scene, formulation=formulation)
    for quantity in ("theta", "phi", "psi", "thetadot", "phidot", "psidot"):
        start = float(getattr(scene.start, quantity))
        assert getattr(trajectory.samples, quantity)[0] == start
        assert getattr(trajectory(0.0), quantity) == start


def test_a_warm_run_makes_few_calls():
    """Events, samples, check and all: what it costs beside some twenty microseconds of steps."""
    ht.propagate(ht.load_scene("sicm-kicked"))
    scene, profile = ht.load_scene("sicm-kicked"), cProfile.Profile()
    profile.runcall(ht.propagate, scene)
    assert pstats.Stats(profile).total_calls <= 4600


WHOLE = [(name, periods, 12) for name in ("sicm-kicked", "sicm-dropped") for periods in (1, 5, -7)]
BETWEEN_DOUBLES = ("sicm-kicked", 7, 30)  # is where this one ends


@pytest.mark.parametrize(("name", "periods", "digits"), [*WHOLE, BETWEEN_DOUBLES])
def test_an_event_at_the_end_is_within_the_run(name, periods, digits):
    changes = [f"span.periods={periods}", f"want.digits={digits}"]
    run = ht.propagate(ht.load_scene(name, overrides=changes))
    assert run(run.events.t).theta == pytest.approx(run.events.theta, abs=1e-14)
    exact = periods * ht.Motion(run.scene.top, run.scene.start).period
    assert abs(run.events.t[-1] + run.events.t_low[-1] - float(exact)) < 1e-14


BEFORE = "import heyoka as hy; hy.llvm_state.set_diskcache_limit(12345); "
LIMIT = (
    "import heavytop.integration.engine, heyoka as hy; print(hy.llvm_state.get_diskcache_limit())"
)


@pytest.mark.parametrize(("before", "bytes_"), [("", 256 * 2**20), (BEFORE, 12345)])
def test_what_is_compiled_has_a_bound_unless_the_user_set_one(before, bytes_, tmp_path):
    env = dict(os.environ, HEYOKA_CACHE_DIR=str(tmp_path))
    command = [sys.executable, "-c", before + LIMIT]
    assert int(subprocess.check_output(command, env=env)) == bytes_
