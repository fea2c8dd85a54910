"""What `stress` promises: the document of the contract, its files, its exit codes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.plots.stability import Cone, stability_figure
from heavytop.plots.stress import stress_figure
from heavytop.results.stress_marks import MARKS, UNTOLD
from heavytop.studies.stresses import stressing
from heavytop.studies.stresses.cases import cases
from heavytop.studies.stresses.methods import METHODS
from heavytop.studies.stresses.outcome import RULES, Word
from heavytop.studies.stresses.stress import Run, Skipped, Stress

PROMISED = ("case", "method", "formulation", "outcome", "error", "digits_lost", "steps", "note")
QUICK = ("--cases", "through-top,cusp", "--methods", "auto,taylor-lagrange")


UNTURNED = dict.fromkeys(("phi", "psi", "phidot", "thetadot"), "0")


def stress(*arguments):
    return CliRunner().invoke(app, ["stress", *map(str, arguments)])


def made(*runs, skipped=()):
    chosen = dict.fromkeys(run.case for run in runs), dict.fromkeys(run.method for run in runs)
    return Stress(
        tuple(cases()[name] for name in chosen[0]), tuple(METHODS[name] for name in chosen[1]),
        runs, skipped, {"budget_s": 1.0, "time_s": 1.0, "steps": 1},
    )  # fmt: skip


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stress") / "made" / "here"
    return folder, stress(*QUICK, "--json", "-o", folder)


def test_the_document_is_the_one_that_is_promised(quick):
    document = json.loads(quick[1].stdout)
    assert quick[1].exit_code == 0
    assert document["schema"] == "heavytop/stress/1"
    rows = {(row["case"], row["method"]): row for row in document["cases"]}
    assert len(rows) == 4
    assert all(set(PROMISED) <= set(row) for row in rows.values())
    assert {row["outcome"] for row in rows.values()} <= {str(word) for word in Word}
    assert rows["through-top", "taylor-lagrange"]["outcome"] == "singular"
    assert rows["through-top", "taylor-lagrange"]["error"] is None
    assert rows["cusp", "auto"]["outcome"] == "ok"
    assert rows["cusp", "auto"]["digits_lost"] == 0.0
    assert rows["cusp", "auto"]["steps"] > 0
    assert rows["cusp", "auto"]["smallest_step"] > 0
    assert document["rules"] == {str(word): rule for word, rule in RULES.items()}
    assert document["auto"] == {"run": True, "silently_wrong": []}
    assert document["skipped"] == document["apart"] == []


def test_the_files_are_written_and_hold_no_times(quick):
    folder, result = quick
    printed = json.loads(result.stdout)
    assert printed["files"] == {
        "document": "stress.json", "chart_svg": "stress.svg", "chart_png": "stress.png",
    }  # fmt: skip
    assert {path.name for path in folder.iterdir()} == set(printed["files"].values())
    assert json.loads((folder / "stress.json").read_text()) == printed
    assert "seconds" not in result.stdout
    svg = (folder / "stress.svg").read_text()
    assert svg.count("<text") > 0 or "through-top" in svg


def test_the_words_of_the_contract_are_these():
    words = "ok inaccurate singular stalled diverged step-limit time-limit refused missed-events"
    assert {str(word) for word in Word} == set(words.split()) == {str(word) for word in RULES}
    assert set(MARKS) == set(words.split()) - {"ok"}


def test_the_chart_has_the_marks_of_the_table():
    document = made(
        Run("cusp", "auto", "auto", Word.OK, digits_lost=0.0),
        Run("cusp", "taylor-axis", "axis", Word.STALLED),
        Run("cusp", "taylor-cubic", "cubic", Word.OK, digits_lost=0.0, untold=True),
    ).document()
    figure = stress_figure(document)
    drawn = [text.get_text() for text in figure.axes[0].texts]
    assert drawn == [MARKS["stalled"], UNTOLD]
    said = figure.axes[0].get_xlabel()
    assert all(f"{mark} {word}" in said.replace("\n", " ") for word, mark in MARKS.items())
    heads = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert heads == ["auto", "axis 2.2e-16", "cubic 2.2e-16"]


def test_the_chart_of_stability_reads_moduli_and_runs():
    def labels(*cones):
        line = [(0.1, 0.9), (1.0, 0.0)]
        return stability_figure(cones, line, line, line).axes[0].get_legend_handles_labels()[1]

    good, bad = Cone(1.2, 0.5, False, 1e-15, 1e-6), Cone(0.9, 1.4, True, 1e-3, 1.0)
    assert "slow: multipliers on the circle" in labels(good)
    assert not {"multipliers off the circle", "pushed runs that leave it"} & set(labels(good))
    assert {"multipliers off the circle", "pushed runs that leave it"} <= set(labels(good, bad))
    assert "fast: multipliers on the circle" not in labels(good, bad)


def test_a_person_reads_what_failed_and_why():
    result = stress(*QUICK)
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    assert "through-top 0 sing" in text
    assert "lagrange case auto 2.2e-16" in text
    assert "through-top singular: taylor-lagrange: the equations are singular" in text
    assert "auto silently wrong: nowhere" in text


def test_what_was_skipped_is_read_by_name_and_nothing_run_is_an_end_too_early():
    result = stress("--cases", "cusp", "--methods", "auto", "--budget", 0)
    assert result.exit_code == 4
    text = " ".join(result.stdout.split())
    assert "the budget was spent: cusp/auto" in text
    assert "auto was not run" in text
    assert "nowhere" not in text
    assert "nothing was run" in result.stderr


def test_a_pair_that_does_not_go_together_is_named():
    result = stress("--cases", "cusp", "--methods", "dop853-scipy-first-order", "--json")
    assert result.exit_code == 4
    [pair] = json.loads(result.stdout)["apart"]
    assert (pair["case"], pair["method"]) == ("cusp", "dop853-scipy-first-order")
    assert "first-order only" in pair["reason"]
    seen = stress("--cases", "cusp", "--methods", "dop853-scipy-first-order").stdout
    assert "left out dop853-scipy-first-order at 1 case: " in " ".join(seen.split())


def test_the_cases_are_listed_with_what_they_are():
    printed = json.loads(stress("--list", "--json").stdout)
    assert printed["schema"] == "heavytop/stress-cases/1"
    found = {case["name"]: case for case in printed["cases"]}
    assert list(found) == list(cases())
    assert found["cusp"]["start"] == {"theta": "0.1", "psidot": "140"} | UNTURNED
    assert found["cusp"]["top"] == {"A": "3.28e-4", "C": "6.60e-5", "gMR": "0.0456"}
    assert found["separatrix-40"]["span"] == "40 s"
    assert all(case["why"] for case in printed["cases"])
    assert [each["name"] for each in printed["methods"]] == list(METHODS)
    text = stress("--list").stdout
    assert all(name in text for name in (*cases(), *METHODS))
    assert "no case can be added" in text


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_whatever_ends_it_no_empty_folders_are_left(tmp_path, number):
    folder = tmp_path / "made" / "here"
    heard = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); "  # nohup ignores it
    command = heard + "from heavytop.cli import main; main()"
    asked = ("stress", "--cases", "start-at-top", "--methods", "lsoda-scipy-lagrange")
    options = ("--time-limit", "60", "-o", str(folder))
    going = subprocess.Popen(
        [sys.executable, "-c", command, *asked, *options],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        until = time.monotonic() + 30
        while not folder.exists() and time.monotonic() < until:
            time.sleep(0.05)
        assert folder.exists()
        time.sleep(0.3)
        os.kill(going.pid, number)
        assert going.wait(20) == 130
    finally:
        going.kill()
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--cases", "cups"), 'did you mean "cusp"?'),
        (("--methods", "taylor-axes"), 'did you mean "taylor-axis"?'),
        (("--methods", ""), "a name is empty"),
        (("--budget", "-1"), "--budget"),
        (("--time-limit", "0"), "time_limit = 0.0"),
        (("--step-limit", "0"), "step_limit = 0"),
    ],
)
def test_a_bad_option_is_the_options_fault(arguments, said):
    result = stress(*arguments)
    assert result.exit_code == 2
    assert said in " ".join(result.stderr.replace("│", " ").split())
    assert result.stdout == ""


def test_a_folder_that_cannot_be_written_is_refused_before_anything_runs(tmp_path):
    (tmp_path / "file").write_text("")
    result = stress(*QUICK, "-o", tmp_path / "file" / "inside")
    assert result.exit_code == 2
    assert "-o" in result.stderr


def test_auto_silently_wrong_is_a_check_out_of_its_bound(monkeypatch):
    wrong = made(
        Run("cusp", "auto", "auto", Word.OK, error=1e-9, digits_lost=5.0),
        Run("cusp", "taylor-lagrange", "lagrange", Word.DIVERGED, error=1.0, digits_lost=14.0),
        skipped=(Skipped("cusp", "taylor-axis", "its process was lost: killed by SIGSEGV"),),
    )
    monkeypatch.setattr(stressing, "stress", lambda **_: wrong)
    result = stress()
    assert result.exit_code == 5
    assert "auto is wrong at cusp, and does not say so" in result.stderr
    assert "5.0" in result.stdout
    assert "14.0 div" in result.stdout
    assert "killed by SIGSEGV: cusp/taylor-axis" in " ".join(result.stdout.split())
    named = made(Run("cusp", "auto", "auto", Word.MISSED_EVENTS, 0.0, 0.0, named=True))
    monkeypatch.setattr(stressing, "stress", lambda **_: named)
    assert stress().exit_code == 0


def test_the_counts_add_up_to_the_runs():
    one = made(
        Run("cusp", "auto", "auto", Word.OK), Run("through-top", "auto", "auto", Word.OK),
        Run("cusp", "taylor-axis", "axis", Word.STALLED),
    )  # fmt: skip
    counts = one.counts()
    assert counts["auto"]["ok"] == 2
    assert counts["taylor-axis"]["stalled"] == 1
    assert sum(map(sum, (each.values() for each in counts.values()))) == 3


def test_what_is_chance_is_counted_as_nothing_to_tell_and_as_nothing_else():
    chance = made(
        Run("separatrix-80", "taylor-axis", "axis", Word.OK, 1e-3, 0.0, untold=True, named=True),
        Run("separatrix-80", "auto", "auto", Word.OK, 1e-3, 0.0, untold=True),
    )
    counts = chance.counts()
    assert counts["taylor-axis"] == dict.fromkeys(map(str, Word), 0) | {"nothing-to-tell": 1}
    assert [run.method for run in chance.silently_wrong] == ["auto"]
    assert re.fullmatch("<Stress: 2 runs of 2 methods at 1 cases, 0 skipped>", repr(chance))
