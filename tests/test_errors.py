"""Errors say what is wrong, can be sent to another process, and print the command that goes on."""

import pickle
from pathlib import Path

import pytest

from heavytop import errors


@pytest.mark.parametrize(
    "error",
    [
        errors.BadScene((errors.Fault("a.toml", 3, "top.A", "-1", "A > 0"),)),
        errors.ImpossibleTop([("A", "A > 0")]),
        errors.Unseparated("x", 1e-9),
        errors.InUse(Path("out"), "12", "here"),
        errors.MissingPackage("strang", ["numba"]),
        errors.EndedEarly("singular", None, "why"),
        errors.StoppedEarly("interrupted", "interrupted", Path("out")),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_can_be_pickled(error):
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), type(again)) == (str(error), type(error))
    names = "faults broken bound differences pid packages outcome folder"
    for name in names.split():
        assert getattr(again, name, None) == getattr(error, name, None)


@pytest.mark.parametrize(
    ("folder", "word"), [("out", "out"), ("long runs", "'long runs'"), ("-o", "./-o")]
)
def test_the_command_that_goes_on_can_be_typed(folder, word):
    stopped = errors.StoppedEarly("interrupted", "interrupted", Path(folder))
    assert str(stopped).endswith(f"\nheavytop resume {word}")
