"""A run that is killed, stopped or lacks room is finished by `resume`, to the same bits."""

import json
import os
import signal
import subprocess
import sys

import pytest

import heavytop as ht
from heavytop.cli import Exit
from heavytop.files import locked
from heavytop.report import files as report_files
from heavytop.studies.journal import sealed

from ..commands import fail_with, heavytop_

# The command line, in which a signal comes at the n-th call of a function; and which saves often.
COMMAND = """
import os, pkgutil, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
place, name, count, number = [sys.argv.pop(1) for _ in range(4)]
import heavytop.run.autosave as running
running.SAVE_S = running.SAVE_SHARE = running.UNSAVED_S = 0.0
home, calls = pkgutil.resolve_name(place), []
whole = getattr(home, name)
def struck(*arguments, **options):
    calls.append(name)
    if len(calls) == int(count):
        os.kill(os.getpid(), int(number))
    return whole(*arguments, **options)
setattr(home, name, struck)
from heavytop.cli import main
main()
"""
BLOCK = "heavytop.integration.orbit:_Journey advance"
EVENTS = "heavytop.run.trajectory no_events"
AT_LAST = "heavytop.run.trajectory events_of"
SAVED = "heavytop.run.trajectory:Trajectory save"
DRAWN = "heavytop.plots.style save"
TOLD = "heavytop.results.base write_document"
PRECISE = "heavytop.run.trajectory events_of"
KILL, TERM, INT = signal.SIGKILL, signal.SIGTERM, signal.SIGINT

LONG = "--set span.periods=4000 --set want.samples=9 --set want.digits=6 --no-figures"
SCENES = {
    "long": f"sicm-kicked {LONG}",
    "drawn": "sicm-kicked",
    "plain": "sicm-kicked --no-figures",
    "exact": "sicm-kicked --set span.periods=1e12 --no-figures",
    "digits": "sicm-kicked --digits 25 --no-figures --formulation axis",
}


def run(words, folder):
    return heavytop_("run", *words.split(), "-o", folder)


def struck(place, count, number, words, folder):
    """Run a command to which a signal comes at the n-th call of a function."""
    asked = [*place.split(), str(count), str(int(number)), *words.split(), str(folder)]
    command = [sys.executable, "-c", COMMAND, *asked]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def resumed(folder):
    """The files of a run that is finished by `resume`, to whom a second one has nothing to add."""
    again = heavytop_("resume", folder)
    assert again.exit_code == 0, again.output
    found = files(folder)
    assert "this run is finished" in heavytop_("resume", folder).stderr
    assert files(folder) == found
    return found


def files(folder):
    """What lies in a folder, without the times that a run took, and the command."""
    there = (path for path in folder.iterdir() if path.name not in ("study.jsonl", "lock"))
    found = {path.name: path.read_bytes() for path in there}
    document = json.loads(found["run.json"])
    document["cost"] = document["cost"]["steps"]
    del document["command"]
    return found | {"run.json": json.dumps(document).encode()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The files of the same runs when nothing happens to them."""
    found = {}
    for name, words in SCENES.items():
        folder = tmp_path_factory.mktemp("whole") / name
        assert run(words, folder).exit_code == 0
        found[name] = files(folder)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "place", "count", "number"),
    [
        *(("long", BLOCK, 4, number) for number in (KILL, TERM, INT)),
        ("long", BLOCK, 1, TERM),
        ("long", SAVED, 3, INT),
        ("long", EVENTS, 8, KILL),
        *(("plain", AT_LAST, 1, number) for number in (KILL, INT)),  # between steps and files
        ("drawn", DRAWN, 4, KILL),
        ("drawn", DRAWN, 5, TERM),
        ("plain", TOLD, 1, KILL),
        ("exact", TOLD, 1, KILL),
        ("digits", PRECISE, 1, KILL),
        ("digits", PRECISE, 1, INT),
    ],
)
def test_resume_finishes_what_is_there(tmp_path, whole, scene, place, count, number):
    folder = tmp_path / "run"
    stopped = struck(place, count, number, f"run {SCENES[scene]} -o", folder)
    if number == KILL:
        assert stopped.returncode == -KILL, stopped.stderr
    else:
        assert stopped.returncode == 130, stopped.stderr
        assert f"heavytop resume {folder}" in stopped.stderr
        assert "Traceback" not in stopped.stderr
    assert resumed(folder) == whole[scene]


@pytest.mark.slow
def test_the_steps_that_were_taken_are_not_taken_again(tmp_path, whole):
    folder = tmp_path / "run"
    struck(BLOCK, 6, KILL, f"run {SCENES['long']} -o", folder)
    part = ht.load_trajectory(folder / "trajectory.nc")
    assert (part.outcome, len(part.orbit.checkpoints)) == ("interrupted", 6)
    again = struck(BLOCK, 2, KILL, "resume", folder)  # a block is done, and kept
    assert again.returncode == -KILL
    assert len(ht.load_trajectory(folder / "trajectory.nc").orbit.checkpoints) == 7
    assert run(SCENES["long"], folder).exit_code == 0  # it goes on as well
    assert files(folder) == whole["long"]


@pytest.mark.slow
@pytest.mark.parametrize("kilobytes", [20, 200])
def test_a_full_disk_ends_a_run_early(tmp_path, whole, kilobytes):
    """The kernel refuses larger files: the trajectory does not fit, or a figure."""
    folder = tmp_path / "run"
    words = f"exec {sys.executable} -m heavytop run sicm-kicked -o {folder}"
    command = ["bash", "-c", f"ulimit -f {kilobytes}; {words}"]
    full = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert full.returncode == 4, full.stderr
    assert full.stderr.startswith("heavytop: ended early: cannot write ")
    assert "File too large" in full.stderr
    assert full.stderr.endswith(f"heavytop resume {folder}\n")
    assert resumed(folder) == whole["drawn"]


# --- one folder, one run -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first") / "run"
    assert run("sicm-kicked --no-figures", folder).exit_code == 0
    return folder


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("sicm-dropped", "scene.start.phidot: -15 there, 0 here"),
        ("sicm-kicked --digits 11", "scene.want.digits: 12 there, 11 here"),
        ("sicm-kicked --formulation axis", 'formulation: "auto" there, "axis" here'),
        ('sleeping --set want.quantities=["class"]', "scene.start"),  # known at once
    ],
)
def test_another_run_is_refused(first, words, told):
    before = files(first)
    refused = run(words, first)
    assert refused.exit_code == Exit.BAD_SCENE
    assert all(part in refused.stderr for part in (f"{first}: ", told, "--force"))
    assert files(first) == before


def test_a_run_begun_by_other_versions_is_refused(first, monkeypatch, tmp_path):
    for name in ("study.jsonl", "trajectory.nc"):  # as if it had been killed
        (tmp_path / name).write_bytes((first / name).read_bytes())
    here = report_files.versions()
    monkeypatch.setattr(report_files, "versions", lambda: here | {"heyoka": "99"})
    again = run("sicm-kicked --no-figures", tmp_path)
    for refused in (heavytop_("resume", tmp_path), again):
        assert refused.exit_code == 3
        assert 'versions.heyoka: "' in refused.stderr
    (tmp_path / "run.json").write_bytes((first / "run.json").read_bytes())
    assert run("sicm-kicked --no-figures", tmp_path).exit_code == 0  # what is whole goes


@pytest.mark.slow
def test_force_replaces(tmp_path):
    """Also what was on its way: none of its figures stays."""
    struck(DRAWN, 4, KILL, "run sicm-kicked -o", tmp_path)
    assert (tmp_path / "overview.svg").exists()
    assert run("sicm-dropped --no-figures --force", tmp_path).exit_code == 0
    assert files(tmp_path).keys() == {"run.json", "trajectory.nc"}
    assert json.loads((tmp_path / "run.json").read_text())["scene"]["name"] == "sicm-dropped"


STUDY = sealed(b'{"command":null,"parameters":{"kind":"drift","versions":{}}}').decode()


@pytest.mark.parametrize(
    ("name", "text", "forced", "told"),
    [
        ("run.json", "{}", "", "not the folder of a study (run.json) (--force replaces it)"),
        ("study.jsonl", STUDY, "", "holds a study; a run needs a folder of its own"),
        ("study.jsonl", STUDY, "--force", "holds a study; a run needs a folder of its own"),
        ("study.jsonl", STUDY.replace("drift", "run"), "--force", "line 1: damaged"),
        ("overview.png", "mine", "", "overview.png"),
    ],
)
def test_a_refusal_takes_nothing_away(tmp_path, name, text, forced, told):
    (tmp_path / name).write_text(text)
    refused = run(f"sicm-kicked {forced}", tmp_path)
    assert refused.exit_code == Exit.BAD_SCENE
    assert told in refused.stderr
    assert {path.name for path in tmp_path.iterdir()} <= {name, "lock"}
    assert (tmp_path / name).read_text() == text


def test_a_run_begins_where_a_journal_is_empty_and_beside_other_files(tmp_path):
    (tmp_path / "study.jsonl").touch()  # of a disk that was full
    (tmp_path / "thesis.tex").touch()
    refused = heavytop_("resume", tmp_path)
    assert (refused.exit_code, "neither a study nor a run" in refused.stderr) == (3, True)
    assert run("sicm-kicked --no-figures", tmp_path).exit_code == 0
    assert files(tmp_path).keys() == {"run.json", "trajectory.nc", "thesis.tex"}


def test_a_run_that_fails_before_anything_is_stored_leaves_its_folder_to_others(tmp_path):
    """Such as where heyoka is missing: what is installed then is another version."""
    with pytest.MonkeyPatch.context() as patched:
        fail_with(patched, ht.MissingPackage("a run", ["heyoka"]))
        assert run("sicm-kicked", tmp_path).exit_code == Exit.USAGE
    assert run("sicm-dropped --no-figures", tmp_path).exit_code == 0


def test_two_runs_do_not_write_one_folder(tmp_path):
    with locked(tmp_path / "lock"):
        refused = run("sicm-kicked", tmp_path)
    assert refused.exit_code == 2
    assert f"is being written by process {os.getpid()}" in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "told"), [("study.jsonl", "neither a study nor a run"), ("trajectory.nc",) * 2]
)
def test_a_damaged_file_of_a_run_is_named(tmp_path, name, told):
    struck(DRAWN, 1, KILL, "run sicm-kicked -o", tmp_path)
    (tmp_path / name).write_bytes((tmp_path / name).read_bytes()[:100])
    refused = heavytop_("resume", tmp_path)
    assert refused.exit_code == 3
    assert told in refused.stderr
    assert run("sicm-kicked", tmp_path).exit_code == 3
    assert run("sicm-kicked --force --no-figures", tmp_path).exit_code == 0
