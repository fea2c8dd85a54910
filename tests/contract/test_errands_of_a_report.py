"""No study that a report runs goes on beyond its time, nor is there after the report."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest
from typer.testing import CliRunner

from heavytop.cli.command import app
from heavytop.report.pages import quick as studies
from heavytop.scene.scene import load_scene

from ..processes import gone, soon

STUBBORN = """
import os, pathlib, signal, subprocess, sys, time
signal.signal(signal.SIGTERM, signal.SIG_IGN)
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
part = pathlib.Path(sys.argv[1] + ".part")
part.write_text(f"{os.getpid()} {child.pid}")
part.rename(sys.argv[1])
time.sleep(60)
"""
"""A command that does not end when it is asked to, and has begun another process."""

LEAVING = """
import pathlib, subprocess, sys
word = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print(1, flush=True); "
child = subprocess.Popen([sys.executable, "-c", word + "time.sleep(60)"], stdout=subprocess.PIPE)
child.stdout.readline()
pathlib.Path(sys.argv[1]).write_text(str(child.pid))
"""
"""A command that ends, and leaves behind what does not."""


def pids_in(path):
    return [int(word) for word in soon(path).split()]


def all_gone(pids):
    return all(map(gone, pids))


def acting(monkeypatch, folder, program):
    """Let a program stand for the command."""
    (folder / "heavytop").mkdir()
    (folder / "heavytop" / "__init__.py").touch()
    (folder / "heavytop" / "__main__.py").write_text(program)
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    monkeypatch.setattr(studies, "GRACE", 0.2)
    return folder / "pids"


def test_what_has_no_time_left_is_gone_with_all_it_began(monkeypatch, tmp_path):
    place = acting(monkeypatch, tmp_path, STUBBORN)
    assert studies.run([str(place)], tmp_path, 2.0)[0] is None
    pids = pids_in(place)
    assert len(pids) == 2
    assert all_gone(pids)


def test_what_a_command_leaves_behind_is_gone(monkeypatch, tmp_path):
    place = acting(monkeypatch, tmp_path, LEAVING)
    assert studies.run([str(place)], tmp_path, 30.0)[0] == 0
    assert all_gone(pids_in(place))


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_nothing_outlives_a_report_that_is_ended(number, tmp_path, monkeypatch):
    pids = acting(monkeypatch, tmp_path, STUBBORN)
    source = f"""
        import signal, sys
        from pathlib import Path
        signal.signal(signal.SIGINT, signal.default_int_handler)
        from heavytop.cli.command import stop_when_ended
        from heavytop.report.pages import quick
        quick.GRACE = 0.2
        sys.path.insert(0, {str(tmp_path)!r})
        stop_when_ended()
        quick.run([{str(pids)!r}], Path({str(tmp_path)!r}), 60.0)
    """
    command = [sys.executable, "-c", textwrap.dedent(source)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as report:
        begun = pids_in(pids)
        os.kill(report.pid, number)
        report.wait(20.0)
        assert all_gone(begun)


def test_what_a_command_says_last_is_known(tmp_path):
    code, said = studies.run(["run", "no-such-scene", "-o", "out"], tmp_path, 60.0)
    assert code == 3
    assert said.startswith("the scene cannot be run: no-such-scene")
    code, said = studies.run(["drift", "sicm-kicked", "--periods", "x"], tmp_path, 60.0)
    assert code == 2
    assert said.startswith("Invalid value for '--periods'")


def test_a_command_prints_its_letters_wherever_the_person_is(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii:strict")
    acting(monkeypatch, tmp_path, "print('\u03b8 of a top')")
    assert studies.run([], tmp_path, 30.0) == (0, "")


def test_a_scene_without_end_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(studies, "LIMIT_S", 4.0)
    own = studies._studies
    monkeypatch.setattr(studies, "_studies", lambda about: [next(own(about))])
    began = time.monotonic()
    missing = studies.quick(tmp_path, ["sicm-kicked", "--set", "span.time=1e9"])
    words = "heavytop run sicm-kicked --set span.time=1e9 --no-figures -o run"
    assert missing == [("run", f"not done in 4 s ({words})")]
    assert time.monotonic() - began < 60  # where it would take hours


@pytest.mark.parametrize("about", [[], ["sicm-kicked"]])
def test_a_slow_study_leaves_the_others_their_time(about, tmp_path, monkeypatch):
    """Where every one of them takes all that it may, each has its share, and the sum is bounded."""
    now, limits = 0.0, {}

    def spent(words, place, limit_s):
        nonlocal now
        now += limit_s
        limits[words[-1]] = limit_s
        return None, ""

    monkeypatch.setattr(studies.time, "monotonic", lambda: now)
    monkeypatch.setattr(studies, "run", spent)
    monkeypatch.setattr(studies, "traces_document", dict)
    missing = studies.quick(tmp_path, about)
    assert len(missing) == len(limits) == (7 if about else 10)
    assert sum(limits.values()) == pytest.approx(studies.LIMIT_S)
    assert min(limits.values()) > 7
    for name in ("workprec", "stress"):
        assert limits[name] > float(studies.BUDGET)
    assert studies.LIMIT_S <= 255


def test_a_scene_of_ones_own_is_found_from_anywhere(tmp_path, monkeypatch):
    (tmp_path / "my scene.toml").write_text(load_scene("sicm-kicked").to_toml())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(studies, "run", lambda words, *_: said.append(words) or (3, "no"))
    monkeypatch.setattr(studies, "traces_document", dict)
    said = []
    done = CliRunner().invoke(app, ["report", "my scene.toml", "--set", "start.phidot=3"])
    assert done.exit_code == 4
    scene = str(tmp_path / "my scene.toml")
    assert said[0] == ("run", scene, "--set", "start.phidot=3", "--no-figures", "-o", "run")
