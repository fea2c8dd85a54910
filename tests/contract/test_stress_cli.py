"""What `stress` promises: the document of the contract, its files, its exit codes."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.report.stress_figure import LETTERS
from heavytop.report.stress_table import MARKS
from heavytop.stresses import stressing
from heavytop.stresses.cases import cases
from heavytop.stresses.methods import METHODS
from heavytop.stresses.outcome import RULES, Word
from heavytop.stresses.stress import Run, Skipped, Stress

PROMISED = ("case", "method", "formulation", "outcome", "error", "digits_lost", "steps", "note")
QUICK = ("--cases", "through-top,cusp", "--methods", "auto,taylor-lagrange")


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
    assert document["auto"] == {"silently_wrong": []}
    assert document["skipped"] == []


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
    assert set(MARKS) == set(LETTERS) == set(words.split()) - {"ok"}


def test_a_person_reads_what_failed_and_why():
    result = stress(*QUICK)
    assert result.exit_code == 0
    text = " ".join(result.stdout.split())
    assert "through-top 0 sing" in text
    assert "through-top singular: taylor-lagrange: the equations are singular" in text
    assert "auto silently wrong: nowhere" in text


def test_what_was_skipped_is_read_by_name():
    result = stress("--cases", "cusp", "--methods", "auto", "--budget", 0)
    assert result.exit_code == 0
    assert "the budget was spent: cusp/auto" in " ".join(result.stdout.split())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--cases", "cups"), 'did you mean "cusp"?'),
        (("--methods", "taylor-axes"), 'did you mean "taylor-axis"?'),
        (("--methods", ""), "methods"),
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
