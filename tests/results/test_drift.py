"""What a drift says, and its numbers as tables, are those of its methods."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.results.table import Row
from heavytop.scene.quantities import MISSING
from heavytop.studies.journal import Journal

from .made import METHOD, drift_of, stress_of

SCENE = ht.load_scene("sicm-kicked", ["span.time=0.6"])
SHORT = Row(METHOD, name="short", periods=[1.0, 4.0], ended={"3": "it diverged"},
            us_per_period=None, phase_exponent=1.4, growth={"energy": "bounded", "phase": 1.4},
            stderr={"energy": None, "phase": 0.02})  # fmt: skip
OTHER = Row(METHOD, name="a.py:mine", skipped="no package", order=1.98, warned={"overflow": 3})


def test_it_says_what_is_lost_skipped_and_ended_early():
    found = drift_of(METHOD, SHORT, OTHER)
    assert [name for name, _ in found.facts()][-4:] == ["short", *["a.py:mine"] * 3]
    assert "(short 4 periods)" in dict(found.facts())["drift"]
    kept = drift_of(Row(METHOD, phase_s=[1e-3, 2e-3]))
    assert dict(found.facts()).keys() - dict(kept.facts()) == {"short", "a.py:mine", "lost"}
    [table] = found.tables()
    assert table.texts() == [
        ["strang", "1230", "2.0e-09", "0.50(3)", "lost at 10", "lost", "3.0e-02"],
        ["short", MISSING, "2.0e-09", "bounded", "lost at 4", "1.40(2)", "3.0e-02"],
    ]
    assert "us_per_period" in table.columns
    assert "us_per_period" not in next(drift_of(SHORT).tables()).columns  # its folder has no times
    assert [code for code, _ in found.problems()] == [4, 4]
    for each in (found, stress_of()):
        with pytest.raises(TypeError, match="not iterable"):
            list(each)


def test_the_journal_of_another_study_tells_no_times():
    found = drift_of(METHOD)
    assert found.timed(Journal({"kind": "drift", "periods": 9})) is found


def test_its_times_are_in_the_journal_of_its_folder(tmp_path):
    found = ht.drift(SCENE, methods=["taylor-axis"], periods=5, samples=2, folder=tmp_path)
    [timed], [stored] = found.methods, replace(found, **found.without_times()).methods
    assert stored.us_per_period is None
    [again] = replace(found, methods=(stored,)).timed(Journal.read(tmp_path)).methods
    assert again.us_per_period == timed.us_per_period > 0


def test_errors_are_by_method_and_time_in_every_form_and_those_of_every_run_by_start_too():
    methods = ["taylor-axis", "taylor-cubic"]
    drift = ht.drift(SCENE, methods=methods, periods=5, ensemble=2, samples=5)
    table, data, every = drift.to_pandas(), drift.to_xarray(), drift.to_pandas(members=True)
    assert table.index.names == ["scheme", "periods"]
    assert every.index.names == ["scheme", "start", "periods"]
    for method in drift.methods:
        one = table.loc[method.name]
        for name in table:
            np.testing.assert_array_equal(one[name], data[name].sel(scheme=method.name))
        members = [(each, every.loc[method.name, k]) for k, each in enumerate(method.members)]
        for known, rows in [(method, one), *members]:
            assert rows.index.tolist() == list(known.periods)
            np.testing.assert_array_equal(rows["energy"], known.energy)
    assert table.attrs["units"]["phase_s"] == data["phase_s"].attrs["units"] == "s"
    assert table.attrs["units"]["axis"] == data["member_axis"].attrs["units"] == "1"
