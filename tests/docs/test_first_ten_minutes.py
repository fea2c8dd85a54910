"""The first ten minutes, typed again: every command of the page prints what the page shows."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from heavytop.cli import app

from .pages_agree import NUMBER, agree

PAGE = Path(__file__).parents[2] / "docs" / "first-ten-minutes.md"
SESSION = re.compile(r"^```console\n(.*?)^```", re.MULTILINE | re.DOTALL)
ANY = "###"
LEFT_OUT = "…"
COMMANDS = 19


def steps(text):
    """Return (command, what is shown of its output) of every console block."""
    for block in SESSION.findall(text):
        for step in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, shown = step.partition("\n")
            yield command, shown


def lines(text):
    """Return the lines that hold something, with one blank where there are many."""
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


def alike(shown, printed):
    """Whether two lines agree; ### stands for any number, … for any part of a line."""
    if LEFT_OUT in shown and LEFT_OUT not in printed:
        pattern = ".*".join(map(re.escape, shown.split(LEFT_OUT)))
        return re.fullmatch(pattern, printed) is not None
    numbers = iter(re.findall(f"{ANY}|{NUMBER.pattern}", shown))
    return agree(shown, NUMBER.sub(lambda n: ANY if next(numbers, "") == ANY else n[0], printed))


def follows(shown, printed):
    """Whether printed lines are those shown, where … alone stands for any number of them."""
    if not shown:
        return not printed
    if shown[0] == LEFT_OUT:
        return any(follows(shown[1:], printed[k:]) for k in range(len(printed) + 1))
    return bool(printed) and alike(shown[0], printed[0]) and follows(shown[1:], printed[1:])


def heavytop_(words):
    """Run the command in this process; return its exit code, stdout, and both streams as shown."""
    result = CliRunner().invoke(app, words)
    return result.exit_code, result.stdout, result.output


def typed(command, code):
    """Do what a shell does with a line; return the exit code, and what a terminal shows."""
    if command == "echo $?":
        return 0, f"{code}\n"
    words = shlex.split(command)
    if words[0] != "heavytop":
        done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
        return 0, done.stdout
    words, _, file = (words[1:], "", "") if ">" not in words else (words[1:-2], ">", words[-1])
    code, out, shown = heavytop_(words)
    if file:
        Path(file).write_text(out, "utf-8")
        return code, shown.removeprefix(out)
    return code, shown


def test_the_comparison_means_something():
    assert alike("at t = 2 s θ = 0.427", "at t = 2 s θ = 0.42694370531")
    assert not alike("at t = 2 s θ = 0.428", "at t = 2 s θ = 0.42494370531")
    assert alike("run ### ms, 7 turning", "run 1.5 ms, 7 turning")
    assert not alike("run ### ms, 7 turning", "run 1.5 ms, 8 turning")
    assert alike("a … (z)", "a b 3 (z)")
    assert not alike("a … (z)", "a b 3 (y)")
    assert follows(["a", "…", "c", "…"], ["a", "b", "c"])
    assert not follows(["a", "…", "c"], ["a", "b", "c", "d"])
    assert not follows(["a", "c"], ["a", "b", "c"])
    assert not follows([], ["a"])


@pytest.fixture(scope="module")
def replayed(tmp_path_factory):
    """Return (command, shown, printed, exit code) of every step, and the folder it left behind."""
    folder, code, done = tmp_path_factory.mktemp("session"), 0, []
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.chdir(folder)
        for command, shown in steps(PAGE.read_text("utf-8")):
            code, printed = typed(command, code)
            done.append((command, shown, printed, code))
    return done, folder


@pytest.mark.slow
def test_the_page_shows_what_happens(replayed):
    assert len(replayed[0]) == COMMANDS
    for command, shown, printed, _ in replayed[0]:
        assert follows(lines(shown), lines(printed)), f"$ {command}\n{shown}\nprinted:\n{printed}"


def test_the_mistakes_are_mistakes_and_nothing_else_is(replayed):
    refused = [(*command.split()[1:3], code) for command, _, _, code in replayed[0] if code]
    assert refused == [
        ("run", "broken.toml", 3),
        ("classify", "my-top.toml", 2),
        ("run", "broken.toml", 3),
        ("run", "my-top", 3),
    ]


def test_the_files_that_it_speaks_of_are_there(replayed):
    named = set(re.findall(r"`((?:first|map|page)/[\w.]+)`", PAGE.read_text("utf-8")))
    assert named == {"first/overview.svg", "map/atlas.svg", "page/report.html"}
    assert all((replayed[1] / name).exists() for name in named)


@pytest.mark.parametrize("link", re.findall(r"\]\(([\w-]+\.md)\)", PAGE.read_text("utf-8")))
def test_every_page_it_leads_to_exists(link):
    assert PAGE.with_name(link).exists()
