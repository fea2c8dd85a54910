"""``heavytop run``: what it prints and writes, and how it ends when it does not reach its end."""

import json

import pytest

import heavytop as ht
from heavytop import errors
from heavytop.cli import Exit
from heavytop.report import files
from heavytop.report.files import finished_run
from heavytop.results.run import FIGURES

from ..commands import document, done_with, fail_with, heavytop_, names, printed, refused

KICKED = ("run", "sicm-kicked", "--set", "span.time=0.5")


def test_a_folder_gets_every_file_the_document_names(tmp_path):
    folder = tmp_path / "new" / "out"
    result = heavytop_(*KICKED, "-o", folder, "--json", "-v")
    assert result.exit_code == 0, result.stderr
    found = json.loads(result.stdout)
    assert found["schema"] == "heavytop/run/1"
    assert found == json.loads((folder / "run.json").read_text("utf-8"))
    figures = {f"{name}.{form}" for name in FIGURES for form in ("svg", "png")}
    assert names(folder) == {*found["files"].values()} == {*figures, "run.json", "trajectory.nc"}
    assert f"heavytop: wrote {folder / 'trajectory.nc'}\n" in result.stderr
    assert "heavytop: run sicm-kicked\n" in result.stderr


def test_options_are_those_asked_for(tmp_path):
    words = ("--digits", 9, "--formulation", "lagrange", "-o", tmp_path, "--no-figures")
    quiet = heavytop_(*KICKED, "--json", *words, "-q", "-v")
    found = json.loads(quiet.stdout)
    assert (found["final"]["t"], found["scene"]["want"]["digits"]) == (0.5, 9)
    assert found["plan"]["formulation"] == "lagrange"
    assert names(tmp_path) == {"run.json", "trajectory.nc"}
    assert quiet.stderr == ""


def test_a_tolerance_is_that_of_the_steps_and_of_a_resumed_run(tmp_path):
    words = (*KICKED, "--no-figures", "--set", "want.digits=5", "--tolerance")
    errors = {}
    for tolerance in (1e-7, 1e-9):
        folder = tmp_path / str(tolerance)
        found = document(*words, tolerance, "-o", folder)
        assert found["plan"]["tolerance"] == tolerance
        (folder / "run.json").unlink()  # as if it had been killed before it was written
        assert document("resume", folder)["errors"] == found["errors"]
        errors[tolerance] = found["errors"]["axis"]
    assert 3 < errors[1e-7] / errors[1e-9] < 3e4
    refused(Exit.USAGE, *words, "1e-9", "--digits", "30")


def test_the_part_of_a_run_that_ended_early_is_printed_kept_and_named(tmp_path, monkeypatch):
    def end(part):
        raise errors.EndedEarly("singular", part)

    done_with(monkeypatch, end)
    result = heavytop_(*KICKED, "--json", "-o", tmp_path, "--no-figures")
    assert result.exit_code == Exit.ENDED_EARLY
    assert json.loads(result.stdout)["schema"] == "heavytop/run/1"
    assert (tmp_path / "trajectory.nc").exists()
    assert all(x in result.stderr for x in ("singular", f"the partial result is in {tmp_path}"))
    assert finished_run(tmp_path) is not None
    assert "result is above (-o DIR keeps it)" in refused(Exit.ENDED_EARLY, *KICKED)


def test_the_answer_is_there_before_figures_are_drawn(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "_save_figure", lambda *_: print("drawn") or {"a": "a.svg"})
    said = printed(*KICKED, "-o", tmp_path)
    assert said.index("kind ") < said.index("drawn") < said.index("\n\nfiles  run.json")


def test_a_figure_without_its_closed_form_is_not_drawn(tmp_path):
    changes = ("--set", "start.psidot=1e-30", "--set", "span.time=1e20")
    assert "angles: not drawn" in refused(0, "run", "at-rest", *changes, "-o", tmp_path)
    assert {"run.json", "phase.svg"} < names(tmp_path)
    changes = ("--set", "start.phi=-1e300", "-o", tmp_path, "--force")
    assert "figures: not drawn" in refused(5, "run", "through-top", *changes)


def test_an_interrupt_before_anything_is_done_can_be_resumed(tmp_path):
    with pytest.MonkeyPatch.context() as patched:
        fail_with(patched, KeyboardInterrupt())
        stopped = refused(Exit.INTERRUPTED, *KICKED, "-o", tmp_path, "--no-figures")
        refused(Exit.INTERRUPTED, *KICKED)
    assert stopped.endswith(f"heavytop resume {tmp_path}\n")
    refused(0, "resume", tmp_path)
    assert names(tmp_path) == {"run.json", "trajectory.nc"}
    with pytest.raises(errors.ForeignFile, match=r"heavytop\.extend"):
        ht.resume(tmp_path)
    again = heavytop_("resume", tmp_path, "--json")
    assert again.stderr == f"heavytop: {tmp_path}: this run is finished\n"
    assert json.loads(again.stdout) == json.loads((tmp_path / "run.json").read_text("utf-8"))


def test_digits_that_are_missed_are_told():
    changes = ("--set", "span.time=10000", "--set", "want.quantities=['theta']")
    words = (*KICKED[:2], *changes, "--set", "want.events=[]", "--formulation", "axis")
    assert "theta" in refused(Exit.OUT_OF_BOUND, *words)
