"""What the command line promises: its streams, its exit codes, its files, its refusals."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import heavytop.propagation
from heavytop import errors
from heavytop.cli import Exit, app, exit_code

SCENE = """\
format = 1
title = "$\\\\frac{ [bold]not markup"
[top]
A = 3.28e-4
C = 6.60e-5
gMR = 0.0456
[start]
theta = 0.1
phidot = -15
psidot = 140
[span]
time = 0.5
"""


VERBS = (
    "run", "classify", "plan", "drift", "resume", "atlas", "workprec", "stress", "report",
    "validate", "scenes", "derive", "doctor",
)  # fmt: skip


def heavytop_(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def process(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "heavytop", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | environment,
    )


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "top.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.fixture
def cut_short(monkeypatch: pytest.MonkeyPatch):
    """Make every run end early, after its work is done, for the given reason."""
    whole = heavytop.propagation.propagate

    def cut(outcome: str) -> None:
        def propagate(*arguments, **options):
            raise errors.EndedEarly(outcome, whole(*arguments, **options))

        monkeypatch.setattr(heavytop.propagation, "propagate", propagate)

    return cut


def fail_with(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def propagate(*_, **__):
        raise error

    monkeypatch.setattr(heavytop.propagation, "propagate", propagate)


class TestHelp:
    def test_lists_the_verbs_that_exist_and_the_exit_codes(self):
        text = heavytop_("--help").stdout
        for verb in VERBS:
            assert f"  {verb} " in text
        known = {each.name or each.callback.__name__ for each in app.registered_commands}
        assert known == set(VERBS)
        assert "130 interrupted" in text

    def test_imports_nothing_slow(self):
        code = "import sys, heavytop.cli; print(*sys.modules)"
        loaded = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split()
        slow = {"heyoka", "sympy", "numpy", "scipy", "mpmath", "matplotlib", "xarray", "pydantic"}
        assert slow.isdisjoint(loaded)

    @pytest.mark.parametrize("verb", VERBS)
    def test_every_verb_has_its_own(self, verb):
        assert f"heavytop {verb}" in heavytop_(verb, "--help").stdout

    def test_python_m_is_the_command(self):
        assert process("--version").stdout == f"heavytop {heavytop.__version__}\n"


class TestRun:
    def test_prints_a_table(self, scene):
        result = heavytop_("run", scene)
        assert result.exit_code == 0, result.stderr
        for word in ("kind", "E'", "period", "plan", "events", "theta_min", "closed form"):
            assert word in result.stdout
        assert result.stderr == ""

    def test_a_title_is_text_and_not_markup(self, scene):
        assert "[bold]not markup" in heavytop_("run", scene).stdout

    def test_json_is_one_document_and_nothing_else(self, scene):
        result = process("run", scene, "--json")
        document = json.loads(result.stdout)
        assert document["schema"] == "heavytop/run/1"
        assert result.stderr == ""

    def test_without_a_folder_nothing_is_written(self, scene, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        heavytop_("run", scene)
        assert [path.name for path in tmp_path.iterdir()] == [scene.name]

    def test_a_folder_gets_every_file_the_document_names(self, scene, tmp_path):
        folder = tmp_path / "new" / "out"
        result = heavytop_("run", scene, "-o", folder, "--json")
        assert result.exit_code == 0, result.stderr
        printed = json.loads(result.stdout)
        assert printed == json.loads((folder / "run.json").read_text("utf-8"))
        figures = ("overview", "angles", "potential", "phase", "errors")
        names = {"run.json", "trajectory.nc"}
        names |= {f"{figure}.{form}" for figure in figures for form in ("svg", "png")}
        assert set(printed["files"].values()) == names
        assert {path.name for path in folder.iterdir()} == names

    def test_no_figures_draws_none(self, scene, tmp_path):
        heavytop_("run", scene, "-o", tmp_path / "out", "--no-figures")
        assert {path.suffix for path in (tmp_path / "out").iterdir()} == {".json", ".nc"}

    def test_verbose_names_the_files_on_stderr(self, scene, tmp_path):
        result = heavytop_("run", scene, "-o", tmp_path / "out", "-v", "--no-figures")
        assert "trajectory.nc" in result.stderr

    def test_set_and_digits_change_the_scene(self, scene):
        changed = heavytop_("run", scene, "--json", "--set", "span.time=0.25", "--digits", 9)
        document = json.loads(changed.stdout)
        assert document["final"]["t"] == 0.25

    def test_formulation_is_the_one_asked_for(self, scene):
        result = heavytop_("run", scene, "--json", "--formulation", "lagrange")
        assert json.loads(result.stdout)["plan"]["formulation"] == "lagrange"

    def test_no_color_means_no_escapes(self, scene):
        result = process("run", scene, NO_COLOR="1", FORCE_COLOR="1")
        assert "\x1b[3" not in result.stdout

    def test_a_terminal_without_greek_is_no_failure(self, scene):
        result = process("run", scene, PYTHONIOENCODING="ascii")
        assert result.returncode == 0, result.stderr


class TestWarnings:
    @pytest.fixture(autouse=True)
    def warned(self, monkeypatch):
        whole = heavytop.propagation.propagate

        def propagate(*arguments, **options):
            warnings.warn("the angle grows", errors.UnboundedAngleWarning, stacklevel=2)
            return whole(*arguments, **options)

        monkeypatch.setattr(heavytop.propagation, "propagate", propagate)

    def test_are_sentences_on_stderr(self, scene):
        result = heavytop_("run", scene, "--json")
        assert result.stderr == "heavytop: warning: the angle grows\n"
        json.loads(result.stdout)

    def test_quiet_drops_them(self, scene):
        assert heavytop_("run", scene, "-q").stderr == ""


class TestBadOptions:
    """Exit 2, before anything is integrated or written."""

    @pytest.fixture(autouse=True)
    def nothing_is_integrated(self, request, monkeypatch):
        if "formulation" not in request.node.name:
            fail_with(monkeypatch, AssertionError("integrated"))

    @pytest.mark.parametrize(
        "options",
        [
            ["--digits", "0"],
            ["--digits", "many"],
            ["--digits", "10001"],
            ["--set", "start.phidot"],
            ["--set", "=3"],
            ["--set", "start.phidot=nan"],
            ["--set", "start.phidto=3"],
            ["--no-such-option"],
        ],
    )
    def test_a_bad_value(self, scene, options):
        result = heavytop_("run", scene, *options)
        assert result.exit_code == Exit.USAGE, result.stderr
        assert result.stdout == ""

    def test_an_unknown_formulation_is_named(self, scene):
        result = heavytop_("run", scene, "--formulation", "hamilton")
        assert result.exit_code == Exit.USAGE
        assert "hamilton" in result.stderr
        assert "axis" in result.stderr

    def test_a_folder_that_is_a_file_is_named(self, scene):
        result = heavytop_("run", scene, "-o", scene)
        assert result.exit_code == Exit.USAGE
        assert str(scene) in result.stderr.replace("\n", "")

    def test_a_folder_that_cannot_be_made_is_named(self, scene):
        result = heavytop_("run", scene, "-o", "/proc/nowhere/out")
        assert result.exit_code == Exit.USAGE
        assert "/proc/nowhere/out" in result.stderr

    def test_no_scene(self):
        assert heavytop_("run").exit_code == Exit.USAGE


class TestBadScenes:
    def test_every_fault_is_listed_with_its_line(self, scene):
        text = SCENE.replace("A = 3.28e-4", "A = -1").replace("theta = 0.1", "thteta = 0.1")
        scene.write_text(text, encoding="utf-8")
        result = heavytop_("run", scene)
        assert result.exit_code == Exit.BAD_SCENE
        assert result.stdout == ""
        assert f"{scene}:4" in result.stderr
        assert f"{scene}:8" in result.stderr
        assert "Traceback" not in result.stderr

    def test_a_scene_that_is_not_there(self):
        assert heavytop_("run", "sicm-kiked").exit_code == Exit.BAD_SCENE

    def test_makes_no_folder(self, tmp_path):
        heavytop_("run", "no-such-scene", "-o", tmp_path / "out")
        assert list(tmp_path.iterdir()) == []

    def test_a_fault_of_the_scene_is_not_blamed_on_an_option(self, scene):
        scene.write_text(SCENE.replace("A = 3.28e-4", "A = -1"), encoding="utf-8")
        result = heavytop_("run", scene, "--set", "span.time=1")
        assert result.exit_code == Exit.BAD_SCENE


class TestEndedEarly:
    @pytest.mark.parametrize(
        ("outcome", "code"),
        [
            ("singular", Exit.ENDED_EARLY),
            ("step-limit", Exit.ENDED_EARLY),
            ("interrupted", Exit.INTERRUPTED),
        ],
    )
    def test_the_part_is_printed_kept_and_named(self, scene, tmp_path, cut_short, outcome, code):
        cut_short(outcome)
        result = heavytop_("run", scene, "--json", "-o", tmp_path / "out", "--no-figures")
        assert result.exit_code == code
        assert json.loads(result.stdout)["schema"] == "heavytop/run/1"
        assert (tmp_path / "out" / "trajectory.nc").exists()
        assert str(tmp_path / "out") in result.stderr
        assert errors.Outcome(outcome).sentence in result.stderr

    def test_an_interrupt_from_anywhere_is_130(self, scene, monkeypatch):
        fail_with(monkeypatch, KeyboardInterrupt())
        result = heavytop_("run", scene)
        assert result.exit_code == Exit.INTERRUPTED
        assert "Traceback" not in result.stderr

    def test_a_failure_leaves_no_empty_folder(self, scene, tmp_path, monkeypatch):
        fail_with(monkeypatch, KeyboardInterrupt())
        heavytop_("run", scene, "-o", tmp_path / "new" / "out")
        assert not (tmp_path / "new").exists()


class TestBugs:
    def test_are_one_line_without_a_traceback(self, scene, monkeypatch):
        fail_with(monkeypatch, ZeroDivisionError("by nothing"))
        result = heavytop_("run", scene)
        assert result.exit_code == Exit.BUG
        assert "ZeroDivisionError: by nothing" in result.stderr
        assert result.stderr.count("\n") == 1

    def test_debug_shows_where(self, scene, monkeypatch):
        fail_with(monkeypatch, ZeroDivisionError("by nothing"))
        assert "Traceback" in heavytop_("run", scene, "--debug").stderr

    def test_a_full_disk_is_the_fault_of_the_folder(self, scene, tmp_path, monkeypatch):
        def full(*_):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("heavytop.files.os.fsync", full)
        result = heavytop_("run", scene, "-o", tmp_path / "out", "--no-figures")
        assert result.exit_code == Exit.USAGE
        assert "No space left" in result.stderr
        assert not (tmp_path / "out" / "run.json").exists()


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.BadScene(()), 3),
        (errors.ImpossibleTop([("A", "A > 0")]), 3),
        (errors.NotANumber("x"), 3),
        (errors.NoClosedForm("x"), 3),
        (errors.EndedEarly("singular", None), 4),
        (errors.ForeignFile("x"), 6),
        (errors.MissingPackage("strang", ["numba"]), 7),
        (errors.InUse("x", "y"), 2),
        (OSError(errno.ENOSPC, "No space left on device"), 4),
        (OSError(errno.ENOENT, "No such file"), 1),
        (errors.StoppedEarly("unwritable", "x", None), 4),
        (errors.StoppedEarly("worker-lost", "x", None), 4),
        (errors.StoppedEarly("interrupted", "x", None), 130),
        (errors.EndedEarly("interrupted", None), 130),
        (KeyboardInterrupt(), 130),
        (errors.UntranslatableExpression("x"), 1),
        (ValueError("x"), 1),
    ],
)
def test_exit_codes(error, code):
    assert exit_code(error) == code


class TestScenes:
    def test_lists_names_and_titles(self):
        assert "sicm-kicked" in heavytop_("scenes").stdout

    def test_json(self):
        document = json.loads(heavytop_("scenes", "--json").stdout)
        assert document["schema"] == "heavytop/scenes/1"
        assert "sicm-kicked" in document["scenes"]


class TestDoctor:
    def test_json_knows_the_integrator(self, monkeypatch, tmp_path):
        (tmp_path / "cache.db").write_bytes(b"12345")
        monkeypatch.setenv("HEYOKA_CACHE_DIR", str(tmp_path))
        document = json.loads(heavytop_("doctor", "--json").stdout)
        assert document["versions"]["heyoka"].startswith("7.")
        assert document["integrator"]["wheel"]["tags"]
        assert document["integrator"]["cache"] == {
            "folder": str(tmp_path),
            "exists": True,
            "bytes": 5,
        }

    def test_in_words(self):
        text = heavytop_("doctor").stdout
        assert f"heavytop     {heavytop.__version__}" in text
        assert "cpu" in text

    def test_names_what_is_missing(self, monkeypatch):
        monkeypatch.setattr("heavytop.doctor.requirements", lambda _: ["no-such-package"])
        result = heavytop_("doctor")
        assert result.exit_code == Exit.OUT_OF_BOUND
        assert "no-such-package" in result.stderr

    def test_does_not_import_the_integrator(self):
        code = "import sys; from heavytop.doctor import diagnosis; diagnosis(); print(*sys.modules)"
        loaded = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout.split()
        assert {"heyoka", "numpy"}.isdisjoint(loaded)

    @pytest.mark.parametrize(
        ("environment", "folder"),
        [
            ({"HEYOKA_CACHE_DIR": "/a", "XDG_CACHE_HOME": "/b"}, "/a"),
            ({"XDG_CACHE_HOME": "/b", "HOME": "/c"}, "/b/heyoka"),
            ({"HOME": "/c"}, "/c/.cache/heyoka"),
        ],
    )
    def test_follows_heyokas_rule_for_its_cache(self, environment, folder):
        from heavytop.doctor import cache_folder

        assert cache_folder(environment) == Path(folder)
