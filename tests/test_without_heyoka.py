"""Where pip brings no integrator, and where nothing is POSIX, all else is as it is here.

`tests/elsewhere` makes a process such a place. Neither macOS nor Windows is tried by this: what
fails here at an import fails there.
"""

import re
from pathlib import Path

import pytest

import heavytop as ht
from heavytop.errors import INSTALL_HEYOKA
from heavytop.report.files import write_result
from heavytop.results.run import run_result

from .commands import printed
from .processes import begin, surroundings

pytestmark = pytest.mark.processes
ELSEWHERE = Path(__file__).with_name("elsewhere")
REFUSAL = f"integration needs heyoka: {INSTALL_HEYOKA}"
INTEGRATED = {  # the public names behind which heyoka is
    "Errors", "Trajectory", "certify", "drift", "extend", "load_trajectory",
    "propagate", "propagate_many", "run_errors", "stress", "work_precision",
}  # fmt: skip


def elsewhere(*words, path=ELSEWHERE, code=0):
    """What a fresh process of Python says that has neither heyoka nor POSIX."""
    done = begin(*words, env=surroundings(path, PYTHONUTF8="1", COLUMNS="100"))
    out, err = done.communicate()
    assert (done.returncode, out if code else "") == (code, ""), err
    return err if code else out


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


CLOSED = (
    "classify sicm-kicked",
    "plan sicm-kicked",
    "derive",
    "reference sicm-kicked --times 0:2:0.5 --events turning --json",
    "reference sicm-dropped --times 0:1:0.05 -o exact.csv",
    "check exact.csv --scene sicm-dropped -o checked",
    "report checked -o reported",
    "film sicm-kicked --seconds 0.2 --fps 10 --size 96x72 -o film.gif",
    "explore -o explore.html",
    "atlas sicm-kicked --x phidot=-20:20:21 --y psidot=-150:150:21 -j 2 --json",
    "scenes",
    "run --help",
)
INTEGRATING = (
    "run sicm-kicked",
    "drift sicm-kicked --periods 3 --methods taylor-axis -o drift",
    "workprec sicm-kicked --periods 3 --methods taylor-axis -o workprec",
    "stress --cases cusp --methods auto -o stress",
)


@pytest.mark.slow
def test_commands_say_the_same_but_those_that_integrate_write_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for line in INTEGRATING:
        assert elsewhere("-m", "heavytop", *line.split(), code=2) == f"heavytop: {REFUSAL}\n"
    assert not [*tmp_path.iterdir()]
    said = [untimed(elsewhere("-m", "heavytop", *line.split())) for line in CLOSED]
    made = {path.name for path in tmp_path.iterdir()}
    assert made == {"exact.csv", "checked", "reported", "film.gif", "explore.html"}
    assert said == [untimed(printed(*line.split())) for line in CLOSED]


def untimed(said):
    """The words, but for the pixels a second, which the clock says."""
    return re.sub(r'("(?:kinds|rows)_per_s": )[\d.e+]+', r"\1", said).split()


def test_a_page_of_a_finished_run_needs_no_integrator(tmp_path):
    scene = ht.load_scene("sicm-kicked", ["span.time=0.3"])
    write_result(run_result(ht.propagate(scene)), tmp_path, figures=False)
    elsewhere("-m", "heavytop", "report", tmp_path, "-o", tmp_path / "x.html")


def test_a_heyoka_that_fails_at_its_import_is_named_with_what_it_says(tmp_path):
    (tmp_path / "heyoka.py").write_text("raise ImportError('libheyoka.so: cannot open')")
    said = elsewhere("-m", "heavytop", "run", "sicm-kicked", path=tmp_path, code=2)
    assert "libheyoka.so: cannot open" in said
