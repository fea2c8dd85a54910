"""What `drift` and `resume` promise: killed at any moment, a study loses a block and no bits."""

from __future__ import annotations

import json
import os
import random
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import xarray
from typer.testing import CliRunner, Result

import heavytop as ht
from heavytop.cli import app
from heavytop.studies.drift import advance, drift_parameters, tasks
from heavytop.studies.store import Record, Store

METHODS = "taylor-attitude,taylor-axis"
ASKED = ("drift", "sicm-kicked", "--periods", "200000", "--samples", "9", "--methods", METHODS)
QUICK = ("drift", "sicm-kicked", "--periods", "300", "--samples", "5", "--methods", "taylor-axis")


def heavytop_(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def parameters(scene="sicm-kicked", methods=("taylor-axis",), **options):
    usual = {"periods": 10, "ensemble": 1, "samples": 3, "seed": 0, "jobs": 1}
    return drift_parameters(ht.load_scene(scene), methods, **usual | options)[0]


def started(*arguments: object) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "heavytop", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )


def result_files(folder: Path) -> dict[str, bytes]:
    """Return what lies in a folder, without the command, which names the folder."""
    files = (p for p in folder.rglob("*") if p.is_file() and p.name != "lock")
    command = re.compile(rb'\n  "command": .*')
    return {p.relative_to(folder).as_posix(): command.sub(b"", p.read_bytes()) for p in files}


def steps(folder: Path) -> int:
    """Return how many steps are stored."""
    records = [json.loads(path.read_text()) for path in folder.glob("tasks/*.json")]
    return sum(record["checkpoint"]["state"]["steps"] for record in records)


def wait_for_checkpoint(folder: Path, process: subprocess.Popen[str]) -> None:
    while not any(folder.glob("tasks/*.json")):
        assert process.poll() is None, process.communicate(timeout=300)
        time.sleep(0.02)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("whole") / "study"
    done = started(*ASKED, "-o", folder, "-q")
    _, err = done.communicate(timeout=300)
    assert done.returncode == 0, err
    return result_files(folder)


@pytest.mark.parametrize("jobs", [1, 2])
def test_killed_and_resumed_the_files_are_the_same_bit_for_bit(tmp_path, whole, jobs):
    folder = tmp_path / "study"
    draw = random.Random(jobs)
    process = started(*ASKED, "-o", folder, "-j", jobs)
    before = 0
    for _ in range(2):
        wait_for_checkpoint(folder, process)
        time.sleep(draw.uniform(0.0, 1.0))
        process.kill()
        process.communicate(timeout=300)
        assert steps(folder) >= before > -1  # it goes on from there, and not from the start
        before = steps(folder)
        process = started("resume", folder, "-j", jobs)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    assert "taylor-axis" in out
    assert result_files(folder) == whole
    made = json.loads((folder / "drift.json").read_text())["command"]
    assert shlex.split(made) == ["heavytop", *map(str, (*ASKED, "-o", folder, "-j", jobs))]


def test_ctrl_c_saves_and_says_how_to_go_on(tmp_path, whole):
    folder = tmp_path / "study"
    process = started(*ASKED, "-o", folder)
    wait_for_checkpoint(folder, process)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 130
    assert out == ""
    assert f"heavytop resume {folder}" in err
    assert "Traceback" not in err
    again = started("resume", folder, "--json")
    out, err = again.communicate(timeout=300)
    assert again.returncode == 0, err
    assert json.loads(out)["schema"] == "heavytop/drift/1"
    assert result_files(folder) == whole


def test_a_second_process_is_refused_by_name(tmp_path):
    folder = tmp_path / "study"
    process = started(*ASKED, "-o", folder)
    try:
        wait_for_checkpoint(folder, process)
        second = heavytop_("resume", folder)
        assert second.exit_code == 2
        assert str(process.pid) in second.stderr
    finally:
        process.kill()
        process.communicate(timeout=300)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("quick") / "study"
    assert heavytop_(*QUICK, "-o", folder).exit_code == 0
    return folder


def copied(study: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(study, tmp_path / "copy"))


def test_resuming_what_is_finished_is_no_fault_and_changes_nothing(study):
    before = result_files(study)
    again = heavytop_("resume", study)
    assert again.exit_code == 0
    assert "taylor-axis" in again.stdout
    assert f"{study}: this study is finished" in again.stderr
    assert result_files(study) == before
    made = json.loads((study / "drift.json").read_text())["command"]
    assert shlex.split(made) == ["heavytop", *QUICK, "-o", str(study)]


def test_the_files_of_a_study(study):
    document = json.loads((study / "drift.json").read_text())
    assert document["files"] == {
        "document": "drift.json",
        "errors": "drift.nc",
        "chart_svg": "drift.svg",
        "chart_png": "drift.png",
    }
    assert "us_per_period" not in document["methods"][0]
    with xarray.open_dataset(study / "drift.nc", engine="h5netcdf") as data:
        found = data["phase_s"].sel(scheme="taylor-axis").values.tolist()
    assert found == document["methods"][0]["phase_s"]
    assert "<svg" in (study / "drift.svg").read_text()[:300]


@pytest.fixture(scope="module")
def half(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of three runs, each at its first chunk."""
    folder = tmp_path_factory.mktemp("half") / "study"
    names = ("taylor-axis", "strang", "dop853-scipy")
    asked = parameters(methods=names, periods=700.0, samples=5)
    with pytest.MonkeyPatch.context() as patch, Store.open(folder, asked) as store:
        patch.setattr("heavytop.studies.drift.CHUNK_S", 1e-9)
        for task in tasks(asked):
            first = next(advance(asked, task, None))
            assert not first.done
            store.save(Record(task).after(first))
    return folder


def test_what_was_begun_goes_on(half, tmp_path):
    assert heavytop_("resume", copied(half, tmp_path)).exit_code == 0


def test_a_folder_that_was_taken_away_is_not_made_again(tmp_path):
    folder = tmp_path / "study"
    process = started(*ASKED, "-o", folder)
    wait_for_checkpoint(folder, process)
    folder.rename(tmp_path / "elsewhere")
    out, err = process.communicate(timeout=300)
    assert process.returncode == 4, err
    assert out == ""
    assert "cannot write" in err
    assert not folder.exists()


@pytest.mark.parametrize("kind", [float, np.int64, Decimal, Fraction])
def test_numbers_of_any_kind_are_the_numbers_they_are(kind):
    scene, plain = ht.load_scene("sicm-kicked"), {"methods": ["taylor-axis"], "samples": 3}
    known = parameters(periods=20, ensemble=2, samples=3, seed=7)
    whole = {"ensemble": np.int64(2), "samples": np.int64(3), "seed": np.int64(7)}
    assert json.dumps(parameters(periods=kind(20), **whole)) == json.dumps(known)
    found = ht.drift(scene, periods=kind(20), jobs=np.int64(1), **plain)
    assert found.periods == 20


def test_every_option_of_the_wrong_kind_is_named_at_once():
    wrong = {
        "periods": "10", "ensemble": 2.5, "samples": 3.7, "seed": True, "methods": [1, "nope"],
        "jobs": 1.5,
    }  # fmt: skip
    with pytest.raises(ht.errors.BadScene) as bad:
        ht.drift("sicm-kicked", **wrong)
    faults = {(fault.key, fault.value) for fault in bad.value.faults}
    assert faults == {
        ("periods", '"10"'), ("ensemble", "2.5"), ("samples", "3.7"), ("seed", "true"),
        ("methods", "1"), ("methods", "nope"), ("jobs", "1.5"), ("scene", '"sicm-kicked"'),
    }  # fmt: skip


@pytest.mark.parametrize(
    "wrong",
    [
        {"seed": 1.5}, {"seed": -1}, {"periods": None}, {"periods": True}, {"methods": None},
        {"periods": Decimal("sNaN")}, {"periods": 10**400}, {"methods": "strang"}, {"jobs": 0},
        {"methods": []}, {"jobs": "2"}, {"jobs": True}, {"samples": None},
    ],
    ids=str,
)  # fmt: skip
def test_an_option_of_the_wrong_kind_is_named(wrong):
    with pytest.raises(ht.errors.BadScene) as bad:
        ht.drift(ht.load_scene("sicm-kicked"), **wrong)
    assert [fault.key for fault in bad.value.faults] == list(wrong)


def test_another_study_in_the_same_folder_is_refused_with_every_difference(study, tmp_path):
    folder = copied(study, tmp_path)
    other = heavytop_(*QUICK, "--seed", 3, "--set", "start.theta=0.2", "-o", folder)
    assert other.exit_code == 3
    assert "scene.start.theta" in other.stderr
    assert "seed" in other.stderr
    assert result_files(folder) == result_files(study)


def test_the_same_study_in_the_same_folder_goes_on(study):
    assert heavytop_(*QUICK, "-o", study).exit_code == 0


@pytest.mark.parametrize("name", ["study.json", "tasks/*.json"])
def test_a_truncated_file_is_refused_by_name(study, tmp_path, name):
    folder = copied(study, tmp_path)
    (file,) = folder.glob(name)
    file.write_bytes(file.read_bytes()[:-40])
    refused = heavytop_("resume", folder)
    assert refused.exit_code == 3
    assert f"{file}: not readable" in refused.stderr


@pytest.mark.parametrize(
    "change",
    [{"periods": -1}, {"samples": "5"}, {"seed": None}, {"ensemble": {}}, {"methods": []},
     {"methods": ["no-such"]}, {"scene": 3}, {"kind": []}, {"versions": None}, {"other": 1}],
    ids=str,
)  # fmt: skip
def test_parameters_that_nobody_could_ask_for_are_refused_by_name(study, tmp_path, change):
    folder = copied(study, tmp_path)
    file = folder / "study.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    refused = heavytop_("resume", folder)
    assert refused.exit_code == 3, refused.output
    assert str(file) in refused.stderr


def test_other_versions_are_refused_by_name(study, monkeypatch):
    from heavytop.studies import runner

    here = runner._versions()
    monkeypatch.setattr(runner, "_versions", lambda: here | {"heyoka": "99"})
    refused = heavytop_("resume", study)
    assert refused.exit_code == 3
    assert "versions.heyoka" in refused.stderr
    assert "99" in refused.stderr


@pytest.mark.parametrize("name", ["nowhere", ".", "file"])
def test_what_is_no_study_is_refused(tmp_path, name):
    (tmp_path / "file").write_text("x")
    refused = heavytop_("resume", tmp_path / name)
    assert refused.exit_code == 3
    assert "bug" not in refused.stderr


def test_a_folder_with_something_else_in_it_is_refused(tmp_path):
    (tmp_path / "thesis.tex").write_text("x")
    refused = heavytop_(*QUICK, "-o", tmp_path)
    assert refused.exit_code == 3
    assert "thesis.tex" in refused.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--methods", "dop854-scipy"], 'did you mean "dop853-scipy"?'),
        (["--methods", "strang=-1"], "steps a period from"),
        (["--methods", ""], "a name is empty"),
        (["--periods", "0"], "periods = 0.0: a number from 1 to"),
        (["--periods", "nan"], "periods"),
        (["--jobs", "0"], "--jobs"),
        (["-o", ""], "the name of a folder, not an empty text"),
        (["-o", __file__], "not a folder"),
    ],
)
def test_bad_options_are_usage_errors(options, said):
    refused = heavytop_("drift", "sicm-kicked", *options)
    assert refused.exit_code == 2
    assert said in refused.stderr


def test_blanks_around_a_method_are_no_part_of_its_name():
    found = heavytop_(*QUICK[:-1], " taylor-axis, strang", "--json")
    assert found.exit_code == 0, found.stderr
    assert [each["name"] for each in json.loads(found.stdout)["methods"]] == [
        "taylor-axis",
        "strang",
    ]


@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_a_closed_stream_is_no_bug(tmp_path, study, closed, jobs):
    command = f"exec {sys.executable} -m heavytop {' '.join(QUICK)} -j {jobs} -o {tmp_path / 'a'}"
    run = subprocess.run(
        ["bash", "-c", f"{command} {closed}"], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stderr == ""
    assert result_files(tmp_path / "a") == result_files(study)


def test_a_study_without_figures_is_resumed_without(tmp_path):
    words = ("--periods", "20", "--samples", "3", "--methods", "taylor-axis", "--no-figures")
    assert heavytop_("drift", "sicm-kicked", *words, "-o", tmp_path).exit_code == 0
    before = (tmp_path / "drift.json").read_bytes()
    assert heavytop_("resume", tmp_path).exit_code == 0
    assert (tmp_path / "drift.json").read_bytes() == before
    assert not list(tmp_path.glob("*.svg"))


def test_a_bad_scene_is_a_bad_scene():
    assert heavytop_("drift", "separatrix").exit_code == 3


def test_json_has_costs_and_nothing_else_is_on_stdout():
    found = heavytop_(*QUICK, "--json")
    assert found.exit_code == 0
    method = json.loads(found.stdout)["methods"][0]
    assert method["us_per_period"] > 0
    assert method["steps"] > 300


def test_results_do_not_depend_on_the_number_of_workers(tmp_path):
    asked = (*QUICK[:-1], "taylor-axis,taylor-cubic,strang", "--ensemble", 2)
    for jobs in (1, 2):
        assert heavytop_(*asked, "-j", jobs, "-o", tmp_path / str(jobs)).exit_code == 0
    assert result_files(tmp_path / "1") == result_files(tmp_path / "2")


def test_a_full_disk_leaves_a_readable_folder(tmp_path):
    """The kernel refuses to write more than 20 kB to a file: the chart does not fit."""
    folder = tmp_path / "study"
    command = f"ulimit -f 20; exec {sys.executable} -m heavytop {' '.join(QUICK)} -o {folder}"
    full = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert full.returncode == 4, full.stderr
    assert "cannot write" in full.stderr
    assert "heavytop resume" in full.stderr
    assert heavytop_("resume", folder).exit_code == 0
    assert (folder / "drift.json").exists()


# --- runs ------------------------------------------------------------------------------------

LONG = (
    "run", "sicm-kicked", "--formulation", "axis", "--no-figures",
    "--set", "span.periods=100000", "--set", "want.samples=7", "--set", "want.digits=5",
)  # fmt: skip


def test_an_interrupted_run_goes_on_where_it_was(tmp_path):
    folder = tmp_path / "run"
    process = started(*LONG, "-v", "-o", folder)
    for line in process.stderr:  # it ends with the process
        if "integrating" in line:
            break
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 130, err
    assert f"heavytop resume {folder}" in err
    part = ht.load_trajectory(folder / "trajectory.nc")
    assert part.outcome == "interrupted"
    assert heavytop_("resume", folder, "--no-figures").exit_code == 0
    found = ht.load_trajectory(folder / "trajectory.nc")
    scene = ht.load_scene("sicm-kicked", list(LONG[6::2]))
    truth = ht.propagate(scene, formulation="axis")
    assert found.outcome == "finished"
    assert found.samples.states.tolist() == truth.samples.states.tolist()
    assert found.phi.tolist() == truth.phi.tolist()
    assert found.events.t.tolist() == truth.events.t.tolist()
    assert found.orbit.steps == truth.orbit.steps
    again = heavytop_("resume", folder)
    assert again.exit_code == 0
    assert "this run is finished" in again.stderr


def test_a_run_begun_by_other_versions_is_refused(tmp_path, monkeypatch):
    from heavytop.run import trajectory_file

    assert heavytop_("run", "sicm-kicked", "--no-figures", "-o", tmp_path).exit_code == 0
    here = trajectory_file.versions()
    monkeypatch.setattr(trajectory_file, "versions", lambda: here | {"heyoka": "99"})
    refused = heavytop_("resume", tmp_path)
    assert refused.exit_code == 3
    assert "heyoka" in refused.stderr
