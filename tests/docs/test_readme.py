"""The README, replayed: what it shows is what happens."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from heavytop.scene.scene import read_scene

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
VARIES = ("cost", "off the closed form", "event time")  # of the machine, or in the last digit
SMALL = re.compile(r"-?\d(\.\d+)?e-1\d|-?0(?=\s|$)")


def fenced(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


def stable(text):
    """Return the lines that do not vary, with numbers that are rounding left out."""
    lines = (re.sub(r"\s+", " ", SMALL.sub("~", line)).strip() for line in text.splitlines())
    return [line for line in lines if line and not line.startswith(VARIES)]


@pytest.mark.parametrize("words", re.findall(r"<!-- begin ((?:run|classify) .*?) -->", README))
def test_the_command_prints_what_is_shown(words, tmp_path):
    command = [sys.executable, "-m", "heavytop", *words.split()]
    if words.startswith("run"):
        command += ["-o", str(tmp_path)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    shown = README.split(f"<!-- begin {words} -->")[1].split("<!-- end")[0]
    assert stable(printed) == stable(shown.replace("```text", "").replace("```", ""))


def test_the_scene_is_a_scene():
    [scene] = fenced("toml")
    assert read_scene(scene).start.held == "omega3"


def test_the_python_runs(tmp_path):
    [program] = fenced("python")
    result = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("loops 0.542895518188")
    assert (tmp_path / "kicked.nc").exists()


COMMAND = re.compile(r"^    \.venv/bin/heavytop (?!report)(.*)$", re.MULTILINE)


@pytest.mark.parametrize("line", COMMAND.findall(README))  # a report is made by the build of pages
def test_the_commands_run(line, tmp_path):
    arguments = shlex.split(line, comments=True)
    command = [sys.executable, "-m", "heavytop", *arguments]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert result.returncode == 0, result.stderr


def test_every_file_named_exists():
    for name in re.findall(r"`((?:tests|validation|docs)/[\w./-]+)`", README):
        assert (ROOT / name).exists(), name


@pytest.mark.parametrize("link", sorted(set(re.findall(r"\]\(([^)#]+)", README))))
def test_every_link_leads_somewhere(link):
    assert link.startswith("https://") or (ROOT / link).exists()


def test_every_verb_is_named():
    frozen = (ROOT / "tests" / "contract" / "public_names.txt").read_text("utf-8")
    for verb in re.findall(r"^heavytop ([a-z]+)", frozen, re.MULTILINE):
        assert f"heavytop {verb}" in README, verb
