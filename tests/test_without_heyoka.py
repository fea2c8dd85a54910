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
from heavytop.errors import INSTALL_HEYOKA, MissingPackage
from heavytop.report.files import write_results

from . import everywhere

ROOT = Path(__file__).parents[1]
ELSEWHERE = os.pathsep.join([str(ROOT / "tests" / "elsewhere"), str(ROOT / "src")])
REFUSAL = f"integration needs heyoka: {INSTALL_HEYOKA}"
INTEGRATED = {  # the public names behind which heyoka is
    "Errors", "Trajectory", "certify", "drift", "extend", "load_trajectory",
    "propagate", "propagate_many", "run_errors", "stress", "work_precision",
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
        import heavytop as ht
        for name in ht.__all__:
            try:
                getattr(ht, name)
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
    for line in everywhere.KEPT:
        assert "fcntl" in found.pop(line)[2], line
    monkeypatch.chdir(here)
    mine = everywhere.commands(everywhere.CLOSED) | {"calls": everywhere.calls()}
    mine |= everywhere.commands(everywhere.DERIVED) | {"files": everywhere.files()}
    assert [line for line, said in mine.items() if isinstance(said, list) and said[0]] == []
    for what, said in json.loads(json.dumps(mine)).items():
        assert found[what] == said, what


@pytest.mark.processes
def test_a_page_of_a_finished_run_needs_no_integrator(tmp_path):
    scene = ht.load_scene("sicm-kicked", ["span.time=0.3"])
    write_results(ht.propagate(scene), tmp_path, figures=False)
    words = elsewhere("-m", "heavytop", "report", tmp_path, "-o", tmp_path / "x.html")
    assert words.endswith("results: 1, figures: 4\n")


@pytest.mark.processes
def test_doctor_has_the_line_that_brings_heyoka():
    assert f"\nheyoka       missing: {INSTALL_HEYOKA}\n" in elsewhere("-m", "heavytop", "doctor")


@pytest.mark.processes
def test_a_heyoka_that_fails_at_its_import_is_named_with_what_it_says(tmp_path):
    (tmp_path / "heyoka.py").write_text("raise ImportError('libheyoka.so: cannot open')")
    done = subprocess.run(
        [sys.executable, "-m", "heavytop", "run", "sicm-kicked"],
        env=os.environ | {"PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT / 'src'}"},
        capture_output=True, text=True,
    )  # fmt: skip
    assert (done.returncode, "libheyoka.so: cannot open" in done.stderr) == (2, True)


def test_heyoka_is_no_extra_of_this_package():
    assert MissingPackage("x", ["heyoka"]).command == INSTALL_HEYOKA
    assert MissingPackage("x", ["numba"]).command == "pip install '.[rivals]'"
