"""The command: its help, its streams, its exit codes, and whom it blames."""

import errno
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import heavytop
import heavytop.run.propagation
from heavytop import errors
from heavytop.cli import Exit, app, entry, exit_code
from heavytop.cli.command import lines_of_progress

from ..commands import fail_with, heavytop_

VERBS = {name: app.get_command(None, name) for name in app.verbs}
FULL = Path("/dev/full")
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
QUICK = ("run", "sicm-kicked", "--set", "span.time=0.1")


def ended(*words, **how):
    """A process of the command, and what it said."""
    both = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | how
    ours = [sys.executable, "-m", "heavytop", *map(str, words)]
    return subprocess.run(ours, text=True, check=False, **both)


# --- help -------------------------------------------------------------------------


def test_help_lists_the_verbs_in_80_columns_and_the_exit_codes():
    text = CliRunner().invoke(app, ["-h"], terminal_width=80).stdout
    assert all(f"  {verb} " in text for verb in VERBS)
    assert "..." not in text.partition("Commands:")[2]
    assert "130 interrupted" in " ".join(text.split())


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_says_what_it_is(verb):
    assert f"heavytop {verb}" in heavytop_(verb, "--help").stdout
    for each in VERBS[verb].params:
        assert len(each.help) > 10, each.name


@pytest.mark.processes
def test_python_m_is_the_command_and_completed_as_it():
    asked = {"_HEAVYTOP_COMPLETE": "bash_complete", "COMP_WORDS": "heavytop cl", "COMP_CWORD": "1"}
    assert ended(env=os.environ | asked).stdout.split() == ["plain,classify"]
    assert ended("--version").stdout == f"heavytop {heavytop.__version__}\n"


# --- what is wrong, and with what ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.BadScene(()), 3),
        (errors.EndedEarly("singular", None), 4),
        (errors.ForeignFile("x"), 3),
        (errors.MissingPackage("strang", ["numba"]), 2),
        (errors.NoScheduler("x"), 2),
        (errors.WrongType("x"), 1),
        (errors.InUse("x", "y"), 2),
        (OSError(errno.ENOSPC, "No space left on device"), 4),
        (OSError(errno.ENOENT, "No such file"), 1),
        (errors.StoppedEarly("unwritable", "x", None), 4),
        (errors.StoppedEarly("interrupted", "x", None), 130),
        (errors.EndedEarly("interrupted", None), 130),
        (KeyboardInterrupt(), 130),
    ],
)
def test_exit_codes(error, code):
    assert exit_code(error) == code


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("runn sicm-kicked", "Did you mean 'run'?"),
        ("atlas", "Missing argument 'SCENE'"),
        ("classify sicm-kicked -o out", "No such option '-o'"),
        ("run sicm-kicked --verbos", "No such option '--verbos'. Did you mean '--verbose'?"),
        ("run sicm-kicked --set start.phidot 14", "'start.phidot' is not KEY=VALUE, in one word"),
        ("run sicm-kicked --set =0.2", "Invalid value for '--set': '=0.2' is not KEY=VALUE"),
        ("run sicm-kicked --set start.theta= 0.2", "extra argument (0.2)\n"),
        ("run sicm-kicked --digits 0", "Invalid value for --digits: digits = 0"),
        ("run sicm-kicked --set top.A=-1", "for --set: top.A = -1: must be greater than 0\n"),
        ("run sicm-kicked --set start.phidto=3", 'unknown key (did you mean "phidot"?)'),
        ("run sicm-kicked --set top.A=0 --set top.C=0", "for --set: top.A = 0: "),
        ("plan sicm-kicked --formulation hamilton", "Invalid value for --formulation: "),
        ("stress --cases cup", 'in all: heavytop stress --list) (did you mean "cusp"?)'),
        ("drift sicm-kicked --methods taylor-axes", "for --methods: methods = taylor-axes: one of"),
        ("drift sicm-kicked --methods x --periods 0", "for --periods and --methods: periods = 0"),
        ("derive --latex --json", "for --latex: "),
        ("scenes my-top.toml", "no shipped scene has this name"),
        *((f"film sicm-kicked -o x.gif --size={size}", f'for --size: size = "{size}": width and ')
          for size in ("800", "800x", "x80x80", "80x80x80", "-9x80", "9x9", "80x1e2")),
        ("validate hold-on", "is neither a claim nor a script"),
    ],
)  # fmt: skip
def test_a_bad_word_is_a_usage_error_that_names_it(words, told, monkeypatch):
    fail_with(monkeypatch, AssertionError("integrated"))
    result = heavytop_(*words.split())
    assert result.exit_code == Exit.USAGE
    assert told in result.stderr
    assert result.stdout == ""
    assert len(result.stderr.splitlines()[-1]) < 450


def test_what_a_change_breaks_is_blamed_on_it_and_what_the_file_breaks_on_the_file(tmp_path):
    file = tmp_path / "mine.toml"
    text = heavytop_("scenes", "sicm-kicked").stdout
    file.write_text(text, "utf-8")
    result = heavytop_("plan", file, "--set", "start.phi=x")
    assert result.exit_code == Exit.USAGE
    assert "Invalid value for --set: " in result.stderr
    assert "mine" not in result.stderr
    file.write_text(text.replace("theta  = 0.1", 'theta = "x"'), "utf-8")
    result = heavytop_("plan", file, "--set", "start.phi=x")
    assert result.exit_code == Exit.BAD_SCENE
    assert "mine.toml:" in result.stderr
    assert "\n--set: start.phi" in result.stderr


def test_a_letter_a_terminal_would_act_on_is_not_shown():
    for words in (("\x1b[2J",), ("run", "\x1b[2J"), ("run", "sicm-kicked", "--set", "\x1b[2J")):
        result = heavytop_(*words)
        assert result.exit_code in (2, 3)
        assert "\x1b" not in result.stderr


@pytest.mark.parametrize("place", ["{file}", "/proc/nowhere/out"])
def test_a_folder_that_cannot_be_written_is_named_before_anything_runs(place, tmp_path):
    (tmp_path / "file").touch()
    place = place.format(file=tmp_path / "file")
    result = heavytop_(*QUICK, "-o", place, "-v")
    assert result.exit_code == Exit.USAGE
    assert f"Invalid value for -o: cannot write {place}" in result.stderr
    assert "run sicm-kicked" not in result.stderr


def test_bugs_are_one_line_without_a_traceback_and_leave_no_empty_folder(tmp_path, monkeypatch):
    fail_with(monkeypatch, ZeroDivisionError("by nothing"))
    result = heavytop_(*QUICK, "-o", tmp_path / "new" / "out")
    assert result.exit_code == Exit.BUG
    assert "ZeroDivisionError: by nothing" in result.stderr
    assert result.stderr.count("\n") == 1
    assert not (tmp_path / "new").exists()
    assert "Traceback" in heavytop_(*QUICK, "--debug").stderr


def test_a_disk_that_is_full_from_the_start_is_no_bug(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("heavytop.files.os.fsync", full)
    result = heavytop_(*QUICK, "-o", tmp_path / "out", "--no-figures")
    assert result.exit_code == Exit.ENDED_EARLY
    request = tmp_path / "out" / "request.json"
    assert result.stderr == f"heavytop: cannot write {request}: No space left on device\n"
    assert not (tmp_path / "out").exists()


def test_warnings_are_sentences_on_stderr_unless_it_is_quiet(monkeypatch):
    whole = heavytop.run.propagation.integrate_plan

    def integrate_plan(*arguments, **options):
        warnings.warn("the angle grows", errors.DoubtfulWarning, stacklevel=2)
        return whole(*arguments, **options)

    monkeypatch.setattr(heavytop.run.propagation, "integrate_plan", integrate_plan)
    result = heavytop_(*QUICK, "--json")
    assert result.stderr == "heavytop: warning: the angle grows\n"
    json.loads(result.stdout)
    assert heavytop_(*QUICK, "-q").stderr == ""


# --- processes: streams, signals, environments --------------------------------------------------


@pytest.mark.processes
@pytest.mark.parametrize("words", ["--help", "plan sicm-kicked --json"])
def test_where_what_is_printed_goes_to_a_full_disk_it_is_told(words):
    with FULL.open("w") as full:
        found = ended(*words.split(), stdout=full)
    assert found.returncode == Exit.ENDED_EARLY
    assert found.stderr == "heavytop: cannot write: No space left on device\n"


@pytest.mark.processes
@pytest.mark.parametrize(("words", "code"), [("run --no-such", 2), ("run no-such-scene", 3)])
def test_where_what_is_wrong_cannot_be_said_the_exit_code_tells_it(words, code):
    with FULL.open("w") as full:
        assert ended(*words.split(), stderr=full).returncode == code


@pytest.mark.processes
def test_without_a_home_a_locale_or_colours():
    kept = ("PATH", "PYTHONPATH", "HEYOKA_CACHE_DIR")
    here = {name: os.environ[name] for name in kept if name in os.environ}
    here |= ASCII | {"HOME": "/nowhere", "NO_COLOR": "1", "FORCE_COLOR": "1"}
    found = ended("classify", "sicm-kicked", env=here)
    assert (found.returncode, found.stderr) == (0, "")
    assert "? between      0.1 and 0.5172313182384348 rad" in found.stdout
    assert "\x1b[3" not in found.stdout


@pytest.mark.slow
@pytest.mark.processes
def test_nothing_is_said_of_the_caches_and_backends_of_others(tmp_path):
    nowhere = dict(os.environ, HOME="/proc", MPLBACKEND="nonsense")
    nowhere.pop("HEYOKA_CACHE_DIR", None)  # heyoka's own place is below the home
    found = ended("run", "sicm-kicked", "-o", tmp_path, env=nowhere)
    assert (found.returncode, found.stderr) == (0, "")
    assert (tmp_path / "overview.png").exists()


@pytest.mark.slow
@pytest.mark.processes
def test_names_beyond_ascii_under_a_locale_of_ascii(tmp_path):
    (tmp_path / "naïf").mkdir()
    text = heavytop_("scenes", "sicm-kicked").stdout
    (tmp_path / "naïf" / "tøp.toml").write_text(text, "utf-8")
    for words in (
        ("run", "naïf/tøp.toml", "--no-figures", "-o", "naïf/out"),
        ("resume", "naïf/out"),
        ("report", "naïf/out", "-o", "naïf/page"),
    ):
        done = ended(*words, "-q", cwd=tmp_path, env=os.environ | ASCII)
        assert done.returncode == 0, done.stderr
    document = json.loads((tmp_path / "naïf" / "out" / "run.json").read_text("utf-8"))
    assert document["scene"]["name"] == "tøp"


@pytest.mark.processes
@pytest.mark.parametrize("late", ["heavytop.cli.command", "click"])
def test_an_interrupt_before_there_is_a_command_is_no_traceback(late):
    program = (
        "import sys\n"
        "class Pressed:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {late!r}: raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Pressed())\nfrom heavytop.cli import main\nmain()\n"
    )
    found = subprocess.run([sys.executable, "-c", program], capture_output=True)
    assert (found.returncode, found.stderr) == (130, b"")


def test_an_interrupt_outside_of_a_verb_is_no_traceback(monkeypatch):
    def pressed():
        raise KeyboardInterrupt

    monkeypatch.setattr(entry, "app", pressed)
    with pytest.raises(SystemExit) as left:
        entry.main()
    assert left.value.code == 130


def test_a_line_every_half_minute_says_how_much_is_done(capsys):
    now = iter((0.0, 29.0, 31.0, 31.0, 40.0, 62.0, 62.0))
    update = lines_of_progress(lambda: next(now))
    for done in (0.1, 0.25, 0.3, SimpleNamespace(fraction=0.5, ended=3, tasks=6)):
        update(done)
    assert capsys.readouterr().err.splitlines() == [
        "heavytop: 25 % done",
        "heavytop: 50 % done, 3 of 6 runs",
    ]
