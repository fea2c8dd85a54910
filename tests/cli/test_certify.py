"""`heavytop certify`: a scene, a stored run, what is refused, and exit codes."""

import json
import random
import subprocess
import sys
import time
from dataclasses import replace

import pytest

import heavytop as ht
from heavytop.results.certificate import Certificate

from ..commands import heavytop_
from ..studies.toy import results


def test_a_scene_is_run_and_certified():
    found = heavytop_("certify", "sicm-kicked")
    assert found.exit_code == 0
    for words in (
        "proved bound",
        "whole turns proved",
        "turning 8, none missed",
        "bounds proved of axis, θ, φ, ψ",
    ):
        assert words in " ".join(found.stdout.split())


def test_a_stored_run_has_the_certificate_of_its_scene(tmp_path):
    run = tmp_path / "run"
    assert heavytop_("run", "sicm-dropped", "--no-figures", "-o", run).exit_code == 0
    stored = heavytop_("certify", run, "--json", "-o", tmp_path / "proof")
    assert stored.exit_code == 0
    known = json.loads(stored.stdout)
    assert known["schema"] == "heavytop/certify/1"
    assert known["bound"] == ht.certify(ht.propagate(ht.load_scene("sicm-dropped"))).bound
    kept = Certificate.load(tmp_path / "proof" / "certify.json")
    assert kept.bound == known["bound"]
    again = heavytop_("resume", tmp_path / "proof", "--json")
    assert json.loads(again.stdout)["bound"] == known["bound"]


def test_a_stored_run_of_other_bits_is_refused(tmp_path):
    run = ht.propagate(ht.load_scene("sicm-kicked"))
    states = run.orbit.samples.states.copy()
    states[200, 0] += 1e-13
    wrong = replace(run.orbit, samples=run.orbit.samples._replace(states=states))
    replace(run, orbit=wrong).save(tmp_path / "trajectory.nc")
    found = heavytop_("certify", tmp_path)
    assert found.exit_code == 3
    assert "its samples are others" in found.stderr


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("sicm-kicked", "--formulation", "lagrange"), 3, "axis and attitude"),
        (("sicm-kicked", "--set", "want.digits=30"), 3, "more digits than doubles"),
    ],
)
def test_what_has_no_certificate_is_refused(words, code, says, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = heavytop_("certify", *words)
    assert found.exit_code == code
    assert says in " ".join(found.stderr.split())


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize("jobs", [2])
def test_killed_at_any_moment_and_resumed_it_is_the_certificate_that_was_not(jobs, tmp_path):
    asked, draw = ("certify", "sicm-kicked", "--set", "span.periods=4000"), random.Random(jobs)
    whole = heavytop_(*asked, "-o", tmp_path / "whole", "--json")
    assert whole.exit_code == 0
    folder = tmp_path / "killed"
    process = _started(*asked, "-o", folder, "-j", jobs)
    for count in (1, 4):
        until = time.monotonic() + 120
        while len(results(folder)) < count and process.poll() is None and time.monotonic() < until:
            time.sleep(0.02)
        time.sleep(draw.uniform(0.0, 0.3))
        process.kill()
        process.communicate(timeout=120)
        assert results(folder)
        process = _started("resume", folder, "--json", "-j", jobs)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    known, made = json.loads(out), json.loads(whole.stdout)
    assert {name for name in made if made[name] != known[name]} <= {"command", "files"}
    assert results(folder) == results(tmp_path / "whole")


def _started(*words):
    command = [sys.executable, "-c", "from heavytop.cli import main; main()", *map(str, words)]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)
