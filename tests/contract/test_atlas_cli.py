"""``heavytop atlas``: what users hold of it, and what it says when something is wrong."""

import json

import pytest
from typer.testing import CliRunner

from heavytop.cli.command import app

AXES = ("--x", "phidot=-20:20:21", "--y", "psidot=-150:150:19")


def run(*arguments):
    return CliRunner().invoke(app, ["atlas", *map(str, arguments)], env={"COLUMNS": "100"})


def test_json_is_one_document_of_the_contract():
    found = run("sicm-kicked", *AXES, "--json", "-j", 1)
    assert found.exit_code == 0
    document = json.loads(found.stdout)
    assert document["schema"] == "heavytop/atlas/1"
    assert document["shape"] == [19, 21]
    assert sum(document["counts"].values()) == 19 * 21
    assert document["kinds_per_s"] > 0 < document["rows_per_s"]
    assert document["axes"]["x"]["name"] == "phidot"
    assert {curve["name"] for curve in document["curves"]} >= {"cusp", "through-bottom"}
    assert document["files"] == {}


def test_a_table_is_for_reading():
    found = run("sicm-kicked", *AXES, "--only", "kind", "-j", 1)
    assert found.exit_code == 0
    for words in ("loops", "waves", "phidot = -20 … 20 rad/s, 21 values", "cusp (", "not proved"):
        assert words in found.stdout


def test_files_are_written_and_named(tmp_path):
    found = run("sicm-kicked", *AXES, "-o", tmp_path / "a", "--json", "-j", 1)
    files = json.loads(found.stdout)["files"]
    assert sorted(files.values()) == ["atlas.json", "atlas.nc", "atlas.png", "atlas.svg"]
    assert all((tmp_path / "a" / name).stat().st_size for name in files.values())
    again = run("sicm-kicked", *AXES, "-o", tmp_path / "a", "--no-figures", "-j", 1)
    assert again.exit_code == 0


def test_two_maps_are_compared():
    found = run("sicm-kicked", *AXES, "--integrate", "--json", "-j", 1)
    document = json.loads(found.stdout)
    assert found.exit_code == 0
    assert document["unexplained"] == 0
    assert document["tops_per_s"] > 0


def test_maps_that_disagree_end_with_5(monkeypatch):
    from heavytop.studies import atlas as module

    real = module.integrated
    monkeypatch.setattr(module, "integrated", lambda tops, period: real(tops, period) * 0)
    found = run("sicm-kicked", *AXES, "--integrate", "-j", 1)
    assert found.exit_code == 5
    assert "differ by more than rounding" in found.stderr


def test_shards_are_joined(tmp_path):
    big = ("--x", "phidot=-20:20:1500", "--y", "psidot=-150:150:1500", "--only", "kind", "-j", 1)
    for i in (1, 2):
        part = run("sicm-kicked", *big, "--shard", f"{i}/2", "-o", tmp_path / str(i), "--json")
        assert part.exit_code == 0
        assert list(json.loads(part.stdout)["files"].values()) == ["atlas.json"]
    assert "--merge" in part.stderr
    part = run("--merge", tmp_path / "1", "-o", tmp_path / "part")
    assert part.exit_code == 4
    whole = run("--merge", tmp_path / "1", tmp_path / "2", "-o", tmp_path / "all", "--json")
    assert whole.exit_code == 0
    assert sum(json.loads(whole.stdout)["counts"].values()) == 1500**2


def test_resume_goes_on_with_an_atlas_or_a_shard(tmp_path):
    big = ("--x", "phidot=-20:20:1500", "--y", "psidot=-150:150:1500", "--only", "kind", "-j", 1)
    run("sicm-kicked", *big, "--shard", "1/2", "-o", tmp_path / "a", "--no-figures")
    tile = next(x for x in (tmp_path / "a/tasks").iterdir() if json.loads(x.read_text())["rows"])
    tile.unlink()
    again = CliRunner().invoke(app, ["resume", str(tmp_path / "a"), "--json"])
    assert again.exit_code == 0
    assert json.loads(again.stdout)["tiles"] == {"done": 2, "all": 3}
    finished = CliRunner().invoke(app, ["resume", str(tmp_path / "a"), "--json"])
    assert "this study is finished" in finished.stderr


def test_a_scheduler_that_nobody_runs_is_named():
    found = run("sicm-kicked", *AXES, "--scheduler", "tcp://127.0.0.1:9")
    assert found.exit_code == 2
    assert "127.0.0.1:9" in found.stderr or "heavytop[cluster]" in found.stderr


def test_the_energy_momentum_diagram(tmp_path):
    found = run("sleeping-unstable", "--energy-momentum", "--json", "-o", tmp_path / "a")
    document = json.loads(found.stdout)
    assert found.exit_code == 0
    assert document["schema"] == "heavytop/energy-momentum/1"
    assert document["circuit"]["winding"] == 1
    assert sorted(document["files"].values()) == [
        "critical_set.png", "critical_set.svg", "energy_momentum.json", "energy_momentum.png",
        "energy_momentum.svg",
    ]  # fmt: skip
    table = run("sleeping-unstable", "--energy-momentum")
    assert "Δφ around it" in table.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (("sicm-kicked",), 2, "--x and --y"),
        (("sicm-kicked", "--x", "phidot=0:1:5"), 2, "--y"),
        (("sicm-kicked", "--x", "phidt=0:1:5", "--y", "psidot=0:1:5"), 2, 'did you mean "phidot"'),
        (("sicm-kicked", "--x", "phidot=1:0:5", "--y", "psidot=1:1:5"), 2, "less than"),
        (("sicm-kicked", *AXES, "--only", "rows"), 2, 'only = "rows": one of kind'),
        (("sicm-kicked", *AXES, "--shard", "3/2"), 2, "i/n"),
        (("no-such-scene", *AXES), 3, "no shipped scene"),
        (("sicm-kicked", "sicm-dropped", *AXES), 2, "one scene"),
        (("--merge", "nowhere"), 2, "-o"),
        (("--merge", "nowhere", "-o", "out", "--shard", "1/2"), 2, "not together with --merge"),
        (("sicm-kicked", "--energy-momentum", *AXES), 2, "not together with --energy-momentum"),
        (("sicm-kicked", *AXES, "--set", "start.omega3=9"), 2, "axis psidot sets the spin"),
        (("--merge", "nowhere", "-o", "out"), 3, "nowhere"),
        (("sicm-kicked", "--x", "phidot=0:1:90000", "--y", "psidot=0:1:90000"), 2, "GB are needed"),
        (("sicm-kicked", "--set", "start.theta=9", *AXES), 2, "start.theta"),
    ],
)
def test_what_is_wrong_is_said_in_a_sentence(arguments, code, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = run(*arguments)
    assert found.exit_code == code
    assert words in " ".join(found.stderr.split())
    assert not list(tmp_path.iterdir())


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    found = run("sicm-kicked", *AXES, "-o", tmp_path, "-j", 1)
    assert found.exit_code == 3
    assert [each.name for each in tmp_path.iterdir()] == ["mine.txt"]


def test_markup_in_a_title_is_text(tmp_path):
    title = "[bold]<script>alert(1)</script> $x_{"
    found = run("sicm-kicked", *AXES, "-j", 1, "--set", f'title="{title}"', "-o", tmp_path / "a")
    assert found.exit_code == 0
    assert title in found.stdout
