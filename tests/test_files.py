"""A result file that is not what was written is refused before anything in it is believed."""

import hashlib
from concurrent.futures import ThreadPoolExecutor

import h5py
import pytest
import xarray

import heavytop as ht
from heavytop.files import write_atomic, write_text
from heavytop.report.files import write_result

SEAL_BYTES = 82
SHORT = ht.load_scene("sicm-kicked", ["span.time=0.1"])


@pytest.fixture
def path(tmp_path):
    """A file of ours."""
    ht.propagate(SHORT).save(tmp_path / "a.nc")
    return tmp_path / "a.nc"


def test_a_digest_stands_behind_the_end_and_a_file_without_it_or_of_another_is_refused(path):
    whole = path.read_bytes()
    before, own = whole[:-SEAL_BYTES], hashlib.sha256(whole[:-SEAL_BYTES]).hexdigest()
    assert whole == before + b"\nheavytop sha256 " + own.encode() + b"\n"
    for wrong in (before, b"", whole[:40]):
        path.write_bytes(wrong)
        with pytest.raises(ht.ForeignFile, match=r"a\.nc: not what was written"):
            ht.load_trajectory(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file["theta"][3] += 1e-9
    with pytest.raises(ht.ForeignFile, match=r"a\.nc: not what was written"):
        ht.load_trajectory(path)
    path.unlink()
    with pytest.raises(ht.ForeignFile, match="no such file"):
        ht.load_trajectory(path)


def test_a_failed_write_leaves_the_file_of_another_and_nothing_else(tmp_path):
    path = tmp_path / "result"

    def half(part):
        part.write_text("ha")
        with ThreadPoolExecutor() as others:
            others.submit(write_text, path, "whole").result()
        assert part.read_text() == "ha"
        raise OSError("full")

    with pytest.raises(OSError, match="full"):
        write_atomic(path, half)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("result", "whole")]


def test_what_a_killed_writer_left_is_taken_away_and_nothing_else(tmp_path):
    mine = [".12.notes.txt", ".x.drift.json", "12.drift.json"]
    for name in (".12.drift.json", ".7.drift.nc", ".12.drift.png", *mine):
        (tmp_path / name).write_text("half")
    study = ht.drift(SHORT, methods=["taylor-axis"], periods=2, samples=2)
    write_result(study, tmp_path, figures=False)
    assert {path.name for path in tmp_path.iterdir()} == {*mine, "drift.json", "drift.nc"}


def test_events_are_read_by_everybody(path):
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=20", "want.samples=5"]))
    run.save(path)
    with xarray.open_dataset(path) as data:
        assert tuple(data.event_kind.values) == run.events.kind
        assert float(data.own_t[-1]) == 2.0


@pytest.mark.slow
def test_damaged_files_are_refused_unseen(script, monkeypatch):
    misses = script("43_fuzz").damage_misses
    assert misses(seed=1, count=320) == []
    monkeypatch.setattr("heavytop.files.expect_sealed", lambda path: None)
    assert len(misses(seed=1, count=32)) > 16  # they are seen where no digest is checked
