"""No study that a report runs goes on beyond its time, nor is there after the report."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

from heavytop.report.pages import errand
from heavytop.report.pages import quick as studies
from heavytop.scene.scene import load_scene

from .processes import gone, soon

STUBBORN = """
import os, pathlib, signal, subprocess, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
part = pathlib.Path(sys.argv[2] + ".part")
part.write_text(f"{os.getpid()} {child.pid}")
part.rename(sys.argv[2])
time.sleep(60)
"""
"""A command that does not end when it is asked to, and has begun another process."""

LEAVING = """
import pathlib, subprocess, sys
word = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(1, flush=True); "
child = subprocess.Popen([sys.executable, "-c", word + "time.sleep(60)"], stdout=subprocess.PIPE)
child.stdout.readline()
pathlib.Path(sys.argv[2]).write_text(str(child.pid))
"""
"""A command that ends, and leaves behind what does not."""


def pids_in(path):
    return [int(word) for word in soon(path).split()]


def all_gone(pids):
    return all(map(gone, pids))


@pytest.fixture
def stubborn(monkeypatch, tmp_path):
    monkeypatch.setattr(errand, "_BOOT", STUBBORN)
    monkeypatch.setattr(errand, "GRACE", 0.2)
    return tmp_path / "pids"


def test_what_has_no_time_left_is_gone_with_all_it_began(stubborn, tmp_path):
    ended = errand.run([str(stubborn)], tmp_path, 2.0)
    assert ended.code is None
    pids = pids_in(stubborn)
    assert len(pids) == 2
    assert all_gone(pids)


def test_what_a_command_leaves_behind_is_gone(stubborn, tmp_path, monkeypatch):
    monkeypatch.setattr(errand, "_BOOT", LEAVING)
    assert errand.run([str(stubborn)], tmp_path, 30.0).code == 0
    assert all_gone(pids_in(stubborn))


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_nothing_outlives_a_report_that_is_killed(number, tmp_path):
    pids = tmp_path / "pids"
    source = f"""
        from pathlib import Path
        from heavytop.cli.ending import ending
        from heavytop.report.pages import errand
        errand._BOOT, errand.GRACE = {STUBBORN!r}, 0.2
        with ending():
            errand.run([{str(pids)!r}], Path({str(tmp_path)!r}), 60.0)
    """
    command = [sys.executable, "-c", textwrap.dedent(source)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as report:
        begun = pids_in(pids)
        os.kill(report.pid, number)
        report.wait(20.0)
        assert all_gone(begun)


def test_what_a_command_says_last_is_known(tmp_path):
    ended = errand.run(["run", "no-such-scene", "-o", str(tmp_path / "out")], tmp_path, 60.0)
    assert ended.code == 3
    assert ended.said.startswith("the scene cannot be run: no-such-scene")
    ended = errand.run(["drift", "sicm-kicked", "--periods", "x"], tmp_path, 60.0)
    assert ended.code == 2
    assert ended.said.startswith("Invalid value for '--periods'")


def test_a_command_prints_its_letters_wherever_the_person_is(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii:strict")
    monkeypatch.setattr(errand, "_BOOT", "print('\u03b8 of a top')")
    assert errand.run([], tmp_path, 30.0) == (0, "")


def test_a_scene_without_end_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(studies, "LIMIT_S", 4.0)
    own = studies._studies
    monkeypatch.setattr(studies, "_studies", lambda *about: list(own(*about))[:1])
    began = time.monotonic()
    endless = load_scene("sicm-kicked", overrides=["span.time=1e9"])
    missing = studies.quick(tmp_path, endless, asked=["my scene.toml"])
    assert missing == [("run", "not done in 4 s (heavytop run 'my scene.toml' -o out/run)")]
    assert time.monotonic() - began < 60  # where it would take hours


@pytest.mark.parametrize("scene", [None, "sicm-kicked", "sleeping-unstable"])
def test_a_slow_study_leaves_the_others_their_time(scene, tmp_path, monkeypatch):
    """Where every one of them takes all that it may, each has its share, and the sum is bounded."""
    now, limits = 0.0, {}

    def spent(words, place, limit_s):
        nonlocal now
        now += limit_s
        limits[place.parent.name] = limit_s
        return errand.Ended(None, "")

    monkeypatch.setattr(studies.time, "monotonic", lambda: now)
    monkeypatch.setattr(studies, "run", spent)
    monkeypatch.setattr(studies, "_traces", lambda folder: None)
    missing = studies.quick(tmp_path, scene and load_scene(scene))
    assert len(missing) == len(limits) == (7 if scene else 10)
    assert sum(limits.values()) == pytest.approx(studies.LIMIT_S)
    assert min(limits.values()) > 7
    for name in ("workprec-aside", "stress-aside"):
        assert limits[name] > float(studies.BUDGET)
    assert studies.LIMIT_S <= 255


def test_a_scene_of_ones_own_is_run_as_it_was_read(tmp_path):
    scene = load_scene("sicm-kicked", overrides=['start.phidot="-14.1 rad/s"', 'title="$ <b>"'])
    (run, *_) = studies._studies(tmp_path, scene, [])
    again = load_scene(run.words[1])
    assert (again.name, again) == (scene.name, scene)
