"""A run that is killed, stopped or lacks room is finished by `resume`, to the same bits.

And Ctrl-C ends what takes long, within a second.
"""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

import heavytop as ht
from heavytop.cli import Exit
from heavytop.report import files as report_files
from heavytop.studies.journal import seal

from ..commands import fail_with, names, printed, refused
from ..processes import begin, soon

# The command line, in which a signal comes at the n-th call of a function; and which saves often.
COMMAND = """
import os, pkgutil, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
place, name, count, number = [sys.argv.pop(1) for _ in range(4)]
import heavytop.run.trajectory_file as running
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
BLOCK = "heavytop.integration.orbit:Integrator block"
EVENTS = "heavytop.run.trajectory events_of"
KILL, TERM, INT = signal.SIGKILL, signal.SIGTERM, signal.SIGINT

LONG = "--set span.periods=4000 --set want.samples=9 --set want.digits=6 --no-figures"
SCENES = {
    "long": f"sicm-kicked {LONG}",
    "drawn": "sicm-kicked",
    "plain": "sicm-kicked --no-figures",
    "exact": "sicm-kicked --set span.periods=1e12 --no-figures",
    "digits": "sicm-kicked --digits 25 --no-figures --formulation axis",
}


def struck(place, count, number, words, folder):
    """Run a command to which a signal comes at the n-th call of a function."""
    arguments = [*place.split(), str(count), str(int(number)), *words.split(), str(folder)]
    command = [sys.executable, "-c", COMMAND, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def resumed(folder):
    """The files of a run that is finished by `resume`, to whom a second one has nothing to add."""
    printed("resume", folder)
    found = files(folder)
    assert "this run is finished" in refused(0, "resume", folder)
    assert files(folder) == found
    return found


def files(folder):
    """What lies in a folder, without the times that a run took, and the command."""
    found = {name: (folder / name).read_bytes() for name in names(folder)}
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
        printed("run", *words.split(), "-o", folder)
        found[name] = files(folder)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "place", "count", "number"), [
    *(("long", BLOCK, 4, number) for number in (KILL, TERM, INT)),
    ("long", BLOCK, 1, TERM),
    ("long", "heavytop.run.trajectory:Trajectory save", 3, INT),
    ("long", EVENTS, 8, KILL),
    # between steps and files
    *((scene, EVENTS, 1, number) for scene in ("plain", "digits") for number in (KILL, INT)),
    *(("drawn", "heavytop.plots.style save", *at) for at in ((4, KILL), (5, TERM))),
    *((x, "heavytop.results.base write_document", 1, KILL) for x in ("plain", "exact")),
])  # fmt: skip
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
    printed("run", *SCENES["long"].split(), "-o", folder)  # it goes on as well
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


# --- Ctrl-C ------------------------------------------------------------------------------------


BEGIN = """
import pathlib, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
import heavytop as ht
pathlib.Path(sys.argv[1]).write_text("on")
"""
MANY = "A=3.28e-4, C=6.6e-5, gMR=0.0456, theta=[0.1] * 300, psidot=140, time=1e12"
CALLS = [f"ht.propagate_many({MANY}, jobs={threads})" for threads in (1, 2)]
CALLS += ["ht.propagate(ht.load_scene('sicm-kicked', ['want.digits=3000']), formulation='axis')"]


@pytest.mark.slow
@pytest.mark.parametrize("call", CALLS)
def test_ctrl_c_ends_a_call_within_a_second(call, tmp_path):
    """Late in the call, where the steps are; a process that was begun with SIGINT ignored, too."""
    run = begin("-W", "ignore", "-c", BEGIN + call, tmp_path / "ready")
    try:
        soon(tmp_path / "ready")
        time.sleep(2)
        assert run.poll() is None
        os.kill(run.pid, signal.SIGINT)
        began = time.monotonic()
        _, said = run.communicate(timeout=20)
        assert time.monotonic() - began < 5  # a second, and a busy machine
        assert run.returncode != 0
        assert "KeyboardInterrupt" in said or "the run was interrupted" in said
    finally:
        run.kill()
        run.wait()


# --- one folder, one run -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first") / "run"
    printed(*PLAIN, "-o", folder)
    return folder


PLAIN = ("run", "sicm-kicked", "--no-figures")


@pytest.mark.parametrize(("words", "difference"), {
    "sicm-dropped": "scene.start.phidot: -15 there, 0 here",
    "sicm-kicked --formulation axis": 'formulation: "auto" there, "axis" here',
    'sleeping --set want.quantities=["class"]': "scene.start",  # known at once
}.items())  # fmt: skip
def test_another_run_is_refused(first, words, difference):
    before = files(first)
    said = refused(Exit.BAD_SCENE, "run", *words.split(), "-o", first)
    assert all(part in said for part in (f"{first}: ", difference, "--force"))
    assert files(first) == before


def test_a_run_begun_by_other_versions_or_of_another_scene_is_refused(first, monkeypatch, tmp_path):
    for name in ("study.jsonl", "trajectory.nc"):  # as if it had been killed
        (tmp_path / name).write_bytes((first / name).read_bytes())
    here = report_files.versions()
    monkeypatch.setattr(report_files, "versions", lambda: here | {"heyoka": "99"})
    for words in (("resume", tmp_path), (*PLAIN, "-o", tmp_path)):
        assert 'versions.heyoka: "' in refused(3, *words)
    (tmp_path / "run.json").write_bytes((first / "run.json").read_bytes())
    printed(*PLAIN, "-o", tmp_path)  # what is whole goes
    (tmp_path / "run.json").unlink()
    ht.propagate(ht.load_scene("sicm-dropped")).save(tmp_path / "trajectory.nc")
    assert "of another scene (run --force" in refused(3, *PLAIN, "-o", tmp_path)


STUDY = seal(b'{"command":null,"parameters":{"kind":"drift","versions":{}}}').decode()


@pytest.mark.parametrize(("name", "text", "forced", "message"), [
    ("run.json", "{}", (), "not the folder of a study (run.json) (run --force replaces it)"),
    ("study.jsonl", STUDY, ("--force",), "holds a study; a run needs a folder of its own"),
    ("study.jsonl", STUDY.replace("drift", "run"), ("--force",), "line 1: damaged"),
    ("overview.png", "mine", (), "overview.png"),
])  # fmt: skip
def test_a_refusal_takes_nothing_away(tmp_path, name, text, forced, message):
    (tmp_path / name).write_text(text)
    assert message in refused(Exit.BAD_SCENE, "run", "sicm-kicked", *forced, "-o", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} <= {name, "lock"}
    assert (tmp_path / name).read_text() == text


def test_a_run_begins_where_a_journal_is_empty_and_beside_other_files(tmp_path):
    (tmp_path / "study.jsonl").touch()  # of a disk that was full
    (tmp_path / "thesis.tex").touch()
    assert f"{tmp_path}: there is neither a study nor a run" in refused(3, "resume", tmp_path)
    printed(*PLAIN, "-o", tmp_path)
    assert names(tmp_path) == {"run.json", "trajectory.nc", "thesis.tex"}


def test_a_run_that_fails_before_anything_is_stored_leaves_its_folder_to_others(tmp_path):
    """Such as where heyoka is missing: what is installed then is another version."""
    with pytest.MonkeyPatch.context() as patched:
        fail_with(patched, ht.MissingPackage("a run", ["heyoka"]))
        refused(Exit.USAGE, *PLAIN, "-o", tmp_path)
    printed("run", "sicm-dropped", "--no-figures", "-o", tmp_path)
