"""A run that is killed, stopped or lacks room is finished by `resume`, to the same bits."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import heavytop as ht
import heavytop.report.files
from heavytop.cli import Exit, app
from heavytop.files import locked
from heavytop.report.files import Request

# The command line, in which a signal comes at the n-th call of a function; and which saves often.
COMMAND = """
import os, signal, sys
from importlib import import_module
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGTERM, signal.SIG_DFL)
place, count, number = sys.argv.pop(1), int(sys.argv.pop(1)), int(sys.argv.pop(1))
import heavytop.run.propagation as running
running.EVERY_S = running.SHARE = running.UNSAVED_S = 0.0
module, _, name = place.partition(":")
home, calls = import_module(module), 0
*inner, name = name.split(".")
for each in inner:
    home = getattr(home, each)
whole = getattr(home, name)
def struck(*arguments, **options):
    global calls
    calls += 1
    if calls == count:
        os.kill(os.getpid(), number)
    return whole(*arguments, **options)
setattr(home, name, struck)
from heavytop.cli import main
main()
"""
BLOCK = "heavytop.integration.integrator:_Journey.advance"
EVENTS = "heavytop.run.propagation:no_events"
AT_LAST = "heavytop.run.propagation:orbit_events"
SAVED = "heavytop.run.trajectory:Trajectory.save"
DRAWN = "heavytop.plots.style:save"
TOLD = "heavytop.results.base:write_document"
PRECISE = "heavytop.run.propagation:precise_events"
FOLDED = "heavytop.run.periodic:nutating"
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)

FULL = ("span.periods=4000", "want.samples=9", "want.digits=6")
SCENES = {
    "long": ("sicm-kicked", *(word for key in FULL for word in ("--set", key)), "--no-figures"),
    "drawn": ("sicm-kicked",),
    "plain": ("sicm-kicked", "--no-figures"),
    "digits": ("sicm-kicked", "--digits", "25", "--no-figures", "--formulation", "axis"),
    "folded": ("sicm-kicked", "--set", "span.periods=1e9", "--set", "want.events=[]"),
}


def heavytop_(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def struck(place: str, count: int, number: int, *words: object) -> subprocess.CompletedProcess[str]:
    """Run a command to which a signal comes at the n-th call of a function."""
    asked = [place, str(count), str(int(number)), *map(str, words)]
    command = [sys.executable, "-c", COMMAND, *asked]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


def files(folder: Path) -> dict[str, bytes]:
    """What lies in a folder, without the times that a run took."""
    found = {path.name: path.read_bytes() for path in folder.iterdir()}
    document = json.loads(found["run.json"])
    document["cost"] = document["cost"]["steps"]
    del document["command"]
    return found | {"run.json": json.dumps(document).encode()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, bytes]]:
    """The files of the same runs when nothing happens to them."""
    found = {}
    for name, words in SCENES.items():
        folder = tmp_path_factory.mktemp("whole") / name
        done = heavytop_("run", *words, "-o", folder)
        assert done.exit_code == 0, done.output
        found[name] = files(folder)
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "place", "count", "number"),
    [
        *(("long", BLOCK, 4, number) for number in SIGNALS),
        ("long", BLOCK, 1, signal.SIGTERM),
        ("long", SAVED, 3, signal.SIGINT),
        ("long", EVENTS, 8, signal.SIGKILL),
        *(("plain", AT_LAST, 1, number) for number in SIGNALS),  # between the steps and the files
        ("drawn", DRAWN, 4, signal.SIGKILL),
        ("drawn", DRAWN, 5, signal.SIGTERM),
        ("plain", TOLD, 1, signal.SIGKILL),
        ("plain", TOLD, 1, signal.SIGINT),
        ("digits", PRECISE, 1, signal.SIGKILL),
        ("digits", PRECISE, 1, signal.SIGINT),
        ("folded", FOLDED, 1, signal.SIGKILL),
        ("folded", FOLDED, 1, signal.SIGTERM),
    ],
)
def test_resume_finishes_what_is_there(tmp_path, whole, scene, place, count, number):
    folder = tmp_path / "run"
    stopped = struck(place, count, number, "run", *SCENES[scene], "-o", folder)
    if number == signal.SIGKILL:
        assert stopped.returncode == -signal.SIGKILL, stopped.stderr
    else:
        assert stopped.returncode == 130, stopped.stderr
        assert f"heavytop resume {folder}" in stopped.stderr
        assert "Traceback" not in stopped.stderr
    assert (folder / "request.json").exists()
    again = heavytop_("resume", folder)
    assert again.exit_code == 0, again.output
    assert files(folder) == whole[scene]
    finished = heavytop_("resume", folder)
    assert finished.exit_code == 0
    assert "this run is finished" in finished.stderr
    assert files(folder) == whole[scene]


@pytest.mark.slow
def test_the_steps_that_were_taken_are_not_taken_again(tmp_path, whole):
    folder = tmp_path / "run"
    struck(BLOCK, 6, signal.SIGKILL, "run", *SCENES["long"], "-o", folder)
    part = heavytop.load_trajectory(folder / "trajectory.nc")
    assert part.outcome == "interrupted"
    assert len(part.orbit.checkpoints) == 6
    again = struck(BLOCK, 2, signal.SIGKILL, "resume", folder)  # a block is done, and kept
    assert again.returncode == -signal.SIGKILL
    assert len(heavytop.load_trajectory(folder / "trajectory.nc").orbit.checkpoints) == 7
    done = heavytop_("run", *SCENES["long"], "-o", folder)  # the same command goes on as well
    assert done.exit_code == 0, done.output
    assert files(folder) == whole["long"]


@pytest.mark.slow
@pytest.mark.parametrize("kilobytes", [20, 200])
def test_a_full_disk_ends_a_run_early(tmp_path, whole, kilobytes):
    """The kernel refuses larger files: the trajectory does not fit, or a figure."""
    folder = tmp_path / "run"
    words = f"exec {sys.executable} -m heavytop run sicm-kicked --json -o {folder}"
    command = ["bash", "-c", f"ulimit -f {kilobytes}; {words}"]
    full = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert full.returncode == 4, full.stderr
    assert full.stderr.startswith("heavytop: ended early: cannot write ")
    assert "File too large" in full.stderr
    assert full.stderr.endswith(f"heavytop resume {folder}\n")
    assert json.loads(full.stdout)["final"] == json.loads(whole["drawn"]["run.json"])["final"]
    assert heavytop_("resume", folder).exit_code == 0
    assert files(folder) == whole["drawn"]


def test_a_checkpoint_that_does_not_fit_ends_a_run_early(tmp_path, whole, monkeypatch):
    folder, write, saves = tmp_path / "run", Path.write_bytes, []

    def filling(path, data):
        saves.append(path.name)
        if len(saves) == 3:
            raise OSError(28, "No space left on device")
        return write(path, data)

    monkeypatch.setattr("heavytop.run.propagation.EVERY_S", 0.0)
    monkeypatch.setattr("heavytop.run.propagation.SHARE", 0.0)
    monkeypatch.setattr(Path, "write_bytes", filling)
    full = heavytop_("run", *SCENES["long"], "-o", folder)
    assert full.exit_code == 4
    assert f"ended early: cannot write {folder / 'trajectory.nc'}: No space left" in full.stderr
    assert len(heavytop.load_trajectory(folder / "trajectory.nc").orbit.checkpoints) == 3
    assert heavytop_("resume", folder).exit_code == 0
    assert files(folder) == whole["long"]


def test_a_folder_that_has_gone_is_no_bad_option(tmp_path, monkeypatch):
    folder = tmp_path / "run"
    write = heavytop.report.files.write_results

    def gone(*arguments, **options):
        folder.rename(tmp_path / "elsewhere")
        return write(*arguments, **options)

    monkeypatch.setattr("heavytop.report.files.write_results", gone)
    lost = heavytop_("run", "sicm-kicked", "-o", folder, "--no-figures")
    assert lost.exit_code == 4
    assert "ended early" in lost.stderr
    assert "the folder has gone" in lost.stderr
    assert "heavytop resume" not in lost.stderr


# --- one folder, one run -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("first") / "run"
    assert heavytop_("run", "sicm-kicked", "-o", folder, "--no-figures").exit_code == 0
    return folder


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("sicm-dropped",), "scene.start.phidot: -15 there, 0 here"),
        (("sicm-kicked", "--set", "start.phidot=-3"), "scene.start.phidot: -15 there, -3 here"),
        (("sicm-kicked", "--digits", "11"), "scene.want.digits: 12 there, 11 here"),
        (("sicm-kicked", "--formulation", "axis"), 'formulation: "auto" there, "axis" here'),
        (("sleeping", "--set", 'want.quantities=["class"]'), "scene.start"),  # known at once
    ],
)
def test_another_run_is_refused(first, words, told):
    before = files(first)
    refused = heavytop_("run", *words, "-o", first)
    assert refused.exit_code == 3
    assert f"{first}: holds another run: " in refused.stderr
    assert told in refused.stderr
    assert "(--force replaces it)" in refused.stderr
    assert files(first) == before


@pytest.mark.slow
def test_force_replaces(tmp_path):
    """Also what was on its way: none of its figures stays."""
    folder = tmp_path / "run"
    struck(DRAWN, 4, signal.SIGKILL, "run", "sicm-kicked", "-o", folder)
    assert (folder / "overview.svg").exists()
    words = ("sicm-dropped", "-o", folder, "--no-figures")
    assert heavytop_("run", *words).exit_code == 3
    assert heavytop_("run", *words, "--force").exit_code == 0
    assert {path.name for path in folder.iterdir()} == {"run.json", "trajectory.nc"}
    assert json.loads((folder / "run.json").read_text())["scene"]["name"] == "sicm-dropped"


def test_what_is_no_run_is_refused_and_forced(tmp_path):
    (tmp_path / "run.json").write_text("{}")
    words = ("sicm-kicked", "-o", tmp_path, "--no-figures")
    refused = heavytop_("run", *words)
    assert refused.exit_code == 3
    assert "run.json: scene: Field required (--force replaces it)" in refused.stderr
    assert (tmp_path / "run.json").read_text() == "{}"
    assert heavytop_("run", *words, "--force").exit_code == 0


def test_a_study_is_never_replaced(tmp_path):
    (tmp_path / "study.json").write_text("{}")
    refused = heavytop_("run", "sicm-kicked", "-o", tmp_path, "--force")
    assert refused.exit_code == 3
    assert "holds a study; a run needs a folder of its own" in refused.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["study.json"]


def test_a_run_begun_by_other_versions_is_refused(first, monkeypatch):
    from heavytop.run import trajectory_file

    here = trajectory_file.versions()
    monkeypatch.setattr(trajectory_file, "versions", lambda: here | {"heyoka": "99"})
    refused = heavytop_("resume", first)
    assert refused.exit_code == 3
    assert "heyoka" in refused.stderr


def test_two_runs_do_not_write_one_folder(tmp_path):
    with locked(tmp_path / "lock"):
        refused = heavytop_("run", "sicm-kicked", "-o", tmp_path)
    assert refused.exit_code == 2
    assert f"is being written by process {os.getpid()}" in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["request.json", "trajectory.nc"])
def test_a_damaged_file_of_a_run_is_named(tmp_path, name):
    folder = tmp_path / "run"
    struck(DRAWN, 1, signal.SIGKILL, "run", "sicm-kicked", "-o", folder)
    (folder / name).write_bytes((folder / name).read_bytes()[:100])
    refused = heavytop_("resume", folder)
    assert refused.exit_code == 3
    assert name in refused.stderr
    assert heavytop_("run", "sicm-kicked", "-o", folder, "--force", "--no-figures").exit_code == 0


@pytest.mark.slow
def test_a_trajectory_alone_gets_the_rest(tmp_path):
    words = ("sicm-kicked", "--formulation", "axis")
    assert heavytop_("run", *words, "-o", tmp_path, "--no-figures").exit_code == 0
    (tmp_path / "run.json").unlink()
    assert heavytop_("resume", tmp_path).exit_code == 0
    assert len(json.loads((tmp_path / "run.json").read_text())["files"]) == 12


def test_a_run_that_met_a_singularity_cannot_go_on(tmp_path):
    start = ("start.phidot=0", "start.psidot=0", "start.thetadot=40")  # over the top
    changed = (word for change in start for word in ("--set", change))
    words = ("sicm-kicked", *changed, "--formulation", "lagrange", "-o", tmp_path)
    ended = heavytop_("run", *words, "--no-figures")
    again = heavytop_("resume", tmp_path)
    assert ended.exit_code == again.exit_code == 4
    assert "ended early" in again.stderr


def test_what_a_killed_writer_left_is_taken_away(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    for name in (".1234.trajectory.nc", ".1234.overview.svg", ".1234.mine"):
        (folder / name).write_text("a part")
    assert heavytop_("run", "sicm-kicked", "-o", folder, "--no-figures").exit_code == 0
    left = {path.name for path in folder.iterdir()}
    assert left == {"run.json", "trajectory.nc", ".1234.mine"}


def test_a_refusal_takes_nothing_away(tmp_path):
    """What another run, or somebody, has left in a folder is there after a refusal as before."""
    begun, theirs = tmp_path / "begun", tmp_path / "theirs"
    Request(ht.load_scene("sicm-kicked", ["span.time=1"])).write(_made(begun))
    (_made(theirs) / "request.json").write_text('{"mine": 1}', "utf-8")
    (_made(tmp_path / "drawn") / "overview.png").write_text("mine", "utf-8")
    for folder, name in (
        (begun, "request.json"), (theirs, "request.json"), (tmp_path / "drawn", "overview.png"),
    ):  # fmt: skip
        before = (folder / name).read_bytes()
        done = heavytop_("run", "sicm-dropped", "--set", "span.time=1", "-q", "-o", folder)
        assert done.exit_code == Exit.BAD_SCENE
        assert (folder / name).read_bytes() == before


def _made(folder):
    folder.mkdir(parents=True)
    return folder
