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
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
import xarray
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.results.base import Problem
from heavytop.results.stress import RULES, Outcome, Run, SkippedRun, Stress
from heavytop.results.work_precision import WorkPrecision
from heavytop.studies import executors, runner
from heavytop.studies import methods as registry
from heavytop.studies.methods import stress_methods
from heavytop.studies.stress_cases import cases

PLANE = ("sicm-kicked", "--x", "phidot=-20:20:21", "--y", "psidot=-150:150:19")
QUICK = {
    "drift": ("sicm-kicked", "--periods", 300, "--samples", 5, "--methods", "taylor-axis"),
    "stress": ("--cases", "through-top,cusp", "--methods", "auto,taylor-lagrange"),
    "workprec": ("sicm-kicked", "--periods", 5, "--budget", 60,
                 "--methods", "auto=9,taylor-axis=1e-9,kahan-li8=32"),
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
PARALLEL = ("drift", "stress", "atlas")  # the times of a diagram are those of one process
KEYS = {
    "drift": {"scene", "periods", "ensemble", "samples", "seed", "starts", "methods"},
    "stress": {"cases", "skipped", "rules", "auto", "limits", "hard", "methods"},
    "workprec": {"points", "front", "cheapest", "skipped", "rivals", "budget", "phase"},
    "atlas": {"counts", "shape", "axes", "curves", "tiles", "kinds_per_s", "rows_per_s"},
}
PLACES = {
    "drift": "heavytop.studies.drift.drift",
    "stress": "heavytop.studies.stress.stress",
    "workprec": "heavytop.studies.work_precision.work_precision",
}
EMPTY = {
    "stress": Stress(
        limits={"budget_s": 1.0, "time_s": 1.0, "steps": 1}, hard={}, methods={}, cases=()
    ),
    "workprec": WorkPrecision(
        scene=Problem(**ht.load_scene("sicm-kicked").problem()),
        periods=5.0, phase=4.6, budget=60.0, points=(), skipped=(),
    ),
}  # fmt: skip


def heavytop_(*words):
    return CliRunner().invoke(app, [*map(str, words)], env={"COLUMNS": "100"})


def started(*words):
    heard = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL); "  # nohup ignores it
    command = heard + "from heavytop.cli import main; main()"
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [sys.executable, "-c", command, *map(str, words)], stdout=pipe, stderr=pipe, text=True
    )


def records(folder):
    return {path.name: path.read_bytes() for path in folder.glob("tasks/[0-9a-f]*.json")}


def files(folder):
    """What lies in a folder, without the command, which names the folder."""
    found = (p for p in folder.rglob("*") if p.is_file() and p.name != "lock")
    command = re.compile(rb'\n  "command": .*')
    return {p.relative_to(folder).as_posix(): command.sub(b"", p.read_bytes()) for p in found}


def said_by(result):
    return " ".join(result.stderr.replace("│", " ").split())


# --- what is written -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A study of each kind: its folder, and what was printed."""
    found = {}
    for verb, words in QUICK.items():
        folder = tmp_path_factory.mktemp(verb) / "made" / "here"
        found[verb] = folder, heavytop_(verb, *words, "--json", "-o", folder)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("verb", QUICK)
def test_json_is_one_document_and_the_files_are_those_it_names(verb, made):
    folder, done = made[verb]
    assert done.exit_code == 0, done.output
    printed, kept = (json.loads(x) for x in (done.stdout, (folder / f"{verb}.json").read_text()))
    assert printed["schema"] == f"heavytop/{verb}/1"
    assert printed.keys() >= KEYS[verb] | {"versions", "command"}
    more = {"drift": {"errors": "drift.nc"}, "atlas": {"map": "atlas.nc"}}.get(verb, {})
    charts = {"chart_svg": f"{verb}.svg", "chart_png": f"{verb}.png"}
    assert printed["files"] == kept["files"] == {"document": f"{verb}.json", **more, **charts}
    there = {path.name for path in folder.iterdir()} - {"study.json", "tasks", "lock"}
    assert there == set(printed["files"].values())
    assert "<svg" in (folder / f"{verb}.svg").read_text()[:300]
    assert (folder / f"{verb}.png").read_bytes()[:4] == b"\x89PNG"
    asked = [verb, *map(str, QUICK[verb]), "--json", "-o", str(folder)]
    assert shlex.split(kept["command"]) == ["heavytop", *asked]


def test_a_drift_has_costs_where_it_is_printed_and_none_where_it_is_kept(made):
    folder, done = made["drift"]
    (printed,), (kept,) = (
        json.loads(text)["methods"] for text in (done.stdout, (folder / "drift.json").read_text())
    )
    assert printed["us_per_period"] > 0
    assert "us_per_period" not in kept
    with xarray.open_dataset(folder / "drift.nc", engine="h5netcdf") as data:
        assert data["phase_s"].sel(scheme="taylor-axis").values.tolist() == kept["phase_s"]


def test_a_stress_test_says_how_each_run_ended(made):
    document = json.loads(made["stress"][1].stdout)
    rows = {(row["case"], row["method"]): row for row in document["cases"]}
    assert len(rows) == 4
    lagrange, auto = rows["through-top", "taylor-lagrange"], rows["cusp", "auto"]
    assert (lagrange["outcome"], lagrange["error"]) == ("singular", None)
    assert (auto["outcome"], auto["digits_lost"], auto["steps"] > 0) == ("ok", 0.0, True)
    assert {"case", "method", "formulation", "error", "digits_lost", "note"} <= auto.keys()
    assert document["rules"] == {str(word): rule for word, rule in RULES.items()}
    assert document["auto"] == {"run": True, "silently_wrong": []}
    assert "seconds" not in made["stress"][1].stdout


@pytest.mark.parametrize(
    ("verb", "options", "words"),
    [
        ("stress", (), ("through-top 0 sing", "lagrange case auto 2.2e-16",
                        "singular: taylor-lagrange: the equations", "silently wrong: nowhere")),
        ("workprec", (), ("32 steps a period", "axis to 1e-9", "best rival", "9 digits of axis",
                          "auto, 9 of θ", "setup")),
        ("atlas", ("--only", "kind"), ("loops", "waves", "phidot = -20 … 20 rad/s, 21 values",
                                       "cusp (", "not proved")),
    ],
)  # fmt: skip
def test_a_person_reads_a_table(verb, options, words):
    told = heavytop_(verb, *QUICK[verb], *options)
    assert told.exit_code == 0
    assert [word for word in words if word not in " ".join(told.stdout.split())] == []


@pytest.mark.slow
@pytest.mark.parametrize("verb", QUICK)
def test_what_is_finished_is_said_to_be_and_nothing_changes(verb, made):
    folder, done = made[verb]
    before = files(folder)
    again = heavytop_("resume", folder, "--json")
    assert again.exit_code == 0, again.output
    assert f"{folder}: this study is finished" in again.stderr
    if verb in ("drift", "stress"):  # the others say what this process took
        assert files(folder) == before
    if verb == "workprec":
        took = [
            [point["us_per_period"] for point in json.loads(text)["points"]]
            for text in (done.stdout, again.stdout)
        ]
        assert took[0] == took[1]
    assert heavytop_(verb, *QUICK[verb], "-o", folder).exit_code == 0


def test_old_charts_do_not_stay_and_a_study_without_figures_is_resumed_without(tmp_path):
    asked = ("drift", *QUICK["drift"], "-o", tmp_path)
    assert heavytop_(*asked).exit_code == 0
    assert (tmp_path / "drift.svg").exists()
    assert heavytop_(*asked, "--no-figures").exit_code == 0
    assert not list(tmp_path.glob("*.svg"))
    new = tmp_path / "new"
    assert heavytop_("drift", *QUICK["drift"], "--no-figures", "-o", new).exit_code == 0
    before = files(new)
    assert heavytop_("resume", new).exit_code == 0
    assert files(new) == before


# --- killed, stopped, full -------------------------------------------------------------------

DROPPED = {"us_per_period", "us_spread", "setup_s", "runs", "kinds_per_s", "rows_per_s", "jobs",
           "front", "front_theta", "cheapest", "cheapest_theta", "ahead", "files", "versions",
           "command", "limits", "budget"}  # fmt: skip


def timeless(value):
    """A document without what depends on the clock."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key not in DROPPED}
    return [timeless(each) for each in value] if isinstance(value, list) else value


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Studies that nothing happens to, each when it is asked for."""
    found = {}

    def study(verb):
        if verb not in found:
            folder = tmp_path_factory.mktemp("whole") / verb
            done = heavytop_(verb, *LONG[verb], "--no-figures", "--json", "-o", folder)
            assert done.exit_code == 0, done.output
            found[verb] = folder, timeless(json.loads(done.stdout))
        return found[verb]

    return study


def wait_for_records(folder, count, process):
    until = time.monotonic() + 120
    while len(records(folder)) < count and process.poll() is None and time.monotonic() < until:
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize(
    ("verb", "jobs"), [("workprec", 1), *((verb, jobs) for verb in PARALLEL for jobs in (1, 2))]
)
def test_killed_at_any_moment_and_resumed_it_is_the_study_that_was_not(verb, jobs, whole, tmp_path):
    folder, draw = tmp_path / "made" / "here", random.Random(jobs)
    parallel = ("-j", jobs) if verb in PARALLEL else ()
    process = started(verb, *LONG[verb], "--no-figures", "-o", folder, *parallel)
    for count in (1, 4):
        wait_for_records(folder, 1 if verb == "drift" else count, process)
        time.sleep(draw.uniform(0.0, 0.5))
        process.kill()
        process.communicate(timeout=300)
        before = records(folder)
        assert before
        process = started("resume", folder, "--json", "-j", jobs)
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    complete, document = whole(verb)
    assert timeless(json.loads(out)) == document
    if verb == "workprec":
        assert before.items() <= records(folder).items()  # what was run is not run again
        assert records(folder).keys() == records(complete).keys()
    else:
        assert records(folder) == records(complete)
    if verb == "stress":
        assert before.items() <= records(folder).items()
    asked = [verb, *LONG[verb], "--no-figures", "-o", folder, *parallel]  # that which began it
    assert shlex.split(json.loads(out)["command"]) == ["heavytop", *map(str, asked)]


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize(
    ("verb", "number"),
    [("stress", signal.SIGTERM), ("stress", signal.SIGHUP), ("drift", signal.SIGINT),
     ("workprec", signal.SIGINT)],
)  # fmt: skip
def test_whatever_ends_it_says_how_to_go_on(verb, number, tmp_path):
    folder, methods = tmp_path / "study", "auto,lsoda-scipy-lagrange,taylor-axis"
    hangs = ("--cases", "start-at-top", "--methods", methods, "--time-limit", 3)
    process = started(verb, *(hangs if verb == "stress" else LONG[verb]), "-o", folder, "--json")
    wait_for_records(folder, 1, process)
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    assert (process.returncode, out) == (130, ""), err
    if number != signal.SIGHUP:  # then nobody reads it
        assert f"heavytop resume {folder}" in err
    assert "Traceback" not in err


@pytest.mark.slow
@pytest.mark.processes
def test_a_full_disk_leaves_a_folder_that_goes_on(tmp_path):
    """The kernel refuses to write more than 20 kB to a file: the chart does not fit."""
    folder, words = tmp_path / "study", " ".join(map(str, QUICK["drift"]))
    command = f"ulimit -f 20; exec {sys.executable} -m heavytop drift {words} -o {folder}"
    full = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert full.returncode == 4, full.stderr
    assert "cannot write" in full.stderr
    assert "heavytop resume" in full.stderr
    assert heavytop_("resume", folder).exit_code == 0
    assert (folder / "drift.json").exists()


def full(*_):
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("verb", EMPTY)
def test_a_disk_that_fills_up_loses_no_document(verb, tmp_path, monkeypatch):
    monkeypatch.setattr(PLACES[verb], lambda *_, **__: EMPTY[verb])
    scene = () if verb == "stress" else ("sicm-kicked",)
    done = heavytop_(verb, *scene, "--no-figures", "-v", "-o", tmp_path)
    assert f"heavytop: wrote {tmp_path / verb}.json" in done.stderr
    monkeypatch.setattr("heavytop.files.os.fsync", full)
    stopped = heavytop_(verb, *scene, "--no-figures", "-o", tmp_path / "new")
    assert stopped.exit_code == 4, stopped.stderr
    assert f"cannot write {tmp_path / 'new' / verb}.json: No space left" in stopped.stderr
    assert "without a folder" not in stopped.stderr
    assert stopped.stdout != ""
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("json_", [(), ("--json",)])
def test_what_cannot_be_written_is_printed_all_the_same(tmp_path, json_):
    """Minutes of work are not lost for a folder where the file should go."""
    asked = ("workprec", *QUICK["workprec"], "-o", tmp_path, *json_)
    assert heavytop_(*asked, "--no-figures").exit_code == 0
    (tmp_path / "workprec.json").unlink()
    (tmp_path / "workprec.json" / "full").mkdir(parents=True)
    done = heavytop_(*asked)
    assert done.exit_code == 4
    assert f"cannot write {tmp_path}/workprec.json: " in done.stderr
    assert "taylor-axis" in done.stdout
    assert not json_ or json.loads(done.stdout)["files"] == {}


def test_a_chart_that_cannot_be_written_leaves_the_document(tmp_path, monkeypatch):
    def save(figure, path):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("heavytop.plots.style.save", save)
    done = heavytop_("drift", *QUICK["drift"], "-o", tmp_path)
    assert done.exit_code == 4
    assert f"cannot write {tmp_path}/drift.svg: No space left" in done.stderr
    kept = json.loads((tmp_path / "drift.json").read_text())
    assert kept["methods"]
    assert not any("svg" in name for name in kept["files"].values())


@pytest.mark.slow
@pytest.mark.processes
@pytest.mark.parametrize(("closed", "jobs"), [("2>&-", 1), ("<&- >&- 2>&-", 2)])
def test_a_closed_stream_is_no_bug(tmp_path, made, closed, jobs):
    words = " ".join(map(str, QUICK["drift"]))
    command = f"exec {sys.executable} -m heavytop drift {words} -j {jobs} -o {tmp_path / 'a'}"
    run = subprocess.run(
        ["bash", "-c", f"{command} {closed}"], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert files(tmp_path / "a") == files(made["drift"][0])


# --- what is refused -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("drift", "sicm-kicked", "--methods", "dop854-scipy"), 2, 'did you mean "dop853-scipy"?'),
        (("drift", "sicm-kicked", "--periods", "0"), 2, "periods = 0.0: a number from 1 to"),
        (("drift", "sicm-kicked", "--jobs", "0"), 2, "--jobs"),
        (("drift", "sicm-kicked", "-o", ""), 2, "the name of a folder, not an empty text"),
        (("drift", "sicm-kicked", "-o", __file__), 2, "not a folder"),
        (("drift", "separatrix"), 3, "no nutation period"),
        (("workprec", "sicm-kicked", "--methods", "strang=-1"), 2, "steps a period from"),
        (("workprec", "sicm-kicked", "--budget", "0"), 2, "budget = 0.0: a number from 1 to"),
        (("workprec", "sicm-kicked", "--methods", "taylor-axis", "-o", "/proc/no"), 2, "cannot"),
        (("workprec", "separatrix"), 3, "no nutation period"),
        (("stress", "--cases", "cups"), 2, 'did you mean "cusp"?'),
        (("stress", "--methods", "taylor-axes"), 2, 'did you mean "taylor-axis"?'),
        (("stress", "--budget", "-1"), 2, "budget = -1.0: a number from 0 to"),
        (("stress", "--time-limit", "0"), 2, "time_limit = 0.0"),
        (("stress", "--step-limit", "0"), 2, "step_limit = 0"),
        (("stress", "-o", f"{__file__}/inside"), 2, "-o"),
        (("atlas", "sicm-kicked"), 2, "--x and --y"),
        (("atlas", "sicm-kicked", "--x", "phidot=0:1:5"), 2, "--y"),
        (("atlas", "sicm-kicked", "--x", "phidt=0:1:5", "--y", "psidot=0:1:5"), 2, '"phidot"'),
        (("atlas", *PLANE, "--only", "rows"), 2, 'only = "rows": one of kind'),
        (("atlas", *PLANE, "--shard", "3/2"), 2, "i/n"),
        (("atlas", "no-such-scene", *PLANE[1:]), 3, "no shipped scene"),
        (("atlas", "sicm-dropped", *PLANE), 2, "one scene"),
        (("atlas", "--merge", "nowhere"), 2, "-o"),
        (("atlas", "--merge", "nowhere", "-o", "out", "--shard", "1/2"), 2, "not together with"),
        (("atlas", "--merge", "nowhere", "-o", "out"), 3, "nowhere"),
        (("atlas", "sicm-kicked", "--energy-momentum", *PLANE[1:]), 2, "not together with"),
        (("atlas", *PLANE, "--set", "start.omega3=9"), 2, "axis psidot sets the spin"),
        (("atlas", *PLANE, "--set", "start.theta=9"), 2, "start.theta"),
        (("resume", "nowhere"), 3, "nowhere"),
        (("resume", "."), 3, "no folder with anything to go on with"),
        (("resume", __file__), 3, "no folder with anything"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(words, code, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused = heavytop_(*words)
    assert refused.exit_code == code
    assert said in said_by(refused)
    assert "bug" not in refused.stderr
    assert refused.stdout == ""
    assert not list(tmp_path.iterdir())


def test_another_study_in_a_folder_is_refused_with_every_difference(made):
    folder, _ = made["drift"]
    before = files(folder)
    more = ("--seed", 3, "--set", "start.theta=0.2", "-o", folder)
    other = heavytop_("drift", *QUICK["drift"], *more)
    assert other.exit_code == 3
    assert "scene.start.theta" in other.stderr
    assert "seed" in other.stderr
    assert files(folder) == before


@pytest.mark.parametrize("change", [{"methods": ["no-such"]}, {"kind": []}, {"ensemble": None}])
def test_a_study_that_cannot_be_read_is_refused_by_name(made, tmp_path, change):
    file = tmp_path / "study.json"
    known = json.loads((made["drift"][0] / "study.json").read_text())
    file.write_text(json.dumps(known | change))
    refused = heavytop_("resume", tmp_path)
    assert refused.exit_code == 3, refused.output
    assert str(file) in refused.stderr


def test_other_versions_are_refused_by_name(made, monkeypatch):
    here = runner._versions()
    monkeypatch.setattr(runner, "_versions", lambda: here | {"heyoka": "99"})
    refused = heavytop_("resume", made["drift"][0])
    assert refused.exit_code == 3
    assert "versions.heyoka" in refused.stderr
    assert "99" in refused.stderr


# --- how each ends ---------------------------------------------------------------------------


def judged(*runs, skipped=()):
    asked = [stress_methods()[name] for name in dict.fromkeys(run.method for run in runs)]
    return Stress(
        hard={run.case: cases()[run.case].hard for run in runs},
        methods={each.name: f"{each.short} {each.set_to}".rstrip() for each in asked},
        cases=runs,
        skipped=skipped,
        limits={"budget_s": 1.0, "time_s": 1.0, "steps": 1},
    )


def ran(outcome, method="auto", **more):
    return Run(case="cusp", method=method, formulation="auto", outcome=outcome, **more)


def test_auto_silently_wrong_is_a_check_out_of_its_bound(monkeypatch):
    lost = SkippedRun(case="cusp", method="taylor-axis", reason="killed by SIGSEGV", lost=True)
    wrong = judged(
        ran(Outcome.OK, error=1e-9, digits_lost=5.0),
        ran(Outcome.DIVERGED, "taylor-lagrange", error=1.0, digits_lost=14.0),
        skipped=(lost,),
    )
    monkeypatch.setattr(PLACES["stress"], lambda **_: wrong)
    result = heavytop_("stress")
    assert result.exit_code == 5
    assert "auto is wrong at cusp, and does not say so" in result.stderr
    for words in ("5.0", "14.0 div", "killed by SIGSEGV: cusp/taylor-axis"):
        assert words in " ".join(result.stdout.split())
    named = judged(ran(Outcome.MISSED_EVENTS, error=0.0, digits_lost=0.0, named=True))
    monkeypatch.setattr(PLACES["stress"], lambda **_: named)
    assert heavytop_("stress").exit_code == 0


def test_what_the_budget_left_out_is_named_and_nothing_run_is_an_end_too_early():
    nothing = heavytop_("stress", "--cases", "cusp", "--methods", "auto", "--budget", 0)
    assert nothing.exit_code == 4
    assert "the budget was spent: cusp/auto" in " ".join(nothing.stdout.split())
    assert "nothing was run" in nothing.stderr
    pole = ("--set", "start.theta=0", "--set", "start.thetadot=1", "--json")
    nothing = heavytop_("workprec", "sicm-kicked", "--methods", "taylor-lagrange=1e-9", *pole)
    assert nothing.exit_code == 4
    document = json.loads(nothing.stdout)
    assert document["points"] == document["front"] == []
    assert "cannot start at a pole" in document["skipped"][0]["reason"]


@pytest.mark.slow
def test_the_budget_of_a_diagram_is_kept():
    began = time.perf_counter()
    done = heavytop_("workprec", "sicm-kicked", "--budget", "3", "--json")
    assert time.perf_counter() - began < 60  # of 240 by default; what compiles is not cut short
    assert done.exit_code == 0
    document = json.loads(done.stdout)
    left_out = {each["method"] for each in document["skipped"]}
    charted = {point["method"] for point in document["points"]}
    assert {"auto", "taylor-axis", "dop853-scipy", "gauss8"} <= left_out | charted
    assert "dop853-scipy" in left_out
    said = ("budget of 3 s", "stopped", "too long", "needs rebound")
    assert all(any(words in each["reason"] for words in said) for each in document["skipped"])


def test_a_missing_package_has_an_exit_code_and_the_pip_line(monkeypatch):
    monkeypatch.setattr(registry, "find_spec", lambda name: None if name == "numba" else name)
    missing = heavytop_("drift", *QUICK["drift"][:-1], "strang")
    assert missing.exit_code == 2
    assert "pip install 'heavytop[rivals]'" in missing.stderr


def test_maps_that_disagree_end_with_5(monkeypatch):
    from heavytop.studies import atlas as module

    agree = heavytop_("atlas", *PLANE, "--integrate", "--json", "-j", 1)
    assert agree.exit_code == 0
    assert json.loads(agree.stdout)["unexplained"] == 0
    assert json.loads(agree.stdout)["tops_per_s"] > 0
    real = module.integrated
    monkeypatch.setattr(module, "integrated", lambda tops, period: real(tops, period) * 0)
    found = heavytop_("atlas", *PLANE, "--integrate", "-j", 1)
    assert found.exit_code == 5
    assert "differ by more than rounding" in found.stderr


def test_shards_are_resumed_and_joined(tmp_path):
    big = ("--x", "phidot=-20:20:1500", "--y", "psidot=-150:150:1500", "--only", "kind", "-j", 1)
    for i in (1, 2):
        asked = ("sicm-kicked", *big, "--shard", f"{i}/2", "-o", tmp_path / str(i), "--json")
        part = heavytop_("atlas", *asked)
        assert part.exit_code == 0
        assert list(json.loads(part.stdout)["files"].values()) == ["atlas.json"]
    assert "--merge" in part.stderr
    tiles = (tmp_path / "1/tasks").iterdir()
    next(x for x in tiles if json.loads(x.read_text())["rows"]).unlink()
    again = heavytop_("resume", tmp_path / "1", "--json")
    assert json.loads(again.stdout)["tiles"] == {"done": 2, "all": 3}
    assert heavytop_("atlas", "--merge", tmp_path / "1", "-o", tmp_path / "part").exit_code == 4
    folders = (tmp_path / "1", tmp_path / "2")
    whole = heavytop_("atlas", "--merge", *folders, "-o", tmp_path / "all", "--json")
    assert whole.exit_code == 0
    assert sum(json.loads(whole.stdout)["counts"].values()) == 1500**2


def test_the_energy_momentum_diagram(tmp_path):
    found = heavytop_("atlas", "sleeping-unstable", "--energy-momentum", "--json", "-o", tmp_path)
    document = json.loads(found.stdout)
    assert found.exit_code == 0
    assert document["schema"] == "heavytop/energy-momentum/1"
    assert document["circuit"]["winding"] == 1
    names = [
        f"{name}.{end}" for name in ("critical_set", "energy_momentum") for end in ("png", "svg")
    ]
    assert sorted(document["files"].values()) == sorted([*names, "energy_momentum.json"])
    assert "Δφ around it" in heavytop_("atlas", "sleeping-unstable", "--energy-momentum").stdout


def test_markup_in_a_title_is_text():
    title = "[bold]<script>alert(1)</script> $x_{"
    assert title in heavytop_("atlas", *PLANE, "-j", 1, "--set", f'title="{title}"').stdout


def test_the_cases_are_listed_with_what_they_are():
    printed = json.loads(heavytop_("stress", "--list", "--json").stdout)
    assert printed["schema"] == "heavytop/stress-cases/1"
    found = {case["name"]: case for case in printed["cases"]}
    assert list(found) == list(cases())
    unturned = dict.fromkeys(("phi", "psi", "phidot", "thetadot"), "0")
    assert found["cusp"]["start"] == {"theta": "0.1", "psidot": "140"} | unturned
    assert found["cusp"]["top"] == {"A": "3.28e-4", "C": "6.60e-5", "gMR": "0.0456"}
    assert found["separatrix-40"]["span"] == "40 s"
    assert all(case["why"] for case in printed["cases"])
    assert [each["name"] for each in printed["methods"]] == list(stress_methods())
    assert {each["setting"] for each in printed["methods"]} >= {"", "2.2e-16", "32/period"}
    text = heavytop_("stress", "--list").stdout
    assert all(name in text for name in (*cases(), *stress_methods()))


# --- lists of names --------------------------------------------------------------------------

LISTS = [("drift", "methods"), ("stress", "methods"), ("stress", "cases"), ("workprec", "methods")]


@pytest.fixture
def asked(monkeypatch):
    """What a verb asks its study for; none is done."""
    found = {}

    def study(*_, **options):
        found.update(options)
        raise KeyboardInterrupt

    for place in PLACES.values():
        monkeypatch.setattr(place, study)
    return found


@pytest.mark.parametrize(("verb", "option"), LISTS)
def test_blanks_around_a_name_are_no_part_of_it(verb, option, asked):
    scene = () if verb == "stress" else ("sicm-kicked",)
    heavytop_(verb, *scene, f"--{option}", " auto ,\tstrang=50,  cusp")
    assert tuple(asked[option]) == ("auto", "strang=50", "cusp")
    asked.clear()
    heavytop_(verb, *scene)
    assert option not in asked  # then it is the list of its study


@pytest.mark.parametrize(("verb", "option"), LISTS)
@pytest.mark.parametrize("text", ["", " ", "cusp,", "cusp, ,auto"])
def test_an_empty_name_is_the_fault_of_its_option(verb, option, text, asked, tmp_path):
    scene = () if verb == "stress" else ("sicm-kicked",)
    refused = heavytop_(verb, *scene, f"--{option}", text, "-o", tmp_path / "new")
    assert refused.exit_code == 2
    said = f"--{option}: {' '.join(repr(text).split())} is not NAME,NAME,…: a name is empty"
    assert said in said_by(refused)
    assert not asked
    assert not (tmp_path / "new").exists()


# --- a scheduler -----------------------------------------------------------------------------

ADDRESS = "tcp://192.0.2.1:8786"


@pytest.mark.slow
def test_the_workers_of_a_scheduler_write_the_same_files(made, tmp_path, monkeypatch):
    called = []

    @contextmanager
    def at(address):
        called.append(address)
        with ThreadPoolExecutor(1) as pool:
            yield pool

    monkeypatch.setattr(executors, "executor_at", at)
    words = (*QUICK["drift"], "-o", tmp_path, "--scheduler", ADDRESS)
    assert heavytop_("drift", *words).exit_code == 0
    assert heavytop_("resume", tmp_path, "--scheduler", ADDRESS).exit_code == 0
    assert called == [ADDRESS, ADDRESS]
    assert records(tmp_path) == records(made["drift"][0])
    refused = heavytop_("drift", *words, "--jobs", 2)
    assert refused.exit_code == 2
    assert "Invalid value for --jobs: a scheduler has its own workers" in refused.stderr
    run = tmp_path / "run"
    run.mkdir()
    (run / "trajectory.nc").touch()
    assert "for studies; this is a run" in heavytop_("resume", run, "--scheduler", ADDRESS).stderr


@pytest.mark.slow
def test_a_scheduler_that_nobody_runs_and_dask_that_is_missing(monkeypatch, tmp_path):
    words = ("drift", *QUICK["drift"], "-o", tmp_path / "a", "--scheduler", "tcp://127.0.0.1:9")
    nobody = heavytop_(*words)
    assert nobody.exit_code == 2
    assert "127.0.0.1:9" in nobody.stderr or "heavytop[cluster]" in nobody.stderr
    monkeypatch.setattr(executors, "find_spec", lambda name: None)
    without = heavytop_(*words)
    assert without.exit_code == 2
    assert "a cluster needs distributed: pip install 'heavytop[cluster]'" in without.stderr
    assert not (tmp_path / "a").exists()
