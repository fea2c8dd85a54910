"""A fast slice of ``validation/fuzz_turns.py``: no turn is lost, and no digits in silence."""

import sys
from importlib import import_module
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def fuzz_turns():
    folder = str(Path(__file__).parents[2] / "validation")
    sys.path.insert(0, folder)
    yield import_module("fuzz_turns")
    sys.path.remove(folder)


def test_no_turn_is_lost_and_no_digit_in_silence(fuzz_turns):
    assert fuzz_turns.misses(2, 10) == []


def test_turns_taken_for_the_least_change_are_found(fuzz_turns, monkeypatch):
    """Planted: the sense in which a pole is passed is left to the state."""

    monkeypatch.setattr("heavytop.integration.turns.in_sense", lambda _sense, change: change)
    found = " ".join(fuzz_turns.misses(2, 10))
    assert "attitude: phi off by" in found
    assert "axis: phi off by" in found
