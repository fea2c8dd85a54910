"""A result file that is not what was written is refused before anything in it is believed."""

import hashlib
import runpy
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

import heavytop as ht
from heavytop import hdf5
from heavytop.hdf5 import SEAL_BYTES, seal

SHORT = ht.load_scene("sicm-kicked", ["span.time=0.1"])


@pytest.fixture
def path(tmp_path):
    """A file of ours."""
    ht.propagate(SHORT).save(tmp_path / "a.nc")
    return tmp_path / "a.nc"


@contextmanager
def forging(path):
    """Change a file of ours with h5py, and give it the digest of what it is then."""
    path.write_bytes(path.read_bytes()[:-SEAL_BYTES])
    with h5py.File(path, "r+") as file:
        yield file
    seal(path)


def test_a_digest_stands_behind_the_end_and_a_file_without_it_or_of_another_is_refused(path):
    whole = path.read_bytes()
    before, own = whole[:-SEAL_BYTES], hashlib.sha256(whole[:-SEAL_BYTES]).hexdigest()
    assert whole == before + b"\nheavytop sha256 " + own.encode() + b"\n"
    path.write_bytes(before)
    with pytest.raises(ht.ForeignFile, match=r"a\.nc: .*no digest at its end.*earlier version"):
        ht.load_trajectory(path)
    path.write_bytes(whole)
    with h5py.File(path, "r+") as file:
        file["theta"][3] += 1e-9
    with pytest.raises(ht.ForeignFile, match=r"a\.nc: not a readable result file"):
        ht.load_trajectory(path)


def test_what_is_stored_is_read_by_everybody(path):
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=20", "want.samples=5"]))
    run.save(path)
    with xarray.open_dataset(path) as data:
        assert np.array_equal(data.theta, run.theta)
        assert tuple(data.event_kind.values) == run.events.kind
        assert float(data.decimal_t_time[-1]) == 2.0


def test_what_is_not_declared_is_not_read(path):
    with forging(path) as file:
        file.create_dataset("bomb", (2**39,), "f8", chunks=(2**20,), compression="gzip")
        file["more"] = h5py.ExternalLink("elsewhere.nc", "/kind")
        file.attrs["more"] = ["a"] * 100
    assert ht.load_trajectory(path).outcome == "finished"


def in_another_file(file):
    file.create_dataset("t", (1,), "f8", external=[("secret.txt", 0, 8)])


def virtual(file):
    layout = h5py.VirtualLayout((4,), "f8")
    layout[:] = h5py.VirtualSource("elsewhere.nc", "t", (4,))
    file.create_virtual_dataset("t", layout)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (in_another_file, "lies in another file"),
        (virtual, "lies in another file"),
        (lambda file: file.create_dataset("t", (2**31, 6), "f8"), "not in one piece"),
        (lambda file: file.__setitem__("t", h5py.ExternalLink("b.nc", "/t")), "no array"),
        (lambda file: file.__setitem__("t", h5py.SoftLink("/theta")), "no array"),
        (lambda file: file.create_dataset("t", (4,), h5py.string_dtype()), "of type"),
        (lambda file: file.create_dataset("t", (4,), ">f8"), "of type"),
    ],
)
def test_an_array_that_is_not_stored_in_the_file_as_doubles_is_refused(path, make, said):
    with forging(path) as file:
        del file["t"]
        make(file)
    with pytest.raises(ht.ForeignFile, match=rf"{said} 't'|'t': {said}"):
        ht.load_trajectory(path)


FUZZ = Path(__file__).parents[1] / "validation" / "fuzz_damage.py"


@pytest.mark.slow
def test_damaged_files_are_refused_unseen(monkeypatch):
    misses = runpy.run_path(str(FUZZ))["misses"]
    assert misses(seed=1, count=320) == []
    monkeypatch.setattr(hdf5, "expect_sealed", lambda path: None)
    assert len(misses(seed=1, count=32)) > 16  # they are seen where no digest is checked
