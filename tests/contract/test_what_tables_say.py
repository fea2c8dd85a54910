"""Tables say in what each number is measured, when the run ended, and what a pendulum's period is.

A folder holds the figures of the run that its document tells of, and no other's.
"""

import json
import re

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.plots.figures import FIGURES
from heavytop.report.run_files import OWN_FIGURES


def printed(*words):
    found = CliRunner().invoke(app, [str(word) for word in words])
    assert found.exit_code == 0, found.output
    return found.stdout


def line(text, start):
    return next(line for line in text.splitlines() if line.startswith(start))


@pytest.fixture(scope="module")
def two_periods():
    return printed("run", "sicm-kicked", "--set", "span.periods=2")


def test_events_are_headed_with_their_units(two_periods):
    headings = re.split(r"\s{2,}", line(two_periods, "event  ").strip())
    assert headings == ["event", "t [s]", "θ [rad]", "φ [rad]", "φ̇ [rad/s]", "residual [rad/s]"]


def test_distances_from_the_closed_form_have_units(two_periods):
    words = " ".join(two_periods.split("off the closed form")[1].split("cost")[0].split())
    named = re.findall(r"([a-z ]+) [\d.e+-]+ (rad|s|\(a length\)|\(relative\))(?:, |$)", words)
    assert {name.strip(): unit for name, unit in named} == {
        "theta": "rad",
        "phi": "rad",
        "psi": "rad",
        "axis": "(a length)",
        "energy": "(relative)",
        "event time": "s",
        "input rounding": "rad",
    }


def test_the_time_of_the_end_has_the_digits_of_the_state_there(two_periods):
    shown = line(two_periods, "at t = ").split()[3]
    assert shown == f"{2 * 0.542895518188230:.12g}"


@pytest.mark.parametrize("verb", ["run", "classify"])
def test_a_pendulum_swings_twice_as_long_as_its_tilt(verb):
    swinging = "the swing there and back 2.37297811194 s; φ jumps by π at the vertical"
    assert swinging in printed(verb, "planar-pendulum")
    assert "there and back" not in printed(verb, "planar-rotating")


def test_the_other_steady_motion_nods_at_a_rate_with_its_unit():
    assert "with a small nutation of 21.0329088001 rad/s" in printed("classify", "steady-betsch")


def test_axes_and_boundaries_of_an_atlas_say_in_what_and_of_what():
    axes = ("--x", "phidot=-20:20:21", "--y", "theta=0.1:3:19")
    text = printed("atlas", "sicm-kicked", *axes, "--only", "kind", "-j", 1)
    assert "phidot = -20 … 20 rad/s, 21 values" in text
    assert "theta = 0.1 … 3 rad, 19 values" in text
    assert re.search(r"through-bottom \((1 line|\d+ lines)\)", text)


WHOLE = [(name, periods, 12) for name in ("sicm-kicked", "sicm-dropped") for periods in (1, 5, -7)]
BETWEEN_DOUBLES = ("sicm-kicked", 7, 30)  # is where this one ends


@pytest.mark.parametrize(("name", "periods", "digits"), [*WHOLE, BETWEEN_DOUBLES])
def test_an_event_at_the_end_is_within_the_run(name, periods, digits):
    changes = [f"span.periods={periods}", f"want.digits={digits}"]
    run = ht.propagate(ht.load_scene(name, overrides=changes))
    there = run(run.events.t)
    assert abs(there.t[-1] - run.orbit.end) < 1e-15
    assert there.theta == pytest.approx(run.events.theta, abs=1e-14)
    assert run(run.t).theta[-1] == pytest.approx(run.events.theta[-1], abs=1e-14)
    exact = periods * ht.Motion(run.scene.top, run.scene.start).period
    assert abs(run.events.t[-1] + run.events.t_low[-1] - float(exact)) < 1e-14


def test_an_event_at_the_end_has_its_mark():
    run = ht.propagate(ht.load_scene("sicm-dropped", overrides=["span.periods=7"]))
    figure = FIGURES["overview"](run)
    marks = [line for ax in figure.axes for line in ax.lines if line.get_label() == "cusp"]
    assert marks
    assert {len(line.get_xdata()) for line in marks} == {run.events.count("cusp")}


def test_figures_of_an_earlier_run_do_not_stay_beside_another(tmp_path):
    folder = tmp_path / "out"
    short = ("--set", "span.time=0.3", "-o", folder)
    printed("run", "sicm-kicked", *short)
    assert set(json.loads((folder / "run.json").read_text())["files"].values()) >= OWN_FIGURES
    assert {f"{name}.{form}" for name in FIGURES for form in ("svg", "png")} == OWN_FIGURES
    (folder / "mine.svg").write_text("mine")
    printed("run", "sicm-dropped", *short, "--no-figures", "--force")
    assert {path.name for path in folder.iterdir()} == {"run.json", "trajectory.nc", "mine.svg"}


@pytest.mark.parametrize("text", ["", "[]", '{"files": {"a": "mine.svg", "b": 3}}', "{}"])
def test_only_figures_of_a_run_are_removed(tmp_path, text):
    """What no run's document tells of is somebody else's, whatever its name."""
    (tmp_path / "run.json").write_text(text)
    for name in ("mine.svg", "overview.svg"):
        (tmp_path / name).write_text("mine")
    words = ("--set", "span.time=0.3", "--no-figures", "-o", tmp_path)
    printed("run", "sicm-kicked", *words, "--force")
    assert (tmp_path / "mine.svg").exists()
    assert (tmp_path / "overview.svg").exists()


def test_a_run_that_needs_no_integration_leaves_no_figures_of_another(tmp_path):
    (tmp_path / "run.json").write_text(
        json.dumps({"schema": "heavytop/run/1", "files": {n: n for n in sorted(OWN_FIGURES)}})
    )
    for name in OWN_FIGURES:
        (tmp_path / name).write_text("another's")
    folded = ("--set", "span.periods=1e9", "--set", "want.events=[]")
    printed("run", "sicm-kicked", *folded, "--force", "-o", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["run.json"]
