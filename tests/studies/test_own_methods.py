"""Methods of your own in every study: judged as all others; a stored study never starts one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.comparison import own
from heavytop.errors import BadScene, ForeignFile, Impossible, StoppedEarly
from heavytop.studies.drift import advance, drift_parameters
from heavytop.studies.methods import method, stress_method
from heavytop.studies.steppers import set_up
from heavytop.studies.stress_cases import cases, reference
from heavytop.studies.stress_runs import judge, run_case

from .. import integrators
from ..commands import heavytop_
from ..integrators import munthe_kaas, product, rk4, semi_implicit_euler, variational
from .toy import change_parameters

RK4 = Path(integrators.__file__).read_text()


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(RK4)
    return path


@pytest.fixture(scope="module")
def scene():
    return ht.load_scene("sicm-kicked")


def test_a_drift_follows_functions_files_and_solvers(scene, mine):
    methods = ["taylor-axis", ht.Method(rk4, setting=200), f"{mine}:rk4=200", f"{mine}:dop853=1e-9"]
    found = ht.drift(scene, methods=methods, periods=20, samples=4)
    assert [each.name for each in found.methods] == [
        "taylor-axis",
        "own:rk4",
        "mine.py:rk4=200",
        "mine.py:dop853",
    ]
    exact, mine_, same, solver = found.methods
    assert mine_.axis == same.axis
    assert 1e-7 < mine_.axis[-1] < 1e-4
    assert 1e-11 < solver.axis[-1] < 1e-6
    assert exact.axis[-1] < 1e-12


THREE = (
    ht.Method(semi_implicit_euler, setting=1600, formulation="quaternion"),
    ht.Method(munthe_kaas, setting=200, formulation="rotation"),
    ht.Method(variational, setting=400, formulation="rotation"),
)


def own_momenta(scene, states):
    """p_phi and p_psi over A of states, by quaternions turned and matrices multiplied."""
    inertia = np.array([1.0, 1.0, float(scene.top.C / scene.top.A)])
    for y in np.array(states):
        spin, attitude = inertia * y[-3:], y[:-3]
        if attitude.size == 4:
            back = attitude * (1, -1, -1, -1)
            space = product(product(attitude, np.array([0.0, *spin])), back)[3]
        else:
            space = attitude.reshape(3, 3)[2] @ spin
        yield space, spin[2]


@pytest.mark.slow
def test_three_methods_of_ones_own_go_through_every_study(scene):
    """Their momenta are sums of their own states, and their orders 1, 4 and 2."""
    found = ht.drift(scene, methods=THREE, periods=3, samples=3)
    parameters, _ = drift_parameters(scene, THREE, periods=3, ensemble=1,
                                     samples=4, seed=0, jobs=1)  # fmt: skip
    for each, order in zip(found.methods, (1, 4, 2), strict=True):
        assert each.order == pytest.approx(order, abs=0.15)
        rows = [row for chunk in advance(parameters, f"{each.name}/0000", None)
                for row in chunk.rows]  # fmt: skip
        begin = set_up(scene, method(each.name)).stepper.begin()
        first, *others = own_momenta(scene, [begin.state, *(row["state"] for row in rows)])
        for k, name in enumerate(("p_phi", "p_psi")):
            off = [(now[k] - first[k]) / abs(first[k]) for now in others]
            assert [row["invariants"][name] for row in rows] == pytest.approx(off, abs=1e-13)
    euler, kutta, discrete = found.methods
    assert discrete.p_phi[-1] < 1e-11 < kutta.p_phi[-1] < euler.p_phi[-1]  # which it keeps
    assert max(kutta.invariants.orthogonality) < 1e-11  # a rotation stays one
    grids = [replace(each, setting=None) for each in THREE]
    diagram = ht.work_precision(scene, methods=grids, periods=1, budget=600)
    assert {p.method for p in diagram.points} == {each.name for each in found.methods}
    orders = diagram.document()["orders"]
    assert [orders[each.name] for each in (kutta, discrete)] == pytest.approx([4, 2], abs=0.2)
    outcomes = []
    for own_method in THREE:
        chosen, truth = stress_method(own.register(own_method)), reference("ten-periods")
        run = run_case(cases()["ten-periods"], chosen, truth, 10**6)
        outcomes.append(str(judge(run, truth, "ten-periods", chosen).outcome))
    assert outcomes == ["diverged", "ok", "ok"]  # Euler's has turned by a radian too much


def test_two_methods_of_one_name_are_refused_and_one_that_is_given_twice_is_one(scene):
    one, other = ht.Method(rk4, setting=200), ht.Method(rk4, setting=200, formulation="rotation")
    with pytest.raises(BadScene, match="own:rk4: another method has this name"):
        ht.drift(scene, methods=[one, other], periods=2, samples=2)
    again = ht.drift(scene, methods=[one, one, replace(other, name="b")], periods=2, samples=2)
    assert [each.name for each in again.methods] == ["own:rk4", "own:b"]
    with pytest.raises(KeyError, match="this study has own:rk4, own:b"):
        again["rk4"]


@pytest.mark.processes
def test_a_study_that_was_stopped_goes_on_bit_for_bit_where_its_code_is_named(
    scene, mine, tmp_path
):
    """A step, one that keeps the rotation, and a solver."""
    place, whole = tmp_path / "study", tmp_path / "whole"
    named = [f"{mine}:rk4", f"{mine}:on_the_group", f"{mine}:dop853"]
    settings = (100, 100, 1e-7)
    methods = [f"{name}={setting}" for name, setting in zip(named, settings, strict=True)]
    asked = {"methods": methods, "periods": 30, "samples": 6}
    reference = ht.drift(scene, folder=whole, **asked)

    def stop(now):
        if now.fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(StoppedEarly):
        ht.drift(scene, folder=place, progress=stop, **asked)
    own._REGISTERED.clear()  # another process
    with pytest.raises(Impossible, match="runs only if you name it"):
        ht.resume(place)
    assert heavytop_("resume", place).exit_code == 3
    resumed = ht.resume(place, methods=named, jobs=2)
    assert resumed.numbers(members=True) == reference.numbers(members=True)
    mine.write_text(RK4 + "\n# changed\n")
    own._REGISTERED.clear()
    with pytest.raises(ForeignFile, match="not the code with which it was begun"):
        ht.resume(place, methods=named)


def test_no_scene_and_no_study_file_starts_code(scene, mine, tmp_path):
    ran = tmp_path / "ran"
    mine.write_text(f"open({str(ran)!r}, 'w')\n{RK4}")
    place = tmp_path / "study"
    ht.drift(scene, methods=["taylor-axis"], periods=5, samples=2, folder=place)
    change_parameters(place, lambda known: known.update(methods=[f"{mine}:rk4"]))
    assert heavytop_("resume", place).exit_code == 3
    assert not ran.exists()


@pytest.mark.slow
@pytest.mark.processes
def test_a_step_that_never_returns_ends_its_run_and_no_other(scene, mine, monkeypatch):
    for limit in ("LIMIT_S", "SET_UP_S"):
        monkeypatch.setattr(f"heavytop.studies.drift.{limit}", 15.0)
    methods = [f"{mine}:hangs", "taylor-axis", f"{mine}:rk4=50"]
    found = ht.drift(scene, methods=methods, periods=5, samples=2)
    said = [each.skipped for each in found.methods]
    assert said == ["it did not return within 15 s", None, None]


@pytest.mark.slow
@pytest.mark.processes
def test_stress_names_what_a_method_does(mine, monkeypatch):
    monkeypatch.setattr("heavytop.studies.stress.SET_UP_S", 15.0)
    methods = ["auto", f"{mine}:rk4=200", f"{mine}:hangs", f"{mine}:dop853=1e-10"]
    found = ht.stress(cases=["cusp"], methods=methods, time_limit=5)
    assert found["cusp", "auto"].outcome == "ok"
    assert found["cusp", "mine.py:hangs"].outcome == "time-limit"
    lost = [found["cusp", f"mine.py:{name}"].digits_lost for name in ("rk4=200", "dop853=1e-10")]
    assert lost[0] > max(2, lost[1])
    with pytest.raises(Impossible, match="must stand in a file"):
        ht.stress(cases=["cusp"], methods=[lambda f, y, h: y + h * f(y)])
