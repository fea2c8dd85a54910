"""The verbs that judge and show: what ``check`` and ``validate`` print, and leave with."""

import json
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.results.registry import RESULTS

from ..claims.own_claims import FAKE, script
from ..commands import document, heavytop_, printed, refused

KICKED = ht.load_scene("sicm-kicked")


# --- check ---------------------------------------------------------------------------------------


def table(path, **columns):
    """The words that judge a table of the kicked top."""
    header, rows = ",".join(columns), np.stack([*columns.values()], axis=1)
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.17g")
    return ("check", path, "--scene", "sicm-kicked")


T = np.linspace(0, 2, 201)
RECORD = ht.Motion(KICKED.top, KICKED.start).at(T)


@pytest.fixture
def mine(tmp_path):
    """Its angles as they are."""
    words = table(tmp_path / "mine.csv", Zeit=T, theta=RECORD.theta, phi=RECORD.phi)
    return (*words, "--columns", "t=Zeit")


def test_document_and_chart_are_written_into_a_folder_and_put_on_a_page(mine, tmp_path):
    found = document(*mine, "-o", tmp_path / "out")
    assert found["command"].startswith("heavytop check ")
    assert found["versions"]["numpy"]
    written = json.loads((tmp_path / "out" / "check.json").read_text("utf-8"))
    assert written["files"].keys() == {"document", "chart_svg", "chart_png"}
    assert found.items() <= written.items()
    printed("report", tmp_path / "out", "-o", tmp_path / "page.html")
    assert "effect of a change in the last" in (tmp_path / "page.html").read_text("utf-8")
    printed(*mine, "-o", tmp_path / "out")  # another check takes its place


def test_a_change_is_of_the_scene_or_of_a_top_without_a_start(mine, tmp_path):
    found = document(*mine, "--set", "start.phidot=-14.9")
    assert found["scene"]["start"]["phidot"] == -14.9
    (tmp_path / "top.toml").write_text("[top]\nA = 3.28e-4\nC = 6.6e-5\ngMR = 0.05\n", "utf-8")
    alone = printed(*mine[:3], tmp_path / "top.toml", *mine[4:], "--set", "top.gMR=0.0456")
    assert "fitted: theta = 0.1, " in alone


def test_data_as_they_are_decide_the_exit_and_conventions_are_undone_where_asked(tmp_path):
    x, y, z = RECORD.axis.T
    words = (*table(tmp_path / "mine.csv", t=T, x=x, y=z, z=-y), "--digits", 12, "--json")
    found = heavytop_(*words)
    told = json.loads(found.stdout)
    assert (found.exit_code, [each["name"] for each in told["conventions"]]) == (5, ["y-up"])
    assert told["digits_as_given"] < 1 < 12 < told["digits"]
    printed(*words, "--as", "y-up")
    refused(2, *words, "--as", "up")


@pytest.mark.parametrize("wanted", [("theta", "phi"), ("rates",)])
def test_a_run_of_ours_knows_its_scene(tmp_path, wanted):
    ht.propagate(replace(KICKED, quantities=wanted)).save(tmp_path / "trajectory.nc")
    found = printed("check", tmp_path / "trajectory.nc", "--digits", 12)
    assert "of the scene: theta = 0.1, phidot = -15" in found


def test_what_the_data_are_of_has_to_be_said(mine, tmp_path):
    for words, code in (
        ((*mine[:2], *mine[4:]), 3), ((*mine, "--columns", "t=Uhr"), 3),
        (("check", tmp_path / "none.csv"), 3), (mine[:4], 0),  # what Zeit is, is understood
    ):  # fmt: skip
        refused(code, *words)


# --- validate ------------------------------------------------------------------------------------


@pytest.mark.processes
def test_claims_are_measured_stored_and_found_again(tmp_path):
    words = ("validate", "betsch-cone", "betsch-cone", "-o", tmp_path / "made" / "here")
    found = document(*words, "--jobs", "1")
    assert found["counts"] == {"passed": 1, "failed": 0, "skipped": 0}
    assert (found["asked"], found["proofs"]) == (["betsch-cone"], False)
    assert json.loads((tmp_path / "made/here/validate.json").read_text("utf-8")) == found
    assert document(*words)["claims"] == found["claims"]


@pytest.mark.processes
def test_a_claim_that_does_not_hold_is_out_of_bound_and_no_bug(tmp_path):
    scripts, _ = script(tmp_path, FAKE)
    ht.validate(["raises", "holds", "absent"], scripts=scripts, folder=tmp_path / "out")
    said = refused(5, "resume", tmp_path / "out")
    assert "raises does not hold: ValueError: no such top" in said


# --- report --------------------------------------------------------------------------------------

LESS = {  # what is put in place of the defaults, so that it takes seconds
    "studies.drift.drift": {"periods": 2, "samples": 2, "methods": ["taylor-axis"]},
    "studies.work_precision.work_precision": {"periods": 2, "methods": ["strang=50"]},
    "studies.stress.stress": {"cases": ["cusp"], "methods": ["auto"]},
    "claims.validate": {"names": ["betsch-cone"]},
}
PLANE = "phidot=-30:40:6", "theta=0.1:1.5:6"


@pytest.fixture
def less(monkeypatch):
    for place, asked in LESS.items():
        module, _, name = f"heavytop.{place}".rpartition(".")
        real = getattr(import_module(module), name)
        monkeypatch.setattr(f"{module}.{name}", partial(real, **asked))
    atlas = RESULTS["atlas.json"]._replace(reported=("scene", *PLANE))
    monkeypatch.setitem(RESULTS, "atlas.json", atlas)


@pytest.mark.slow
@pytest.mark.usefixtures("less")
def test_a_scene_is_run_and_studied_and_put_on_a_page(tmp_path):
    written = document("report", "separatrix", "--set", "span.time=1", "-o", tmp_path)
    names = [f"{study}.json" for study in ("run", "stress", "atlas", "validate")]
    assert [Path(name).name for name in written["results"]] == names
    assert [each["study"] for each in written["missing"]] == ["drift", "workprec"]
    kept = {name.removesuffix(".json") for name in names}
    assert {path.name for path in tmp_path.iterdir()} == {"report.html", *kept}
    refused(3, "report", "sicm-kicked", "-o", tmp_path)  # whose studies are not these


def stopped(*_, **__):
    raise KeyboardInterrupt


def test_what_a_page_without_folders_takes_is_said_before_anything_runs(monkeypatch, tmp_path):
    monkeypatch.setattr("heavytop.cli.verbs.run_in", stopped)
    loud, quiet = (refused(130, "report", "-o", tmp_path, *how) for how in ((), ("-q",)))
    assert ("four minutes" in loud, "four minutes" in quiet) == (True, False)
    assert ("run (1 of 6)" in loud, "run (1 of 6)" in quiet) == (True, False)


@pytest.mark.usefixtures("less")
def test_what_a_report_has_finished_when_it_is_stopped_is_kept_and_taken_up(monkeypatch, tmp_path):
    words = ("report", "sicm-kicked", "--set", "span.time=0.1", "-o")
    with monkeypatch.context() as patched:
        patched.setattr("heavytop.studies.work_precision.complete", stopped)
        said = refused(130, *words, tmp_path / "kept")
        alone = refused(130, *words, tmp_path / "x.html")
    assert "keeps run, drift\n" in said
    assert f"heavytop resume {tmp_path / 'kept' / 'workprec'}\n" in said
    assert alone.endswith("nothing was kept\n")
    assert not list(tmp_path.glob("x*"))
    refused(0, "resume", tmp_path / "kept" / "workprec")
    begun = (tmp_path / "kept" / "drift" / "study.jsonl").read_bytes()
    with monkeypatch.context() as patched:
        patched.setattr("heavytop.studies.drift.advance", None)  # nothing of it is left to do
        patched.setattr("heavytop.studies.stress.complete", stopped)
        assert "keeps run, drift, workprec\n" in refused(130, *words, tmp_path / "kept")
    assert (tmp_path / "kept" / "drift" / "study.jsonl").read_bytes() == begun


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("no-such-scene", 3), ("{here} no-such-folder", 2), ("sicm-kicked sicm-dropped", 2),
        ("{here} --set start.phidot=3", 2), ("sicm-kicked --set start.phidot=x", 2),
    ],
)  # fmt: skip
def test_a_report_of_what_makes_no_sense_is_refused(words, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(code, "report", *words.format(here=Path(__file__).parent).split())
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_finished_says_how_to_go_on(tmp_path):
    printed("run", "sicm-kicked", "--no-figures", "-o", tmp_path)
    (tmp_path / "run.json").unlink()
    assert f"heavytop resume {tmp_path}" in refused(3, "report", tmp_path)
