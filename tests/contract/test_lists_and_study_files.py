"""Every verb reads lists of names alike; a study's files are written, or it has ended early."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

import heavytop as ht
from heavytop.cli import app
from heavytop.errors import Stop, StoppedEarly
from heavytop.report.files import write_study
from heavytop.results.base import Problem
from heavytop.results.stress import Stress
from heavytop.results.work_precision import WorkPrecision

STUDIES = {
    "drift": "heavytop.studies.drift.drift",
    "stress": "heavytop.studies.stress.stress",
    "workprec": "heavytop.studies.work_precision.work_precision",
}
LISTS = [("drift", "methods"), ("stress", "methods"), ("stress", "cases"), ("workprec", "methods")]
SCENE = {"drift": ("sicm-kicked",), "stress": (), "workprec": ("sicm-kicked",)}
EMPTY = {
    "stress": Stress(
        limits={"budget_s": 1.0, "time_s": 1.0, "steps": 1}, hard={}, methods={}, cases=()
    ),
    "workprec": WorkPrecision(
        scene=Problem(**ht.load_scene("sicm-kicked").problem()),
        periods=5.0, phase=4.6, budget=60.0, points=(), skipped=(),
    ),
}  # fmt: skip


def heavytop_(verb: str, *arguments: object) -> Result:
    return CliRunner().invoke(app, [verb, *SCENE[verb], *map(str, arguments)])


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what a verb asks its study for; none is done."""
    found: dict[str, Any] = {}

    def study(*_: object, **options: object) -> None:
        found.update(options)
        raise KeyboardInterrupt

    for place in STUDIES.values():
        monkeypatch.setattr(place, study)
    return found


@pytest.mark.parametrize(("verb", "option"), LISTS)
def test_blanks_around_a_name_are_no_part_of_it(verb, option, asked):
    heavytop_(verb, f"--{option}", " auto ,\tstrang=50,  cusp")
    assert tuple(asked[option]) == ("auto", "strang=50", "cusp")


@pytest.mark.parametrize(("verb", "option"), LISTS)
@pytest.mark.parametrize("text", ["", " ", ",", "cusp,", "cusp,,auto", "cusp, ,auto"])
def test_an_empty_name_is_the_fault_of_its_option(verb, option, text, asked, tmp_path):
    refused = heavytop_(verb, f"--{option}", text, "-o", tmp_path / "new")
    said = " ".join(refused.stderr.replace("│", " ").split())
    assert refused.exit_code == 2
    assert f"--{option}: {' '.join(repr(text).split())} is not NAME,NAME,…: a name is empty" in said
    assert not asked
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("verb", STUDIES)
def test_a_list_left_out_is_the_list_of_its_study(verb, asked):
    heavytop_(verb)
    assert "folder" in asked
    assert "methods" not in asked


def full(*_: object) -> None:
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("verb", EMPTY)
def test_a_disk_that_fills_up_ends_a_study_early(verb, tmp_path, monkeypatch):
    """A disk full after minutes: exit code 4, the file is named, what was found is printed."""
    monkeypatch.setattr(STUDIES[verb], lambda *_, **__: EMPTY[verb])
    monkeypatch.setattr("heavytop.files.os.fsync", full)
    stopped = heavytop_(verb, "--no-figures", "-o", tmp_path / "new")
    assert stopped.exit_code == 4, stopped.stderr
    assert f"cannot write {tmp_path / 'new' / verb}.json: No space left" in stopped.stderr
    assert "without a folder" not in stopped.stderr
    assert stopped.stdout != ""
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("verb", EMPTY)
def test_the_exception_names_the_file_and_keeps_its_cause(verb, tmp_path, monkeypatch):
    monkeypatch.setattr("heavytop.files.os.fsync", full)
    with pytest.raises(StoppedEarly, match="No space left") as stopped:
        write_study(EMPTY[verb], tmp_path, figures=False)
    assert stopped.value.outcome is Stop.UNWRITABLE
    assert stopped.value.folder is None
    assert str(stopped.value) == stopped.value.why
    assert isinstance(stopped.value.__cause__, OSError)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("verb", EMPTY)
def test_a_folder_is_made_and_a_file_is_none(verb, tmp_path):
    made: Path = tmp_path / "made" / "here"
    names = write_study(EMPTY[verb], made, figures=False)
    assert names == {"document": f"{verb}.json"}
    assert list(made.iterdir()) == [made / f"{verb}.json"]
    with pytest.raises(StoppedEarly, match=f"cannot write {made / names['document']}"):
        write_study(EMPTY[verb], made / names["document"], figures=False)


@pytest.mark.parametrize("verb", EMPTY)
def test_verbose_names_the_files_on_stderr(verb, tmp_path, monkeypatch):
    monkeypatch.setattr(STUDIES[verb], lambda *_, **__: EMPTY[verb])
    done = heavytop_(verb, "--no-figures", "-v", "-o", tmp_path)
    assert done.exit_code == 4, done.stderr  # nothing was run
    assert f"heavytop: wrote {tmp_path / verb}.json" in done.stderr
