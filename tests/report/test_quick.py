"""A report without results runs the quick studies: each in its time, none outlives the report."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from heavytop.cli.command import app
from heavytop.files import write_document
from heavytop.report import quick
from heavytop.scene.scene import load_scene

from ..processes import gone, soon
from .conftest import validate

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


@pytest.fixture
def acting(monkeypatch, tmp_path):
    """Let a program stand for the command; its first word is where it writes."""
    (tmp_path / "heavytop").mkdir()
    (tmp_path / "heavytop" / "__init__.py").touch()
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(quick, "GRACE", 0.2)
    return (tmp_path / "heavytop" / "__main__.py").write_text


@pytest.mark.processes
@pytest.mark.parametrize(
    ("program", "limit", "ended", "count"), [(STUBBORN, 2.0, None, 2), (LEAVING, 30.0, 0, 1)]
)
def test_a_command_is_gone_with_all_it_began(acting, tmp_path, program, limit, ended, count):
    acting(program)
    code, _ = quick.run([str(tmp_path / "pids")], tmp_path, limit)
    pids = pids_in(tmp_path / "pids")
    assert (code, len(pids)) == (ended, count)
    assert all(map(gone, pids))


ENDED = """
import signal, sys
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)
from heavytop.cli.command import stop_when_ended
from heavytop.report import quick
quick.GRACE = 0.2
sys.path.insert(0, sys.argv[1])
stop_when_ended()
quick.run([f"{sys.argv[1]}/pids"], Path(sys.argv[1]), 60.0)
"""


@pytest.mark.processes
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_nothing_outlives_a_report_that_is_ended(number, tmp_path, acting):
    acting(STUBBORN)
    command = [sys.executable, "-c", ENDED, str(tmp_path)]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as report:
        begun = pids_in(tmp_path / "pids")
        os.kill(report.pid, number)
        report.wait(20.0)
        assert all(map(gone, begun))


def test_what_a_command_says_last_is_known_wherever_the_person_is(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "ascii:strict")
    code, said = quick.run(["run", "no-such-θ", "-o", "out"], tmp_path, 60.0)
    assert code == 3
    assert said.startswith("the input is not valid: no-such-θ")


@pytest.mark.parametrize(
    ("about", "count", "used"), [([], 10, 1), (["sicm-kicked"], 7, 1), (["sicm-kicked"], 7, 0)]
)
def test_each_has_its_share_of_the_time_and_what_it_leaves(
    about, count, used, tmp_path, monkeypatch
):
    now, limits, heard = 0.0, {}, []

    def spent(words, place, limit_s):
        nonlocal now
        now += used * limit_s
        limits[words[-1]] = limit_s
        (place / words[-1]).mkdir()  # a part, which goes
        return None, ""

    monkeypatch.setattr(quick.time, "monotonic", lambda: now)
    monkeypatch.setattr(quick, "run", spent)
    monkeypatch.setattr(quick, "traces_document", dict)
    missing = quick.quick(tmp_path, about, heard.append)
    assert [name for name, _ in missing] == list(limits) == heard
    left = [quick.LIMIT_S / (count if used else count - k) for k in range(count)]
    assert [*limits.values()] == pytest.approx(left)
    assert missing[0][1].startswith(f"not done in {left[0]:.0f} s (heavytop run")
    assert {path.name for path in tmp_path.iterdir()} == (set() if about else {"traces"})


@pytest.fixture
def quickly(monkeypatch, tmp_path):
    """Quick studies that are quicker still: the claims are there at once, and nothing else is."""

    def ended(words, place, limit_s):
        asked.append(words)
        if words[0] == "validate":
            (place / words[-1]).mkdir()
            write_document(place / words[-1] / "validate.json", validate())
            return 0, ""
        return None if words[0] == "drift" else 3, f"{words[-1]}: no <b>"

    asked = []
    trace = {"name": "x", "title": "x", "kind": "loops", "tags": [], "seconds": 1.0,
             "axis": [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]]}  # fmt: skip
    traces = {"schema": "heavytop/traces/1", "traces": [trace]}
    monkeypatch.setattr(quick, "run", ended)
    monkeypatch.setattr(quick, "traces_document", lambda: traces)
    monkeypatch.chdir(tmp_path)
    return asked


def report(*words):
    return CliRunner().invoke(app, ["report", *map(str, words)])


def test_without_anything_the_studies_are_run_and_what_was_not_is_said(quickly, tmp_path):
    for _ in range(2):  # a report may be replaced
        assert report().exit_code == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html"]
    page = (tmp_path / "report.html").read_text("utf-8")
    drifting = f"--periods 1000 --methods {','.join(quick.DRIFTING)}"
    command = f"heavytop drift sicm-kicked {drifting} --no-figures -o drift"
    assert re.search(rf"drift: not done in \d+ s \({command}\)", page)
    assert "atlas: atlas: no &lt;b&gt; (heavytop atlas sicm-kicked --x phidot=-30:40:300" in page


def test_a_scene_of_ones_own_is_found(quickly, tmp_path):
    scene = tmp_path / "my scene.toml"
    scene.write_text(load_scene("sicm-kicked").to_toml())
    done = report("my scene.toml", "--set", "start.phidot=-14", "--json")
    document = json.loads(done.stdout)
    missing = {each["study"]: each["reason"] for each in document["missing"]}
    assert {*missing} == {"run", "drift", "workprec", "stress", "atlas", "energy_momentum"}
    assert (document["file"], document["results"]) == ("report.html", ["validate/validate.json"])
    own = ("run", str(scene), "--set", "start.phidot=-14", "--no-figures", "-o", "run")
    assert (quickly[0], missing["run"]) == (own, f"run: no <b> ({shlex.join(('heavytop', *own))})")


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("no-such-scene", 3), ("{here} no-such-folder", 2), ("sicm-kicked sicm-dropped", 2),
        ("{here} --set start.phidot=3", 2), ("--set start.phidot=3", 2),
        ("sicm-kicked --set start.phidot=x", 2),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused(quickly, words, code, tmp_path):
    here = Path(__file__).parent
    assert report(*(word.format(here=here) for word in words.split())).exit_code == code
    assert not list(tmp_path.iterdir())


def test_traces_are_of_every_scene_in_closed_form_and_thinned_evenly():
    traces = {each["name"]: each for each in quick.traces_document()["traces"]}
    assert traces["sleeping"]["pushed"] == 1.0
    assert traces["sicm-kicked"]["pushed"] is None
    assert traces["sicm-kicked"]["seconds"] == pytest.approx(3 * 0.542895518188)
    for each in traces.values():
        assert len(each["axis"]) == quick.TRACE_POINTS
        assert all(abs(sum(x * x for x in axis) - 1) < 3e-5 for axis in each["axis"])
