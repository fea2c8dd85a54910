"""Methods, trajectories and exact values: what their pages show at a terminal is what happens."""

import contextlib
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.comparison import own

from .pages_agree import BLOCK
from .test_first_ten_minutes import follows, lines, steps

DOCS = Path(__file__).parents[2] / "docs"
CODES = {  # what each command of a page leaves with
    "bring-your-integrator.md": [0, 3, 0],
    "check-a-trajectory.md": [0, 5],
    "reference-values.md": [0, 0, 0, 0, 1],
}


def typed(command):
    """Exit code of a command, and what is shown of it."""
    program, *words = shlex.split(command)
    own._ADMITTED.clear()  # another process knows no code
    if program == "heavytop":
        found = CliRunner().invoke(app, words)
        return found.exit_code, found.output
    done = subprocess.run([sys.executable, *words], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("page", CODES)
def test_the_session_of_a_page(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (DOCS / page).read_text("utf-8")
    code = BLOCK.search(text)[1]
    Path("mine.py").write_text(code.partition("\n\n\nscene")[0], "utf-8")
    if page == "check-a-trajectory.md":  # which writes the file that is checked
        with contextlib.redirect_stdout(None):
            exec(compile(code, page, "exec"), {})
    codes = []
    for command, shown in steps(text):
        code, printed = typed(command)
        assert follows(lines(shown), lines(printed)), printed
        codes.append(code)
    assert codes == CODES[page]
