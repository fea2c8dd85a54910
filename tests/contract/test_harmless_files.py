"""A result file that is not what was written is refused before anything in it is believed."""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli.command import app
from heavytop.hdf5 import SEAL_BYTES, seal
from heavytop.report.pages.sections import stored_map


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a.nc"


@contextmanager
def forging(path):
    """Change a file of ours with h5py, and give it the digest of what it is then."""
    path.write_bytes(path.read_bytes()[:-SEAL_BYTES])
    with h5py.File(path, "r+") as file:
        yield file
    seal(path)


@pytest.fixture
def forged(path):
    ht.propagate(ht.load_scene("sicm-kicked", ["span.time=0.1"])).save(path)
    return lambda: forging(path)


def memory_of_a_load(path):
    """The most memory that a process has taken which loaded a file, and what it said [bytes]."""
    code = (
        "import sys, heavytop as ht\n"
        "try: ht.load_trajectory(sys.argv[1])\n"
        "except ht.ForeignFile as fault: print(fault, file=sys.stderr)\n"
        "told = open('/proc/self/status').read()\n"  # what getrusage tells begins with the parent's
        "print(int(told.partition('VmHWM:')[2].split()[0]) * 1024)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True,
                          timeout=120, check=True)  # fmt: skip
    return int(done.stdout), done.stderr


def test_a_digest_of_the_file_stands_behind_its_end(path):
    ht.propagate(ht.load_scene("sicm-kicked")).save(path)
    data = path.read_bytes()
    before, own = data[:-SEAL_BYTES], hashlib.sha256(data[:-SEAL_BYTES]).hexdigest()
    assert data == before + b"\nheavytop sha256 " + own.encode() + b"\n"


def test_what_is_stored_is_read_by_everybody(path):
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=20", "want.samples=5"]))
    run.save(path)
    with xarray.open_dataset(path) as data:
        assert np.array_equal(data.theta, run.theta)
        assert tuple(data.event_kind.values) == run.events.kind
        assert float(data.decimal_t_time[-1]) == 2.0


def test_a_file_without_a_digest_is_refused(path):
    ht.propagate(ht.load_scene("sicm-kicked")).save(path)
    path.write_bytes(path.read_bytes()[:-SEAL_BYTES])
    with pytest.raises(ht.ForeignFile, match=r"a\.nc: .*no digest at its end.*earlier version"):
        ht.load_trajectory(path)


def test_a_file_that_another_program_changed_is_refused(path):
    ht.propagate(ht.load_scene("sicm-kicked")).save(path)
    with h5py.File(path, "r+") as file:
        file["theta"][3] += 1e-9
    with pytest.raises(ht.ForeignFile, match=r"a\.nc: not a readable result file"):
        ht.load_trajectory(path)


def test_what_is_not_declared_is_not_read(forged, path):
    with forged() as file:
        file.create_dataset("bomb", (2**39,), "f8", chunks=(2**20,), compression="gzip")
        file["more"] = h5py.ExternalLink("elsewhere.nc", "/kind")
        file.attrs["more"] = ["a"] * 100
    assert ht.load_trajectory(path).outcome == "finished"


@pytest.mark.parametrize("name", ["theta", "states", "event_t", "checkpoint_states"])
def test_zeros_that_are_compressed_take_no_memory(forged, path, name):
    with forged() as file:
        del file[name]
        file.create_dataset(name, (2**29, 6), "f8", chunks=(2**18, 6), compression="gzip")
    size, said = memory_of_a_load(path)
    assert size < 2**30
    if name != "theta":  # which is computed from the states
        assert f"'{name}': not in one piece" in said


def test_arrays_that_are_declared_and_not_stored_are_refused(forged, path):
    with forged() as file:
        del file["states"]
        file.create_dataset("states", (2**31, 6), "f8")
    with pytest.raises(ht.ForeignFile, match="'states': not in one piece"):
        ht.load_trajectory(path)


def test_an_array_in_another_file_is_refused(forged, path, tmp_path):
    (tmp_path / "secret.txt").write_text("a secret, and more of it")
    with forged() as file:
        del file["t"]
        file.create_dataset("t", (1,), "f8", external=[(str(tmp_path / "secret.txt"), 0, 8)])
    with pytest.raises(ht.ForeignFile, match="'t': lies in another file"):
        ht.load_trajectory(path)


def test_a_virtual_array_is_refused(forged, path):
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource("elsewhere.nc", "t", (4,))
    with forged() as file:
        del file["t"]
        file.create_virtual_dataset("t", layout)
    with pytest.raises(ht.ForeignFile, match="'t': lies in another file"):
        ht.load_trajectory(path)


@pytest.mark.parametrize("link", [h5py.ExternalLink("b.nc", "/t"), h5py.SoftLink("/theta")])
def test_a_link_is_refused(forged, path, link):
    with forged() as file:
        del file["t"]
        file["t"] = link
    with pytest.raises(ht.ForeignFile, match="no array 't'"):
        ht.load_trajectory(path)


@pytest.mark.parametrize("kind", [h5py.string_dtype(), "u1", ">f8", h5py.ref_dtype])
def test_an_array_of_another_type_is_refused(forged, path, kind):
    with forged() as file:
        del file["t"]
        file.create_dataset("t", (4,), kind)
    with pytest.raises(ht.ForeignFile, match="'t': of type"):
        ht.load_trajectory(path)


def test_a_map_in_one_huge_part_is_refused(tmp_path):
    with h5py.File(tmp_path / "atlas.nc", "w") as file:
        shape = (40_000, 40_000)
        kind = file.create_dataset("kind", shape, "u1", chunks=shape, compression="gzip")
        kind.attrs["flag_meanings"] = "loops"
    seal(tmp_path / "atlas.nc")
    with pytest.raises(ht.ForeignFile, match="'kind': in parts that are too large"):
        stored_map(tmp_path / "atlas.nc", shape)


@pytest.mark.parametrize("made", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
def test_a_pipe_or_a_device_is_no_trajectory(path, made):
    made(path)
    with pytest.raises(ht.ForeignFile, match="not a regular file"):
        ht.load_trajectory(path)


RESUME_ALL = """
import json, sys
from typer.testing import CliRunner
from heavytop.cli.command import app
for place in sys.argv[1:]:
    done = CliRunner().invoke(app, ["resume", "--no-figures", place])
    print(json.dumps([place, done.exit_code, done.stderr]), flush=True)
"""


@pytest.mark.parametrize(
    ("words", "needed"),
    [
        (
            ["drift", "sicm-kicked", "--methods", "taylor-axis", "--periods", "3"],
            {"study.json", "tasks"},
        ),
        (
            ["atlas", "sicm-kicked", "--x", "phidot=-20:20:6", "--y", "theta=0.1:3:6"],
            {"study.json", "tasks"},
        ),
        (["run", "sicm-kicked"], {"run.json", "trajectory.nc"}),
    ],
)
def test_a_pipe_in_a_folder_stops_nothing(tmp_path, words, needed):
    """Whatever file it stands for, `resume` ends, and names it where it is needed."""
    whole = tmp_path / "whole"
    begun = CliRunner().invoke(app, [*words, "-q", "--no-figures", "-o", str(whole)])
    assert begun.exit_code == 0, begun.stderr
    files = sorted(path.relative_to(whole) for path in whole.rglob("*") if path.is_file())
    places = {str(tmp_path / f"{number}"): file for number, file in enumerate(files)}
    for place, file in places.items():
        shutil.copytree(whole, place)
        (Path(place) / file).unlink()
        os.mkfifo(Path(place) / file)
    done = subprocess.run([sys.executable, "-c", RESUME_ALL, *places], capture_output=True,
                          text=True, timeout=120, check=True)  # fmt: skip
    told = [json.loads(line) for line in done.stdout.splitlines()]
    assert [place for place, *_ in told] == list(places)
    for place, code, said in told:
        name, top = places[place].name, places[place].parts[0]
        assert code == (3 if top in needed else 0), (name, said)
        assert top not in needed or name in "".join(said.split())


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
    assert found.exit_code == 3
    said = "".join(found.stderr.split())
    assert "a/trajectory.nc:thetrajectoryofanotherscene" in said


def test_a_damaged_trajectory_is_the_one_that_is_named(tmp_path):
    runner = CliRunner()
    runner.invoke(app, ["run", "sicm-kicked", "-q", "--no-figures", "-o", str(tmp_path / "a")])
    (tmp_path / "a" / "trajectory.nc").write_bytes(b"no such thing")
    found = runner.invoke(app, ["report", str(tmp_path / "a"), "-o", str(tmp_path / "c")])
    assert found.exit_code == 3
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


def test_escape_codes_in_the_name_of_a_folder_do_not_reach_the_terminal(run_twice):
    place, reported = run_twice
    (place / "a").rename(place / "esc\x1b[31mred\x07")
    (place / "esc\x1b[31mred\x07" / "trajectory.nc").write_bytes(b"no such thing")
    found = reported("esc\x1b[31mred\x07")
    assert found.exit_code == 3
    assert r"esc\x1b[31mred\x07" in "".join(found.stderr.split())
    assert not {"\x1b", "\x07"} & set(found.stderr)
