"""A slice of the fuzz of derivatives: random scenes where numbers break; and a planted error."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht


@pytest.fixture
def fuzz(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "validation"))
    import fuzz_sensitivities

    return fuzz_sensitivities


def test_derivatives_are_no_farther_off_than_they_say(fuzz):
    assert fuzz.misses(1, 8) == []


def test_matrices_are_no_farther_off_than_they_say(fuzz):
    assert fuzz.misses_of_matrices(1, 8, ("cubic", "axis", "attitude")) == []


def test_planted_errors_are_found(fuzz, monkeypatch):
    own, transition = ht.sensitivities, ht.state_transition

    def slightly_off(scene, form):
        found = own(scene, form)
        return replace(found, period=found.period | {"C": found.period["C"] * (1 + 1e-6)})

    def off_too(scene, form, t):
        found = transition(scene, form, t=t)
        return replace(found, matrix=found.matrix + 1e-6 * np.eye(len(found.names)))

    monkeypatch.setattr(ht, "sensitivities", slightly_off)
    monkeypatch.setattr(ht, "state_transition", off_too)
    assert any("dperiod/dC" in miss for miss in fuzz.misses(1, 1, ("attitude",)))
    assert fuzz.misses_of_matrices(1, 1, ("axis",)) != []
