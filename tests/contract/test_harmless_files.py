"""A result file whose arrays lie elsewhere, or would fit nowhere, is refused before it is read."""

import os
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli.command import app
from heavytop.hdf5 import MOST_BYTES, expect_harmless


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.nc"


def test_a_file_of_ours_is_harmless(path):
    ht.propagate(ht.load_scene("sicm-kicked")).save(path)
    expect_harmless(path)


def test_an_array_in_another_file_is_refused(path, tmp_path):
    (tmp_path / "secret.txt").write_text("a secret")
    with h5py.File(path, "w") as file:
        file.create_dataset("kind", (8,), np.uint8, external=[(str(tmp_path / "secret.txt"), 0, 8)])
    with pytest.raises(ht.ForeignFile, match="'kind': lies in another file"):
        ht.load_trajectory(path)


def test_a_virtual_array_is_refused(path):
    layout = h5py.VirtualLayout((4,), np.uint8)
    layout[:] = h5py.VirtualSource("elsewhere.nc", "kind", (4,))
    with h5py.File(path, "w") as file:
        file.create_virtual_dataset("kind", layout)
    with pytest.raises(ht.ForeignFile, match="lies in another file"):
        expect_harmless(path)


def test_a_link_is_refused(path):
    with h5py.File(path, "w") as file:
        file["kind"] = h5py.ExternalLink("elsewhere.nc", "/kind")
    with pytest.raises(ht.ForeignFile, match="a link"):
        expect_harmless(path)


def test_more_than_fits_is_refused(path):
    with h5py.File(path, "w") as file:
        file.create_dataset("bomb", (MOST_BYTES + 1,), np.uint8, chunks=(1000,), compression="gzip")
    with pytest.raises(ht.ForeignFile, match="declares"):
        ht.load_trajectory(path)


@pytest.mark.parametrize("scene", ["at-rest", "planar-asymptotic"])
def test_a_run_of_a_top_that_hardly_moves_has_a_page(scene, tmp_path):
    runner = CliRunner()
    assert runner.invoke(app, ["run", scene, "-q", "-o", str(tmp_path / "a")]).exit_code == 0
    found = runner.invoke(app, ["report", str(tmp_path / "a"), "-o", str(tmp_path / "b")])
    assert found.exit_code == 0, found.stderr


@pytest.mark.parametrize("name", ["run.json", "run.html"])
def test_a_report_replaces_nothing_but_a_report(name, tmp_path):
    runner = CliRunner()
    runner.invoke(app, ["run", "sicm-kicked", "-q", "-o", str(tmp_path)])
    kept = tmp_path / name
    if not kept.exists():
        kept.write_text("<h1>My notes on heavytop</h1>")
    before = kept.read_bytes()
    found = runner.invoke(app, ["report", str(tmp_path), "-o", str(tmp_path / "run.html")])
    assert found.exit_code == 2
    assert name in " ".join(found.stderr.split())
    assert kept.read_bytes() == before


def test_what_is_no_number_is_never_the_smaller(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "validation"))
    most = __import__("claim").most
    assert most(1, 3, 2) == most(iter([1, 3, 2])) == 3
    assert np.isnan(most(1.0, np.nan))
    assert np.isnan(most(iter([1.0, np.nan, 2.0])))


def test_a_trajectory_of_another_span_is_named(tmp_path):
    runner = CliRunner()
    for folder, time in (("a", 2), ("b", 4)):
        there = ["-q", "--no-figures", "-o", str(tmp_path / folder)]
        runner.invoke(app, ["run", "sicm-kicked", "--set", f"span.time={time}", *there])
    (tmp_path / "b" / "trajectory.nc").replace(tmp_path / "a" / "trajectory.nc")
    found = runner.invoke(app, ["report", str(tmp_path / "a"), "-o", str(tmp_path / "c")])
    assert found.exit_code == 6
    said = "".join(found.stderr.split())
    assert "a/trajectory.nc:thetrajectoryofanotherscene" in said


def test_a_damaged_trajectory_is_the_one_that_is_named(tmp_path):
    runner = CliRunner()
    runner.invoke(app, ["run", "sicm-kicked", "-q", "--no-figures", "-o", str(tmp_path / "a")])
    (tmp_path / "a" / "trajectory.nc").write_bytes(b"no such thing")
    found = runner.invoke(app, ["report", str(tmp_path / "a"), "-o", str(tmp_path / "c")])
    assert found.exit_code == 6
    assert "trajectory.nc: not a readable" in " ".join(found.stderr.split())
    assert "run.json" not in found.stderr


@pytest.fixture
def run_twice(tmp_path):
    """Two folders with the same run, and what a report of them, or of the first, says."""
    runner, report = CliRunner(), tmp_path / "page" / "report.html"
    runner.invoke(app, ["run", "sicm-kicked", "-q", "--no-figures", "-o", str(tmp_path / "a")])
    shutil.copytree(tmp_path / "a", tmp_path / "b")

    def reported(*names):
        asked = ["report", *(str(tmp_path / name) for name in names), "-o", str(report)]
        return runner.invoke(app, asked)

    return tmp_path, reported


def test_a_trajectory_by_other_equations_or_of_another_motion_is_refused(run_twice):
    place, reported = run_twice
    trajectory = place / "a" / "trajectory.nc"
    ht.propagate(ht.load_scene("sicm-kicked"), formulation="attitude").save(trajectory)
    found = reported("a")
    assert found.exit_code == 6
    assert "trajectory.nc: the trajectory of another plan" in " ".join(found.stderr.split())
    shutil.copy(place / "b" / "trajectory.nc", trajectory)
    with h5py.File(trajectory, "r+") as file:
        file["checkpoint_states"][:, 0] += 0.01  # the axis
    found = reported("a")
    assert found.exit_code == 6
    assert "a/trajectory.nc" in "".join(found.stderr.split())


def test_copies_are_one_only_with_what_lies_beside_them(run_twice):
    place, reported = run_twice
    assert "the same as" in reported("a", "b").stderr
    (place / "b" / "trajectory.nc").write_bytes(b"no such thing")
    found = reported("a", "b")
    assert found.exit_code == 6
    assert "b/trajectory.nc" in "".join(found.stderr.split())


def test_a_page_that_cannot_be_put_in_its_place_leaves_the_document_that_was_there(
    run_twice, monkeypatch
):
    place, reported = run_twice
    assert reported("a").exit_code == 0
    before = (place / "page" / "report.json").read_bytes()
    put = os.replace

    def refused(source, target):
        if str(target).endswith(".html"):
            raise PermissionError(1, "Operation not permitted")
        return put(source, target)

    monkeypatch.setattr(os, "replace", refused)
    monkeypatch.setattr(Path, "replace", lambda source, target: refused(source, target))
    assert reported("b").exit_code != 0
    assert (place / "page" / "report.json").read_bytes() == before


def test_escape_codes_in_the_name_of_a_folder_do_not_reach_the_terminal(run_twice):
    place, reported = run_twice
    (place / "a").rename(place / "esc\x1b[31mred\x07")
    (place / "esc\x1b[31mred\x07" / "trajectory.nc").write_bytes(b"no such thing")
    found = reported("esc\x1b[31mred\x07")
    assert found.exit_code == 6
    assert r"esc\x1b[31mred\x07" in "".join(found.stderr.split())
    assert not {"\x1b", "\x07"} & set(found.stderr)
