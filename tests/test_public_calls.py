"""What is no argument is refused by an error of the package that says what would be one."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app

TOP = ht.Top("3.28e-4", "6.60e-5", "0.0456")
START = ht.State("0.1", phidot=-15, psidot=140)
SCENE = ht.Scene(TOP, START, time="0.01")
MOTION = ht.Motion(TOP, START)
JUNK = (
    None, "x", "", "1e400", "1/0", b"x", float("nan"), float("inf"), -1, 0, 2.5, 1e140, -1e300,
    10**400, True, 1j, [], {}, (1, 2), np.array([1.0, 2.0]), np.array(1.0), np.float32(1), object(),
)  # fmt: skip


@pytest.fixture(scope="module")
def known():
    return ht.fold(SCENE), ht.enclose(TOP, START), ht.propagate(SCENE)


CALLS = {
    **{f"Top({n})": lambda v, _, n=n: ht.Top(**{"A": 1, "C": 1, "gMR": 1} | {n: v})
       for n in ("A", "C", "gMR")},
    **{f"State({n})": lambda v, _, n=n: ht.State(**{"theta": 1} | {n: v})
       for n in ("theta", "phi", "psi", "thetadot", "phidot", "psidot", "omega3")},
    **{f"Scene({n})": lambda v, _, n=n: ht.Scene(**{"top": TOP, "start": START} | {n: v})
       for n in ("time", "periods")},
    **{f"Scene({n})": lambda v, _, n=n: ht.Scene(**{"top": TOP, "start": START, "time": 1} | {n: v})
       for n in ("top", "start", "samples", "quantities", "events", "digits", "title", "name")},
    "Motion": lambda v, _: ht.Motion(TOP, v),
    "Motion.at": lambda v, _: MOTION.at(v),
    "Motion.at digits": lambda v, _: MOTION.at(1, v),
    "Motion.at in digits": lambda v, _: MOTION.at(v, 30),
    "Motion.form": lambda v, _: MOTION.form(v),
    "classify": lambda v, _: ht.classify(v, START),
    "classify_many": lambda v, _: ht.classify_many(A=1, C=1, gMR=1, theta=v, psidot=1),
    "classify_many tags": lambda v, _: ht.classify_many(
        A=1, C=1, gMR=1, theta=1, psidot=1, tags=v),
    "facts": lambda v, _: ht.facts(v),
    "facts of a top": lambda v, _: ht.facts(TOP, v),
    "fold": lambda v, _: ht.fold(v),
    "fold digits": lambda v, _: ht.fold(SCENE, v),
    "folded": lambda v, known: known[0](v),
    "folded decimals": lambda v, known: known[0].decimals(v),
    "enclose digits": lambda v, _: ht.enclose(TOP, START, v).period,
    "enclose limit": lambda v, _: ht.enclose(TOP, START, 15, v).period,
    "enclosure theta": lambda v, known: known[1].theta(v),
    "plan": lambda v, _: ht.plan(v),
    "plan formulation": lambda v, _: ht.plan(SCENE, v),
    "plan projected": lambda v, _: ht.plan(SCENE, projected=v),
    "propagate": lambda v, _: ht.propagate(v),
    "propagate step_limit": lambda v, _: ht.propagate(SCENE, step_limit=v),
    "propagate progress": lambda v, _: ht.propagate(SCENE, progress=v),
    "trajectory": lambda v, known: known[2](v),
    "run_errors": lambda v, _: ht.run_errors(v),
    "sensitivities": lambda v, _: ht.sensitivities(v),
    "state_transition": lambda v, _: ht.state_transition(SCENE, v),
    "sensitivities formulation": lambda v, _: ht.sensitivities(SCENE, v),
    "state_transition times": lambda v, _: ht.state_transition(
        SCENE, "axis", v if np.ndim(v) or not isinstance(v, float) else "x"),
    **{f"atlas {n}": lambda v, _, n=n: ht.atlas(
        SCENE, **{"x": "phidot=-2:2:3", "y": "psidot=-2:2:3", "jobs": 1} | {n: v})
       for n in ("x", "y", "only", "shard", "folder", "progress", "integrate")},
    **{f"drift {n}": lambda v, _, n=n: ht.drift(
        SCENE, **{"methods": ("taylor-axis",), "periods": 2} | {n: v})
       for n in ("methods", "ensemble", "seed", "folder", "progress")},
    "stress progress": lambda v, _: v is not None and ht.stress(
        cases=("kick-1e-9",), methods=("taylor-axis",), progress=v),
    "work_precision progress": lambda v, _: v is not None and ht.work_precision(
        SCENE, progress=v),
    "resume jobs": lambda v, _: ht.resume("no such folder", jobs=v),
    "energy_momentum": lambda v, _: ht.energy_momentum(TOP, v),
    "load_scene": lambda v, _: ht.load_scene(v),
    "load_trajectory": lambda v, _: ht.load_trajectory(v),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", CALLS)
def test_junk_is_refused_by_name_or_served(name, known, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    raw = []
    for value in JUNK:
        try:
            CALLS[name](value, known)
        except ht.HeavyTopError:
            continue
        except Exception as error:
            raw.append(f"{value!r:.40}: {type(error).__name__}: {error}")
    assert raw == []


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: ht.fold(SCENE, digits=10**400), "digits: a whole number from 1 to"),
        (
            lambda: ht.enclose(TOP, START, "x"),
            'from 2 to 10000, not "x"',
        ),
        (
            lambda: ht.propagate(SCENE, step_limit=[]),
            "a whole number, at least 1, not \\[\\]",
        ),
        (lambda: MOTION.at(10**400), "t: finite times"),
        (lambda: ht.facts(TOP), "start: a State"),
        (lambda: ht.facts(MOTION, START), "start: only with a top"),
    ],
)
def test_what_is_wanted_is_said(call, words):
    with pytest.raises(ht.HeavyTopError, match=words):
        call()


def test_facts_of_a_top_and_a_start_are_those_of_its_motion():
    assert ht.facts(TOP, START) == ht.facts(MOTION)


def test_numbers_too_small_to_fold_are_refused():
    with pytest.raises(ht.BadScene, match="more than 4096 bits"):
        ht.fold(ht.Scene(TOP, ht.State("1e-300", phidot=1), time="0.01"))


@pytest.mark.parametrize(
    "change", ["top.A=1e-5", "start.phidot=1e155", "span.time=1e200", "start.phi=x"]
)
def test_what_a_change_breaks_is_blamed_on_it(change, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(CliRunner().invoke(app, ["scenes", "sicm-kicked"]).stdout, "utf-8")
    result = CliRunner().invoke(app, ["plan", str(file), "--set", change])
    assert result.exit_code == 2
    assert "\n--set: " in result.stderr
    assert "mine" not in result.stderr


def test_what_the_file_has_wrong_is_still_blamed_on_it(tmp_path):
    file = tmp_path / "mine.toml"
    text = CliRunner().invoke(app, ["scenes", "sicm-kicked"]).stdout
    file.write_text(text.replace("theta  = 0.1", "theta = 9"), "utf-8")
    result = CliRunner().invoke(app, ["plan", str(file), "--set", "start.phi=x"])
    assert result.exit_code == 3
    assert "mine.toml:" in result.stderr
    assert "\n--set: start.phi" in result.stderr


def command(*words, cwd, **env):
    return subprocess.run(
        [sys.executable, "-m", "heavytop", *words], cwd=cwd, env=dict(os.environ, **env),
        capture_output=True, check=False,
    )  # fmt: skip


def test_a_backend_that_is_none_stops_no_figure(tmp_path):
    done = command("run", "sicm-kicked", "-q", "-o", "out", cwd=tmp_path, MPLBACKEND="nonsense")
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "out" / "overview.svg").exists()


def test_names_beyond_ascii_under_a_locale_of_ascii(tmp_path):
    ascii_only = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}
    (tmp_path / "naïf").mkdir()
    scene = command("scenes", "sicm-kicked", cwd=tmp_path, PYTHONIOENCODING="utf-8").stdout
    (tmp_path / "naïf" / "tøp.toml").write_bytes(scene)
    for words in (
        ("run", "naïf/tøp.toml", "--no-figures", "-o", "naïf/out"),
        ("resume", "naïf/out"),
        ("report", "naïf/out", "-o", "naïf/page"),
    ):
        done = command(*words, "-q", cwd=tmp_path, **ascii_only)
        assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "naïf" / "out" / "run.json").read_text("utf-8"))
    assert found["scene"]["name"] == "tøp"
