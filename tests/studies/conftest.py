"""The toy studies, for whoever asks for them."""

import pytest

from heavytop.studies import study

from .toy import TOYS


@pytest.fixture
def toys(monkeypatch):
    """The kinds of study in the folder toys, which go as fast as they can."""
    monkeypatch.syspath_prepend(str(TOYS))
    monkeypatch.setenv("TOY_PAUSE", "0")
    monkeypatch.setitem(study.STUDIES, "toy", "toy_study")
