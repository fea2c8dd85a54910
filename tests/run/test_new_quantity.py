"""A quantity is a row: the kinetic energy, put into the table from outside."""

import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.results.run import run_result
from heavytop.run.exact import SceneMotion
from heavytop.run.verify import misses
from heavytop.scene.quantities import QUANTITIES, Need, Quantity, number_like

from ..commands import document, printed
from ..trajectories import with_states

NAME = "kinetic_energy"
WANTS = f"want.quantities=['{NAME}']"


def kinetic_energy(record, motion):
    """Of the rotation about any axis across the top's own, and about that."""
    A, C = map(number_like(record.t), (motion.top.A, motion.top.C))
    omega, axis = np.asarray(record.omega), np.asarray(record.axis)
    along = np.sum(omega * axis, axis=-1)
    return (A * np.sum(omega * omega, axis=-1) + (C - A) * along * along) / 2


@pytest.fixture(autouse=True)
def row(monkeypatch):
    row = Quantity("T", "J", "kinetic energy", need=Need.AXIS, of=kinetic_energy)
    monkeypatch.setitem(QUANTITIES, NAME, row)


def scene_of(*changes):
    return ht.load_scene("sicm-kicked", [WANTS, "want.samples=9", *changes])


def test_it_is_in_the_file_of_a_run_and_in_that_of_its_exact_motion(tmp_path):
    """And is what E = T + gMR cos θ leaves."""
    scene = scene_of()
    run, motion = ht.propagate(scene), ht.Motion(scene.top, scene.start)
    for name, one in {"run": run, "exact": SceneMotion(scene, motion, ht.plan(scene))}.items():
        one.save(tmp_path / f"{name}.nc")
        with xarray.open_dataset(tmp_path / f"{name}.nc") as data:
            weight = float(scene.top.gMR) * np.cos(one.samples.theta)
            np.testing.assert_allclose(data[NAME], float(motion.constants.E) - weight, rtol=1e-12)
            assert data[NAME].attrs == {"long_name": "kinetic energy", "units": "J"}
            np.testing.assert_array_equal(data[NAME], getattr(one, NAME))
            assert (data.attrs["source"], data.axis.dims) == (one.source, ("t", "space"))
    read = ht.load_trajectory(tmp_path / "run.nc")
    np.testing.assert_array_equal(getattr(read, NAME), getattr(run, NAME))
    run.save(tmp_path / "run.csv")
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table[NAME], getattr(run, NAME))


@pytest.mark.parametrize("digits", [12, 30])
def test_it_is_compared_and_must_have_the_digits(digits):
    run = ht.propagate(scene_of(f"want.digits={digits}", "want.events=[]"))
    assert 0 < ht.run_errors(run).derived[NAME] < 10.0**-digits
    assert misses(run).digits == {}
    wrong = with_states(run, run.orbit.samples.states[[*range(1, 9), 8]])
    assert set(misses(wrong).digits) == {NAME}
    assert misses(wrong).digits[NAME] == ht.run_errors(wrong).derived[NAME] > 1e-6


def test_a_record_of_the_closed_form_has_it_to_any_digits():
    motion = ht.propagate(scene_of()).motion
    exact = motion.at("0.7", 50)
    rest = motion.integrals(60).E - motion.top.gMR.mpf(exact.theta.context) * exact.u
    assert abs(getattr(exact, NAME) - rest) < 1e-50
    assert getattr(motion.at(0.7), NAME) == pytest.approx(float(rest), rel=1e-14)


def test_a_command_says_it_at_the_end_and_draws_it_over_time():
    words = "run", "sicm-kicked", "--set", WANTS
    found = document(*words)
    run = ht.propagate(ht.load_scene("sicm-kicked", [WANTS]))
    assert found["final"][NAME] == getattr(run, NAME)[-1]
    assert found["errors"][NAME] == ht.run_errors(run).derived[NAME]
    facts = dict(run_result(run).facts())
    assert facts["T"] == QUANTITIES[NAME].with_unit(found["final"][NAME])
    assert "kinetic energy" in facts["errors"]
    assert facts["T"] in printed(*words)
    ax = run.plot(NAME, ax=Figure().subplots())
    assert (ax.get_ylabel(), ax.lines[0].get_ydata()[0]) == ("T [J]", getattr(run, NAME)[0])
