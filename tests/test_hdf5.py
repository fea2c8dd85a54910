"""A damaged result file is refused before HDF5, which may hang, sees a byte of it."""

import runpy
from pathlib import Path

import pytest

from heavytop import hdf5

FUZZ = Path(__file__).parents[1] / "validation" / "fuzz_damage.py"
misses = runpy.run_path(str(FUZZ))["misses"]


def test_damaged_files_are_refused_unseen():
    assert misses(seed=1, count=320) == []


@pytest.mark.parametrize("count", [32])
def test_files_whose_digest_is_not_checked_are_seen(monkeypatch, count):
    monkeypatch.setattr(hdf5, "expect_sealed", lambda path: None)
    assert len(misses(seed=1, count=count)) > count / 2
