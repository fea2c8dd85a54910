"""The commands of studies: what they write, how they end, and that a killed one is finished."""

from __future__ import annotations

import json
import random
import re
import shlex
import signal
import subprocess
import sys
import time
from dataclasses import replace
from functools import cache

import pytest

from heavytop.results.stress import Stress, StressOutcome
from heavytop.results.table import Row
from heavytop.studies import study, workers
from heavytop.studies.methods import stress_methods
from heavytop.studies.stress_cases import cases

from ..commands import heavytop_
from .toy import change_parameters, results

PLANE = ("sicm-kicked", "--x", "phidot=-20:20:21", "--y", "psidot=-150:150:19")
QUICK = {
    "drift": ("sicm-kicked", "--periods", 300, "--samples", 5, "--methods", "taylor-axis"),
    "stress": ("--cases", "through-top,cusp", "--methods", "auto,taylor-lagrange"),
    "workprec": ("sicm-kicked", "--periods", 5, "--budget", 60,
                 "--methods", "auto=9,taylor-axis=1e-9,blanes-moan-rkn6=32"),
    "atlas": (*PLANE, "-j", 1),
}  # fmt: skip
LONG = {
    "drift": ("sicm-kicked", "--periods", 200_000, "--samples", 9,
              "--methods", "taylor-attitude,taylor-axis"),
    "stress": ("--cases", "cusp,through-top,lie-group",
               "--methods", "auto,taylor-lagrange,dop853-scipy", "--time-limit", 60),
    "workprec": ("sicm-kicked", "--periods", 5, "--budget", 60,
                 "--methods", "auto=9,taylor-axis,taylor-lagrange,strang=50"),
    "atlas": ("sicm-kicked", "--x", "phidot=-20:20:900", "--y", "psidot=-150:150:900"),
}  # fmt: skip
ADDRESS = "tcp://192.0.2.1:8786"
PLACES = {
    "drift": "heavytop.studies.drift.drift",
    "stress": "heavytop.studies.stress.stress",
    "workprec": "heavytop.studies.work_precision.work_precision",
}


def started(*words):
    heard = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); "  # nohup ignores it
    command = heard + "from heavytop.cli import main; main()"
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [sys.executable, "-c", command, *map(str, words)], stdout=pipe, stderr=pipe, text=True
    )


def files(folder):
    """What lies in a folder, without the command, which names the folder, and without costs."""
    changes = re.compile(rb'\n *"(command|us_per_period)": .*')
    there = (path for path in folder.iterdir() if path.name not in ("study.jsonl", "lock"))
    return results(folder), {path.name: changes.sub(b"", path.read_bytes()) for path in there}


def read(text):
    """The words of an output, however they were broken into lines."""
    return " ".join(text.replace("│", " ").split())


# --- what is written -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A study of each kind, when it is asked for: its folder, and what was printed."""

    @cache
    def study(verb):
        folder = tmp_path_factory.mktemp(verb) / "made" / "here"
        return folder, heavytop_(verb, *QUICK[verb], "--json", "-o", folder)

    return study


@pytest.mark.slow
@pytest.mark.parametrize("verb", QUICK)
def test_json_is_one_document_with_its_files_and_what_is_finished_does_not_change(verb, made):
    folder, done = made(verb)
    assert done.exit_code == 0, done.output
    printed, kept = (json.loads(x) for x in (done.stdout, (folder / f"{verb}.json").read_text()))
    assert printed["schema"] == f"heavytop/{verb}/1"
    assert printed["versions"]
    assert printed["files"] == kept["files"]
    assert {"document", "chart_svg", "chart_png"} <= printed["files"].keys()
    there = {path.name for path in folder.iterdir()} - {"study.jsonl", "lock"}
    assert there == set(printed["files"].values())
    asked = [verb, *map(str, QUICK[verb]), "--json", "-o", str(folder)]
    assert shlex.split(kept["command"]) == ["heavytop", *asked]
    if verb == "drift":
        (shown,), (stored,) = printed["methods"], kept["methods"]
        assert shown["us_per_period"] == stored["us_per_period"] > 0
    before = files(folder)
    again = heavytop_("resume", folder, "--json")
    assert again.exit_code == 0, again.output
    assert f"{folder}: this study is finished" in again.stderr
    if verb in ("drift", "stress"):  # the others say what this process took
        assert files(folder) == before
    if verb == "workprec":
        points = printed["points"], json.loads(again.stdout)["points"]
        once, twice = ([point["us_per_period"] for point in each] for each in points)
        assert once == twice


# --- killed, stopped, full -------------------------------------------------------------------

DROPPED = {"us_per_period", "us_spread", "setup_s", "runs", "pixels_per_s", "jobs",
           "front", "cheapest", "files", "versions",
           "command"}  # fmt: skip


def timeless(value):
    """A document without what depends on the clock."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key not in DROPPED}
    return [timeless(each) for each in value] if isinstance(value, list) else value


def wait_for_records(folder, count, process):
    until = time.monotonic() + 120
    while len(results(folder)) < count and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize(
    ("verb", "jobs"), {"workprec": 1, "drift": 2, "stress": 1, "atlas": 2}.items()
)
def test_killed_at_any_moment_and_resumed_it_is_the_study_that_was_not(verb, jobs, tmp_path):
    whole, folder, draw = tmp_path / "whole", tmp_path / "made" / "here", random.Random(jobs)
    complete = heavytop_(verb, *LONG[verb], "--no-figures", "--json", "-o", whole)
    parallel = ("-j", jobs) if jobs > 1 else ()
    asked = [verb, *LONG[verb], "--no-figures", "-o", folder, *parallel]
    process = started(*asked)
    for count in (1, 4):
        wait_for_records(folder, 1 if verb == "drift" else count, process)
        time.sleep(draw.uniform(0.0, 0.5))
        process.kill()
        process.communicate(timeout=300)
        before = results(folder)
        assert before
        process = started("resume", folder, "--json", "-j", jobs)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    assert timeless(json.loads(out)) == timeless(json.loads(complete.stdout))
    if verb == "workprec":
        assert results(folder).keys() == results(whole).keys()
    else:
        assert results(folder) == results(whole)
    if verb in ("workprec", "stress"):
        assert before.items() <= results(folder).items()  # what was run is not run again
    assert shlex.split(json.loads(out)["command"]) == ["heavytop", *map(str, asked)]


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize(
    ("verb", "number"),
    [("stress", signal.SIGTERM), ("workprec", signal.SIGINT)],
)
def test_whatever_ends_it_says_how_to_go_on(verb, number, tmp_path):
    folder, methods = tmp_path / "study", "auto,lsoda-scipy-lagrange,taylor-axis"
    hangs = ("--cases", "start-at-top", "--methods", methods, "--time-limit", 3)
    process = started(verb, *(hangs if verb == "stress" else LONG[verb]), "-o", folder, "--json")
    wait_for_records(folder, 1, process)
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    # what ends in an `exec` of Python 3.11 ends by SIGINT itself, which a shell calls 130 too
    assert process.returncode in (130, -signal.SIGINT), err
    assert out == ""
    assert f"heavytop resume {folder}" in err
    assert "Traceback" not in err


def full(*about):
    raise OSError(28, "No space left on device", *map(str, about[1:]))


def test_a_chart_that_cannot_be_written_leaves_the_document(tmp_path, monkeypatch):
    monkeypatch.setattr("heavytop.plots.style.save", full)
    done = heavytop_("drift", *QUICK["drift"], "-o", tmp_path)
    assert done.exit_code == 4
    assert f"cannot write {tmp_path}/drift.svg: No space left" in done.stderr
    assert "heavytop resume" in done.stderr
    kept = json.loads((tmp_path / "drift.json").read_text())
    assert kept["methods"]
    assert not any("svg" in name for name in kept["files"].values())
    monkeypatch.undo()
    assert heavytop_("resume", tmp_path).exit_code == 0
    assert (tmp_path / "drift.svg").exists()


# --- what is refused -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "code", "key"),
    [
        (("drift", "sicm-kicked", "--methods", "dop854-scipy"), 2, "methods"),
        (("drift", "sicm-kicked", "--periods", "0"), 2, "periods"),
        (("drift", "separatrix"), 3, "start"),
        (("workprec", "sicm-kicked", "--methods", "strang=-1"), 2, "methods"),
        (("stress", "--cases", "cups"), 2, "cases"),
        (("stress", "--step-limit", "0"), 2, "step_limit"),
        (("resume", "."), 3, "neither"),
    ],
)
def test_what_is_wrong_is_named_and_nothing_is_written(words, code, key, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused = heavytop_(*words)
    assert refused.exit_code == code
    assert key in read(refused.stderr)
    assert "bug" not in refused.stderr
    assert refused.stdout == ""
    assert not list(tmp_path.iterdir())


def test_another_study_or_other_versions_in_a_folder_are_refused(made, monkeypatch):
    folder, _ = made("drift")
    before = files(folder)
    more = ("--seed", 3, "--set", "start.theta=0.2", "-o", folder)
    other = heavytop_("drift", *QUICK["drift"], *more)
    here = study._versions()
    monkeypatch.setattr(study, "_versions", lambda: here | {"heyoka": "99"})
    newer = heavytop_("resume", folder)
    assert (other.exit_code, newer.exit_code) == (3, 3)
    assert "scene.start.theta" in other.stderr
    assert "versions.heyoka" in newer.stderr
    assert files(folder) == before


def test_a_study_with_a_method_that_is_none_is_refused_by_name(made, tmp_path):
    file = tmp_path / "study.jsonl"
    file.write_bytes((made("drift")[0] / file.name).read_bytes())
    change_parameters(tmp_path, lambda known: known.update(methods=["no-such"]))
    refused = heavytop_("resume", tmp_path)
    assert refused.exit_code == 3, refused.output
    assert str(file) in refused.stderr


# --- how each ends ---------------------------------------------------------------------------


def test_auto_silently_wrong_is_a_check_out_of_its_bound(made, monkeypatch):
    found = Stress.load(made("stress")[0] / "stress.json")
    off = {"outcome": StressOutcome.INACCURATE, "digits_lost": 5.0}
    wrong = tuple(Row(run, **off) if run.method == "auto" else run for run in found.cases)
    lost = Row(case="cusp", method="taylor-axis", reason="killed by SIGSEGV", lost=True)
    for runs, code in ((wrong, 5), (found.cases, 0)):
        shown = replace(found, cases=runs, skipped=(lost,))
        monkeypatch.setattr(PLACES["stress"], lambda shown=shown, **_: shown)
        result = heavytop_("stress")
        assert result.exit_code == code
        assert ("auto was silently wrong at cusp" in result.stderr) == (code == 5)
        assert "killed by SIGSEGV: cusp/taylor-axis" in read(result.stdout)


def test_what_the_budget_left_out_is_named_and_nothing_run_is_an_end_too_early():
    nothing = heavytop_("stress", "--cases", "cusp", "--methods", "auto", "--budget", 0)
    assert nothing.exit_code == 4
    assert "the budget was spent: cusp/auto" in read(nothing.stdout)
    assert "nothing was run" in nothing.stderr
    pole = ("--set", "start.theta=0", "--set", "start.thetadot=1", "--json")
    nothing = heavytop_("workprec", "sicm-kicked", "--methods", "taylor-lagrange=1e-9", *pole)
    assert nothing.exit_code == 4
    (left,) = json.loads(nothing.stdout)["skipped"]
    assert "cannot start at a pole" in left["reason"]


def test_a_missing_package_has_an_exit_code_and_the_pip_line(monkeypatch):
    monkeypatch.setattr(
        "heavytop.comparison.methods.find_spec", lambda name: None if name == "numba" else name
    )
    missing = heavytop_("drift", *QUICK["drift"][:-1], "strang")
    assert missing.exit_code == 2
    assert "pip install '.[rivals]'" in missing.stderr


def test_the_cases_are_listed_with_what_they_are():
    printed = json.loads(heavytop_("stress", "--list", "--json").stdout)
    assert [case["name"] for case in printed["cases"]] == list(cases())
    settings = {each["name"]: each["setting"] for each in printed["methods"]}
    assert list(settings) == list(stress_methods())
    assert {"", "2.2e-16", "32/period"} <= {*settings.values()}


# --- a scheduler -----------------------------------------------------------------------------


def test_dask_that_is_missing_is_named_before_anything_is_made(monkeypatch, tmp_path):
    monkeypatch.setattr(workers, "find_spec", lambda name: None)
    words = ("drift", *QUICK["drift"], "-o", tmp_path / "a", "--scheduler", ADDRESS)
    without = heavytop_(*words)
    assert without.exit_code == 2
    assert "a cluster needs distributed: pip install '.[cluster]'" in without.stderr
    assert not (tmp_path / "a").exists()
