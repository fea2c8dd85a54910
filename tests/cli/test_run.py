"""``heavytop run``: what it prints and writes, and how it ends when it does not reach its end."""

import json
import warnings

import pytest
from typer.testing import CliRunner

import heavytop as ht
import heavytop.run.propagation
from heavytop import errors
from heavytop.cli import Exit, app
from heavytop.run.verify import missed_digits

KICKED = ("run", "sicm-kicked", "--set", "span.time=0.5")
SCENE = """\
format = 1
title = "$\\\\frac{ [bold]not markup"
[top]
A = 3.28e-4
C = 6.60e-5
gMR = 0.0456
[start]
theta = 0.1
phidot = -15
psidot = 140
[span]
time = 0.5
"""


def heavytop_(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


def fail_with(monkeypatch, error):
    def carried_out(*_, **__):
        raise error

    monkeypatch.setattr(heavytop.run.propagation, "carried_out", carried_out)


def test_a_table_is_printed_and_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "top.toml").write_text(SCENE, "utf-8")
    result = heavytop_("run", "top.toml")
    assert result.exit_code == 0, result.stderr
    for word in ("kind", "E′", "period", "plan", "events", "theta_min", "closed form"):
        assert word in result.stdout
    assert "[bold]not markup" in result.stdout
    assert result.stderr == ""
    assert [path.name for path in tmp_path.iterdir()] == ["top.toml"]


def test_a_folder_gets_every_file_the_document_names(tmp_path):
    folder = tmp_path / "new" / "out"
    result = heavytop_(*KICKED, "-o", folder, "--json", "-v")
    assert result.exit_code == 0, result.stderr
    printed = json.loads(result.stdout)
    assert printed["schema"] == "heavytop/run/1"
    assert printed == json.loads((folder / "run.json").read_text("utf-8"))
    figures = ("overview", "angles", "potential", "phase", "errors")
    names = {"run.json", "trajectory.nc"}
    names |= {f"{figure}.{form}" for figure in figures for form in ("svg", "png")}
    assert set(printed["files"].values()) == {path.name for path in folder.iterdir()} == names
    assert f"heavytop: wrote {folder / 'trajectory.nc'}\n" in result.stderr
    assert "integrating" in result.stderr


def test_options_are_those_asked_for(tmp_path):
    words = ("--digits", 9, "--formulation", "lagrange", "-o", tmp_path / "out", "--no-figures")
    quiet = heavytop_(*KICKED, "--json", *words, "-q", "-v")
    document = json.loads(quiet.stdout)
    assert document["final"]["t"] == 0.5
    assert document["scene"]["want"]["digits"] == 9
    assert document["plan"]["formulation"] == "lagrange"
    assert {path.suffix for path in (tmp_path / "out").iterdir()} == {".json", ".nc"}
    assert quiet.stderr == ""


def test_every_fault_of_a_scene_is_listed_with_its_line_and_no_folder_is_made(tmp_path):
    scene = tmp_path / "top.toml"
    text = SCENE.replace("A = 3.28e-4", "A = -1").replace("theta = 0.1", "thteta = 0.1")
    scene.write_text(text, encoding="utf-8")
    result = heavytop_("run", scene, "-o", tmp_path / "out", "--set", "span.time=1")
    assert result.exit_code == Exit.BAD_SCENE
    assert result.stdout == ""
    assert result.stderr.startswith("heavytop: the scene cannot be run:\n")
    assert f"{scene}:4" in result.stderr
    assert f"{scene}:8" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["top.toml"]


@pytest.mark.parametrize(
    ("outcome", "code"),
    [
        ("singular", Exit.ENDED_EARLY),
        ("step-limit", Exit.ENDED_EARLY),
        ("interrupted", Exit.INTERRUPTED),
    ],
)
def test_the_part_of_a_run_that_ended_early_is_printed_kept_and_named(
    tmp_path, monkeypatch, outcome, code
):
    whole = heavytop.run.propagation.carried_out

    def carried_out(*arguments, **options):
        raise errors.EndedEarly(outcome, whole(*arguments, **options))

    monkeypatch.setattr(heavytop.run.propagation, "carried_out", carried_out)
    folder = tmp_path / "out"
    result = heavytop_(*KICKED, "--json", "-o", folder, "--no-figures")
    assert result.exit_code == code
    assert json.loads(result.stdout)["schema"] == "heavytop/run/1"
    assert (folder / "trajectory.nc").exists()
    assert f"what was done is in {folder}" in result.stderr
    assert (f"heavytop resume {folder}" in result.stderr) == (outcome == "interrupted")
    assert (folder / "request.json").exists() == (outcome == "interrupted")
    assert errors.Outcome(outcome).sentence in result.stderr
    nowhere = heavytop_(*KICKED)
    assert nowhere.exit_code == code
    assert "what was done is above (-o DIR keeps it)" in nowhere.stderr


def test_an_interrupt_before_anything_is_done_can_be_resumed(tmp_path):
    folder = tmp_path / "out"
    with pytest.MonkeyPatch.context() as patched:
        fail_with(patched, KeyboardInterrupt())
        stopped = heavytop_(*KICKED, "-o", folder, "--no-figures")
        assert heavytop_(*KICKED).exit_code == Exit.INTERRUPTED
    assert stopped.exit_code == Exit.INTERRUPTED
    assert stopped.stderr.endswith(f"heavytop resume {folder}\n")
    assert heavytop_("resume", folder).exit_code == 0
    assert {path.name for path in folder.iterdir()} == {"run.json", "trajectory.nc"}
    again = heavytop_("resume", folder, "--json")
    assert again.exit_code == 0
    assert again.stderr == f"heavytop: {folder}: this run is finished\n"
    assert json.loads(again.stdout) == json.loads((folder / "run.json").read_text("utf-8"))


@pytest.mark.parametrize("place", ["nowhere", "file", "empty"])
def test_what_cannot_be_resumed(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    result = heavytop_("resume", place)
    assert result.exit_code == Exit.BAD_SCENE
    assert f"heavytop: {place}: no folder with anything to go on with: neither" in result.stderr


@pytest.mark.parametrize(
    ("formulation", "time", "code"),
    [("axis", 2, 0), ("axis", 10_000, Exit.OUT_OF_BOUND), ("auto", 2, 0)],
)
def test_missed_digits_are_told_by_the_command_whoever_chose_the_equations(formulation, time, code):
    """And in Python too."""
    changes = [f"span.time={time}", "want.quantities=['theta', 'phi']", "want.events=[]"]
    words = [word for change in changes for word in ("--set", change)]
    by_command = heavytop_("run", "sicm-kicked", *words, "--formulation", formulation)
    assert by_command.exit_code == code
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        found = ht.propagate(ht.load_scene("sicm-kicked", changes), formulation=formulation)
    told = [each for each in heard if issubclass(each.category, ht.MissedDigitsWarning)]
    missed = missed_digits(found, ht.run_errors(found))
    assert bool(missed) == bool(told) == (code == 5)
    assert all(name in by_command.stderr for name in missed)


# --- where the axis passes through the vertical, φ̇ is its limit p_ψ/2A, and no rounding's --------

POLES = [("through-top", "theta_min", 140 * 6.6e-5), ("through-bottom", "theta_max", -40 * 6.6e-5)]


@pytest.mark.parametrize(("name", "kind", "limit"), POLES)
@pytest.mark.parametrize("digits", [12, 25])
def test_a_row_at_a_pole_has_the_limit(name, kind, limit, digits):
    words = ("run", name, "--set", "span.time=0.6", "--digits", digits)
    rows = json.loads(heavytop_(*words, "--json").stdout)["events"]["table"]
    there = [float(row["phidot"]) for row in rows if row["kind"] == kind]
    assert there == pytest.approx([limit / (2 * 3.28e-4)] * 3, rel=1e-14)
    assert len(rows) == 5
    note = "at the pole          φ is that before or after, π apart; φ̇ is its limit"
    assert note in heavytop_(*words).stdout
    assert note not in heavytop_(*KICKED).stdout


def test_an_advance_that_is_zero_is_printed_as_zero():
    """Without gravity the axis runs round a circle: φ comes back, and 1e-101 is no advance."""
    found = json.loads(heavytop_("run", "force-free", "--json").stdout)
    assert found["motion"]["precession"] == 0
    assert found["motion"]["spin"] > 3
