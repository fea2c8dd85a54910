"""Errors say what is wrong, can be sent to another process, and print the command that goes on."""

import errno
import pickle
from pathlib import Path

import pytest

from heavytop import errors
from heavytop.cli.command import problem_of

EXITS = {
    1: (errors.WrongType("x"), OSError(errno.ENOENT, "No such file")),
    2: (errors.MissingPackage("strang", ["numba"]), errors.NoScheduler("x"),
        errors.InUse(Path("out"), "12", "here")),
    3: (errors.BadScene((errors.Fault("a.toml", 3, "top.A", "-1", "A > 0"),)),
        errors.ForeignFile("x"), errors.NotCertified("x"), errors.ImpossibleTop([("A", "A > 0")]),
        errors.Unseparated("x", 1e-9)),
    4: (errors.EndedEarly("singular", None, "why"), OSError(errno.ENOSPC, "No space left"),
        errors.StoppedEarly("unwritable", "x", None)),
    130: (KeyboardInterrupt(), errors.EndedEarly("interrupted", None),
          errors.StoppedEarly("interrupted", "interrupted", Path("out"))),
}  # fmt: skip


@pytest.mark.parametrize(("code", "error"), [(code, x) for code in EXITS for x in EXITS[code]])
def test_an_error_has_its_exit_code_and_can_be_pickled(code, error):
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), type(again)) == (str(error), type(error))
    assert problem_of(error)[0] == problem_of(again)[0] == code
    for name in ("faults", "broken", "bound", "differences", "pid", "packages", "folder"):
        assert getattr(again, name, None) == getattr(error, name, None)


@pytest.mark.parametrize(("folder", "typed"), [("out", "out"), ("a b", "'a b'"), ("-o", "./-o")])
def test_the_command_that_goes_on_can_be_typed(folder, typed):
    stopped = errors.StoppedEarly("interrupted", "interrupted", Path(folder))
    assert str(stopped).endswith(f"\nheavytop resume {typed}")
