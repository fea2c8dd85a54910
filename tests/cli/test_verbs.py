"""What the verbs print, write and leave with; of ``run`` in test_run.py."""

import json
import re
from functools import partial
from importlib import import_module
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

import heavytop as ht
from heavytop.cli import Exit
from heavytop.equations.derivation import as_latex, as_text, derivation
from heavytop.results.registry import RESULTS

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


def test_a_change_is_of_the_scene_or_of_a_top_without_a_start(tmp_path):
    mine = table(tmp_path / "mine.csv", Zeit=T, theta=RECORD.theta, phi=RECORD.phi)
    for _ in range(2):  # another check takes its place
        found = document(*mine, "--set", "start.phidot=-14.9", "-o", tmp_path / "out")
    assert found.items() <= json.loads((tmp_path / "out" / "check.json").read_text("utf-8")).items()
    assert found["scene"]["start"]["phidot"] == -14.9
    (tmp_path / "top.toml").write_text("[top]\nA = 3.28e-4\nC = 6.6e-5\ngMR = 0.05\n", "utf-8")
    refused(3, *mine, "--columns", "t=Uhr")
    words = ("--columns", "t=Zeit", "--set", "top.gMR=0.0456")
    assert "fitted: θ = 0.1 rad, " in printed(*mine[:3], tmp_path / "top.toml", *words)


def test_data_as_they_are_decide_the_exit_and_conventions_are_undone_where_asked(tmp_path):
    x, y, z = RECORD.axis.T
    words = (*table(tmp_path / "mine.csv", t=T, x=x, y=z, z=-y), "--digits", 12, "--json")
    found = heavytop_(*words)
    verdict = json.loads(found.stdout)
    assert (found.exit_code, [each["name"] for each in verdict["conventions"]]) == (5, ["y-up"])
    assert verdict["digits_as_given"] < 1 < 12 < verdict["digits"]
    printed(*words, "--as", "y-up")
    shown = printed(*table(tmp_path / "t.csv", t=T, theta=RECORD.theta), "--unit", "ms,deg,rpm")
    assert not re.search(r"[0-9] (rad/s|rad|s)\b", shown), shown
    worse = str(ht.check({"t": T, "theta": RECORD.theta}, KICKED, undone=["degrees"]))
    assert re.search("No other convention.*undone: degrees [(]0.3 digits, without 1", worse, re.S)
    refused(2, *words, "--as", "up")


# --- validate ------------------------------------------------------------------------------------


@pytest.mark.processes
def test_claims_are_measured_stored_and_found_again(tmp_path):
    words = ("validate", "betsch-cone", "betsch-cone", "-o", tmp_path / "made" / "here")
    found = document(*words, "--jobs", "1")
    assert found["counts"] == {"passed": 1, "failed": 0, "skipped": 0}
    assert (found["asked"], found["proofs"]) == (["betsch-cone"], False)
    assert json.loads((tmp_path / "made/here/validate.json").read_text("utf-8")) == found
    assert document(*words)["claims"] == found["claims"]


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
    for place, options in LESS.items():
        module, _, name = f"heavytop.{place}".rpartition(".")
        real = getattr(import_module(module), name)
        monkeypatch.setattr(f"{module}.{name}", partial(real, **options))
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


@pytest.mark.usefixtures("less")
def test_what_a_report_has_finished_when_it_is_stopped_is_kept_and_taken_up(monkeypatch, tmp_path):
    words = ("report", "sicm-kicked", "--set", "span.time=0.1", "-o")
    stop = Mock(side_effect=KeyboardInterrupt)
    with monkeypatch.context() as patched:
        patched.setattr("heavytop.studies.work_precision.complete", stop)
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
        patched.setattr("heavytop.studies.stress.complete", stop)
        assert "keeps run, drift, workprec\n" in refused(130, *words, tmp_path / "kept")
    assert (tmp_path / "kept" / "drift" / "study.jsonl").read_bytes() == begun


def test_a_study_that_takes_a_scene_alone_is_reported(monkeypatch, tmp_path):
    quick = ht.drift(KICKED, **LESS["studies.drift.drift"])
    monkeypatch.setattr("heavytop.studies.drift.drift", lambda _: quick)
    for name in RESULTS.keys() - {"drift.json"}:
        monkeypatch.setitem(RESULTS, name, RESULTS[name]._replace(reported=None))
    written = document("report", "sicm-kicked", "--set", "span.time=0.1", "-o", tmp_path)
    assert written["results"] == ["run/run.json", "drift/drift.json"]
    assert written["missing"] == []


def test_a_folder_that_is_not_finished_says_how_to_go_on(tmp_path):
    printed("run", "sicm-kicked", "--no-figures", "-o", tmp_path)
    (tmp_path / "run.json").unlink()
    assert f"heavytop resume {tmp_path}" in refused(3, "report", tmp_path, "-o", tmp_path / "page")
    assert not (tmp_path / "page").exists()


# --- find and sweep, and units ----------------------------------------------------------------


def test_find_and_sweep_answer_in_json_and_in_words(tmp_path):
    words = ("find", "sicm-dropped", "--vary", "start.psidot=100:400", "--so-that", "period <= 0.3")
    assert document(*words)["schema"] == "heavytop/find/1"
    assert re.search("period 300 ms.*to 3819.72 rpm", printed(*words, "--unit", "rpm,ms"), re.S)
    swept = ("sweep", "sicm-dropped", "--over", "start.psidot=100:400:3", "--facts", "round,ratio")
    assert len(document(*swept, "--unit", "rpm")["rows"]) == 3
    said = printed(*swept, "--unit", "rpm", "-o", str(tmp_path / "new" / "x.csv"))
    assert said == f"wrote {tmp_path}/new/x.csv\n"
    written = (tmp_path / "new" / "x.csv").read_text("utf-8")
    assert written.startswith("start.psidot [rpm],kind,round [s]")
    printed(*swept, "-o", str(tmp_path / "out"))
    assert (tmp_path / "out" / "sweep.svg").stat().st_size > 1000


def test_a_motion_is_shown_in_the_units_asked_for_and_its_json_stays_si():
    for scene in ("sicm-dropped", "sleeping-unstable", "steady-betsch", "spherical-pendulum"):
        shown = printed("classify", scene, "--unit", "deg,ms,rpm").partition("why")
        rest = shown[2].partition("\nθ")[2]
        assert not re.search(r"[0-9] (rad/s|rad|s)\b", rest), rest
    found = document("classify", "sicm-dropped", "--unit", "deg,ms")["motion"]
    assert round(found["period"], 6) == 0.401406


def test_what_a_held_spin_makes_of_a_kick_is_said():
    [note] = document("classify", "sicm-kicked")["warnings"]
    assert "from 0.1 to 0.363598452 rad" in note
    assert document("classify", "sicm-forward")["warnings"] == []
    in_degrees = printed("classify", "sicm-kicked", "--unit", "deg")
    assert "20.8327 deg" in " ".join(in_degrees.split())
    assert "°" not in in_degrees


# --- certify -----------------------------------------------------------------------------------


def test_a_stored_run_has_the_certificate_of_its_scene(tmp_path):
    run = tmp_path / "run"
    printed("run", "sicm-dropped", "--no-figures", "-o", run)
    known = document("certify", run, "-o", tmp_path / "proof")
    assert known["schema"] == "heavytop/certify/1"
    assert known["bound"] == ht.certify(ht.propagate(ht.load_scene("sicm-dropped"))).bound
    assert document("resume", tmp_path / "proof")["bound"] == known["bound"]


# --- scenes --------------------------------------------------------------------------------------


def test_scenes_are_listed_and_printed_as_json():
    assert "sicm-kicked" in printed("scenes")
    for key, found in (("scenes", document("scenes")), ("text", document("scenes", "sleeping"))):
        assert found["schema"] == "heavytop/scenes/1"
        assert found[key]


# --- derive and doctor ---------------------------------------------------------------------------


def test_derive_prints_text_latex_or_json():
    steps = derivation()
    for words, text in ((("derive",), as_text(steps)), (("derive", "--latex"), as_latex(steps))):
        assert printed(*words).rstrip("\n") == text.rstrip("\n")
    assert [each["name"] for each in document("derive")["steps"]] == [each.name for each in steps]


def test_doctor_names_what_is_missing(monkeypatch):
    assert f"heavytop     {ht.__version__}" in printed("doctor")
    assert document("doctor")["schema"] == "heavytop/doctor/2"
    monkeypatch.setattr("heavytop.doctor.requirements", lambda: {"": ["no-such-package"]})
    assert "no-such-package" in refused(Exit.OUT_OF_BOUND, "doctor")
