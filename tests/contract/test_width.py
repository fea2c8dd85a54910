"""Tables fit the width they are printed in: no number is cut, and nothing stands behind a line."""

import fcntl
import json
import os
import pty
import re
import struct
import subprocess
import sys
import termios

import pytest
from rich.cells import cell_len
from rich.console import Console
from typer.testing import CliRunner

from heavytop.cli import app
from heavytop.report.run import settled
from heavytop.report.studies import rendered
from heavytop.scene.scene import shipped_scenes

NARROW = 80
TABLES = (
    ("scenes",),
    ("stress", "--list"),
    ("stress", "--cases", "kick-1e-9", "--methods", "auto,taylor-axis,taylor-attitude,gauss8"),
    ("drift", "sicm-kicked", "--periods", "30", "--methods", "taylor-axis-projected,gauss8"),
    ("atlas", "sicm-kicked", "--energy-momentum"),
    ("atlas", "sicm-kicked", "--x", "phidot=-20:20:9", "--y", "psidot=-150:150:9", "-j", "1"),
    *(("classify", name) for name in shipped_scenes()),
    *(("plan", name) for name in shipped_scenes()),
    *((verb.callback.__name__, "--help") for verb in app.registered_commands),
    ("--help",),
)


def narrow(*words):
    """Return what a command prints into a pipe where COLUMNS is 80."""
    result = CliRunner().invoke(app, list(words), env={"COLUMNS": str(NARROW)})
    assert result.exit_code == 0, result.output
    return result.stdout


def terminal(*words):
    """Return what a command prints at a terminal of 80 columns, without its colours."""
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("4H", 24, NARROW, 0, 0))
    env = dict(os.environ, TERM="xterm")
    command = [sys.executable, "-m", "heavytop", *words]
    with subprocess.Popen(command, stdin=its, stdout=its, stderr=its, env=env) as process:
        os.close(its)
        printed = b"".join(iter(lambda: _read(ours), b""))
    os.close(ours)
    assert process.returncode == 0, printed
    return re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", printed.decode()).replace("\r\n", "\n")


def _read(terminal):
    try:
        return os.read(terminal, 65536)
    except OSError:  # its end, on Linux
        return b""


def fits(text):
    lines = text.splitlines()
    assert max(map(cell_len, lines)) <= NARROW
    assert [line for line in lines if line != line.rstrip()] == []
    assert [line for line in lines if "…" in line and not re.match(r"… and \d+ more", line)] == []


@pytest.mark.parametrize("words", TABLES, ids=" ".join)
def test_what_a_verb_prints_fits_eighty_columns(words):
    text = narrow(*words)
    if "atlas" in words:  # their ends are written low … high
        text = re.sub(r" … (?=-?\d)", " to ", text)
    if "--help" in words:
        text = text.replace("…", "")  # NAME,…
    fits(text)


def shown(text):
    """Return the numbers of the events shown, a row for each."""
    rows = [line.split() for line in text.split("\nevent ")[1].splitlines()[1:]]
    return [row[1:] for row in rows[: rows.index([])] if row[0] not in ("…", "at")]


@pytest.mark.parametrize("name", shipped_scenes())
@pytest.mark.parametrize("width", [NARROW, 100])
def test_every_number_of_a_run_is_whole(name, width, documents):
    document = documents(name)
    console = Console(width=width)
    with console.capture() as printed:
        console.print(rendered(document))
    text = "\n".join(line.rstrip() for line in printed.get().splitlines())
    assert max(map(cell_len, text.splitlines())) <= width
    if not (rows := document["events"]["table"]):
        return
    columns = ("t", "theta", "phi", "phidot")
    scales = {each: max((abs(row[each] or 0) for row in rows), default=0) for each in columns}
    for row, texts in zip(rows, shown(text), strict=False):
        for each, told in zip(columns, texts, strict=False):
            if row[each] is None:
                assert told == "–"
            else:  # at least seven digits, or nothing but rounding
                near = max(5e-7 * abs(row[each]), 8 * sys.float_info.epsilon * scales[each])
                assert abs(float(told) - row[each]) <= near
        assert float(texts[-1]) == pytest.approx(row["residual"], rel=6e-3)


@pytest.fixture(scope="module")
def documents():
    """Return the document of a run, which is made once."""
    made = {}

    def of(name):
        if name not in made:
            made[name] = json.loads(CliRunner().invoke(app, ["run", name, "--json"]).stdout)
        return made[name]

    return of


def test_the_first_command_of_the_readme_at_a_terminal():
    text = terminal("run", "sicm-kicked", "-q")
    fits(text)
    assert [row[3] for row in shown(text)][:4] == ["-15", "0", "12.33871543", "0"]


def test_the_list_of_scenes_at_a_terminal():
    text = terminal("scenes")
    fits(text)
    assert set(shipped_scenes()) <= {line.split()[0] for line in text.splitlines()}


def test_documents_keep_what_tables_show_as_0(documents):
    rates = [row["phidot"] for row in documents("sicm-kicked")["events"]["table"]]
    assert 0 < min(map(abs, rates)) < 1e-14


def test_a_cell_is_0_only_where_it_is_rounding_beside_its_column():
    assert settled([1.0, 1e-15, 2e-15, None, "-3e-16"]) == [1.0, 0.0, 2e-15, None, 0.0]
    assert settled([1e-15, 2e-15]) == [1e-15, 2e-15]
    assert settled([]) == []
