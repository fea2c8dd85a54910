"""What the command line promises: its streams, its exit codes, its files, its refusals."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

import heavytop.run.propagation
from heavytop import errors
from heavytop.cli import Exit, app, exit_code
from heavytop.cli.options import FormulationName
from heavytop.comparison import METHODS
from heavytop.equations.formulation import FORMULATIONS
from heavytop.studies.atlas_plane import ROLES
from heavytop.studies.methods import stress_methods, taylor_methods
from heavytop.studies.stress_cases import cases

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
    "reference", "check", "validate", "scenes", "derive", "doctor",
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
    whole = heavytop.run.propagation.carried_out

    def cut(outcome: str) -> None:
        def carried_out(*arguments, **options):
            raise errors.EndedEarly(outcome, whole(*arguments, **options))

        monkeypatch.setattr(heavytop.run.propagation, "carried_out", carried_out)

    return cut


def fail_with(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def carried_out(*_, **__):
        raise error

    monkeypatch.setattr(heavytop.run.propagation, "carried_out", carried_out)


class TestHelp:
    def test_lists_the_verbs_that_exist_and_the_exit_codes(self):
        text = heavytop_("--help").stdout
        for verb in VERBS:
            assert f"  {verb} " in text
        known = {each.name or each.callback.__name__ for each in app.registered_commands}
        assert known == set(VERBS)
        assert "130 interrupted" in " ".join(text.split())

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

    @pytest.mark.parametrize("verb", VERBS)
    def test_every_option_says_what_it_is(self, verb):
        for each in typer.main.get_command(app).commands[verb].params:
            assert len(each.help) > 10, each.name

    def test_the_equations_that_can_be_asked_for_are_those_there_are(self):
        assert sorted(FormulationName) == sorted(["auto", *FORMULATIONS])
        assert ", ".join(FormulationName) in " ".join(heavytop_("run", "--help").stdout.split())

    @pytest.mark.parametrize(
        ("verb", "known"),
        [
            ("drift", ["auto", *taylor_methods(), *METHODS]),
            ("workprec", ["auto", *taylor_methods(), *METHODS]),
            ("stress", [*cases(), *stress_methods()]),
            ("atlas", list(ROLES)),
        ],
    )
    def test_names_are_listed(self, verb, known):
        text = "".join(heavytop_(verb, "--help").stdout.partition("Names for")[2].split())
        assert set(known) <= set(re.split(r"[,.:]|Namesfor", text))

    @pytest.mark.parametrize(
        ("words", "completed"),
        [
            ("plan sicm-k", "sicm-kicked"),
            ("plan sicm-kicked --formulation cu", "cubic"),
            ("drift sicm-kicked --methods auto,stra", "auto,strang"),
            ("stress --cases cusp,through-b", "cusp,through-bottom"),
            ("atlas sicm-kicked --x om", "omega3="),
        ],
    )
    def test_names_are_completed(self, words, completed):
        line = f"heavytop {words}"
        asked = {"_HEAVYTOP_COMPLETE": "complete_bash", "COMP_WORDS": line}
        code = "import sys; from heavytop.cli import main; sys.argv = ['heavytop']; main()"
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True,
            env=os.environ | asked | {"COMP_CWORD": str(len(line.split()) - 1)},
        )  # fmt: skip
        assert done.stdout.split() == [completed]


class TestSummaries:
    def test_each_fits_a_line_of_80_letters(self):
        shown = CliRunner().invoke(app, ["-h"], terminal_width=80).stdout
        assert "..." not in shown.partition("Commands:")[2]

    def test_the_page_of_commands_has_them_unbuilt(self):
        page = (Path(__file__).parents[2] / "docs" / "commands.md").read_text("utf-8")
        for name, verb in typer.main.get_command(app).commands.items():
            assert f"| `{name}` | {verb.help.splitlines()[0]} |" in page


class TestRun:
    def test_prints_a_table(self, scene):
        result = heavytop_("run", scene)
        assert result.exit_code == 0, result.stderr
        for word in ("kind", "E′", "period", "plan", "events", "theta_min", "closed form"):
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
        whole = heavytop.run.propagation.carried_out

        def carried_out(*arguments, **options):
            warnings.warn("the angle grows", errors.UnboundedAngleWarning, stacklevel=2)
            return whole(*arguments, **options)

        monkeypatch.setattr(heavytop.run.propagation, "carried_out", carried_out)

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
        fail_with(monkeypatch, ZeroDivisionError())
        heavytop_("run", scene, "-o", tmp_path / "new" / "out")
        assert not (tmp_path / "new").exists()

    def test_an_interrupt_before_anything_is_done_can_be_resumed(self, scene, tmp_path):
        folder = tmp_path / "out"
        with pytest.MonkeyPatch.context() as patched:
            fail_with(patched, KeyboardInterrupt())
            stopped = heavytop_("run", scene, "-o", folder, "--no-figures")
        assert stopped.exit_code == Exit.INTERRUPTED
        assert f"heavytop resume {folder}" in stopped.stderr
        assert heavytop_("resume", folder).exit_code == 0
        assert {path.name for path in folder.iterdir()} == {"run.json", "trajectory.nc"}


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

    def test_a_disk_that_is_full_from_the_start_is_said_plainly(self, scene, tmp_path, monkeypatch):
        def full(*_):
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("heavytop.files.os.fsync", full)
        result = heavytop_("run", scene, "-o", tmp_path / "out", "--no-figures")
        assert result.exit_code == Exit.ENDED_EARLY
        assert result.stderr == "heavytop: cannot write: No space left on device\n"
        assert not (tmp_path / "out").exists()


class TestStreams:
    """Where what is said cannot be told, the exit code tells it, and no traceback."""

    FULL = Path("/dev/full")

    def ended(self, *words: object, **streams: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "heavytop", *map(str, words)]
        both = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams
        return subprocess.run(command, text=True, check=False, **both)

    @pytest.mark.parametrize(
        "words", ["--help", "--version", "scenes", "scenes sicm-kicked", "run --help", "derive",
                  "classify sicm-kicked", "plan sicm-kicked --json", "doctor"],
    )  # fmt: skip
    def test_what_is_printed_goes_to_a_full_disk(self, words):
        with self.FULL.open("w") as full:
            found = self.ended(*words.split(), stdout=full)
        assert found.returncode == Exit.ENDED_EARLY
        assert found.stderr == "heavytop: cannot write: No space left on device\n"

    @pytest.mark.parametrize(
        ("words", "code"),
        [("run no-such-scene", 3), ("run --no-such", 2), ("resume nowhere", 3), ("scenes", 0)],
    )
    def test_what_is_wrong_cannot_be_said(self, words, code):
        with self.FULL.open("w") as full:
            assert self.ended(*words.split(), stderr=full).returncode == code

    @pytest.mark.parametrize("words", ["--help", "scenes", "derive", "classify sicm-kicked"])
    def test_nobody_reads(self, words):
        """As a shell says of what ends by a closed pipe; 1 would be a bug of ours."""
        read, write = os.pipe()
        os.close(read)
        found = self.ended(*words.split(), stdout=write)
        os.close(write)
        assert (found.returncode, found.stderr) == (Exit.UNREAD, "")

    @pytest.mark.parametrize("words", ["scenes", "classify sicm-kicked"])
    def test_a_closed_stdout_is_no_bug(self, words):
        command = f"exec {sys.executable} -m heavytop {words} >&-"
        found = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
        assert (found.returncode, found.stderr) == (0, "")

    @pytest.mark.parametrize("home", [{}, {"HOME": "/nowhere"}])
    def test_without_a_home_or_a_locale(self, home):
        plain = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
        found = self.ended("classify", "sicm-kicked", env=self.environment(**home, **plain))
        assert (found.returncode, found.stderr) == (0, "")
        assert "? between      0.1 and 0.5172313182384348 rad" in found.stdout

    def test_nothing_is_said_of_the_caches_of_others(self, tmp_path):
        words = ("run", "sicm-kicked", "-o", tmp_path)
        nowhere = self.environment(HOME="/proc")
        nowhere.pop("HEYOKA_CACHE_DIR", None)  # heyoka's own place is below the home
        found = self.ended(*words, env=nowhere)
        assert (found.returncode, found.stderr) == (0, "")
        assert (tmp_path / "overview.png").exists()

    @staticmethod
    def environment(**others: str) -> dict[str, str]:
        kept = ("PATH", "PYTHONPATH", "HEYOKA_CACHE_DIR")
        return {name: os.environ[name] for name in kept if name in os.environ} | others

    def test_results_cannot_stand_where_one_is(self):
        found = self.ended("run", "sicm-kicked", "-o", "out", cwd="/proc")
        assert found.returncode == Exit.USAGE
        assert found.stderr.splitlines()[-1].startswith("Error: Invalid value for -o: cannot write")


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (errors.BadScene(()), 3),
        (errors.ImpossibleTop([("A", "A > 0")]), 3),
        (errors.NotANumber("x"), 3),
        (errors.NoClosedForm("x"), 3),
        (errors.EndedEarly("singular", None), 4),
        (errors.ForeignFile("x"), 3),
        (errors.MissingPackage("strang", ["numba"]), 2),
        (errors.NoScheduler("x"), 2),
        (errors.WrongType("x"), 1),
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


class TestPoles:
    """Where the axis passes through the vertical, φ̇ is its limit p_ψ/2A, and no rounding's."""

    @pytest.mark.parametrize(
        ("name", "kind", "limit"),
        [("through-top", "theta_min", 140 * 6.6e-5), ("through-bottom", "theta_max", -40 * 6.6e-5)],
    )
    @pytest.mark.parametrize("digits", [12, 25])
    def test_a_row_at_a_pole_has_the_limit(self, name, kind, limit, digits):
        words = ("run", name, "--set", "span.time=0.6", "--digits", digits)
        found = json.loads(heavytop_(*words, "--json").stdout)
        rows = found["events"]["table"]
        there = [float(row["phidot"]) for row in rows if row["kind"] == kind]
        assert there == pytest.approx([limit / (2 * 3.28e-4)] * 3, rel=1e-14)
        assert len(rows) == 5
        table = heavytop_(*words).stdout
        assert "at the pole          φ is that before or after, π apart; φ̇ is its limit" in table

    @pytest.mark.parametrize("name", ["sicm-kicked", "lie-group-benchmark", "planar-pendulum"])
    def test_elsewhere_nothing_is_said_of_poles(self, name):
        assert "φ is that before" not in heavytop_("run", name, "--set", "span.time=1").stdout

    def test_what_a_stored_run_says_is_the_same(self, tmp_path):
        scene = heavytop.load_scene("through-top", ["span.time=0.6", "want.digits=25"])
        run = heavytop.propagate(scene)
        run.save(tmp_path / "run.nc")
        again = heavytop.load_trajectory(tmp_path / "run.nc")
        assert again.events.phidot.tolist() == run.events.phidot.tolist()
        texts = [[each.decimals.text(e.sample.phidot) for e in each.decimals.events]
                 for each in (run, again)]  # fmt: skip
        assert texts[0] == texts[1]
        assert texts[0][0] == texts[0][2] == texts[0][4] != texts[0][1]


def test_an_advance_that_is_zero_is_printed_as_zero():
    """Without gravity the axis runs round a circle: φ comes back, and 1e-101 is no advance."""
    found = json.loads(heavytop_("run", "force-free", "--json").stdout)
    assert found["motion"]["precession"] == 0
    assert found["motion"]["spin"] > 3


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
