"""``heavytop run``: what it prints and writes, and how it ends when it does not reach its end."""

import json
import re

import pytest

import heavytop.run.propagation
from heavytop import errors
from heavytop.cli import Exit
from heavytop.integration.blocks import Integrator
from heavytop.integration.orbit import Orbit, _Journey
from heavytop.report.files import finished_run

from ..commands import fail_with, heavytop_

KICKED = ("run", "sicm-kicked", "--set", "span.time=0.5")


def test_a_table_is_printed_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = heavytop_(*KICKED, "--set", r'title="$\\frac{ [bold]not markup"')
    assert result.exit_code == 0, result.stderr
    for word in ("kind", "E′", "period", "plan", "events", "theta_min", "closed form"):
        assert word in result.stdout
    assert "[bold]not markup" in result.stdout
    assert result.stderr == ""
    assert not list(tmp_path.iterdir())


def test_a_folder_gets_every_file_the_document_names(tmp_path):
    folder = tmp_path / "new" / "out"
    result = heavytop_(*KICKED, "-o", folder, "--json", "-v")
    assert result.exit_code == 0, result.stderr
    printed = json.loads(result.stdout)
    assert printed["schema"] == "heavytop/run/1"
    assert printed == json.loads((folder / "run.json").read_text("utf-8"))
    there = {path.name for path in folder.iterdir()}
    assert there == {*printed["files"].values(), "study.jsonl", "lock"}
    assert f"heavytop: wrote {folder / 'trajectory.nc'}\n" in result.stderr
    assert "heavytop: run sicm-kicked\n" in result.stderr


def test_options_are_those_asked_for(tmp_path):
    words = ("--digits", 9, "--formulation", "lagrange", "-o", tmp_path / "out", "--no-figures")
    quiet = heavytop_(*KICKED, "--json", *words, "-q", "-v")
    document = json.loads(quiet.stdout)
    assert document["final"]["t"] == 0.5
    assert document["scene"]["want"]["digits"] == 9
    assert document["plan"]["formulation"] == "lagrange"
    there = {path.name for path in (tmp_path / "out").iterdir()}
    assert there == {"run.json", "trajectory.nc", "study.jsonl", "lock"}
    assert quiet.stderr == ""


def test_a_tolerance_is_that_of_the_steps_and_of_a_resumed_run(tmp_path):
    words = (*KICKED, "--no-figures", "--json", "--set", "want.digits=5", "--tolerance")
    errors = {}
    for tolerance in (1e-7, 1e-9):
        folder = tmp_path / str(tolerance)
        found = heavytop_(*words, tolerance, "-o", folder)
        assert found.exit_code == 0, found.stderr
        document = json.loads(found.stdout)
        assert document["plan"]["tolerance"] == tolerance
        errors[tolerance] = document["errors"]["axis"]
        (folder / "run.json").unlink()  # as if it had been killed before it was written
        again = heavytop_("resume", folder, "--json")
        assert json.loads(again.stdout)["errors"] == document["errors"]
    assert 3 < errors[1e-7] / errors[1e-9] < 3e4
    other = heavytop_(*words, 1e-9, "-o", tmp_path / "1e-07")
    assert other.exit_code == Exit.BAD_SCENE  # it holds another run
    for wrong in (("0.5",), ("1e-9", "--digits", "30")):
        assert heavytop_(*words, *wrong).exit_code == 2


def test_every_fault_of_a_scene_is_listed_with_its_line_and_no_folder_is_made(tmp_path):
    scene = tmp_path / "top.toml"
    text = "format = 1\n[top]\nA = -1\nC = 1\ngMR = 1\n[start]\nthteta = 0.1\n"
    scene.write_text(text, encoding="utf-8")
    result = heavytop_("run", scene, "-o", tmp_path / "out", "--set", "span.time=1")
    assert result.exit_code == Exit.BAD_SCENE
    assert result.stdout == ""
    assert result.stderr.startswith("heavytop: the input is not valid:\n")
    assert f"{scene}:3" in result.stderr
    assert f"{scene}:7" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["top.toml"]


def test_the_part_of_a_run_that_ended_early_is_printed_kept_and_named(tmp_path, monkeypatch):
    whole = heavytop.run.propagation.integrate_plan

    def integrate_plan(*arguments, **options):
        raise errors.EndedEarly("singular", whole(*arguments, **options))

    monkeypatch.setattr(heavytop.run.propagation, "integrate_plan", integrate_plan)
    folder = tmp_path / "out"
    result = heavytop_(*KICKED, "--json", "-o", folder, "--no-figures")
    assert result.exit_code == Exit.ENDED_EARLY
    assert json.loads(result.stdout)["schema"] == "heavytop/run/1"
    assert (folder / "trajectory.nc").exists()
    assert f"the partial result is in {folder}" in result.stderr
    assert finished_run(folder) is not None
    assert "singular" in result.stderr
    nowhere = heavytop_(*KICKED)
    assert nowhere.exit_code == Exit.ENDED_EARLY
    assert "the partial result is above (-o DIR keeps it)" in nowhere.stderr


def test_an_interrupted_run_is_kept_and_not_gone_through_again(tmp_path, monkeypatch):
    """To compare its part would take as long as the run did."""
    folder, long = tmp_path / "out", (*KICKED, "--set", "span.periods=1500", "--no-figures")

    def stopped(*words):
        with monkeypatch.context() as patched:
            advance, calls = _Journey.advance, []

            def struck(journey):
                calls.append(journey)
                if len(calls) == 3:
                    raise KeyboardInterrupt
                return advance(journey)

            patched.setattr(_Journey, "advance", struck)
            patched.setattr(Integrator, "polynomials", None)
            patched.setattr(Orbit, "at", None)
            return heavytop_(*long, *words)

    kept = stopped("-o", folder, "--json")
    assert (kept.exit_code, kept.stdout) == (Exit.INTERRUPTED, "")
    assert re.match(r"heavytop: interrupted at t = \d+\.\d+ s; the partial", kept.stderr)
    assert kept.stderr.endswith(f"resume with:\nheavytop resume {folder}\n")
    part = heavytop.load_trajectory(folder / "trajectory.nc")
    assert len(part.orbit.checkpoints) == 3  # the last block that was done is there
    assert stopped().stderr.endswith("; nothing was kept\n")
    assert heavytop_("resume", folder).exit_code == 0


def test_an_interrupt_before_anything_is_done_can_be_resumed(tmp_path):
    folder = tmp_path / "out"
    with pytest.MonkeyPatch.context() as patched:
        fail_with(patched, KeyboardInterrupt())
        stopped = heavytop_(*KICKED, "-o", folder, "--no-figures")
        assert heavytop_(*KICKED).exit_code == Exit.INTERRUPTED
    assert stopped.exit_code == Exit.INTERRUPTED
    assert stopped.stderr.endswith(f"heavytop resume {folder}\n")
    assert heavytop_("resume", folder).exit_code == 0
    there = {path.name for path in folder.iterdir()}
    assert there == {"run.json", "trajectory.nc", "study.jsonl", "lock"}
    again = heavytop_("resume", folder, "--json")
    assert again.exit_code == 0
    assert again.stderr == f"heavytop: {folder}: this run is finished\n"
    assert json.loads(again.stdout) == json.loads((folder / "run.json").read_text("utf-8"))


def test_a_folder_without_a_run_cannot_be_resumed(tmp_path):
    result = heavytop_("resume", tmp_path)
    assert result.exit_code == Exit.BAD_SCENE
    assert f"{tmp_path}: there is neither a study nor a run" in result.stderr


def test_digits_that_are_missed_are_told():
    words = ("span.time=10000", "want.quantities=['theta']", "want.events=[]")
    asked = [word for change in words for word in ("--set", change)]
    missed = heavytop_("run", "sicm-kicked", *asked, "--formulation", "axis")
    assert missed.exit_code == Exit.OUT_OF_BOUND
    assert "theta" in missed.stderr
