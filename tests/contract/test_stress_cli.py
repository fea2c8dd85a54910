"""What `stress` promises: the document of the contract, its files, its exit codes."""

from __future__ import annotations

import json
import re
import shlex
import signal
import subprocess
import sys
import time

import pytest
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.plots.studies import stress_figure
from heavytop.plots.theory import Cone, stability_figure
from heavytop.results.stress import MARKS, RULES, UNTOLD, Outcome, Run, SkippedRun, Stress
from heavytop.studies import stress as stressing
from heavytop.studies.methods import stress_methods
from heavytop.studies.stress_cases import cases

PROMISED = ("case", "method", "formulation", "outcome", "error", "digits_lost", "steps", "note")
QUICK = ("--cases", "through-top,cusp", "--methods", "auto,taylor-lagrange")


UNTURNED = dict.fromkeys(("phi", "psi", "phidot", "thetadot"), "0")


def stress(*arguments):
    return heavytop_("stress", *arguments)


def heavytop_(*arguments):
    return CliRunner().invoke(app, [str(each) for each in arguments])


def ran(case, method, formulation, outcome, **more):
    return Run(case=case, method=method, formulation=formulation, outcome=outcome, **more)


def made(*runs, skipped=()):
    methods = [stress_methods()[name] for name in dict.fromkeys(run.method for run in runs)]
    return Stress(
        hard={run.case: cases()[run.case].hard for run in runs},
        methods={each.name: f"{each.short} {each.set_to}".rstrip() for each in methods},
        cases=runs,
        skipped=skipped,
        limits={"budget_s": 1.0, "time_s": 1.0, "steps": 1},
    )


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
    assert {row["outcome"] for row in rows.values()} <= {str(word) for word in Outcome}
    assert rows["through-top", "taylor-lagrange"]["outcome"] == "singular"
    assert rows["through-top", "taylor-lagrange"]["error"] is None
    assert rows["cusp", "auto"]["outcome"] == "ok"
    assert rows["cusp", "auto"]["digits_lost"] == 0.0
    assert rows["cusp", "auto"]["steps"] > 0
    assert document["rules"] == {str(word): rule for word, rule in RULES.items()}
    assert document["auto"] == {"run": True, "silently_wrong": []}
    assert document["skipped"] == []


def test_the_files_are_written_and_hold_no_times(quick):
    folder, result = quick
    printed = json.loads(result.stdout)
    assert printed["files"] == {
        "document": "stress.json", "chart_svg": "stress.svg", "chart_png": "stress.png",
    }  # fmt: skip
    written = {path.name for path in folder.iterdir()} - {"study.json", "tasks", "lock"}
    assert written == set(printed["files"].values())
    assert json.loads((folder / "stress.json").read_text()) == printed
    assert "seconds" not in result.stdout
    svg = (folder / "stress.svg").read_text()
    assert svg.count("<text") > 0 or "through-top" in svg


def test_the_words_of_the_contract_are_these():
    words = "ok inaccurate singular stalled diverged step-limit time-limit refused missed-events"
    assert {str(word) for word in Outcome} == set(words.split()) == {str(word) for word in RULES}
    assert set(MARKS) == set(words.split()) - {"ok"}


def test_the_chart_has_the_marks_of_the_table():
    document = made(
        ran("cusp", "auto", "auto", Outcome.OK, digits_lost=0.0),
        ran("cusp", "taylor-axis", "axis", Outcome.STALLED),
        ran("cusp", "taylor-cubic", "cubic", Outcome.OK, digits_lost=0.0, untold=True),
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


def test_the_cases_are_listed_with_what_they_are():
    printed = json.loads(stress("--list", "--json").stdout)
    assert printed["schema"] == "heavytop/stress-cases/1"
    found = {case["name"]: case for case in printed["cases"]}
    assert list(found) == list(cases())
    assert found["cusp"]["start"] == {"theta": "0.1", "psidot": "140"} | UNTURNED
    assert found["cusp"]["top"] == {"A": "3.28e-4", "C": "6.60e-5", "gMR": "0.0456"}
    assert found["separatrix-40"]["span"] == "40 s"
    assert all(case["why"] for case in printed["cases"])
    assert [each["name"] for each in printed["methods"]] == list(stress_methods())
    text = stress("--list").stdout
    assert all(name in text for name in (*cases(), *stress_methods()))
    assert "no case can be added" in text


SOME = ("--cases", "cusp,through-top,lie-group", "--methods", "auto,taylor-lagrange,dop853-scipy",
        "--time-limit", "60")  # fmt: skip


def started(*arguments):
    heard = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); "  # nohup ignores it
    command = heard + "from heavytop.cli import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", command, *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def records(folder):
    return {path.name: path.read_text() for path in folder.glob("tasks/[0-9a-f]*.json")}


def wait_for_records(folder, count, process):
    until = time.monotonic() + 60
    while len(records(folder)) < count and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)


@pytest.fixture(scope="module")
def whole():
    return json.loads(stress(*SOME, "--json").stdout)


@pytest.mark.parametrize("jobs", [1, 2])
def test_killed_at_any_moment_and_resumed_it_finds_the_same(tmp_path, whole, jobs):
    folder = tmp_path / "made" / "here"
    process = started("stress", *SOME, "-o", folder, "-j", jobs)
    for count in (1, 4):
        wait_for_records(folder, count, process)
        process.kill()
        process.communicate(timeout=60)
        before = records(folder)
        process = started("resume", folder, "--json", "-j", jobs)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    after = records(folder)
    assert len(after) == 9
    assert before.items() <= after.items()  # what was done is not done again
    files = ("files", "versions", "limits", "command")
    told = json.loads(out)
    assert {k: v for k, v in told.items() if k not in files} == {
        k: v for k, v in whole.items() if k not in files
    }
    assert json.loads((folder / "stress.json").read_text()) == told
    asked = ["heavytop", "stress", *SOME, "-o", str(folder), "-j", str(jobs)]
    assert shlex.split(told["command"]) == asked  # that which began it


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_whatever_ends_it_says_how_to_go_on(tmp_path, number):
    folder = tmp_path / "made" / "here"
    asked = ("--cases", "start-at-top", "--methods", "auto,lsoda-scipy-lagrange,taylor-axis")
    process = started("stress", *asked, "--time-limit", "3", "-o", folder)
    wait_for_records(folder, 1, process)
    process.send_signal(number)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    if number != signal.SIGHUP:  # then nobody reads it
        assert f"heavytop resume {folder}" in err
    assert heavytop_("resume", folder).exit_code == 0
    assert len(records(folder)) == 3


def test_another_test_is_refused(tmp_path):
    assert stress(*QUICK, "-o", tmp_path / "study").exit_code == 0
    again = stress("--cases", "cusp", "--methods", "auto", "-o", tmp_path / "study")
    assert again.exit_code == 3
    assert "cases[0]" in again.stderr
    merely = heavytop_("resume", tmp_path / "study")
    assert merely.exit_code == 0
    assert "this study is finished" in merely.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--cases", "cups"), 'did you mean "cusp"?'),
        (("--methods", "taylor-axes"), 'did you mean "taylor-axis"?'),
        (("--methods", ""), "a name is empty"),
        (("--budget", "-1"), "budget = -1.0: a number from 0 to"),
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
        ran("cusp", "auto", "auto", Outcome.OK, error=1e-9, digits_lost=5.0),
        ran(
            "cusp",
            "taylor-lagrange",
            "lagrange",
            Outcome.DIVERGED,
            error=1.0,
            digits_lost=14.0,
        ),
        skipped=(
            SkippedRun(
                case="cusp",
                method="taylor-axis",
                reason="its process was lost: killed by SIGSEGV",
                lost=True,
            ),
        ),
    )
    monkeypatch.setattr(stressing, "stress", lambda **_: wrong)
    result = stress()
    assert result.exit_code == 5
    assert "auto is wrong at cusp, and does not say so" in result.stderr
    assert "5.0" in result.stdout
    assert "14.0 div" in result.stdout
    assert "killed by SIGSEGV: cusp/taylor-axis" in " ".join(result.stdout.split())
    named = made(
        ran(
            "cusp",
            "auto",
            "auto",
            Outcome.MISSED_EVENTS,
            error=0.0,
            digits_lost=0.0,
            named=True,
        )
    )
    monkeypatch.setattr(stressing, "stress", lambda **_: named)
    assert stress().exit_code == 0


def test_the_counts_add_up_to_the_runs():
    one = made(
        ran("cusp", "auto", "auto", Outcome.OK), ran("through-top", "auto", "auto", Outcome.OK),
        ran("cusp", "taylor-axis", "axis", Outcome.STALLED),
    )  # fmt: skip
    counts = one.counts()
    assert counts["auto"]["ok"] == 2
    assert counts["taylor-axis"]["stalled"] == 1
    assert sum(map(sum, (each.values() for each in counts.values()))) == 3


def test_what_is_chance_is_counted_as_nothing_to_tell_and_as_nothing_else():
    by_chance = {"error": 1e-3, "digits_lost": 0.0, "untold": True}
    chance = made(
        ran("separatrix-80", "taylor-axis", "axis", Outcome.OK, **by_chance, named=True),
        ran("separatrix-80", "auto", "auto", Outcome.OK, **by_chance),
    )
    counts = chance.counts()
    assert counts["taylor-axis"] == dict.fromkeys(map(str, Outcome), 0) | {"nothing-to-tell": 1}
    assert [run.method for run in chance.silently_wrong] == ["auto"]
    assert re.fullmatch("<Stress: 2 runs of 2 methods at 1 cases, 0 skipped>", repr(chance))
