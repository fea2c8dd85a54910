"""What `workprec` promises on the command line: a document, files, exit codes, its budget kept."""

from __future__ import annotations

import errno
import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import heavytop as ht
from heavytop.cli import app

QUICK = ("workprec", "sicm-kicked", "--periods", "5", "--budget", "60", "--methods")
FEW = (
    "auto,taylor-axis=1e-9,taylor-axis,taylor-cubic=1e-6,taylor-cubic-longdouble,strang=50,"
    "kahan-li8=32"
)


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
    from heavytop.plots.studies import workprec_figure

    folder, _ = written
    document = json.loads((folder / "workprec.json").read_text())
    left, right, _, more = workprec_figure(document).axes  # doubles above, more bits below
    shown = [{line.get_label(): line for line in ax.lines} for ax in (left, right, more)]
    precise = {"taylor-cubic-longdouble"}
    names = {point["method"] for point in document["points"]} - precise
    assert set(shown[2]) == precise | {"front"}
    assert set(shown[1]) == names | {"front"}
    assert set(shown[0]) == (names | {"front"}) - {"taylor-cubic"}
    for name, lines, error in (
        ("front", shown[0], "error"),
        ("front_theta", shown[1], "theta_error"),
    ):
        front = [p for i in document[name] if (p := document["points"][i])["bits"] == 53]
        assert lines["front"].get_xdata().tolist() == [p[error] for p in front]
        assert lines["front"].get_ydata().tolist() == [p["us_per_period"] for p in front]
    for name in names - {"auto"}:
        points = [p for p in document["points"] if p["method"] == name]
        assert shown[1][name].get_xdata().tolist() == [p["theta_error"] for p in points]
    for lines, wants, error in ((shown[0], "axis", "error"), (shown[1], "theta", "theta_error")):
        chosen = [p for p in document["points"] if p.get("wants") == wants]
        assert lines["auto"].get_xdata().tolist() == [p[error] for p in chosen]
    assert left.get_xscale() == left.get_yscale() == "log"
    assert {text.get_text() for ax in (left, right) for text in ax.texts} == {
        "auto: 6, 9, 12 digits"
    }
    colour = {name: shown[1][name].get_color() for name in names - {"auto"}}
    assert colour["taylor-cubic"] == shown[2]["taylor-cubic-longdouble"].get_color()
    assert len({colour[name] for name in ("taylor-cubic", "taylor-axis", "strang")}) == 3


def test_the_table_says_who_is_cheapest_and_where_auto_stands():
    told = heavytop_(*QUICK, "auto=9,taylor-axis=1e-9,kahan-li8=32")
    assert told.exit_code == 0, told.stderr
    for words in ("taylor-axis", "kahan-li8", "32 steps a period", "axis to 1e-9", "best rival",
                  "9 digits of axis", "auto, 9 of θ", "setup"):  # fmt: skip
        assert words in " ".join(told.stdout.split())


def test_without_figures_there_is_the_document_alone(tmp_path):
    folder = tmp_path / "new"
    done = heavytop_(*QUICK, "taylor-axis=1e-9", "-o", folder, "--no-figures")
    assert done.exit_code == 0
    assert results(folder) == ["workprec.json"]


def test_old_charts_do_not_stay_beside_a_new_document(tmp_path):
    asked = (*QUICK, "taylor-axis=1e-9", "-o", tmp_path / "study")
    assert heavytop_(*asked).exit_code == 0
    assert (tmp_path / "study" / "workprec.svg").exists()
    assert heavytop_(*asked, "--no-figures").exit_code == 0
    assert results(tmp_path / "study") == ["workprec.json"]


@pytest.mark.parametrize("json_", [True, False])
def test_what_cannot_be_written_is_printed_all_the_same(tmp_path, json_):
    """Minutes of work are not lost for a folder where the file should go."""
    asked = (*QUICK, "taylor-axis=1e-9", "-o", tmp_path, *(["--json"] * json_))
    assert heavytop_(*asked, "--no-figures").exit_code == 0
    (tmp_path / "workprec.json").unlink()
    (tmp_path / "workprec.json").mkdir()
    (tmp_path / "workprec.json" / "full").touch()
    done = heavytop_(*asked)
    assert done.exit_code == 4
    assert f"cannot write {tmp_path}/workprec.json: " in done.stderr
    assert "without a folder" not in done.stderr
    assert "taylor-axis" in done.stdout
    if json_:
        assert json.loads(done.stdout)["files"] == {}


TIMES = {"us_per_period", "us_spread", "setup_s", "runs"}


def measured(document):
    """What is measured of each point without a clock."""
    return [{k: v for k, v in point.items() if k not in TIMES} for point in document["points"]]


def test_killed_at_any_moment_and_resumed_it_measures_the_same(tmp_path):
    asked = (*QUICK, "auto=9,taylor-axis,taylor-lagrange,strang=50")
    whole = json.loads(heavytop_(*asked, "--json").stdout)
    folder = tmp_path / "study"
    process = started(*asked, "-o", folder)
    for count in (1, 8):
        until = time.monotonic() + 60
        while len(records(folder)) < count and process.poll() is None and time.monotonic() < until:
            time.sleep(0.01)
        process.kill()
        process.communicate(timeout=60)
        before = records(folder)
        process = started("resume", folder, "--json")
    out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    told, after = json.loads(out), records(folder)
    assert before.items() <= after.items()  # what was run is not run again
    assert len(after) == 14 * 2 + 2 + 1  # with auto's taylor-cubic, and the rounds
    assert measured(told) == measured(whole)
    again = heavytop_("resume", folder, "--json")
    assert "this study is finished" in again.stderr
    finished = json.loads(again.stdout)
    assert [p["us_per_period"] for p in finished["points"]] == [
        p["us_per_period"] for p in told["points"]
    ]


def test_ctrl_c_keeps_what_was_measured_and_says_how_to_go_on(tmp_path):
    process = started(*QUICK, "taylor-axis,taylor-lagrange", "-o", tmp_path / "study")
    until = time.monotonic() + 60
    while not records(tmp_path / "study") and time.monotonic() < until:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert f"heavytop resume {tmp_path}/study" in err


def started(*arguments):
    command = "from heavytop.cli import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", command, *map(str, arguments)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def records(folder):
    return {path.name: path.read_text() for path in folder.glob("tasks/[0-9a-f]*.json")}


def results(folder):
    return sorted(p.name for p in folder.iterdir() if p.name not in ("study.json", "tasks", "lock"))


def test_a_chart_that_cannot_be_written_leaves_the_document(tmp_path, monkeypatch):
    def full(figure, path):
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    monkeypatch.setattr("heavytop.plots.style.save", full)
    done = heavytop_(*QUICK, "taylor-axis=1e-9", "-o", tmp_path)
    assert done.exit_code == 4
    assert f"cannot write {tmp_path}/workprec.svg: No space left" in done.stderr
    kept = json.loads((tmp_path / "workprec.json").read_text())
    assert kept["files"] == {"document": "workprec.json"}
    assert kept["points"]


def test_a_list_that_is_a_text_and_a_scene_that_is_a_name_are_refused_in_words():
    with pytest.raises(ht.BadScene, match="a sequence of names"):
        ht.work_precision(ht.load_scene("sicm-kicked"), methods="taylor-axis")
    with pytest.raises(ht.BadScene, match=r'scene = "a\.toml": a Scene \(load_scene'):
        ht.work_precision("a.toml")


def test_the_budget_is_kept_and_what_it_left_out_is_named():
    began = time.perf_counter()
    done = heavytop_("workprec", "sicm-kicked", "--budget", "3", "--json")
    assert time.perf_counter() - began < 60  # of 240 by default; what compiles is not cut short
    assert done.exit_code == 0
    document = json.loads(done.stdout)
    left_out = {each["method"] for each in document["skipped"]}
    charted = {point["method"] for point in document["points"]}
    assert {"auto", "taylor-axis", "dop853-scipy", "gauss8"} <= left_out | charted
    assert "dop853-scipy" in left_out
    said = ("budget of 3 s", "stopped", "too long")
    assert all(any(words in each["reason"] for words in said) for each in document["skipped"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--methods", "dop854-scipy"], 'did you mean "dop853-scipy"?'),
        (["--methods", "strang=-1"], "steps a period from"),
        (["--methods", ""], "a name is empty"),
        (["--periods", "0"], "periods = 0.0: a number from 1 to"),
        (["--periods", "nan"], "periods"),
        (["--budget", "0"], "budget = 0.0: a number from 1 to"),
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
    from heavytop.studies import methods

    monkeypatch.setattr(methods, "find_spec", lambda name: None if name == "numba" else name)
    missing = heavytop_(*QUICK, "strang")
    assert missing.exit_code == 2
    assert "pip install 'heavytop[rivals]'" in missing.stderr


def test_where_nothing_could_be_run_it_ended_early():
    scene = ("--set", "start.theta=0", "--set", "start.thetadot=1")
    nothing = heavytop_(*QUICK, "taylor-lagrange=1e-9", *scene, "--json")
    assert nothing.exit_code == 4
    document = json.loads(nothing.stdout)
    assert document["points"] == document["front"] == []
    assert "cannot start at a pole" in document["skipped"][0]["reason"]
    assert heavytop_(*QUICK, "taylor-lagrange=1e-9", *scene).exit_code == 4
