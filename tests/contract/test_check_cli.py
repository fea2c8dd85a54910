"""``heavytop check``: what its page shows, its files, and what it leaves with."""

import contextlib
import errno
import json
import os
import shlex
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from heavytop.analytic.motion import Motion
from heavytop.cli import app, exit_code
from heavytop.errors import ForeignFile
from heavytop.plots.studies import check_figure
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene

from .pages_agree import BLOCK
from .test_transcript import follows, lines, steps

PAGE = (Path(__file__).parents[2] / "docs" / "check-a-trajectory.md").read_text("utf-8")
KICKED = load_scene("sicm-kicked")
FOREIGN = exit_code(ForeignFile("x"))


def heavytop_(*words):
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture
def mine(tmp_path):
    """A table of the kicked top, its angles as they are, and where the run is."""
    t = np.linspace(0, 2, 201)
    record = Motion(KICKED.top, KICKED.start).at(t)
    path = tmp_path / "mine.csv"
    rows = np.stack([t, record.theta, record.phi], axis=1)
    np.savetxt(path, rows, delimiter=",", header="Zeit,theta,phi", comments="", fmt="%.17g")
    return path


def test_the_session_of_the_page(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with contextlib.redirect_stdout(None):
        exec(compile(BLOCK.search(PAGE)[1], "the page", "exec"), {})
    session = list(steps(PAGE))
    assert len(session) == 2
    for command, shown in session:
        found = heavytop_(*shlex.split(command)[1:])
        assert follows(lines(shown), lines(found.output)), found.output
    assert found.exit_code == 5
    assert (tmp_path / "errors.svg").read_text("utf-8").startswith("<?xml")


def test_columns_have_their_names_told(mine):
    refused = heavytop_("check", mine, "--scene", "sicm-kicked")
    assert refused.exit_code == FOREIGN
    assert "t: a column of at least 5 times" in refused.stderr
    words = ("check", mine, "--scene", "sicm-kicked", "--columns", "t=Zeit")
    found = heavytop_(*words, "--json", "--digits", 13)
    assert found.exit_code == 0
    document = json.loads(found.stdout)
    assert document["schema"] == "heavytop/check/1"
    assert (document["digits"] > 14, document["slip"]) == (True, None)
    assert heavytop_(*words[:-1], "Zeit").exit_code == 2


def test_a_run_of_ours_knows_its_scene(tmp_path):
    propagate(KICKED).save(tmp_path / "trajectory.nc")
    found = heavytop_("check", tmp_path / "trajectory.nc", "--digits", 12)
    assert found.exit_code == 0, found.output
    assert "of the scene: theta = 0.1, phidot = -15" in found.stdout


def test_what_it_cannot_do_is_told(mine, tmp_path):
    needed = heavytop_("check", mine, "--columns", "t=Zeit")
    assert needed.exit_code == 3
    assert "a scene, or its top alone, has to say what the data are of" in needed.stderr
    assert heavytop_("check", tmp_path / "none.csv").exit_code == FOREIGN
    words = ("check", mine, "--scene", "sicm-kicked", "--columns", "t=Zeit", "-o")
    assert heavytop_(*words, "errors.txt").exit_code == 2
    assert heavytop_(*words, tmp_path / "no" / "x.svg").exit_code == 2


@pytest.mark.parametrize("digits", ["nan", "-1", "inf"])
def test_digits_are_a_number_of_them(mine, digits):
    found = heavytop_("check", mine, "--scene", "sicm-kicked", f"--digits={digits}")
    assert (found.exit_code, found.stdout) == (2, "")
    assert "is no number of digits" in found.stderr


@pytest.mark.parametrize(("number", "code"), [(errno.ENOSPC, 4), (errno.EACCES, 2)])
def test_the_judgement_is_printed_without_its_chart(mine, monkeypatch, number, code):
    def full(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr("heavytop.plots.style.save", full)
    words = ("check", mine, "--scene", "sicm-kicked", "--columns", "t=Zeit", "-o", "errors.svg")
    found = heavytop_(*words)
    assert found.exit_code == code
    assert "digits          1" in found.stdout
    assert f"cannot write errors.svg: {os.strerror(number)}" in found.stderr
    assert heavytop_(*words, "--digits", "17").exit_code == 5


def test_the_chart_shows_what_the_document_holds(mine):
    words = ("check", mine, "--scene", "sicm-dropped", "--columns", "t=Zeit", "--json")
    document = json.loads(heavytop_(*words).stdout)
    above, below = check_figure(document).axes
    drawn = {line.get_label(): line.get_ydata() for line in above.lines}
    curve = np.abs(np.array(document["curves"]["axis"], dtype=float))
    assert np.array_equal(drawn["axis [rad]"][1:], curve[1:])
    assert list(drawn) == ["axis [rad]", "θ [rad]", "φ [rad]", "conditioning"]
    assert list(below.lines[0].get_ydata()) == document["curves"]["phase"]
