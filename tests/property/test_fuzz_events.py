"""A fast slice of ``validation/fuzz_events.py``: no run is wrong and says nothing of it."""

import sys
from importlib import import_module
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def fuzz_events():
    folder = str(Path(__file__).parents[2] / "validation")
    sys.path.insert(0, folder)
    yield import_module("fuzz_events")
    sys.path.remove(folder)


@pytest.mark.parametrize("way", ["doubles", "more", "extended"])
def test_no_run_is_wrong_in_silence(fuzz_events, way):
    assert fuzz_events.misses(3, 8, (way,)) == []


def test_runs_that_nobody_checks_are_found(fuzz_events, monkeypatch):
    """Planted: the one function that holds a run against the closed form says nothing."""
    monkeypatch.setattr("heavytop.run.propagation.checked", lambda run: run)
    for way in ("doubles", "extended"):
        assert fuzz_events.misses(3, 16, (way,))


def test_an_event_that_is_left_out_is_found(fuzz_events, monkeypatch):
    """Planted: the last event is never looked for, and nobody counts."""
    schedule = import_module("heavytop.run.events").schedule
    monkeypatch.setattr("heavytop.run.propagation.schedule", lambda *given: schedule(*given)[:-1])
    monkeypatch.setattr("heavytop.run.propagation.checked", lambda run: run)
    assert len(fuzz_events.misses(3, 16, ("more",))) > 4
