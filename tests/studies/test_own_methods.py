"""Methods of your own in every study: judged as all others; a stored study never starts one."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.comparison import user
from heavytop.errors import Impossible
from heavytop.results.table import Row
from heavytop.studies import journal

from .. import integrators
from ..commands import document, refused
from ..integrators import rk4
from ..results.made import POINT, RUN, diagram_of, stress_of

KICKED = ht.load_scene("sicm-kicked")
RK4 = Path(integrators.__file__).read_text()


@pytest.fixture
def mine(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(RK4)
    return path


def test_a_drift_follows_functions_files_and_solvers(mine):
    methods = ["taylor-axis", ht.Method(rk4, setting=200), f"{mine}:rk4=200", f"{mine}:dop853=1e-9"]
    exact, mine_, same, solver = ht.drift(KICKED, methods=methods, periods=20, samples=4).methods
    assert (mine_.name, same.name, solver.name) == ("own:rk4", "mine.py:rk4=200", "mine.py:dop853")
    assert mine_.axis == same.axis
    assert 1e-7 < mine_.axis[-1] < 1e-4
    assert 1e-11 < solver.axis[-1] < 1e-6
    assert exact.axis[-1] < 1e-12


def test_an_order_costs_few_steps():
    taken = []

    def step(f, y, h):
        taken.append(h)
        return rk4(f, y, h)

    [found] = ht.drift(KICKED, methods=[step], periods=1, samples=2).methods
    assert found.order == pytest.approx(4, abs=0.2)
    assert len(taken) < 1500


def test_what_ones_own_code_prints_is_no_result(mine):
    mine.write_text(f"print('here')\n{RK4}".replace("a = f(y)", "print(a := f(y))"))
    words = "workprec", "sicm-kicked", "--periods", 1, "--budget", 60
    assert document(*words, "--methods", f"{mine}:rk4=50")["points"]


def test_two_methods_of_one_name_are_refused_and_one_that_is_given_twice_is_one():
    one, other = ht.Method(rk4, setting=200), ht.Method(rk4, setting=200, formulation="rotation")
    with pytest.raises(Impossible, match="must stand in a file"):
        ht.stress(cases=["cusp"], methods=[lambda f, y, h: y + h * f(y)])
    with pytest.raises(ht.BadScene, match="own:rk4: another method has this name"):
        ht.drift(KICKED, methods=[one, other], periods=2, samples=2)
    again = ht.drift(KICKED, methods=[one, one, replace(other, name="b")], periods=2, samples=2)
    assert [each.name for each in again.methods] == ["own:rk4", "own:b"]
    with pytest.raises(KeyError, match="this study has own:rk4, own:b"):
        again["rk4"]


@pytest.mark.processes
def test_a_stopped_study_goes_on_bit_for_bit_where_its_code_is_named(mine, tmp_path):
    """A step, one that keeps the rotation, and a solver."""
    place = tmp_path / "study"
    named = [f"{mine}:rk4", f"{mine}:on_the_group", f"{mine}:dop853"]
    options = {"methods": [f"{named[0]}=100", f"{named[1]}=100", f"{named[2]}=1e-7"]}
    options |= {"periods": 30, "samples": 6}
    reference = ht.drift(KICKED, **options)

    def stop(now):
        if now.fraction > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(ht.StoppedEarly):
        ht.drift(KICKED, folder=place, progress=stop, **options)
    user._REGISTERED.clear()  # another process
    every = "--methods mine.py:dop853,mine.py:on_the_group,mine.py:rk4\n"
    assert refused(3, "resume", place).endswith(every)
    resumed = ht.resume(place, methods=named, jobs=2)
    assert resumed.numbers(members=True) == reference.numbers(members=True)
    mine.write_text(RK4 + "\n# changed\n")
    user._REGISTERED.clear()
    with pytest.raises(ht.ForeignFile, match="not the code with which it was begun"):
        ht.resume(place, methods=named)


def test_no_study_file_starts_code(mine, tmp_path):
    mine.write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n{RK4}")
    file = tmp_path / "study" / "study.jsonl"
    ht.drift(KICKED, methods=["taylor-axis"], periods=5, samples=2, folder=file.parent)
    first = json.loads(file.read_text().partition("\n")[0])
    del first["sha256"]
    first["parameters"]["methods"] = [f"{mine}:rk4"]
    file.write_bytes(journal.seal(journal.canonical_json(first).encode()))
    refused(3, "resume", file.parent)
    assert not (tmp_path / "ran").exists()


@pytest.mark.slow
@pytest.mark.processes
def test_a_step_that_never_returns_ends_its_run_and_no_other(mine, monkeypatch):
    for limit in ("LIMIT_S", "SET_UP_S"):
        monkeypatch.setattr(f"heavytop.studies.drift.{limit}", 15.0)
    methods = [f"{mine}:hangs", "taylor-axis", f"{mine}:rk4=50"]
    said = [x.skipped for x in ht.drift(KICKED, methods=methods, periods=5, samples=2).methods]
    assert said == ["it did not return within 15 s", None, None]


def test_a_method_of_ones_own_that_fails_now_and_then_has_results():
    mine = {"method": "own:a", "reason": "it returns nan"}
    assert diagram_of(skipped=(mine,)).failures() == {"own:a": "it returns nan"}
    assert not diagram_of(Row(POINT, method="own:a"), skipped=(mine,)).failures()
    assert not diagram_of(skipped=(mine | {"method": "strang"},)).failures()
    bad = Row(RUN, method="own:a", outcome="method-error", note="nan")
    assert stress_of(bad, bad).failures() == {"own:a": "nan"}
    assert not stress_of(bad, Row(bad, outcome="diverged")).failures()


@pytest.mark.slow
@pytest.mark.processes
def test_a_method_that_never_returns_leaves_time_for_others_in_the_budget(mine):
    methods = [f"{mine}:hangs", "taylor-axis"]
    found = ht.work_precision(KICKED, methods=methods, periods=2, budget=20)
    assert {point.method for point in found.points} == {"taylor-axis"}
    first, *others = (each.reason for each in found.skipped if each.method == "mine.py:hangs")
    assert first.startswith("it did not return within 1")
    assert {"took too long" in reason for reason in others} == {True}
