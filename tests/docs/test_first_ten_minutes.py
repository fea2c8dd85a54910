"""The first ten minutes, and other sessions, typed again: commands print what the pages show."""

import contextlib
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ..processes import surroundings
from .pages_agree import BLOCK, NUMBER, agree

FILES = Path(__file__).parents[1] / "checking" / "data"
ANY = "###"
LEFT_OUT = "…"


def steps(text):
    """Return (command, what is shown of its output) of every console block."""
    for block in re.findall(r"^```console\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
        for step in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, shown = step.partition("\n")
            yield command, shown


def lines(text):
    """Return the lines that hold something, with one blank where there are many."""
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


def alike(shown, printed):
    """Whether two lines agree; ### stands for any number, … for any part of a line."""
    if LEFT_OUT in shown and LEFT_OUT not in printed:
        return re.fullmatch(".*".join(map(re.escape, shown.split(LEFT_OUT))), printed) is not None
    numbers = iter(re.findall(f"{ANY}|{NUMBER.pattern}", shown))
    return agree(shown, NUMBER.sub(lambda n: ANY if next(numbers, "") == ANY else n[0], printed))


def follows(shown, printed):
    """Whether printed lines are those shown, where … alone stands for any number of them."""
    if not shown:
        return not printed
    if shown[0] == LEFT_OUT:
        return any(follows(shown[1:], printed[k:]) for k in range(len(printed) + 1))
    return bool(printed) and alike(shown[0], printed[0]) and follows(shown[1:], printed[1:])


def typed(command, code):
    """Let a shell do a line; return the exit code, and what a terminal shows."""
    found = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    env = surroundings(PATH=found, PYTHONUNBUFFERED="1")
    how = {"shell": True, "text": True, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    done = subprocess.run(command.replace("$?", str(code)), env=env, **how)
    return done.returncode, done.stdout


# and two that are printed: one that agrees, and one that does not
@pytest.mark.parametrize(("shown", "same", "other"), [
    ("x = 1.250, 3.28e-04, 22 %", "x = 1.251, 3.29e-04, 22 %", "x = 1.253, 3.28e-04, 22 %"),
    ("22 %, 3.28e-04, True", "22 %, 3.28e-04, True", "23 %, 3.28e-04, True"),
    ("at t = 2 s θ = 0.427", "at t = 2 s θ = 0.42694370531", "at t = 2 s θ = 0.42494370531"),
    ("run ### ms, 7 turning", "run 1.5 ms, 7 turning", "run 1.5 ms, 8 turning"),
    ("a … (z)", "a b 3 (z)", "a b 3 (y)"),
    ("a\n…\nc", "a\nb\nc", "a\nb\nc\nd"),
    ("a\nc", "a\nc", "a\nb\nc"),
])  # fmt: skip
def test_the_comparison_means_something(shown, same, other):
    assert follows(shown.split("\n"), same.split("\n"))
    assert not follows(shown.split("\n"), other.split("\n"))


# how many commands there are, and the exit codes of those that end otherwise than by 0
@pytest.mark.slow
@pytest.mark.parametrize(("page", "expected"), {
    "first-ten-minutes.md": (13, [3, 3]),
    "bring-your-integrator.md": (2, [3]),
    "check-a-trajectory.md": (3, [5]),
    "closed-form.md": (1, []),
    "find.md": (2, []),
    "sweep.md": (1, []),
}.items())  # fmt: skip
def test_a_page_shows_what_happens(page, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (Path(__file__).parents[2] / "docs" / page).read_text("utf-8")
    if block := BLOCK.search(text):
        Path("mine.py").write_text(block[1].partition("\n\n\nscene")[0], "utf-8")
    if page == "check-a-trajectory.md":  # which writes the file that is checked
        with contextlib.redirect_stdout(None):
            exec(compile(block[1], page, "exec"), {})
        shutil.copytree(FILES, tmp_path, dirs_exist_ok=True)
    codes = [0]
    for command, shown in steps(text):
        code, printed = typed(command, codes[-1])
        assert follows(lines(shown), lines(printed)), f"$ {command}\n{shown}\nprinted:\n{printed}"
        codes.append(code)
    assert (len(codes) - 1, list(filter(None, codes))) == expected
    assert all(Path(x).exists() for x in re.findall(r"`((?:first|map|page)/[\w.]+)`", text))
