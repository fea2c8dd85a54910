"""A fast slice of ``validation/fuzz_many.py``: every top is as right as its run says."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from heavytop.run.ensemble import Ensemble

FILE = Path(__file__).parents[2] / "validation" / "fuzz_many.py"
SPEC = importlib.util.spec_from_file_location("fuzz_many", FILE)
fuzz_many = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(fuzz_many)


@pytest.mark.parametrize(("seed", "stretch"), [(5, 1.0), (6, 40.0)])
def test_no_top_is_wrong_beyond_what_its_run_says(seed, stretch):
    assert fuzz_many.misses(seed, 48, "axis", stretch) == []


def test_an_estimate_that_is_too_small_is_found(monkeypatch):
    """Planted: errors a hundred thousandth of what they are said to be, and no marks."""
    honest = Ensemble.error.func
    monkeypatch.setattr(Ensemble, "error", property(lambda run: honest(run) / 1e5))
    monkeypatch.setattr(Ensemble, "missed", property(lambda run: np.zeros(run.end.size, bool)))
    assert len(fuzz_many.misses(5, 48)) > 5
