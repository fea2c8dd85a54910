"""The command: its help, its streams, its exit codes, and whom it blames."""

import json
import os
import pkgutil
import pty
import subprocess
import sys
import warnings
from inspect import signature
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from rich.cells import cell_len

import heavytop
from heavytop import errors
from heavytop.cli import Exit, app
from heavytop.cli.command import lines_of_progress
from heavytop.cli.signature import read_function

from ..commands import done_with, fail_with, heavytop_, refused

VERBS = {name: app.get_command(None, name) for name in app.verbs}
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
QUICK = ("run", "sicm-kicked", "--set", "span.time=0.1")


def ended(*words, **how):
    """A process of the command, and what it said."""
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True} | how
    return subprocess.run([sys.executable, "-m", "heavytop", *map(str, words)], check=False, **both)


# --- help -------------------------------------------------------------------------


def test_help_lists_the_verbs_in_80_columns_and_the_exit_codes():
    text = CliRunner().invoke(app, ["-h"], terminal_width=80).stdout
    assert all(f"  {verb} " in text for verb in VERBS)
    assert "..." not in text.partition("Commands:")[2]
    assert "130 interrupted" in " ".join(text.split())


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_says_what_it_is(verb):
    short = {each.name: each.help for each in VERBS[verb].params if len(each.help) <= 10}
    assert not short, "the docstring of its function says more of a parameter"


PLACES = sorted({place for places in app.verbs.values() for place in places.split()})
COMPUTED = ("methods", "studies.work_precision:work_precision")  # a default that help leaves out


@pytest.mark.parametrize("place", PLACES)
def test_what_a_verb_takes_and_leaves_out_is_as_its_function_says(place):
    known = signature(pkgutil.resolve_name(f"heavytop.{place}")).parameters
    for name, each in signature(read_function(place)).parameters.items():
        assert each.replace(default=known[name].default) == known[name]
        assert each.default == (known[name].default if (name, place) != COMPUTED else None)


@pytest.mark.processes
def test_python_m_is_the_command_and_completed_as_it():
    words = {"_HEAVYTOP_COMPLETE": "bash_complete", "COMP_WORDS": "heavytop cl", "COMP_CWORD": "1"}
    assert ended(env=os.environ | words).stdout.split() == ["plain,classify"]
    assert ended("--version").stdout == f"heavytop {heavytop.__version__}\n"


# --- what is wrong, and with what ----------------------------------------------------------------


@pytest.mark.parametrize(("words", "expected"), {  # words: the code, and all that is named
    "runn sicm-kicked": (2, "'run'?"),
    "atlas": (2, "SCENE"),
    "run ": (2, "SCENE empty"),
    "film sicm-kicked": (2, "-o"),
    "run sicm-kicked --verbos": (2, "--verbos"),
    "run sicm-kicked --set start.phidot 14": (2, "14"),
    "run sicm-kicked --set start.phidto=3": (2, "--set"),
    f"run sicm-kicked -o {__file__}": (2, __file__),
    "run sicm-kicked -o /proc/nowhere/out": (2, "/proc/nowhere/out"),
    "drift sicm-kicked --methods x --periods 0": (2, "--periods --methods"),
    "film sicm-kicked -o new/x.gif --size=80x": (2, "--size"),
    "film sicm-kicked -o /proc/nowhere/out": (2, "--output"),
    "find sicm-kicked": (2, "--vary --so-that"),
    "run sicm-kicked --digits 0 --formulation x": (2, "digits=0 formulation=x"),
    "run sicm-kicked --unit el -o /proc/x/y --set top.A=-1": (2, "el /proc/x/y top.A=-1"),
    "sweep sicm-kicked --over k=1:2:3 --facts x -o x.png": (2, "over=k facts=x x.png"),
    "reference sicm-kicked --times 0:1:0 --unit deg --events cups": (2, "0:1:0 unit events=cups"),
    "check x.csv --digits -1 --as x --scene nosuch": (3, "digits undone=x nosuch"),
    "check x.csv --digits -1 --as x --set top.A=1": (2, "--digits --as --set"),
    "report . --set top.A=1 nosuch": (2, "places changes"),
    "report nosuch": (3, "nosuch"),
    f"resume {__file__}": (3, __file__),
    "report . nosuch": (2, "places nosuch"),
    "report sicm-kicked sicm-dropped": (2, "places"),
}.items())  # fmt: skip
def test_all_that_is_wrong_is_named_before_anything_runs(words, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fail_with(monkeypatch, AssertionError("integrated"))
    (code, named), result = expected, heavytop_(*words.split(" "))
    said = result.stderr.replace(" = ", "=").replace('"', "")
    assert (result.exit_code, result.stdout, [*tmp_path.iterdir()]) == (code, "", [])
    assert [x for x in named.split() if x not in said] == []


def test_what_a_change_breaks_is_blamed_on_it_and_what_the_file_breaks_on_the_file(tmp_path):
    file = tmp_path / "mine.toml"
    text = heavytop_("scenes", "sicm-kicked").stdout
    file.write_text(text, "utf-8")
    assert "mine" not in refused(Exit.USAGE, "plan", file, "--set", "start.phi=x")
    file.write_text(text.replace("theta  = 0.1", 'theta = "x"'), "utf-8")
    said = refused(Exit.BAD_SCENE, "run", file, "--set", "start.phi=x", "-o", tmp_path / "out")
    assert said.startswith("heavytop: the input is not valid:\n")
    assert all(where in said for where in ("mine.toml:", "\n--set: start.phi"))
    assert not (tmp_path / "out").exists()


def test_bugs_are_one_line_without_a_traceback(monkeypatch):
    fail_with(monkeypatch, ZeroDivisionError("by nothing"))
    said = refused(Exit.BUG, *QUICK)
    assert ("ZeroDivisionError: by nothing" in said, said.count("\n")) == (True, 1)
    assert "Traceback" in heavytop_(*QUICK, "--debug").stderr


def test_warnings_are_sentences_on_stderr_unless_it_is_quiet(monkeypatch):
    def warned(run):
        warnings.warn("the angle grows", errors.DoubtfulWarning, stacklevel=2)
        return run

    done_with(monkeypatch, warned)
    result = heavytop_(*QUICK, "--json")
    assert result.stderr == "heavytop: warning: the angle grows\n"
    json.loads(result.stdout)
    assert heavytop_(*QUICK, "-q").stderr == ""


# --- processes: streams, signals, environments --------------------------------------------------


@pytest.mark.processes
@pytest.mark.parametrize("words", ["--help", "plan sicm-kicked --json"])
def test_where_what_is_printed_goes_to_a_full_disk_it_is_told(words):
    with Path("/dev/full").open("w") as full:
        found = ended(*words.split(), stdout=full)
    message = "heavytop: cannot write: No space left on device\n"
    assert (found.returncode, found.stderr) == (Exit.ENDED_EARLY, message)


@pytest.mark.processes
def test_without_a_home_a_locale_or_colours():
    kept = ("PATH", "PYTHONPATH", "HEYOKA_CACHE_DIR")
    here = {name: os.environ[name] for name in kept if name in os.environ}
    here |= ASCII | {"HOME": "/nowhere", "NO_COLOR": "1", "FORCE_COLOR": "1"}
    found = ended("classify", "sicm-kicked", env=here)
    assert (found.returncode, found.stderr) == (0, "")
    assert "sicm-kicked ? SICM 2.10, kicked backwards: loops" in found.stdout
    assert " = -9.028e-05 kg m?/s < 0" in found.stdout  # a minus is none of what is not there
    assert "\x1b[3" not in found.stdout


@pytest.mark.processes
@pytest.mark.parametrize(("module", "error", "message"), [
    ("heavytop.cli.command", "KeyboardInterrupt", ""),
    ("heyoka", "ImportError('failed') from KeyboardInterrupt()", "heavytop: interrupted\n"),
])  # fmt: skip
def test_an_interrupt_while_something_is_imported_is_no_traceback(module, error, message):
    """Nor does it call missing what it kept from being imported."""
    program = (
        "import sys\n"
        "class Pressed:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {module!r}: raise {error}\n"
        "sys.meta_path.insert(0, Pressed())\nfrom heavytop.cli import main\nmain()\n"
    )
    found = subprocess.run([sys.executable, "-c", program, *QUICK], capture_output=True, text=True)
    assert (found.returncode, found.stderr) == (130, message)


@pytest.mark.processes
def test_results_reach_a_file_while_a_bar_is_drawn(tmp_path):
    shown, stderr = pty.openpty()
    with (tmp_path / "out").open("wb") as out:
        assert ended(*QUICK, "--json", stdout=out, stderr=stderr).returncode == 0
    os.close(stderr)
    os.close(shown)
    assert json.loads((tmp_path / "out").read_bytes())["schema"] == "heavytop/run/1"


@pytest.mark.processes
def test_a_closed_stdout_and_a_terminal_without_columns_are_no_bugs():
    words = f"{sys.executable} -m heavytop classify sicm-kicked"
    assert subprocess.run(f"{words} >&-", shell=True, check=False).returncode == 0
    found = subprocess.run(f"COLUMNS=0 {words}", shell=True, check=True, capture_output=True)
    assert b"loops" in found.stdout


@pytest.mark.processes
@pytest.mark.parametrize("words", ["-h", "run -h", "scenes"])
def test_what_nobody_reads_on_is_no_bug(words):
    """As `head` leaves it: in a shell the code is that of a program which SIGPIPE ends."""
    read, write = os.pipe()
    os.close(read)
    found = ended(*words.split(), stdout=write)
    os.close(write)
    assert (found.returncode, found.stderr) == (Exit.CLOSED, "")


@pytest.mark.processes
def test_an_interrupted_command_does_not_wait_for_what_takes_itself_apart():
    """A thread that heyoka is still compiling in crashes an interpreter that ends around it."""
    program = (
        "import atexit, os, sys, threading, heavytop.cli as cli\n"
        "atexit.register(os._exit, 99)\n"
        "wait = threading.Event().wait\n"
        "threading.Thread(target=wait, name=sys.argv[1], daemon=True).start()\n"
        "cli.app = lambda: sys.exit(cli.Exit.INTERRUPTED)\ncli.main()\n"
    )
    for thread, code in {"in heyoka": 130, "of a pool": 99}.items():
        assert subprocess.run([sys.executable, "-c", program, thread]).returncode == code


def test_a_line_every_half_minute_says_how_much_is_done(capsys):
    now = iter((0.0, 29.0, 31.0, 31.0, 40.0, 62.0, 62.0))
    update = lines_of_progress(lambda: next(now))
    for done in (0.1, 0.25, 0.3, SimpleNamespace(fraction=0.5, ended=3, tasks=6)):
        update(done)
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["heavytop: 25 % done", "heavytop: 50 % done, 3 of 6 runs"]


@pytest.mark.parametrize("words", [
    "run sicm-kicked", "run through-top", "classify separatrix", "plan sicm-kicked --digits 60",
    "stress --list", "atlas sicm-kicked --x phidot=-9:9:9 --y psidot=-9:9:9 -j 1",
    "drift sicm-kicked --periods 30 --methods taylor-axis-projected,gauss8",
])  # fmt: skip
def test_what_a_verb_prints_fits_its_lines_and_nothing_is_written(words, tmp_path, monkeypatch):
    """In eighty columns, without blanks behind a line."""
    monkeypatch.chdir(tmp_path)
    lines = CliRunner().invoke(app, words.split(), env={"COLUMNS": "80"}).stdout.splitlines()
    assert (bool(lines), [*tmp_path.iterdir()]) == (True, [])
    assert max(map(cell_len, lines)) <= 80
    assert [line for line in lines if line != line.rstrip()] == []
