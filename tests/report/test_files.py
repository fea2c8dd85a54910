"""A folder holds the files of the run or the study that its document tells of, and no other's."""

import json
from unittest.mock import Mock

import h5netcdf
import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import Stop, StoppedEarly
from heavytop.report.files import write_result

from ..commands import heavytop_, names, printed

SHORT = ("--set", "span.time=0.3")


@pytest.mark.slow
def test_figures_of_an_earlier_run_do_not_stay_beside_another(tmp_path):
    printed("run", "sicm-kicked", *SHORT, "-o", tmp_path)
    (tmp_path / "mine.svg").write_text("mine")
    (tmp_path / "run.json").unlink()  # as if it had been killed between its figures
    printed("run", "sicm-dropped", *SHORT, "-o", tmp_path, "--no-figures", "--force")
    assert names(tmp_path) == {"run.json", "trajectory.nc", "mine.svg"}
    known_at_once = ("--set", "want.quantities=['class']")
    printed("run", "sicm-kicked", *known_at_once, "--force", "-o", tmp_path)
    assert names(tmp_path) == {"run.json", "mine.svg"}


def checked(scene):
    t = np.linspace(0, 2, 201)
    return ht.check({"t": t, "theta": ht.Motion(scene.top, scene.start).at(t).theta}, scene)


def test_a_study_without_charts_leaves_none_of_an_earlier_one(tmp_path):
    found = checked(ht.load_scene("sicm-kicked"))
    files = write_result(found, tmp_path)
    assert names(tmp_path) == {*files.values()} == {"check.json", "check.svg", "check.png"}
    assert json.loads((tmp_path / "check.json").read_text())["files"] == files
    assert write_result(found, tmp_path, figures=False) == {"document": "check.json"}
    assert names(tmp_path) == {"check.json"}


@pytest.mark.parametrize("kept", [False, True])
def test_a_file_that_cannot_be_written_ends_a_study_early(tmp_path, kept):
    """A study whose folder goes on says how; of another all that was found is printed."""
    scene = ht.load_scene("sicm-kicked")
    study = {"methods": ["strang"], "periods": 3, "folder": tmp_path}
    found = ht.drift(scene, **study) if kept else checked(scene)
    name = "drift.nc" if kept else "check.json"
    (tmp_path / name).mkdir()
    with pytest.raises(StoppedEarly, match=rf"cannot write .*{name}") as stopped:
        write_result(found, tmp_path, figures=False)
    assert stopped.value.outcome is Stop.UNWRITABLE
    assert stopped.value.folder == (tmp_path if kept else None)
    assert ("heavytop resume" in str(stopped.value)) == kept


STOPS = {KeyboardInterrupt(): Stop.INTERRUPTED, OSError(28, "No space left"): Stop.UNWRITABLE}


@pytest.mark.parametrize(("error", "outcome"), STOPS.items())
def test_what_stops_a_chart_leaves_the_document(error, outcome, tmp_path, monkeypatch):
    monkeypatch.setattr("heavytop.plots.style.save", Mock(side_effect=error))
    with pytest.raises(StoppedEarly) as stopped:
        write_result(checked(ht.load_scene("sicm-kicked")), tmp_path)
    assert stopped.value.outcome is outcome
    assert names(tmp_path) == {"check.json"}
    assert str(stopped.value).endswith(f"the partial result is in {tmp_path}")


ATLAS = ("--x", "phidot=-20:20:5", "--y", "psidot=-150:150:5", "-j", "1")
DRIFT = ("--methods", "taylor-axis", "--periods", "5")


@pytest.mark.slow
@pytest.mark.parametrize(("verb", "options"), [("atlas", ATLAS), ("drift", DRIFT), ("run", ())])
def test_every_variable_of_a_file_says_what_it_is(verb, options, tmp_path):
    more = () if options else (*SHORT, "--digits", "20", "--no-figures")
    done = heavytop_(verb, "sicm-kicked", *options, *more, "-q", "-o", tmp_path)
    assert done.exit_code in (0, 5), done.output
    [path] = tmp_path.glob("*.nc")
    with h5netcdf.File(path, "r") as file:
        for name, each in file.variables.items():
            assert each.attrs.get("long_name"), name
            assert each.attrs.get("units"), name
