"""The pack of exact values, and what scores a trajectory by it with Python alone."""

import csv
import subprocess
import sys

import numpy as np
import pytest

from heavytop.results.reference_pack import packed, write_pack
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene, shipped_scenes

PARTS = {"axis": "xyz", "omega": "xyz", "quaternion": "wxyz"}


@pytest.fixture(scope="module")
def pack(tmp_path_factory):
    """A folder with the pack, and the names of its files."""
    folder = tmp_path_factory.mktemp("pack")
    return folder, write_pack(folder)


def scored(pack, name, path):
    command = [sys.executable, "-I", "-S", pack[0] / "score.py", name, path]
    return subprocess.run(command, capture_output=True, text=True)


def mine(pack, path, name, ahead=0.0):
    """A trajectory of our integrator that runs ahead by some seconds, as a file."""
    rows = csv.DictReader((pack[0] / f"{name}.csv").read_text("utf-8").splitlines())
    t = np.array([float(row["t"]) for row in rows])
    whole = load_scene(name, overrides=["span.time=5", 'want.quantities=["attitude"]'])
    there = propagate(whole)(t + ahead)
    table = np.column_stack((t, there.axis, there.omega, -there.quaternion))
    header = ["t", *(f"{name}_{part}" for name, parts in PARTS.items() for part in parts)]
    np.savetxt(path, table, delimiter=",", header=",".join(header), comments="", fmt="%.17g")
    return path


def test_the_pack_has_every_scene_and_is_small(pack):
    folder, files = pack
    assert sum((folder / name).stat().st_size for name in files) <= 5e6
    assert len((folder / "score.py").read_text("utf-8").splitlines()) <= 100
    assert len(files) == 3 * len(shipped_scenes()) + 2


@pytest.mark.processes
@pytest.mark.parametrize("name", ["sicm-kicked", "sicm-dropped"])
def test_the_pack_scores_a_trajectory_with_python_alone(pack, tmp_path, name):
    good = scored(pack, name, mine(pack, tmp_path / "good.csv", name)).stdout
    errors = {line.split()[0]: float(line.split()[1]) for line in good.splitlines()}
    assert list(errors) == ["axis", "phase", "quaternion", "omega", "digits"]
    assert errors["digits"] > 13
    assert abs(errors["phase"]) < 1e-11  # also near a cusp, where the axis is at rest
    assert errors["quaternion"] < 1e-12
    late = scored(pack, name, mine(pack, tmp_path / "late.csv", name, 1e-7)).stdout
    assert late.split("phase")[1].split()[0] == "1.00e-07"
    assert 5 < float(late.split("digits")[1]) < 8


@pytest.mark.processes
def test_angles_alone_are_scored_as_an_axis(pack, tmp_path):
    rows = csv.DictReader((pack[0] / "sicm-kicked.csv").read_text("utf-8").splitlines())
    table = [",".join((row["t"], row["theta"], row["phi"])) for row in rows]
    path = tmp_path / "mine.csv"
    path.write_text("\n".join(["t,theta,phi", *table, "", ""]), "utf-8")
    said = scored(pack, "sicm-kicked", path).stdout
    assert [line.split()[0] for line in said.splitlines()] == ["axis", "phase", "digits"]
    assert float(said.split("digits")[1]) > 15


@pytest.mark.processes
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "No such file or directory"),
        (b"\xff\xfe\x00", "no table of numbers below their names"),
        (b"t,theta,phi\n0,0.1\n", "no table of numbers below their names"),
        (b"t,theta,phi\n0,0.1,0\n1,x,0\n", "could not convert string to float: 'x'"),
        (b"t,theta,phi\n0,0.1,nan\n", "a number is not finite"),
        (b"t,theta,phi\n0,0.1,0\n", "is missing"),
    ],
)
def test_a_file_that_cannot_be_scored_is_told_in_a_line(pack, tmp_path, text, said):
    path = tmp_path / "mine.csv"
    if text is not None:
        path.write_bytes(text)
    found = scored(pack, "sicm-kicked", path)
    assert (found.returncode, found.stdout) == (1, "")
    assert said in found.stderr
    assert len(found.stderr.splitlines()) == 1


def test_the_pack_has_events_and_two_hundred_times():
    found = packed(load_scene("sicm-dropped"))
    assert len(found.columns["t"]) == 200
    assert {kind for kind, _ in found.events} == {"turning", "cusp"}
