"""What `workprec` promises on the command line: a document, files, exit codes, its budget kept."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from heavytop.cli import app

QUICK = ("workprec", "sicm-kicked", "--periods", "5", "--budget", "60", "--methods")
FEW = "auto,taylor-axis=1e-9,taylor-axis,taylor-cubic=1e-6,strang=50,kahan-li8=32"


def heavytop_(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    folder = tmp_path_factory.mktemp("work") / "precision"
    return folder, heavytop_(*QUICK, FEW, "-o", folder, "--json")


def test_json_is_one_document_and_nothing_else_is_on_stdout(written):
    _, done = written
    assert done.exit_code == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "heavytop/workprec/1"
    assert {"points", "front", "cheapest", "skipped", "files", "versions"} <= document.keys()
    assert document["scene"]["name"] == "sicm-kicked"
    assert (document["periods"], document["phase"], document["budget"]) == (5, 4.618, 60)
    assert document["skipped"] == []
    assert all(0 <= index < len(document["points"]) for index in document["front"])


def test_the_files(written):
    folder, done = written
    document = json.loads((folder / "workprec.json").read_text())
    assert document == json.loads(done.stdout)
    assert sorted(document["files"].values()) == ["workprec.json", "workprec.png", "workprec.svg"]
    chart = (folder / "workprec.svg").read_text()
    assert "<svg" in chart[:300]
    assert (folder / "workprec.png").read_bytes()[:4] == b"\x89PNG"


def test_every_method_stands_in_the_chart_and_so_does_the_front(written):
    from heavytop.report.workprec_figure import workprec_figure

    folder, _ = written
    document = json.loads((folder / "workprec.json").read_text())
    left, right = workprec_figure(document).axes
    shown = [{line.get_label(): line for line in ax.lines} for ax in (left, right)]
    names = {point["method"] for point in document["points"]}
    assert set(shown[1]) == names | {"front"}
    assert set(shown[0]) == (names | {"front"}) - {"taylor-cubic"}
    for name, lines, error in (
        ("front", shown[0], "error"),
        ("front_theta", shown[1], "theta_error"),
    ):
        front = [document["points"][i] for i in document[name]]
        assert lines["front"].get_xdata().tolist() == [p[error] for p in front]
        assert lines["front"].get_ydata().tolist() == [p["us_per_period"] for p in front]
    for name in names - {"auto"}:
        points = [p for p in document["points"] if p["method"] == name]
        assert shown[1][name].get_xdata().tolist() == [p["theta_error"] for p in points]
    assert left.get_xscale() == left.get_yscale() == "log"


def test_the_table_says_who_is_cheapest_and_where_auto_stands():
    told = heavytop_(*QUICK, "auto=9,taylor-axis=1e-9,kahan-li8=32")
    assert told.exit_code == 0, told.stderr
    for words in ("taylor-axis", "kahan-li8", "32 steps a period", "cheapest: 1e-9", "best rival",
                  "9 digits of axis", "setup [s]"):  # fmt: skip
        assert words in told.stdout


def test_without_figures_there_is_the_document_alone(tmp_path):
    folder = tmp_path / "new"
    done = heavytop_(*QUICK, "taylor-axis=1e-9", "-o", folder, "--no-figures")
    assert done.exit_code == 0
    assert [path.name for path in folder.iterdir()] == ["workprec.json"]


def test_the_budget_is_kept_and_what_it_left_out_is_named():
    began = time.perf_counter()
    done = heavytop_("workprec", "sicm-kicked", "--budget", "3", "--json")
    assert time.perf_counter() - began < 10  # what is compiled is not cut short
    document = json.loads(done.stdout)
    assert done.exit_code == 0
    left_out = {each["method"] for each in document["skipped"]}
    charted = {point["method"] for point in document["points"]}
    assert {"auto", "taylor-axis", "dop853-scipy", "gauss8"} <= left_out | charted
    assert "dop853-scipy" in left_out
    assert all("budget of 3 s" in s["reason"] or "stopped" in s["reason"] or "too long"
               in s["reason"] for s in document["skipped"])  # fmt: skip


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--methods", "dop854-scipy"], 'did you mean "dop853-scipy"?'),
        (["--methods", "strang=-1"], "steps a period from"),
        (["--methods", ""], "one of taylor-"),
        (["--periods", "0"], "--periods"),
        (["--periods", "nan"], "periods"),
        (["--budget", "0"], "--budget"),
        (["--budget", "inf"], "budget"),
        (["--methods", "taylor-axis=1e-9", "-o", "/proc/nowhere"], "cannot write"),
    ],
)
def test_bad_options_are_usage_errors(options, said):
    refused = heavytop_("workprec", "sicm-kicked", *options)
    assert refused.exit_code == 2
    assert said in refused.stderr


def test_a_bad_scene_is_a_bad_scene():
    assert heavytop_("workprec", "separatrix").exit_code == 3


def test_a_missing_package_has_an_exit_code_and_the_pip_line(monkeypatch):
    from heavytop.drifts import methods

    monkeypatch.setattr(methods, "find_spec", lambda name: None if name == "numba" else name)
    missing = heavytop_(*QUICK, "strang")
    assert missing.exit_code == 7
    assert "pip install 'heavytop[rivals]'" in missing.stderr


def test_where_nothing_could_be_run_it_ended_early():
    scene = ("--set", "start.theta=0", "--set", "start.thetadot=1")
    nothing = heavytop_(*QUICK, "taylor-lagrange=1e-9", *scene, "--json")
    assert nothing.exit_code == 4
    document = json.loads(nothing.stdout)
    assert document["points"] == document["front"] == []
    assert "cannot start at a pole" in document["skipped"][0]["reason"]
    assert heavytop_(*QUICK, "taylor-lagrange=1e-9", *scene).exit_code == 4
