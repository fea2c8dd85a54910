"""Where pip brings no integrator, and where nothing is POSIX, all else is as it is here.

`tests/elsewhere` makes a process such a place. Neither macOS nor Windows is tried by this: what
fails here at an import fails there.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.errors import CONDA, MissingPackage

from . import everywhere

ROOT = Path(__file__).parents[1]
ELSEWHERE = os.pathsep.join([str(ROOT / "tests" / "elsewhere"), str(ROOT / "src")])
REFUSAL = f"integration needs heyoka: {CONDA}"
INTEGRATED = {  # the public names behind which heyoka is
    "Errors", "Sensitivities", "Trajectory", "Transition", "certify", "drift", "extend",
    "load_trajectory", "propagate", "propagate_many", "run_errors", "sensitivities",
    "state_transition", "stress", "work_precision",
}  # fmt: skip


def elsewhere(*words):
    """What a fresh process of Python says that has neither heyoka nor POSIX."""
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        env=os.environ | {"PYTHONPATH": ELSEWHERE, "PYTHONUTF8": "1"},
        capture_output=True,
        encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.processes
def test_only_the_names_that_integrate_are_refused():
    program = """if True:
        import pydoc
        import heavytop as ht
        from heavytop import *
        pydoc.render_doc(ht)
        for name, each in ((name, getattr(ht, name)) for name in ht.__all__):
            if "needs heyoka" in (each.__doc__ or ""):
                try:
                    each("sicm-kicked", time=2)
                except ht.MissingPackage as missing:
                    print(name, missing, sep=": ")
    """
    said = elsewhere("-c", program).splitlines()
    assert said == [f"{name}: {REFUSAL}" for name in ht.__all__ if name in INTEGRATED]


@pytest.mark.slow
@pytest.mark.processes
def test_everything_else_is_the_same_bit_for_bit(tmp_path, monkeypatch):
    there, here = tmp_path / "there", tmp_path / "here"
    there.mkdir()
    here.mkdir()
    found = json.loads(elsewhere(ROOT / "tests" / "everywhere.py", there))
    for line in everywhere.INTEGRATED:
        assert found.pop(line) == [2, "", f"heavytop: {REFUSAL}\n"], line
    assert found.pop("left") == found["files"]  # a refusal writes nothing
    monkeypatch.chdir(here)
    mine = everywhere.commands(everywhere.CLOSED) | {"calls": everywhere.calls()}
    mine |= everywhere.commands(everywhere.DERIVED) | {"files": everywhere.files()}
    assert [line for line, said in mine.items() if isinstance(said, list) and said[0]] == []
    for what, said in json.loads(json.dumps(mine)).items():
        assert found[what] == said, what


@pytest.mark.processes
def test_doctor_has_the_line_that_brings_heyoka():
    assert f"\nwheel        heyoka: missing: {CONDA}\n" in elsewhere("-m", "heavytop", "doctor")


@pytest.mark.processes
def test_a_folder_is_locked_there_too(tmp_path):
    program = f"""if True:
        from pathlib import Path
        from subprocess import run
        import sys
        from heavytop.errors import InUse
        from heavytop.files import locked
        path = Path({str(tmp_path / "lock")!r})
        def held():
            try:
                with locked(path):
                    return "free"
            except InUse as other:
                return str(other)
        if sys.argv[1:]:
            print(held())
        else:
            with locked(path):
                run([sys.executable, *sys.orig_argv[1:], "again"])
                print(path.read_text().split()[0], end=" ")
            print(held())
    """
    first, second = elsewhere("-c", program).splitlines()
    number, free = second.split()
    assert first.startswith(f"{tmp_path}: is being written by process {number} on ")
    assert free == "free"


def test_heyoka_is_no_extra_of_this_package():
    assert MissingPackage("x", ["heyoka"]).command == CONDA
    assert MissingPackage("x", ["rebound"]).command == "pip install '.[rebound]'"
    assert MissingPackage("x", ["numba"]).command == "pip install '.[rivals]'"
